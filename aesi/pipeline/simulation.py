"""Files in, files out: the physics model alone, and a saved hybrid model with its intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aesi.data.current import CurrentProfile, read_current
from aesi.data.read import Sign
from aesi.errors import DataError, InputError
from aesi.physics import ModelName, initial_state, simulate
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Hold, Measurement, Run

if TYPE_CHECKING:
    import pandas as pd

    from aesi.physics import ActiveEffect

SayNotes = Callable[[Iterable[str]], None]


def simulate_file(
    cell: Path,
    current: Path,
    out: Path,
    soc0: float | None = None,
    effects: Sequence[tuple[str, Mapping[str, float]]] = (),
    effect_files: Sequence[Path] = (),
    hold: Hold = "linear",
    columns: Mapping[str, str | None] | None = None,
    sign: Sign = "discharge-positive",
    say_notes: SayNotes | None = None,
    model: ModelName = "espm",
) -> Run:
    """Simulate the profile in `current` and write time, current, voltage and states to the CSV `out`.

    cell : a BPX file, or a folder of a saved model, whose cell and effects are taken (not its correction).
    soc0 : None takes it from the file's voltage, where it has one (see `initial_state`), else from the saved model.
    say_notes : is given what the reader dropped or mapped, one sentence each.
    model : "espm" or "dfn".
    """
    profile = _read(current, columns, sign, say_notes)
    declared = declared_model(cell)
    active = (*declared.effects, *_activated(effects, effect_files))
    start = _start(replace(declared, effects=active, hold=hold), profile, current, soc0, say_notes)
    run = simulate(
        declared.cell,
        profile.time_s,
        profile.current_a,
        start,
        active,
        profile.temperature_degc,
        hold,
        model=model,
    )
    columns_out = {"time_s": run.time_s, "current_a": run.current_a, "voltage_v": run.voltage_v, **run.series}
    write_table(out, columns_out)
    return run


def predict_file(
    model: Path,
    current: Path,
    out: Path,
    measured: bool = False,
    soc0: float | None = None,
    columns: Mapping[str, str | None] | None = None,
    sign: Sign = "discharge-positive",
    say_notes: SayNotes | None = None,
) -> int:
    """Predict the voltage of the profile in `current`, write it with its band to `out`; the number of rows.

    measured : one step ahead from the file's voltage; otherwise a free run.  say_notes : as in `simulate_file`.
    """
    profile = _read(current, columns, sign, say_notes)
    if measured and profile.voltage_v is None:
        raise DataError(f"{current.name} has no voltage_v; leave out --measured for a free run.")
    hybrid = HybridModel.load(model)
    prediction = hybrid.predict(
        profile.time_s,
        profile.current_a,
        soc0=_start(hybrid, profile, current, soc0, say_notes),
        voltage_v=profile.voltage_v if measured else None,
        temperature_degc=profile.temperature_degc,
    )
    frame = prediction.to_frame()
    frame.insert(1, "current_a", profile.current_a)
    _write(out, frame)
    return len(frame)


def write_table(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Columns as a CSV; the folder is made. Raises InputError where it cannot be written."""
    import pandas as pd

    _write(path, pd.DataFrame(columns))


def _read(
    current: Path, columns: Mapping[str, str | None] | None, sign: Sign, say_notes: SayNotes | None
) -> CurrentProfile:
    profile = read_current(current, columns, sign)
    if say_notes is not None:
        say_notes(profile.notes)
    return profile


def _start(
    model: HybridModel, profile: CurrentProfile, file: Path, soc0: float | None, say_notes: SayNotes | None
) -> float:
    """State of charge at the first row: as given, from the voltage, or the saved model's; it is said."""
    voltage = profile.voltage_v
    if voltage is None and soc0 is None:
        soc0 = model.soc0
    if voltage is None:
        voltage = np.full_like(profile.time_s, np.nan)
    record = Measurement(
        profile.time_s, profile.current_a, voltage, profile.temperature_degc, file.name.split(".")[0]
    )
    start = initial_state(model.cell, record, soc0, model.hold, model.effects)
    if say_notes is not None:
        say_notes([start.sentence])
    return start.soc


def _write(path: Path, frame: pd.DataFrame) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        frame.to_csv(path, index=False, float_format="%.9g")
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}.") from None


def _activated(
    effects: Sequence[tuple[str, Mapping[str, float]]], files: Sequence[Path]
) -> tuple[ActiveEffect, ...]:
    from difflib import get_close_matches

    from aesi.physics.effects import CATALOGUE

    known = dict(CATALOGUE)
    for path in files:
        from aesi.physics.effects import load_effect

        effect = load_effect(path)
        known[effect.id] = effect
    for name, _ in effects:
        if name not in known:
            near = get_close_matches(name, list(known), n=1)
            hint = f"; did you mean {near[0]!r}?" if near else "."
            raise InputError(f"there is no effect {name!r} in the catalogue{hint} `aesi effects` lists them.")
    return tuple(known[name].activate(**values) for name, values in effects)
