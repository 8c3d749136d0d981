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

from aesi.calibration.ageing import Ageing
from aesi.calibration.heat import case_records, with_fitted_heat
from aesi.calibration.model import FitState, Model
from aesi.calibration.parameters import free_parameters, with_interfaces, with_priors
from aesi.calibration.records.conditions import Conditions
from aesi.calibration.records.named import uniquely_named
from aesi.calibration.records.prepared import (
    Prepared,
    fitted_rows_sentence,
    prepared,
    with_temperatures,
)
from aesi.calibration.records.sizes import other_sizes, sizes_sentence
from aesi.calibration.records.spectra import degc_of, fitted_spectra
from aesi.calibration.records.temperature import against_temperature
from aesi.calibration.records.zero import Zero, zero_of
from aesi.calibration.result import (
    Calibration,
    RecordError,
    at_bounds,
    ends_sentences,
    information_weights,
    intervals,
    undetermined,
)
from aesi.calibration.shapes import Shapes
from aesi.calibration.silicon import SILICON_V
from aesi.calibration.start import (
    activation_sentences,
    discharge_branch,
    full_discharge_numbers,
    scaled_to_discharge,
    size_assumed,
    with_activation,
    with_area_factor,
)
from aesi.calibration.written_cell import capacities, start_soc, written_cell
from aesi.constants import MILLI, ZERO_CELSIUS_K
from aesi.errors import DataError, FitError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.cell.energies import SPAN_K
from aesi.physics.cell.health import day_of
from aesi.physics.depletion import ran_out
from aesi.physics.record_checks import check_voltage, other_materials_sentence
from aesi.physics.start.charge import check_charge
from aesi.records import Measurement, Spectrum, measured_on_case
from aesi.records.checked import check_row, check_whole_number

FEWEST_ROWS = 2
"""Of a record: one row has no time in which a current flows."""
EVALUATIONS = 100
"""Most evaluations of one descent. The fits behind the shipped files of the Panasonic NCR18650PF and the LG 18650HG2
need fewer."""
GAIN = 1e-5
"""Relative reduction of the cost below which a descent ends. With ten times as much the first descent for an LG
18650HG2 ends a prior standard deviation away, at a cost of 344.7 instead of 340.1."""
NOTED_ZERO = 0.02
"""Share of a record's typical current above which a note reports the offset of its cycler's current."""
NOTED_AGE = 0.01
"""Relative difference of a record's active material from the file's above which a note reports it."""
NOTED_SILICON = 0.05
"""The same for the silicon, which holds a sixth of such a cell's charge."""
MOVED_SOC = 1e-3
"""Least change of a given state of charge between the windows of the start file and of the written cell that a note
tells. A convention."""
NOTED_DEVIATIONS = 2.0
"""A fit that ends more than this many standard deviations from a prior that the user gave contradicts it. A
convention."""
OnStep = Callable[[int, float], None]
"""Called at each step of a fit with the number of steps so far, and the present misfit over that of the start."""
OF_ROWS_LEFT_OUT = (
    "the state of charge that was given is that of its first row, which is not fitted; it starts where its "
    "voltage says."
)


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
    states = model.states(cell, x)
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
        errors=_errors(model, states),
        capacities=shares,
        size_assumed="" if conditions.same_cell else size_assumed(cell, records),
        notes=(
            *notes,
            *_contradicted_prior_sentences(model, x),
            *_own_parameter_sentences(model, x),
            *_ran_out_sentences(model, states),
            *_moved_start_sentences(model, begun),
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
        fitted_at_k=tuple((r.name, round(kelvin_taken(declared, r), 2)) for r in model.records),
    )


def _errors(model: Model, states: Mapping[FitState, tuple[Cell, Array]]) -> tuple[RecordError, ...]:
    """The RMSE of each record under each state of the cell."""
    left_v = {name: [rms(error) for error in model.errors_of(*state)] for name, state in states.items()}
    return tuple(
        RecordError(r.name, _degc(r), left_v["declared"][i], left_v["fitted"][i], left_v["simulated"][i])
        for i, r in enumerate(model.records)
    )


def prepared_model(
    cell: Cell, records: Sequence[Measurement], conditions: Conditions
) -> tuple[Model, tuple[str, ...]]:
    """(model that is fitted, sentences on how it was set up, in the order of the steps).

    Raises DataError for records that do not fit the cell.
    """
    records = _checked_records(cell, records, conditions)
    start, zero, size_sentences = _size_and_zero(cell, records, conditions.same_cell)
    branches = [discharge_branch(start, data) for data in records]
    at_temperatures, temperature_sentences = with_temperatures(
        start, [data for data, _ in branches], conditions.temperatures_degc
    )
    declared, start = start, with_activation(start)
    full_discharges = () if conditions.same_cell else full_discharge_numbers(cell, records)
    # Their capacity is not the one that the largest full discharge shows.
    smaller = other_sizes(cell, records)
    of_size = (records[i] for i in full_discharges if records[i].name not in smaller)
    potential_sentences = filter(None, (other_materials_sentence(start, record) for record in of_size))
    cut_names = [
        r.name for r, whole in zip(at_temperatures, records, strict=True) if r.time_s[0] > whole.time_s[0]
    ]
    model_name = conditions.model or "espm"
    prepared_records = prepared(
        start, at_temperatures, conditions.soc0, model_name, conditions.same_cell, cut_names
    )
    for one in prepared_records:
        check_charge(start, one.rows, one.start.soc, one.hold)
    spectra, spectrum_sentences = fitted_spectra(start, conditions.spectra)
    span = _span_k(start, prepared_records, spectra)
    on_case = any(r.kelvin is not None and measured_on_case(r.kelvin) for r in prepared_records)
    start = with_interfaces(start, on_case)
    free = with_priors(free_parameters(start, span, conditions.same_cell, on_case), conditions.priors)
    energies = {f.name: (f.start, f.sd) for f in free if f.name.endswith("_energy")}
    ageing = Ageing.of(prepared_records, conditions.dates, conditions.as_of)
    model = Model(
        start,
        prepared_records,
        free,
        Shapes.over(start, span),
        zero,
        ageing,
        model_name,
        spectra,
    )
    return model, (
        *size_sentences,
        *filter(None, [sizes_sentence(cell, records)]),
        *potential_sentences,
        *zero.sentences,
        *(sentence for _, branch_sentences in branches for sentence in branch_sentences),
        *temperature_sentences,
        *(f"{name}: {OF_ROWS_LEFT_OUT}" for name in cut_names if conditions.soc0 is not None),
        *_small_span_sentences(span, len(prepared_records)),
        *activation_sentences(declared, start, energies, [f.name for f in free if f.given]),
        *(r.start.sentence for r in prepared_records if not r.start.against_voltage),  # those are warnings
        *spectrum_sentences,
        *map(fitted_rows_sentence, prepared_records),
        *ageing.sentences,
    )


def _checked_records(
    cell: Cell, records: Sequence[Measurement], conditions: Conditions
) -> tuple[Measurement, ...]:
    """The records with names of their own.

    Raises DataError where there is none, and for one that has too few rows, lacks a voltage or a current, or is no
    record of the cell.
    """
    if not records:
        raise DataError("give at least one record to calibrate with.")
    named = uniquely_named(records, {"temperature": conditions.temperatures_degc, "date": conditions.dates})
    for record in named:
        if len(record) < FEWEST_ROWS:
            raise DataError(
                f"{record.name} has too few rows ({len(record)}) to be fitted; a record needs at least {FEWEST_ROWS}."
            )
        check_row(record.voltage_v, f"{record.name}: voltage_v")
        check_voltage(cell, record)
        if not record.current_a.any():
            raise DataError(
                f"{record.name}: no current flows in it, so that it tells no parameter; leave it out."
            )
    return named


def _size_and_zero(
    cell: Cell, records: Sequence[Measurement], same_cell: bool
) -> tuple[Cell, Zero, tuple[str, ...]]:
    """(cell of the size that the records indicate, zero offset of their cycler's current, sentences on the size).

    Each needs the other: a first size gives the offset, and currents without the offset give the final size.
    """
    if same_cell:
        return cell, zero_of(cell, records), ()
    roughly, _ = scaled_to_discharge(cell, records)
    zero = zero_of(roughly, records)
    start, sentences = scaled_to_discharge(
        cell, [zero.subtracted_from(r, roughly.nominal_capacity_ah) for r in records]
    )
    return start, zero, sentences


def _start_file_at_size(cell: Cell, sized_cell: Cell) -> Cell:
    """The start file at the size that the records indicate, without the typical values that a fit fills in. The limits
    beyond which a record contradicts its temperature were set with such files."""
    return with_area_factor(
        cell, sized_cell.electrode_area_m2 / cell.electrode_area_m2, sized_cell.nominal_capacity_ah
    )


def _small_span_sentences(span_k: float, n_records: int) -> tuple[str, ...]:
    """A sentence where the records span too few kelvin to determine the temperature dependence; else empty."""
    if span_k > SPAN_K:
        return ()
    apart = (
        f"the mean temperatures of the records are {span_k:.1f} K apart, less than {SPAN_K:g} K"
        if n_records > 1
        else "a single record does not tell how the cell answers to temperature"
    )
    return (f"{apart}: activation energies and entropy stay as they are.",)


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


STATE_WORDS: dict[FitState, str] = {
    "declared": "the declared cell",
    "fitted": "the fitted cell",
    "simulated": "the file as simulated",
}
"""State of the cell -> what notes call it."""


def _moved_start_sentences(model: Model, begun: Mapping[str, float]) -> tuple[str, ...]:
    """A sentence for each record whose given state of charge is another one in the windows of the written cell.

    begun : `Calibration.starts`.
    """
    given = ((r.name, r.start.soc) for r in model.records if r.start.basis == "given")
    return tuple(
        f"{name} starts at a state of charge of {begun[name]:.4f} of the written cell, in which empty is the rest at "
        f"its lower cut-off: by the start file it is the {soc:.4g} that was given."
        for name, soc in given
        if abs(begun[name] - soc) >= MOVED_SOC
    )


def _ran_out_sentences(model: Model, states: Mapping[FitState, tuple[Cell, Array]]) -> tuple[str, ...]:
    """A sentence for each record on which the cell runs out of lithium or salt in one of the states."""
    out = []
    for i, record in enumerate(model.records):
        found = {words: model.ran_out_s(i, *states[name]) for name, words in STATE_WORDS.items()}
        if at_s := {words: at for words, at in found.items() if at is not None}:
            out.append(ran_out(record.name, at_s))
    return tuple(out)


def _contradicted_prior_sentences(model: Model, x: Array) -> tuple[str, ...]:
    """A sentence for each prior that was given and that the records contradict."""
    out = []
    for free, z in zip(model.free, x, strict=False):
        if free.given and abs(z) > NOTED_DEVIATIONS:
            out.append(
                f"{free.name} ends at {free.value(float(z)):.4g} {free.unit}, {abs(z):.1f} standard deviations "
                f"{'above' if z > 0.0 else 'below'} what was given ({free.start:g}): the records contradict it."
            )
    return tuple(out)


def _own_parameter_sentences(model: Model, x: Array) -> tuple[str, ...]:
    """Sentences on the parameters of single records: offset of the current, active material and silicon."""
    out = []
    zero_a = model.zero.at(float(x[model.layout.zero]))
    for i, record in enumerate(model.records):
        typical = float(np.median(np.abs(record.rows.current_a[record.flows > 0.0])))
        if record.slow and abs(zero_a) > NOTED_ZERO * typical:
            out.append(
                f"{record.name}: by the fit its current reads {MILLI * abs(zero_a):.2g} mA too "
                f"{'high' if zero_a > 0 else 'low'} ({100 * abs(zero_a) / typical:.1f} % of it); the fit corrects that."
            )
        material, silicon = model.material(i, x) - 1.0, model.silicon(i, x)
        if abs(material) > NOTED_AGE:
            out.append(
                f"{record.name}: in the fit the cell has {100 * abs(material):.1f} % "
                f"{'more' if material > 0.0 else 'less'} active material in this record than in the file; the record "
                "may be of another age."
            )
        if abs(silicon - 1.0) > NOTED_SILICON:
            how = "fits with" if record.slow else "has, by the slow records before and after it,"
            out.append(
                f"{record.name}: {how} {100 * silicon:.0f} % of the capacity of the negative electrode above "
                f"{SILICON_V:g} V (silicon, if it has any)."
            )
    return tuple(out)


def _degc(record: Prepared) -> float | None:
    """Mean temperature of a record, degC; None where it has none."""
    return None if record.mean_kelvin is None else record.mean_kelvin - ZERO_CELSIUS_K


def _span_k(cell: Cell, records: Sequence[Prepared], spectra: Sequence[Spectrum]) -> float:
    """K between the coldest and the warmest record's mean, or spectrum."""
    means = [kelvin_taken(cell, r) for r in records] + [degc_of(s) + ZERO_CELSIUS_K for s in spectra]
    return max(means) - min(means)


def kelvin_taken(cell: Cell, record: Prepared) -> float:
    """Mean temperature of a record, K; the file's where the record tells none."""
    return cell.initial_temperature_k if record.mean_kelvin is None else record.mean_kelvin
