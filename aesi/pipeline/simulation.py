"""Files in, files out: the physics model alone, and a saved hybrid model with its intervals. What is said of a result
is in simulation_words.py."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aesi.constants import ZERO_CELSIUS_K
from aesi.data.convert import write_csv
from aesi.data.current import CurrentProfile, read_current
from aesi.data.reading import Reading, record_name
from aesi.errors import DataError, InputError, SimulationError, not_written
from aesi.numerics.typing import Array
from aesi.physics import ActiveEffect, Cell, InitialState, ModelName, initial_state
from aesi.physics.cell import Soh
from aesi.physics.depletion import ran_out
from aesi.physics.effects.self_heating import assumed, of_file
from aesi.physics.model import case_k
from aesi.physics.record_checks import check_belongs
from aesi.physics.simulation import OnDepletion, model_with
from aesi.pipeline.notes import (
    aged_sentences,
    contradiction_sentences,
    dry_collector_sentences,
    fitted_record_sentences,
    other_model_sentences,
    saved_model_sentences,
    soh_sentences,
    temperature_range_sentences,
    temperature_sentence,
)
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.simulation_words import (
    band_sentences,
    baseline_of,
    changed_cell_sentences,
    effect_sentences,
    exact_start_sentence,
    first_error_sentences,
    simulated_record_sentences,
)
from aesi.records import Hold, Measurement, Run, hold_sentence

if TYPE_CHECKING:
    import pandas as pd

DIGITS = 9
"""Significant digits of what is written, except for the time (or the frequency)."""
SayNotes = Callable[[Iterable[str]], None]


@dataclass(frozen=True)
class ProfileRequest:
    """The user's options for a profile, in addition to its file.

    soc0 : state of charge at the first row; None takes it from the file's voltage, where it has one (see
    `initial_state`), else from the saved model.
    hold : how the current runs between rows; None takes what `HybridModel.hold_of` says.
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
    say([*other_model_sentences(declared, model), *soh_sentences(given, asked.soh)])
    used = replace(declared, effects=(*declared.effects, *effects), model=model or declared.model)
    profiled = _profiled_model(used, profile, current, asked, say)
    used = profiled.model
    with _with_start_doubt(profiled.start, say):
        on_depletion: OnDepletion = "clip" if asked.run_on else "raise"
        hold = used.hold_of(profiled.record)
        run = used.physics.run(profiled.record, profiled.start.soc, hold, on_depletion)
    degc, of_case = _case_degc(used, run, profile.temperature_degc, declared.cell)
    _write_run(out, run, degc)
    say([f"{profiled.record.name}: {words}" for words in of_case])
    say(changed_cell_sentences(profiled.record, used, profiled.start.soc, run.series["soc"]))
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
    """((n,) degC, temperature of the case in a run, as measured or else the model's; sentences). The temperature is
    None where it is that of the declared cell throughout, and where the model does not determine it, which a sentence
    says."""
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
    if asked.soc0_sd is not None and given.bands is None:
        raise InputError(f"--soc0-sd widens the band of a free run, and {model} has none; leave it out.")
    saved = given.with_soh(asked.soh)
    say(soh_sentences(given, asked.soh))
    profiled = _profiled_model(saved, profile, current, asked, say)
    hybrid, record = profiled.model, profiled.record
    start, soc0_sd = profiled.start, profiled.start.read_sd if asked.soc0_sd is None else asked.soc0_sd
    with _with_start_doubt(start, say):
        prediction = hybrid.predict_record(record, start.soc, one_step=measured, soc0_sd=soc0_sd)
    frame = prediction.to_frame()
    frame.insert(1, "current_a", profile.current_a)
    _write(out, frame)
    say(changed_cell_sentences(record, hybrid, start.soc, prediction.soc))
    baseline = baseline_of(prediction, hybrid)
    say(simulated_record_sentences(hybrid.cell, record, prediction.voltage_v, prediction.soc, baseline))
    say(dry_collector_sentences(record.name, prediction, hybrid.model))
    say(first_error_sentences(record, prediction, hybrid, measured))
    if hybrid.bands is not None and not measured and start.basis == "given" and asked.soc0_sd is None:
        say([exact_start_sentence(record, prediction, hybrid, start.soc)])
    say(band_sentences(record, prediction, hybrid, measured))
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
) -> _ProfiledModel:
    """The model as it is asked for, with the profile and its initial state; says what is assumed.

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
    start, hold = _start(model, record, asked.soc0), model.hold_of(record)
    saved = "" if model.hold is None else "as the saved model was made"
    say(
        [
            *model.cell.unread,
            *saved_model_sentences(model, record),
            *fitted_record_sentences(model.cell, record, asked.soh, model.effects),
            start.sentence,
            *aged_sentences(model.cell, record, start, asked.soh),
            hold_sentence(record.name, hold, asked.hold is not None, why=saved),
            temperature_sentence(model.cell, record, model.effects),
            *temperature_range_sentences(model.cell, [record.temperature_degc], model.effects),
            *contradiction_sentences(model, record, start.soc, hold),
            *effect_sentences(record, model),
            *cooling,
            *([f"when this model was made: {model.finding}"] if model.finding else []),
        ]
    )
    return _ProfiledModel(model, record, start)


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
        str(file),
        hold=hold,
    )


def _start(model: HybridModel, record: Measurement, soc0: float | None) -> InitialState:
    """The state of charge at the first row: as given, from the voltage, or the saved model's."""
    start = partial(
        initial_state,
        model.cell,
        record,
        hold=model.hold_of(record),
        effects=model.effects,
        model=model.model,
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
        raise InputError(not_written(path, error)) from None
