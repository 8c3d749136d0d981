"""Notes on records, each said once for all the records that it holds for."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Sequence
from datetime import date
from numbers import Real

import numpy as np

from aesi.calibration.records.sizes import aged_sentence
from aesi.calibration.records.thinning import thinned
from aesi.calibration.records.zero import zero_of
from aesi.constants import ZERO_CELSIUS_K
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.physics import ActiveEffect, Cell, InitialState, ModelName
from aesi.physics.cell import Soh
from aesi.physics.model import HeatBalance, of_record
from aesi.physics.simulation import MODEL_WORDS, model_with
from aesi.physics.start.temperature import contradicted_temperature
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.product.prediction import Prediction
from aesi.records import LABORATORY, Hold, Measurement, Run, at_its_temperature, measured_on_case

SEPARATOR = ": "
MERE_NAMES = re.compile(r"[^\s,]+(, [^\s,]+)*")
"""Pattern by which notes of several records are joined, where the names of these are not known: without a space."""
OTHER_TEMPERATURE = {LABORATORY: "", "": "; for another one give its temperature_degc"}
"""Source of a record that is no file -> how it is given another temperature: one of the virtual laboratory, which makes
it at the file's, is not; one that was made in memory takes it as an argument."""
TELLING_K = 5.0
"""K from a cell's reference temperature beyond which activation energies tell: with 20 kJ/mol rates differ by a
sixth. A convention."""


def together(notes: Iterable[str], names: Collection[str] = ()) -> tuple[str, ...]:
    """Notes `record: text` with the same text joined to `record, other: text`, in the order of the first of each. A
    note with something else than names before the colon stays as it is; notes without a colon come last.

    names : of the records, by which one with a space (`25degC drive`) is known for a name.
    """
    subjects: dict[str, list[str]] = {}
    for note in notes:
        subject, separator, text = note.partition(SEPARATOR)
        if separator and subject not in names and not MERE_NAMES.fullmatch(subject):
            subjects.setdefault(note, [])
        else:
            subjects.setdefault(text if separator else "", []).append(subject if separator else note)
    alone = subjects.pop("", [])
    return (
        *(
            f"{', '.join(dict.fromkeys(names))}{SEPARATOR}{text}" if names else text
            for text, names in subjects.items()
        ),
        *alone,
    )


def temperature_sentence(cell: Cell, record: Measurement, effects: Sequence[ActiveEffect]) -> str:
    """A sentence on the temperature at which a record is simulated, and on what that rests."""
    inferring = [active.id for active in effects if active.effect.infers == "temperature"]
    inferred, several = " and ".join(inferring), len(inferring) > 1
    if record.temperature_degc is not None:
        beside = f"; {inferred} {'have' if several else 'has'} nothing to add" if inferred else ""
        if inferred and _on_case(cell, effects) != _on_case(cell, ()):
            beside += " but the cell's heat capacity"
        stated = not measured_on_case(record.temperature_degc) and cell.winding_resistance_k_w
        of_case = ", for its case: the winding is warmer under load" if stated else ""
        return f"{record.name}: {at_its_temperature(record.temperature_degc)}{of_case}{beside}."
    degc = cell.initial_temperature_k - ZERO_CELSIUS_K
    beside = f" and {inferred} {'change' if several else 'changes'} it" if inferred else ""
    another = OTHER_TEMPERATURE.get(
        record.source,
        "; for another one add a column temperature_degc, or give --column temperature_degc=40",
    )
    told = f"{record.name}: no temperature column; taken at {degc:.4g} degC, as the cell's file declares"
    return f"{told}{beside}{another}."


def _on_case(cell: Cell, effects: Sequence[ActiveEffect]) -> HeatBalance | None:
    """The heat balance of the cell with these effects, where the temperature of its case was measured."""
    return of_record(model_with(cell, effects), measured=True).heat


def missing_energy_sentences(
    cell: Cell, temperatures_degc: Iterable[Array | float | None]
) -> tuple[str, ...]:
    """A sentence where properties of the cell do not answer to the temperatures that it is taken at.

    temperatures_degc : of each record, None where it holds none and is taken as the cell declares.
    """
    reference_k, missing = cell.reference_temperature_k, _without_energy(cell)
    kelvin = (cell.initial_temperature_k if t is None else t + ZERO_CELSIUS_K for t in temperatures_degc)
    farthest = max((float(np.max(np.abs(each - reference_k))) for each in kelvin), default=0.0)
    if not missing or farthest <= TELLING_K:
        return ()
    return (
        f"the cell's file declares no activation energy for {', '.join(missing)}: their values at "
        f"{reference_k - ZERO_CELSIUS_K:.4g} degC are used at temperatures up to {farthest:.0f} K away.",
    )


def beyond_fitted_sentences(cell: Cell, temperatures_degc: Iterable[Array | float | None]) -> tuple[str, ...]:
    """A sentence where records are colder or warmer in the mean than any that the cell's file was fitted to.

    Arguments as of `missing_energy_sentences`.
    """
    if not cell.fitted_at_k:
        return ()
    means = [
        cell.initial_temperature_k if t is None else float(np.mean(t)) + ZERO_CELSIUS_K
        for t in temperatures_degc
    ]
    out = []
    for word, sign in (("colder", -1.0), ("warmer", 1.0)):
        record, edge_k = max(cell.fitted_at_k, key=lambda one: sign * one[1])
        farthest_k = max(means, key=lambda kelvin: sign * kelvin)
        if sign * (farthest_k - edge_k) > TELLING_K:
            out.append(
                f"{farthest_k - ZERO_CELSIUS_K:.1f} degC in the mean is {abs(farthest_k - edge_k):.0f} K {word} than "
                f"any record that the cell's file was fitted to ({record}, {edge_k - ZERO_CELSIUS_K:.1f} degC): what "
                "the model says there is extrapolated."
            )
    return tuple(out)


def temperature_range_sentences(
    cell: Cell, temperatures_degc: Iterable[Array | float | None], effects: Iterable[ActiveEffect] = ()
) -> tuple[str, ...]:
    """Sentences on the temperatures that a cell is taken at: `missing_energy_sentences` and `beyond_fitted_sentences`.

    temperatures_degc : of each record, None where it holds none and is taken as the cell's file declares, or as
    `effects` change that.
    """
    given, acting = list(temperatures_degc), model_with(cell, effects).cell
    return (*missing_energy_sentences(acting, given), *beyond_fitted_sentences(acting, given))


def contradiction_sentences(
    model: HybridModel, record: Measurement, soc0: float, hold: Hold
) -> tuple[str, ...]:
    """A sentence where the voltage of a record contradicts the temperature that it is simulated at, told on the rows
    that a fit would see of it.

    model : what is simulated, without its correction.  soc0 : at the first row.  hold : how the current runs between
    the rows.
    """
    if record.temperature_degc is None or not np.all(np.isfinite(record.voltage_v)):
        return ()
    thin = thinned(record, model.cell.capacity_ah)
    between = hold if thin.data is record else thin.hold
    found = contradicted_temperature(model.cell, thin.data, soc0, between, model.effects, model.model)
    return () if found is None else (found.sentence(record.name),)


def soh_sentences(given: HybridModel, soh: Soh | None) -> tuple[str, ...]:
    """A sentence on the state of health at which a saved model was made, to which a requested share refers, and one on
    the share at a requested day.

    given : what is declared, before it is taken at the state of health that is asked for.
    """
    said = []
    if not math.isclose(given.soh, 1.0):
        share = isinstance(soh, Real)
        further = f", and is taken at {float(soh):.3f} of that, as asked" if share else ""  # type: ignore[arg-type]
        said.append(
            f"the saved model's cell has {given.soh:.3f} of its file's capacity, at which it was made{further}."
        )
    if isinstance(soh, date):
        said.append(
            f"the cell as of {soh}: {given.cell.soh_on(soh):.3f} of its file's capacity, by the records that it was "
            "fitted to."
        )
    return tuple(said)


def fitted_record_sentences(
    cell: Cell, record: Measurement, soh: Soh | None, effects: Iterable[ActiveEffect] = ()
) -> tuple[str, ...]:
    """Sentences where the cell's file was fitted to a record of this name: the share of its capacity that the cell had
    then, unless a state of health is given, and what the fit takes out of the current of a slow cycle."""
    share = dict(cell.capacity_shares).get(record.name)
    if share is None:
        return ()
    of_then = soh is None and round(share, 3) != 1.0
    said = [
        f"{record.name}: the cell's file was fitted to a record of this name"
        + (
            f", in which the cell had {share:.3f} of its capacity (--soh {share:.3f} takes it)."
            if of_then
            else "."
        )
    ]
    if np.all(np.isfinite(record.voltage_v)) and not any(
        one.id == "current_sensor_offset" for one in effects
    ):
        zero = zero_of(cell, [record])
        said += [
            f"{sentence} A fit takes that out, a simulation does not: the effect current_sensor_offset with "
            f"offset_a={zero.mean_a:.2g} does."
            for sentence in zero.sentences
        ]
    return tuple(said)


def aged_sentences(cell: Cell, record: Measurement, start: InitialState, soh: Soh | None) -> tuple[str, ...]:
    """A sentence where a record shows another capacity than the cell's file has, unless a state of health is given or
    the file knows that of the record (`fitted_record_sentences`).  start : of the record."""
    if soh is not None or record.name in dict(cell.capacity_shares):
        return ()
    said = aged_sentence(cell, record, start) if np.all(np.isfinite(record.voltage_v)) else ""
    return (said,) if said else ()


def seen_names(declared: HybridModel, judging: Iterable[Measurement]) -> tuple[str, ...]:
    """Names of those of the judging records that the declared model was fitted to, recognised by content for a saved
    model and by name for the file of a cell."""
    digests = {digest for _, digest in declared.fitted_to}
    of_file = dict(declared.cell.capacity_shares)
    return tuple(one.name for one in judging if one.file_digest in digests or one.name in of_file)


def seen_sentences(declared: HybridModel, judging: Iterable[Measurement]) -> tuple[str, ...]:
    """Sentences on the records, of those that judge, that the declared model was fitted to."""
    said: list[str] = []
    for record in judging:
        said += saved_model_sentences(declared, record)
        if record.name in dict(declared.cell.capacity_shares):
            said.append(
                f"{record.name}: the cell's file was fitted to a record of this name, so that no model has it held "
                "out; the error of a record that the file was not fitted to says more."
            )
    return tuple(said)


def saved_model_sentences(model: HybridModel, record: Measurement) -> tuple[str, ...]:
    """A sentence where a saved model was fitted to a record that may judge it, or to one of its name."""
    if not np.any(np.isfinite(record.voltage_v)):
        return ()
    if record.file_digest in {digest for _, digest in model.fitted_to}:
        return (
            f"{record.name}: the saved model was fitted to this very record, or to a part of it: its error there is "
            "not that of a held-out record.",
        )
    if record.name in dict(model.fitted_to):
        return (
            f"{record.name}: the saved model was fitted to a record of this name with other rows or columns; if both "
            "are of one test, its error there is not that of a held-out record.",
        )
    return ()


def dry_collector_sentences(name: str, run: Run | Prediction, model: ModelName) -> tuple[str, ...]:
    """A sentence where a single particle model depleted the salt at a collector, with the time; empty for others."""
    salt_mol_m3 = run.collector_mol_m3
    dry = np.zeros(len(run), dtype=bool) if salt_mol_m3 is None else salt_mol_m3 < 0.0
    if model != "espm" or not dry.any():
        return ()
    return (
        f"{name}: the salt at a collector is used up in {100 * dry.mean():.2g} % of the rows, from "
        f"{stamp(run.time_s[int(np.argmax(dry))])} s on. There the reaction moves towards the separator, which one "
        "particle an electrode does not see: compare with `aesi simulate --model dfn`.",
    )


def other_model_sentences(declared: HybridModel, asked: ModelName | None) -> tuple[str, ...]:
    """A sentence where a simulation takes another physics model than what is simulated was found or fitted with."""
    cell, found = declared.cell, bool(declared.effects or declared.correction)
    if asked is None or asked == declared.model or not (found or cell.fitted_with):
        return ()
    source = "what the saved model adds to its cell was found" if found else "the cell's file was fitted"
    return (
        f"{source} with {MODEL_WORDS[declared.model]}, and {MODEL_WORDS[asked]} is simulated, as asked: its parameters "
        "may compensate for the difference of the two; leave out --model to use the model that they belong to.",
    )


def _without_energy(cell: Cell) -> list[str]:
    """Names of the properties that the cell declares no activation energy for."""
    energies = {
        "negative diffusivity": cell.negative.diffusivity_ea_j_mol,
        "negative reaction rate": cell.negative.rate_ea_j_mol,
        "positive diffusivity": cell.positive.diffusivity_ea_j_mol,
        "positive reaction rate": cell.positive.rate_ea_j_mol,
        "electrolyte conductivity": cell.electrolyte.conductivity_ea_j_mol,
        "electrolyte diffusivity": cell.electrolyte.diffusivity_ea_j_mol,
    }
    return [name for name, energy in energies.items() if not energy]
