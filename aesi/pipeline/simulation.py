"""Files in, files out: the physics model alone, and a saved hybrid model with its intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aesi.constants import MV_PER_V, ZERO_CELSIUS_K
from aesi.data.convert import write_csv
from aesi.data.current import CurrentProfile, read_current
from aesi.data.reading import Reading, record_name
from aesi.errors import DataError, InputError, SimulationError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.over_time import stamp
from aesi.physics import ActiveEffect, Cell, InitialState, ModelName, initial_state, simulate
from aesi.physics.cell import Soh
from aesi.physics.depletion import ran_out
from aesi.physics.effects.self_heating import assumed, of_file
from aesi.physics.model import case_k
from aesi.physics.record_checks import check_belongs
from aesi.physics.rest.open_circuit import GIVEN_SD
from aesi.physics.simulation import model_with
from aesi.pipeline.notes import (
    contradiction_sentences,
    dry_collector_sentences,
    fitted_record_sentences,
    other_model_sentences,
    soh_day_sentences,
    temperature_range_sentences,
    temperature_sentence,
)
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.product.prediction import Prediction
from aesi.pipeline.product.trained import trained_figures, trained_sentence
from aesi.records import Hold, Measurement, Run, assumed_hold, hold_sentence

if TYPE_CHECKING:
    import pandas as pd

DIGITS = 9
"""Significant digits of what is written, except for the time (or the frequency)."""
TOLD_SD = 0.01
"""Change of state of charge for which a note gives the change of the voltage. A convention."""
SayNotes = Callable[[Iterable[str]], None]


@dataclass(frozen=True)
class ProfileRequest:
    """The user's options for a profile, in addition to its file.

    soc0 : state of charge at the first row; None takes it from the file's voltage, where it has one (see
    `initial_state`), else from the saved model.
    hold : how the current runs between rows. None takes that of a saved model; for a cell's file, straight lines for a
    profile without a voltage, and what `assumed_hold` says for a measurement.
    reading : how the file is read.
    self_heating : the cell warms itself, by the thermal data of its file.
    soh : share of the file's capacity that the cell had then, or the day of the test; None takes all of it.
    soc0_sd : for `predict_file` alone: standard deviation of soc0; None takes soc0 as exact.
    run_on : for `simulate_file` alone: go on where a surface or the electrolyte runs empty or full, as `simulate` does
    with on_depletion="clip".
    """

    soc0: float | None = None
    hold: Hold | None = None
    reading: Reading | None = None
    self_heating: bool = False
    soh: Soh | None = None
    run_on: bool = False
    soc0_sd: float | None = None


def simulate_file(
    cell: Path,
    current: Path,
    out: Path,
    asked: ProfileRequest | None = None,
    effects: Sequence[ActiveEffect] = (),
    model: ModelName | None = None,
    say_notes: SayNotes | None = None,
) -> Run:
    """Simulate the profile in `current` and write time, current, voltage and states to the CSV `out`.

    The file has `temperature_k`, the winding's, and, where the temperature was measured or moves, `temperature_degc`,
    the case's. `depleted`, where it is asked to run on, is 1 from where the model ran out.

    cell : a BPX file, or a folder of a saved model, whose cell and effects are taken (not its correction).
    effects : added to those.
    model : "espm" or "dfn"; None takes that of a saved model, or that the cell's file was fitted with, else "espm".
    say_notes : called with sentences on changes by the reader, on assumptions and on the result.
    Raises DataError where a measurement cannot be of this cell.
    """
    asked, say = asked or ProfileRequest(), say_notes or _silent
    profile = read_current(current, asked.reading)
    say(profile.notes)
    given = declared_model(cell)
    declared = given.with_soh(asked.soh)
    if declared.correction is not None:
        say(["the saved model's learnt correction is no part of a simulation; `aesi predict` has it."])
        declared = replace(declared, finding="")  # it is of the model with its correction
    say([*other_model_sentences(declared, model), *soh_day_sentences(given.cell, asked.soh)])
    saved, lone = cell.is_dir(), profile.voltage_v is None
    assumed = declared.hold if saved else "linear" if lone else assumed_hold(profile.time_s)
    used = replace(
        declared,
        effects=(*declared.effects, *effects),
        hold=asked.hold or assumed,
        model=model or declared.model,
    )
    profiled = _profiled_model(used, profile, current, asked, say, saved=saved)
    used = profiled.model
    with _with_start_doubt(profiled.start, say):
        run = simulate(
            used.cell,
            profile.time_s,
            profile.current_a,
            profiled.start.soc,
            used.effects,
            profile.temperature_degc,
            used.hold,
            on_depletion="clip" if asked.run_on else "raise",
            model=used.model,
        )
    degc, of_case = _case_degc(used, run, profile.temperature_degc, declared.cell)
    _write_run(out, run, degc)
    say([f"{profiled.record.name}: {words}" for words in of_case])
    say(simulated_record_sentences(used.cell, profiled.record, run.voltage_v, run.series["soc"]))
    say(dry_collector_sentences(profiled.record.name, run, used.model))
    if asked.run_on and np.any(run.series["depleted"]):
        at = int(np.argmax(run.series["depleted"]))
        say([ran_out(profiled.record.name, {"this model": float(run.time_s[at])})])
    return run


def _write_run(out: Path, run: Run, case_degc: Array | None) -> None:
    """Write the columns of a run.

    Beside `temperature_k`, which is the winding's, stands `temperature_degc`, the case's, which files are read by.
    """
    columns = {"time_s": run.time_s, "current_a": run.current_a, "voltage_v": run.voltage_v, **run.series}
    write_table(out, columns if case_degc is None else columns | {"temperature_degc": case_degc})


def _case_degc(
    used: HybridModel, run: Run, measured_degc: Array | None, declared: Cell
) -> tuple[Array | None, tuple[str, ...]]:
    """(n,) degC of the case in a run: as measured, else the model's, and a sentence where that does not tell it; None
    also where it is the declared cell's all along."""
    winding_k = run.series["temperature_k"]
    if measured_degc is not None or np.all(winding_k == declared.initial_temperature_k):
        return measured_degc, ()
    model = model_with(used.cell, used.effects)
    kelvin = case_k(model, winding_k)
    if kelvin is not None:
        return kelvin - ZERO_CELSIUS_K, ()
    assert model.heat is not None
    return None, (
        f"the model gives off {model.heat.conductance_w_k:.3g} W/K, and the winding of the cell's file conducts "
        f"{1.0 / model.cell.winding_resistance_k_w:.3g} W/K to its case: what the case is at it does not tell, and "
        "temperature_degc is left out.",
    )


def predict_file(
    model: Path,
    current: Path,
    out: Path,
    asked: ProfileRequest | None = None,
    measured: bool = False,
    say_notes: SayNotes | None = None,
) -> int:
    """Predict the voltage of the profile in `current`, write it with its band to `out`; the number of rows.

    measured : one step ahead from the file's voltage; otherwise a free run, which sees the first of it at most.
    say_notes : as in `simulate_file`.
    Raises DataError where a measurement cannot be of this cell, InputError for a doubt about a start that is not given,
    or that no band has a use for.
    """
    asked, say = asked or ProfileRequest(), say_notes or _silent
    if asked.soc0_sd is not None and (asked.soc0 is None or measured):
        raise InputError(
            "--soc0-sd says how far the --soc0 of a free run may be off; give it with --soc0 and without --measured."
        )
    profile = read_current(current, asked.reading)
    say(profile.notes)
    if measured and profile.voltage_v is None:
        raise DataError(f"{current.name} has no voltage_v; leave out --measured for a free run.")
    given = HybridModel.load(model)
    saved = given.with_soh(asked.soh)
    say(soh_day_sentences(given.cell, asked.soh))
    used = replace(saved, hold=asked.hold or saved.hold)
    profiled = _profiled_model(used, profile, current, asked, say, saved=True)
    hybrid, record = profiled.model, profiled.record
    start, soc0_sd = profiled.start, profiled.start.read_sd if asked.soc0_sd is None else asked.soc0_sd
    with _with_start_doubt(start, say):
        prediction = hybrid.predict_record(record, start.soc, one_step=measured, soc0_sd=soc0_sd)
    frame = prediction.to_frame()
    frame.insert(1, "current_a", profile.current_a)
    _write(out, frame)
    # One step ahead knows the voltage before each row, which the physics does not: its errors are no peers of these.
    alone_v = None if hybrid.correction is None or measured else prediction.physics_v
    say(simulated_record_sentences(hybrid.cell, record, prediction.voltage_v, prediction.soc, alone_v))
    say(dry_collector_sentences(record.name, prediction, hybrid.model))
    say(_first_error_sentences(record, prediction, hybrid, measured))
    if hybrid.bands is not None and not measured and start.basis == "given" and asked.soc0_sd is None:
        say([_exact_start_sentence(record, prediction, hybrid, start.soc)])
    say(_band_sentences(record, prediction, hybrid, measured))
    return len(frame)


@dataclass(frozen=True, eq=False)
class _ProfiledModel:
    """A model with the profile that it is to simulate.

    record : the profile, NaN for a voltage that is not there.  start : state of charge at its first row.
    """

    model: HybridModel
    record: Measurement
    start: InitialState


def _profiled_model(
    model: HybridModel,
    profile: CurrentProfile,
    file: Path,
    asked: ProfileRequest,
    say: SayNotes,
    *,
    saved: bool,
) -> _ProfiledModel:
    """The model as it is asked for, with the profile and its initial state; says what is assumed.

    saved : the model is one of a folder, whose hold it has where none is asked for.
    Raises DataError for a profile that cannot be of its cell.
    """
    cooling: tuple[str, ...] = ()
    if asked.self_heating:
        heated = with_self_heating(model.cell, model.effects)
        if heated != model.effects and profile.temperature_degc is None:
            cooling = assumed(model.cell)
        model = replace(model, effects=heated)
    record = _record(profile, file, asked.hold)
    check_belongs(model.cell, [record])
    start = _start(model, record, asked.soc0)
    say(
        [
            *model.cell.unread,
            *fitted_record_sentences(model.cell, record, asked.soh, model.effects),
            start.sentence,
            hold_sentence(record.name, model.hold, asked.hold is not None, saved=saved),
            temperature_sentence(model.cell, record, model.effects),
            *temperature_range_sentences(model.cell, [record.temperature_degc], model.effects),
            *contradiction_sentences(model, record, start.soc, model.hold),
            *_effect_sentences(record, model),
            *cooling,
            *([f"when this model was made: {model.finding}"] if model.finding else []),
        ]
    )
    return _ProfiledModel(model, record, start)


def _effect_sentences(record: Measurement, model: HybridModel) -> list[str]:
    """A sentence on the effects that act, or that the cell holds, with their values, which may be defaults; of those
    that were fitted beside what was found the names alone."""
    acting = {
        one.id: repr(one)
        for one in model.effects
        if record.temperature_degc is None or one.effect.infers != "temperature"
    }
    held = {words.partition("(")[0]: words for words in model.held}
    told, inside = (
        [words for id, words in each.items() if id not in model.beside] for each in (acting, held)
    )
    beside = [id for id in (acting | held) if id in model.beside]
    said = [f"with {', '.join(told)}"] if told else []
    said += [f"the saved model includes {', '.join(inside)}"] if inside else []
    said += [f"and other parameters that were fitted together: {', '.join(beside)}"] if beside else []
    return [f"{record.name}: {'; '.join(said)}."] if said else []


def simulated_record_sentences(
    cell: Cell, record: Measurement, voltage_v: Array, soc: Array, alone_v: Array | None = None
) -> list[str]:
    """Sentences on a simulated record: where it ended, its error, and how much lies outside what the file declares.

    voltage_v, soc : (n,) simulated.  alone_v : (n,) V by the physics without a correction, where there is one.
    A record without a voltage has no error.
    """
    said = [f"{record.name}: state of charge {soc[0]:.3f} at the start, {soc[-1]:.3f} at the end."]
    if np.all(np.isfinite(record.voltage_v)):
        error = MV_PER_V * (record.voltage_v - voltage_v)
        said.append(
            f"{record.name}: against the measured voltage {rms(error):.2f} mV RMSE, "
            f"{np.mean(error):+.2f} mV in the mean (measured minus model), at most {np.max(np.abs(error)):.1f} mV"
            f"{_physics_error_clause(record, rms(error), alone_v)}."
        )
    beyond = (soc < -GIVEN_SD) | (soc > 1.0 + GIVEN_SD)  # as closely as any is known
    low, high = voltage_v < cell.lower_voltage_v, voltage_v > cell.upper_voltage_v
    limits = f"the cell's {cell.lower_voltage_v:g} to {cell.upper_voltage_v:g} V"
    left = [
        f"{side} {limit:g} V first at {stamp(record.time_s[int(np.argmax(rows))])} s, {furthest} {voltage_v[at]:.3f} "
        f"V at {stamp(record.time_s[at])} s"
        for side, limit, rows, furthest, at in (
            ("below", cell.lower_voltage_v, low, "down to", int(np.argmin(voltage_v))),
            ("above", cell.upper_voltage_v, high, "up to", int(np.argmax(voltage_v))),
        )
        if np.any(rows)
    ]
    for rows, words in (
        (beyond, f"a state of charge outside 0 to 1{_beyond_limits_clause(soc)}"),
        (low | high, f"a voltage outside {limits}: {'; '.join(left)}"),
    ):
        if np.any(rows):
            said.append(f"{record.name}: {_percent(rows)} of the simulated rows have {words}.")
    return said


def _physics_error_clause(record: Measurement, corrected_mv: float, alone_v: Array | None) -> str:
    """Clause, from '; ' on, on the error of the physics without its correction, and on that being the smaller one."""
    if alone_v is None:
        return ""
    alone, ours = f"{rms(MV_PER_V * (record.voltage_v - alone_v)):.2f}", f"{corrected_mv:.2f}"
    better = (
        ": without the correction the error on this record is lower" if float(alone) < float(ours) else ""
    )
    return f"; the physics alone {alone} mV RMSE{better}"


def _beyond_limits_clause(soc: Array) -> str:
    """A clause, beginning with ': ', on how far a record discharges or charges a cell beyond its limits.  soc : (n,)
    simulated."""
    said = []
    if (low := -float(np.min(soc))) > GIVEN_SD:
        said.append(f"asks for more charge than the cell has, by {100 * low:.1f} % of its capacity")
    if (high := float(np.max(soc)) - 1.0) > GIVEN_SD:
        asks = "starts with" if soc[0] == np.max(soc) else "brings"
        said.append(f"{asks} more charge than the cell can hold, by {100 * high:.1f} %")
    return f": the record {' and '.join(said)}" if said else ""


def voltage_words(run: Run) -> str:
    """Range of a run's voltage, '2.5 to 4.1 V'; of one that went on where it ran out, the range until then, and
    beyond."""
    voltage, depleted = run.voltage_v, run.series.get("depleted")
    if depleted is None or not np.any(depleted):
        return _range_v(voltage)
    at = int(np.argmax(depleted))
    until = f"{_range_v(voltage[:at])} until" if at else "no row before"
    return f"{until} it ran out at {stamp(run.time_s[at])} s, {_range_v(voltage[at:])} beyond, of no cell"


def _range_v(voltage_v: Array) -> str:
    return f"{np.min(voltage_v):.3f} to {np.max(voltage_v):.3f} V"


def _first_error_sentences(
    record: Measurement, prediction: Prediction, model: HybridModel, measured: bool
) -> list[str]:
    """A sentence on the error that a free run of a corrected model begins with."""
    if measured or model.correction is None:
        return []
    error_v = float(record.voltage_v[0] - prediction.physics_v[0])
    if np.isfinite(error_v):
        side = "below" if error_v < 0.0 else "above"
        return [
            f"{record.name}: its first voltage is {MV_PER_V * abs(error_v):.1f} mV {side} the model's; the prediction "
            "starts with that error."
        ]
    words = "the prediction starts with the error that the correction predicts, since no voltage is measured there"
    return [f"{record.name}: {words}; the band is that of a whole drive from its first row on."]


def _exact_start_sentence(
    record: Measurement, prediction: Prediction, model: HybridModel, soc0: float
) -> str:
    """A sentence that a band around a given start does not include an error of the start."""
    worth_v = model.start_worth_v(record, soc0, TOLD_SD, prediction.physics_v)
    return (
        f"{record.name}: the band takes the initial state of charge of {soc0:.4g} as exact; an error of {TOLD_SD:g} in "
        f"it changes the voltage by {MV_PER_V * rms(worth_v):.1f} mV RMS along this record. --soc0-sd widens the band "
        "by the uncertainty of the initial state."
    )


def _band_sentences(
    record: Measurement, prediction: Prediction, model: HybridModel, measured: bool
) -> list[str]:
    """Sentences on where the correction is applied, and on the share of rows within its band."""
    if model.correction is None:
        empty = ", and lower_v and upper_v are empty" if prediction.nominal is None else ""
        said = [f"the model carries no learnt correction: one step ahead is the same as a free run{empty}."]
    else:
        figures = trained_figures(
            prediction.outside,
            prediction.temperature_degc,
            model.correction,
            model.visited,
            prediction.weight,
        )
        said = [trained_sentence(record.name, figures, one_step=measured)]
        if model.correction.fade is not None and model.correction.fade.amplitude == 0.0:
            said.append("the correction improved no left-out training drive, so that it is applied nowhere.")
    banded = np.isfinite(prediction.lower_v)
    if prediction.nominal is not None and np.all(np.isfinite(record.voltage_v)):
        low, high = prediction.lower_v[banded], prediction.upper_v[banded]
        inside = _within(record.voltage_v[banded], low, high)
        said.append(
            f"{record.name}: the {100 * prediction.nominal:g} % band holds {100 * np.mean(inside):.1f} % of the "
            f"measured voltage; it is {MV_PER_V * float(np.mean(high - low)):.1f} mV wide in the mean."
        )
        if measured:
            said += _one_step_band_sentences(record, model, ~_within(prediction.voltage_v[banded], low, high))
    return said


def _one_step_band_sentences(record: Measurement, model: HybridModel, apart: BoolArray) -> list[str]:
    """Sentences on predictions outside a band one step ahead, and on rows further apart than its step.

    apart : True for those of the rows with a band that are predicted outside it.
    """
    said = []
    if np.any(apart):
        said.append(
            f"{record.name}: in {_percent(apart)} of the rows voltage_v lies outside its own band, which follows the "
            "errors of the rows before; the middle of lower_v and upper_v is the better estimate there."
        )
    if np.any(gaps := model.after_gap(record.time_s)):
        said.append(
            f"{record.name}: {_percent(gaps)} of the rows are more than a step of {model.dt_s:g} s after the one "
            "before, from which they are predicted; the band is of a step."
        )
    return said


def _within(voltage_v: Array, lower_v: Array, upper_v: Array) -> BoolArray:
    """(n,) True where a voltage lies in its band."""
    return (voltage_v >= lower_v) & (voltage_v <= upper_v)


def _percent(rows: BoolArray) -> str:
    """The share of True rows, '3.2 %'."""
    share = 100.0 * float(np.mean(rows))
    return f"{share:.2g} %" if share < 99.5 else "100 %"


def with_self_heating(cell: Cell, effects: tuple[ActiveEffect, ...]) -> tuple[ActiveEffect, ...]:
    """The effects with self-heating by the cell file's thermal data, where it is not among them already."""
    return effects if any(e.id == "self_heating" for e in effects) else (*effects, of_file(cell))


def write_table(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Columns as a CSV; the folder is made. Raises InputError where it cannot be written."""
    import pandas as pd

    _write(path, pd.DataFrame(columns))


def _record(profile: CurrentProfile, file: Path, hold: Hold | None) -> Measurement:
    """The profile as a measurement; NaN for a voltage that is not there."""
    voltage = np.full_like(profile.time_s, np.nan) if profile.voltage_v is None else profile.voltage_v
    return Measurement(
        profile.time_s,
        profile.current_a,
        voltage,
        profile.temperature_degc,
        record_name(file),
        hold=hold,
    )


def _start(model: HybridModel, record: Measurement, soc0: float | None) -> InitialState:
    """The state of charge at the first row: as given, from the voltage, or the saved model's."""
    start = partial(
        initial_state, model.cell, record, hold=model.hold, effects=model.effects, model=model.model
    )
    if soc0 is not None or np.isfinite(record.voltage_v[0]) or model.soc0 is None:
        return start(soc0)
    words = f"{record.name} starts at the saved model's state of charge of {model.soc0:.4g}; --soc0 takes another."
    return replace(start(model.soc0), sentence=words)


@contextmanager
def _with_start_doubt(start: InitialState, say: SayNotes) -> Iterator[None]:
    """Where a simulation fails that began at a state of charge read from a voltage, the error says to check that
    first."""
    try:
        yield
    except SimulationError:
        if start.read_sd > 0.0:
            say(
                [
                    f"where this record starts was read from its voltage, {start.soc:.3f} +/- {start.read_sd:.3f} of "
                    "its charge: check that first; --soc0 gives it."
                ]
            )
        raise


def _silent(notes: Iterable[str]) -> None:
    pass


def _write(path: Path, frame: pd.DataFrame) -> None:
    try:
        write_csv(path, frame, DIGITS)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}.") from None
