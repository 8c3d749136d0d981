"""What a fit says of states of charge that no record has been at.

    sd(t)^2 = s(t) C s(t)'          s the slopes of the voltage over the parameters, C their covariance in the fit   (1)

Parameters that hardly move what was seen can move the knee at the end of a discharge by hundreds of millivolts.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from aesi.errors import AesiError
from aesi.numerics.typing import Array, BoolArray
from aesi.records import Measurement
from aesi.tracer.case.free_parameter import values_of
from aesi.tracer.case.problem import STEP, InverseProblem
from aesi.tracer.decide.carry_over import ORDINARY_C, full_course, temperatures_degc
from aesi.tracer.likelihood.fit import FittedHypothesis


def foretold_beyond(problem: InverseProblem, fit: FittedHypothesis, allowed_v: float) -> float:
    """Share of the rows, at states of charge outside those of the records, whose voltage a fit foretells within
    `allowed_v`: of full discharges and charges at ordinary rates, between the limits of voltage, at the temperatures
    of the records. 1 where the records have been everywhere; nought where the fit cannot be simulated there."""
    known = []
    for rows, course, soc0 in _unseen(problem):
        try:
            known.append(_sd_v(problem, fit, course, soc0)[rows] <= allowed_v)
        except AesiError:
            return 0.0
    return float(np.mean(np.concatenate(known))) if known else 1.0


def _unseen(problem: InverseProblem) -> Iterator[tuple[BoolArray, Measurement, float]]:
    """Rows of full courses where no record has been, as the declared model goes through them; those of which there are
    some and that it can go through."""
    cell, seen = problem.cell, problem.declared_soc
    for degc, rate in product(temperatures_degc(problem), ORDINARY_C):
        course, soc0 = full_course(cell, rate, degc)
        try:
            run = problem.run(course, soc0, problem.fixed, "linear")
        except AesiError:
            continue
        soc, voltage = run.series["soc"], run.voltage_v
        rows = (soc < seen.min()) | (soc > seen.max())
        rows &= (
            (soc > 0.0) & (soc < 1.0) & (voltage > cell.lower_voltage_v) & (voltage < cell.upper_voltage_v)
        )
        if rows.any():
            yield rows, course, soc0


def _sd_v(problem: InverseProblem, fit: FittedHypothesis, course: Measurement, soc0: float) -> Array:
    """(n,) V, (1); what is of single records moves nothing."""

    def voltage_v(x: Array) -> Array:
        effects = problem.active(values_of(fit.free, x))
        return problem.run(course, soc0, effects, "linear").voltage_v

    x = fit.point.x
    held = voltage_v(x)
    slopes = np.zeros((len(held), len(x)))
    for j, one in enumerate(fit.free):
        if one.record is None:
            there = x.copy()
            there[j] += STEP if x[j] + STEP <= one.bounds[1] else -STEP
            slopes[:, j] = (voltage_v(there) - held) / (there[j] - x[j])
    return np.sqrt(np.einsum("ij,jk,ik->i", slopes, fit.score.covariance, slopes))
