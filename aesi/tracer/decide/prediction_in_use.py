"""How well a fit predicts ordinary use: full discharges and charges, whatever range the records themselves cover.

    sd(t)^2 = s(t) C s(t)'          s the slopes of the voltage over the parameters, C their covariance in the fit   (1)

Parameters that hardly change the fitted records can move the knee at the end of a discharge by hundreds of millivolts.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from aesi.errors import AesiError
from aesi.numerics.bounded import slope_within
from aesi.numerics.typing import Array, BoolArray
from aesi.records import Measurement
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import values_of
from aesi.tracer.case.problem import STEP, InverseProblem
from aesi.tracer.decide.carry_over import ORDINARY_C, full_course, temperatures_degc
from aesi.tracer.decide.verdict import prediction_weight
from aesi.tracer.likelihood.fit import FittedHypothesis, covariance_at
from aesi.tracer.likelihood.model_error import PRIORS


def predicted_share_in_use(
    problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis, allowed_v: float
) -> float:
    """`verdict.predicted_share` for full discharges and charges at ordinary rates, within the voltage limits and at the
    temperatures of the records, 0 to 1. It is 0 where the fit cannot be simulated there, 1 where the declared model
    cannot."""
    most = PRIORS[problem.trust].median._replace(delta_v=allowed_v)
    covariance = covariance_at(problem, blocks, fit, most)
    told = []
    for rows, course, soc0 in _courses(problem):
        slopes = _slopes_v(problem, fit, course, soc0)
        if slopes is None:
            return 0.0
        sd_v = np.sqrt(np.einsum("ij,jk,ik->i", slopes[rows], covariance, slopes[rows]))
        told.append(prediction_weight(problem.noise_v, sd_v, allowed_v))
    return float(np.mean(np.concatenate(told))) if told else 1.0


def _courses(problem: InverseProblem) -> Iterator[tuple[BoolArray, Measurement, float]]:
    """The full courses that the declared model can run: (rows within the voltage limits, record without voltages,
    initial state of charge)."""
    cell = problem.cell
    for degc, rate in product(temperatures_degc(problem), ORDINARY_C):
        course, soc0 = full_course(cell, rate, degc)
        try:
            run = problem.run(course, soc0, problem.fixed, "linear")
        except AesiError:
            continue
        soc, voltage = run.series["soc"], run.voltage_v
        rows = (soc > 0.0) & (soc < 1.0) & (voltage > cell.lower_voltage_v) & (voltage < cell.upper_voltage_v)
        if rows.any():
            yield rows, course, soc0


def _slopes_v(
    problem: InverseProblem, fit: FittedHypothesis, course: Measurement, soc0: float
) -> Array | None:
    """(n, k) V, sensitivities per prior standard deviation, by one-sided differences within the bounds; zero for
    parameters of single records. None where the fit, or a point next to it, cannot be simulated."""

    def voltage_v(x: Array) -> Array | None:
        try:
            return problem.run(
                course, soc0, problem.active(values_of(fit.free, x, fit.hypothesis)), "linear"
            ).voltage_v
        except AesiError:
            return None

    x = fit.point.x
    held = voltage_v(x)
    if held is None:
        return None
    slopes = np.zeros((len(held), len(x)))
    for j, one in enumerate(fit.free):
        if one.record is not None:
            continue
        slope = slope_within(voltage_v, x, held, j, one.bounds, STEP)
        if slope is None:
            return None
        slopes[:, j] = slope
    return slopes
