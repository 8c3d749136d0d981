"""`calibrate`: fit the parameters of a cell's file to records, with intervals and the combinations left undetermined.

A first descent starts from the file as it is. From its result the heat of the cell is computed; a second descent
continues from there with this heat. The posterior has several maxima (of an LG 18650HG2 at 25 degC descents by three
methods end 0, 10 and 66 nats apart), and intervals hold about one: further starts find others.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from datetime import date
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from aesi.calibration.fit_sentences import (
    contradicted_prior_sentences,
    moved_start_sentences,
    own_parameter_sentences,
    ran_out_sentences,
    unfitted_rows_sentences,
)
from aesi.calibration.heat import case_records, with_fitted_heat
from aesi.calibration.model import FitState, Model
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.conditions import Conditions
from aesi.calibration.records.prepared import Prepared, kelvin_taken
from aesi.calibration.records.temperature import against_temperature
from aesi.calibration.result import (
    Calibration,
    RecordError,
    at_bounds,
    ends_sentences,
    information_weights,
    intervals,
    undetermined,
)
from aesi.calibration.start import size_assumed, with_area_factor
from aesi.calibration.written_cell import capacities, fit_states, start_soc, written_cell
from aesi.errors import FitError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.cell.health import day_of
from aesi.records import Measurement
from aesi.records.checked import check_whole_number

EVALUATIONS = 100
"""Most evaluations of one descent. The fits behind the shipped files of the Panasonic NCR18650PF and the LG 18650HG2
need fewer."""
GAIN = 1e-5
"""Relative reduction of the cost below which a descent ends. With ten times as much the first descent for an LG
18650HG2 ends a prior standard deviation away, at a cost of 344.7 instead of 340.1."""
OnStep = Callable[[int, float], None]
"""Called at each step of a fit with the number of steps so far, and the present misfit over that of the start."""


def calibrate(
    cell: Cell,
    records: Sequence[Measurement],
    conditions: Conditions | None = None,
    *,
    evaluations: int = EVALUATIONS,
    starts: int = 1,
    seed: int = 0,
    on_step: OnStep | None = None,
) -> Calibration:
    """Fit the parameters of a cell's file to records by maximum a posteriori: capacities, stoichiometry windows,
    potentials, diffusion, kinetics, electrolyte and contacts, with their temperature dependence. Returns the new cell,
    values with 95 % intervals (Laplace's approximation), undetermined combinations, and each record's errors before and
    after.

    records : at least one, current_a in A, positive on discharge. A record's temperature (degC) is its column, else
    that of `conditions`, else the cell file's. Records of the same name are numbered in the result.
    conditions : what is known of records and cell beyond the data; None for nothing.
    evaluations : most of each descent.  on_step : called at each step of a descent.
    starts : number of fits: one from the file, the others from cells drawn from the priors with `seed`. The end of the
    highest posterior density is taken, and a note says how far apart the ends are.
    Raises DataError for records that do not belong to the cell; FitError where the start cannot be simulated;
    InputError for less than one start or evaluation, and for a prior of no parameter or of an impossible value.
    """
    began = time.perf_counter()
    conditions = conditions or Conditions()
    check_whole_number("evaluations", evaluations, 1)
    check_whole_number("starts", starts, 1)
    start_model, notes = prepared_model(cell, records, conditions)
    ends = _fit_ends(start_model, starts, seed, evaluations, on_step)
    model, x, found = ends[0].model, ends[0].x, ends[0].cell
    runs = {name: model.errors_and_ends(*state) for name, state in fit_states(model, cell, x).items()}
    scaled = ends[0].jacobian * information_weights(model, x)[:, None]
    covariance: Array = np.asarray(np.linalg.inv(scaled.T @ scaled), dtype=float)
    shares = capacities(model, x)
    begun = {record.name: start_soc(model, x, i) for i, record in enumerate(model.records)}
    parameters = [intervals(model, end.x, covariance) for end in ends]
    return Calibration(
        cell=_with_provenance(found, cell, model, shares, conditions.dates),
        declared=cell,
        parameters=parameters[0],
        undetermined=undetermined(model, scaled),
        at_bounds=at_bounds(model, x),
        errors=_errors(model, runs),
        capacities=shares,
        size_assumed="" if conditions.same_cell else size_assumed(cell, records),
        notes=(
            *notes,
            *contradicted_prior_sentences(model, x),
            *own_parameter_sentences(model, x),
            *ran_out_sentences(model, runs),
            *unfitted_rows_sentences(found, model, records, begun),
            *moved_start_sentences(model, begun),
            *ends[0].heat_sentences,
            *ends_sentences(
                [end.cost for end in ends],
                parameters,
                [end.from_file for end in ends].index(True),
                starts - len(ends),
            ),
        ),
        seconds=time.perf_counter() - began,
        model=model,
        x=x,
        covariance=covariance,
        starts=begun,
        against_temperature=against_temperature(
            _start_file_at_size(cell, model.cell),
            model.records,
            model.model_name,
            conditions.temperatures_degc,
        ),
    )


class _ReportingModel:
    """A model that reports the progress of its descents.  on_step : callback, or None."""

    def __init__(self, model: Model, on_step: OnStep | None) -> None:
        self.model, self._on_step = model, on_step
        self._steps, self._first, self._last = 0, 0.0, 0.0

    def residual(self, x: Array) -> Array:
        """The model's residual; its size is kept for the report."""
        residual = self.model.residual(x)
        self._last = float(residual @ residual)
        return residual

    def jacobian(self, x: Array) -> Array:
        """The model's jacobian. A descent evaluates it once per accepted step, so that progress is reported here."""
        self._first = self._first or self._last
        if self._on_step is not None:
            self._on_step(self._steps, self._last / self._first if self._first else 1.0)
        self._steps += 1
        return self.model.jacobian(x)


class _Descent(NamedTuple):
    """The end of one descent: working vector, jacobian of the model there, and half the sum of squares, which is minus
    the logarithm of the posterior density, up to a constant, nats."""

    x: Array
    jacobian: Array
    cost: float


@dataclass(frozen=True, eq=False)
class _FitEnd:
    """The end of the descents from one start.

    model : with the thermal data that it was fitted with.  x, jacobian, cost : as of a `_Descent`.  cell : fitted.
    heat_sentences : on its thermal data.  from_file : True where the start file is where it began, not a cell drawn
    from the priors.
    """

    model: Model
    x: Array
    jacobian: Array
    cost: float
    cell: Cell
    heat_sentences: tuple[str, ...]
    from_file: bool


def _fit_ends(
    model: Model, starts: int, seed: int, evaluations: int, on_step: OnStep | None
) -> list[_FitEnd]:
    """The ends of the descents from each start that can be simulated, the best first.

    Raises FitError where the start file itself cannot be simulated on the records.
    """
    drawn = np.random.default_rng(seed).standard_normal((starts - 1, model.layout.size))
    ends: list[_FitEnd] = []
    for start in (np.zeros(model.layout.size), *np.clip(drawn, model.low, model.high)):
        one = copy(model)  # which takes thermal data of its own
        try:
            end, cell, sentences = _fitted_twice(_ReportingModel(one, on_step), evaluations, start)
        except FitError:
            if not ends:
                raise
            continue
        ends.append(_FitEnd(one, *end, cell, sentences, from_file=not ends))
    return sorted(ends, key=lambda end: end.cost)


def _fitted_twice(
    reporting: _ReportingModel, evaluations: int, start: Array
) -> tuple[_Descent, Cell, tuple[str, ...]]:
    """(end of the last descent, cell there with the heat fitted to its temperatures, sentences on that).

    The second descent is skipped where no record determines the heat, since nothing would change.
    """
    model = reporting.model
    end = _descend(reporting, evaluations, start)
    plain = written_cell(model, end.x)
    found, heat, sentences = with_fitted_heat(plain, case_records(model, end.x))
    if heat is not None:
        # The thermal lag of the winding behind its case is part of the file, so that the fit has to include it.
        model.set_thermal_data(found)
        end = _descend(reporting, evaluations, end.x)
        found = written_cell(model, end.x)
        sentences = (heat.by(found, case_records(model, end.x)).sentence, *sentences)
    return end, found, sentences


def _with_provenance(
    found: Cell, declared: Cell, model: Model, shares: Mapping[str, float], days: Mapping[str, date]
) -> Cell:
    """The fitted cell as it is written, with the name of the model and the records of the fit.

    declared : start cell; records without a temperature have its initial one.  shares : record -> its capacity over the
    written one.  days : record -> day of its test, where known.
    """
    return replace(
        found,
        fitted_with=model.model_name,
        capacity_shares=tuple(shares.items()),
        tested_on=tuple((name, day_of(days[name])) for name in shares if name in days),
        fitted_at_k=tuple((r.name, round(kelvin_taken(declared, r.rows), 2)) for r in model.records),
    )


def _errors(
    model: Model, runs: Mapping[FitState, Sequence[tuple[Array, int | None]]]
) -> tuple[RecordError, ...]:
    """The RMSE of each record under each state of the cell.  runs : state -> `Model.errors_and_ends`."""
    out = []
    for i, record in enumerate(model.records):
        before_v, after_v, simulated_v = (
            rms(runs[name][i][0]) for name in ("declared", "fitted", "simulated")
        )
        error_v, row = runs["simulated"][i]
        at_s = None if row is None else float(record.rows.time_s[row])
        until_v = rms(error_v[:row]) if row else None
        out.append(RecordError(record.name, _degc(record), before_v, after_v, simulated_v, at_s, until_v))
    return tuple(out)


def _start_file_at_size(cell: Cell, sized_cell: Cell) -> Cell:
    """The start file at the size that the records indicate, without the typical values that a fit fills in. The limits
    beyond which a record contradicts its temperature were set with such files."""
    return with_area_factor(
        cell, sized_cell.electrode_area_m2 / cell.electrode_area_m2, sized_cell.nominal_capacity_ah
    )


def _descend(reporting: _ReportingModel, evaluations: int, x0: Array) -> _Descent:
    """Where bounded least squares ends.

    Raises FitError where the model cannot be simulated at x0.
    """
    model = reporting.model
    if not np.isfinite(model.residual(x0)).all():
        raise FitError(
            f"{model.cell.name}: the start file cannot be simulated on these records; start from a cell of the same "
            "chemistry."
        )
    found = least_squares(
        reporting.residual, x0, reporting.jacobian, (model.low, model.high), ftol=GAIN, xtol=1e-5, gtol=1e-8,
        max_nfev=evaluations,
    )  # fmt: skip
    return _Descent(found.x, found.jac, float(found.cost))


def _degc(record: Prepared) -> float | None:
    """Mean temperature of a record, degC; None where it has none."""
    degc = record.rows.temperature_degc
    return None if degc is None else float(degc.mean())
