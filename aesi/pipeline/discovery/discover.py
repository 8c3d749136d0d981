"""`aesi discover` as plain functions: a case in; discovery.json, report.html and a model folder out."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from aesi.advice import Reader, told
from aesi.calibration.records.sizes import ends_full, sizes_sentence
from aesi.constants import MILLI, MV_PER_V, ZERO_CELSIUS_K
from aesi.numerics.files.whole import write_whole
from aesi.physics.cell import Soh
from aesi.physics.effects import CATALOGUE, Effect, known_effects, selected
from aesi.physics.folded import folded
from aesi.physics.initial_state import InitialState, initial_state
from aesi.physics.rest.open_circuit import GOOD_READING_V
from aesi.physics.simulation import ModelName
from aesi.pipeline.notes import (
    aged_sentences,
    seen_names,
    seen_sentences,
    soh_sentences,
    temperature_range_sentences,
    temperature_sentence,
    together,
)
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.report.views import DiscoveryTrace, DiscoveryView, EffectView
from aesi.pipeline.report.words.sizes import capitalised
from aesi.pipeline.written import ARCHIVE, FINDING, MODEL, REPORT
from aesi.records import Measurement
from aesi.tracer import Discovery, discover
from aesi.tracer.discovery import Progress
from aesi.tracer.report.candidate_effects import CandidateEffect
from aesi.tracer.report.outcome import STATES, Errors, Part, State
from aesi.tracer.report.own_parameters import OwnParameter
from aesi.tracer.report.step_resistance import MEASURED, CurrentSteps, StepResistance
from aesi.tracer.report.yardstick import POINTS_TO, Pointer

SCHEMA = "aesi.discovery/1"
HOLDOUT = 0.3
"""Default share of the data, at the end, that is kept back where there are no test records."""
ABBREVIATIONS = {"ocv": "OCV", "ocp": "OCP"}
"""Words of effect ids -> how titles write them."""


@dataclass(frozen=True, eq=False)
class Case:
    """One discovery, as requested.

    cell : BPX file, or a saved model or its folder, whose cell and effects are the declared ones.
    measurements : records that are searched for missing effects.  tests : records that choose nothing.  good : records
    of the same cell that are known to be good.
    soc0 : state of charge at the first row, 0 to 1; None reads it from the voltage.  soh : share of the
    cell's capacity that it had then, or the day of the records; None takes the whole capacity.
    holdout : last share of each record that is kept back if there are no tests, 0 to 1; None takes `HOLDOUT`.
    max_effects : most effects that are added; a note says so if it is less than the default.  seed : of the bootstrap.
    effect_files : Python files of the user's own effects.  only, without : ids of the effects that are tried, or are
    not; empty for all.
    model : "espm" or "dfn" for every hypothesis; None takes that of a saved porous electrode, else what the data ask
    for.
    reader : whom its sentences are for; they name keys or arguments beside the options for who uses none.
    """

    cell: Path | HybridModel
    measurements: tuple[Measurement, ...]
    tests: tuple[Measurement, ...] = ()
    soc0: float | None = None
    holdout: float | None = None
    max_effects: int = 3
    seed: int = 0
    effect_files: tuple[Path, ...] = ()
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    model: ModelName | None = None
    soh: Soh | None = None
    good: tuple[Measurement, ...] = ()
    reader: Reader = "command"

    @property
    def records(self) -> tuple[Measurement, ...]:
        """All records: the fitted ones, those that are known to be good, and the test records."""
        return (*self.measurements, *self.good, *self.tests)

    def with_each(self, changed: Callable[[Measurement], Measurement]) -> Case:
        """The case with `changed` applied to each of its records."""
        groups = (self.measurements, self.tests, self.good)
        measurements, tests, good = (tuple(map(changed, group)) for group in groups)
        return replace(self, measurements=measurements, tests=tests, good=good)

    @property
    def kept_back(self) -> float:
        """Share of each record, at the end, that is kept back for the test."""
        if self.tests:
            return 0.0
        return HOLDOUT if self.holdout is None else self.holdout

    @property
    def restrictions(self) -> tuple[str, ...]:
        """Sentences on effects that are not tried, so that nobody reads the verdict as one about them, and on
        options that are not used."""
        only, without = (
            [name.strip() for names in given for name in names.split(",")]
            for given in (self.only, self.without)
        )
        competing = self.competing() if only and self.max_effects else ()
        alone = [name for name in only if name in competing]
        few = "1 effect is" if self.max_effects == 1 else f"{self.max_effects} effects are"
        said = {
            "no effect is tried (at most 0 are added), so that none can be found.": self.max_effects == 0,
            f"at most {few} added, as asked; what more effects explain together is not looked for.": (
                0 < self.max_effects < Case.max_effects
            ),
            f"tried alone: {', '.join(alone)}; nothing is said about other effects.": bool(alone),
            f"not tried: {', '.join(without)}.": bool(without and self.max_effects),
            f"test records are given, so that the holdout of {self.holdout or 0.0:g} is not used: all rows of the data "
            "are looked at.": bool(self.tests and self.holdout),
        }
        return tuple(sentence for sentence, holds in said.items() if holds)

    @property
    def judging(self) -> tuple[Measurement, ...]:
        """The records with rows that choose nothing; those that are looked at where their end is kept back."""
        return self.tests or (self.measurements if self.kept_back else ())

    @property
    def seen(self) -> tuple[str, ...]:
        """Names of the records that judge, and that the declared model was fitted to."""
        return seen_names(declared_model(self.cell), self.judging)

    @cached_property
    def assumed(self) -> tuple[str, ...]:
        """Sentences on the temperature of records that hold none, on what of the declared cell is left out, and on
        records that judge a model which was fitted to them."""
        given = self.declared()
        untold = (m for m in self.records if m.temperature_degc is None)
        without = "the saved model's learnt correction is left out: what is sought is what its physics lacks."
        left = () if given.correction is None else (without,)
        temperatures = [temperature_sentence(given.cell, m, given.effects) for m in untold]
        return (
            *given.cell.unread,
            *filter(None, [sizes_sentence(given.cell, self.records, given.cell.capacity_ah)]),
            *soh_sentences(declared_model(self.cell), self.soh),
            *(told(self.reader, sentence) for sentence in self._aged(given)),
            *seen_sentences(given, self.judging),
            *temperature_range_sentences(
                given.cell, (m.temperature_degc for m in self.records), given.effects
            ),
            *left,
            *(told(self.reader, sentence) for sentence in temperatures),
        )

    def _aged(self, given: HybridModel) -> Iterator[str]:
        """Sentences on records that look as of a cell with another capacity than the file's, from the start that the
        search reads."""
        shared = len(self.measurements) > 1
        full = InitialState(1.0, 0.0, "full charge", "")
        for m in self.measurements:
            if not (ends_full(given.cell, m) or aged_sentences(given.cell, m, full, self.soh)):
                continue  # a start below full leaves more of a discharge to the cell
            start = initial_state(
                given.cell,
                m,
                self.soc0,
                m.hold_taken,
                given.effects,
                shared=shared,
                potentials_v=GOOD_READING_V,
            )
            yield from aged_sentences(given.cell, m, start, self.soh)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what was not tried, not used or assumed, and on what a reader dropped, mapped or averaged in
        the files."""
        return (*self.restrictions, *self.assumed, *(note for m in self.records for note in m.notes))

    def declared(self) -> HybridModel:
        """The declared cell and effects.  Raises CellError or InputError for what cannot be read."""
        return declared_model(self.cell).with_soh(self.soh)

    def tried(self) -> dict[str, Effect]:
        """The effects that may be tried.  Raises InputError for an effect file or an id that is none."""
        return selected(known_effects(self.effect_files), self.only, self.without)

    def competing(self) -> tuple[str, ...]:
        """Ids of those that the declared model has not already. One that restates declared parameters may be tried
        again: a parameter that was corrected once may still be off."""
        given = {one.id for one in self.declared().effects}
        return tuple(name for name, one in self.tried().items() if name not in given or one.restates_declared)


def run_case(case: Case, out: Path | None = None, progress: Progress | None = None) -> Discovery:
    """Trace one case; fits are kept in `out`, so that the same case goes on where it was interrupted."""
    given = case.declared()
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    found = discover(
        given.cell,
        case.measurements,
        case.tests,
        soc0=case.soc0,
        holdout=case.kept_back,
        max_effects=case.max_effects,
        seed=case.seed,
        effects=case.tried(),
        given=given.effects,
        archive=None if out is None else out / ARCHIVE,
        progress=progress,
        model=case.model or ("dfn" if given.model == "dfn" else None),
        good=case.good,
    )
    warnings, notes = (
        tuple(told(case.reader, one) for one in said) for said in (found.warnings, found.notes)
    )
    return replace(found, warnings=warnings, notes=notes)


def write_discovery(out: Path, case: Case, found: Discovery, mlflow_run_id: str = "") -> dict[str, Any]:
    """Write discovery.json, report.html and model/ to `out`; returns the content of discovery.json."""
    from aesi.pipeline.report.write import write_discovery_report

    content = discovery_content(found, case.notes, case.seen)
    write_whole(out / FINDING, json.dumps(content, indent=1, allow_nan=False) + "\n")
    case_model(case, found).save(out / MODEL)
    title = ", ".join(m.name for m in case.measurements)
    write_discovery_report(out / REPORT, discovery_view(found, content, title, mlflow_run_id))
    return content


def case_model(case: Case, found: Discovery) -> HybridModel:
    """The model that a discovery writes: `found_model`, with the records that it was fitted to."""
    return found_model(found, case.declared()).with_fitted((*case.measurements, *case.good))


def found_model(found: Discovery, given: HybridModel | None = None) -> HybridModel:
    """The cell with what was found: as far as its file can hold it as values of the cell, the rest as effects.

    given : the declared model, whose effects keep the words that it has for them; None for one without any.
    Lost lithium and active material, which move full and empty, stay effects, so that a state of charge keeps its
    meaning.
    """
    inside = folded(found.cell, found.model_effects)
    if not inside.same_window(found.cell):
        inside = folded(found.cell, ())
    left = inside.left if inside.held else found.model_effects
    held = (*found.held, *inside.held)
    said = HybridModel(found.cell) if given is None else given
    fitted = (one for one in (*left, *held) if one not in said.effects)
    return HybridModel(
        inside.cell,
        left,
        soc0=found.soc0,
        hold=found.hold,
        model=found.choice.model,
        held=(*said.held, *map(repr, held)),
        beside=(*said.beside, *(repr(one) for one in fitted if one.id not in found.written)),
        finding=" ".join(map(capitalised, found.warnings)),
        soh=said.soh,
        fitted_to=said.fitted_to,
    )


def discovery_content(
    found: Discovery, asked: Sequence[str] = (), seen: Sequence[str] = ()
) -> dict[str, Any]:
    """The content of discovery.json.

    asked : sentences on effects not tried, options not used and changes by a reader.  seen : names of the records of
    the test part that the declared model was fitted to.
    """
    verdict, explained_v = found.verdict, found.after.yardstick.explained_v
    return {
        "schema": SCHEMA,
        "verdict": verdict.word,
        "effects": list(verdict.effects),
        "chosen": list(found.chosen),
        "written": list(found.written),
        "written_parameters": {name: dict(values) for name, values in found.written.items()},
        "tried": list(found.tried),
        "indistinguishable": [list(group) for group in verdict.groups],
        "of_another_age": list(verdict.aged),
        "confidence": round(verdict.confidence, 4),
        "reason": verdict.reason,
        "declared_degc": found.cell.initial_temperature_k - ZERO_CELSIUS_K,
        "model": _model(found),
        **{state: {part: _errors(found, state, part) for part in ("fit", "test")} for state in STATES},
        "noise_floor_mv": MV_PER_V * found.noise_floor_v,
        "explainable_mv": None if explained_v is None else MV_PER_V * explained_v,
        "structured_mv": MV_PER_V * verdict.structured_v,
        "tolerance_mv": MV_PER_V * verdict.tolerance_v,
        "margin": verdict.margin,
        "candidates": [_candidate_row(c) for c in found.candidates],
        "own_parameters": {state: [_own_row(one) for one in rows] for state, rows in found.own.items()},
        "files": _file_rows(found),
        "dependence": _dependence(found),
        "points_to": _pointers(found),
        "step_resistance": _step_resistance(found),
        "experiments": [{"effects": list(g), "experiment": text} for g, text in found.experiments],
        "not_adopted": found.not_adopted,
        "notes": list(together((*asked, *found.notes), [one.name for one in found.files])),
        "contradicted": found.contradicted,
        "other_temperature": list(found.other_temperature),
        "good": list(found.good),
        "seen": list(seen),
        "warnings": list(found.warnings),
        "seconds": round(found.seconds, 2),
        "simulations": found.simulations,
    }


def _model(found: Discovery) -> dict[str, Any]:
    """The model of the cell that every hypothesis used, and how far the two models of the declared cell differ."""
    choice, told = found.choice, found.choice.reduction
    out: dict[str, Any] = {"name": choice.model, "sentence": choice.sentence}
    if told is not None:
        out |= {"differ_rms_mv": MV_PER_V * told.shift_v, "of_noise": told.shift_v / told.noise_v}
    return out


def _errors(found: Discovery, state: State, part: Part) -> dict[str, float]:
    """Errors of a state over all files; none where it cannot be simulated on one of them."""
    files = [f for f in found.files if f.part == part]
    if not files or any(state in f.unsimulated for f in files):
        return {}
    errors = Errors.of(np.concatenate([f.residual_v(state) for f in files]))
    return {
        "rmse_mv": MV_PER_V * errors.rmse_v,
        "mae_mv": MV_PER_V * errors.mae_v,
        "max_mv": MV_PER_V * errors.max_v,
    }


def _candidate_row(candidate: CandidateEffect) -> dict[str, Any]:
    test_v = candidate.test_rmse_v
    return {
        "effect": candidate.effect,
        "kind": candidate.kind,
        "score": candidate.score,
        "test_rmse_mv": None if test_v is None else MV_PER_V * test_v,
        "parameters": {
            name: {"value": p.value, "low": p.low, "high": p.high, "unit": p.unit}
            for name, p in candidate.parameters.items()
        },
        "hypothesis": list(candidate.hypothesis),
        "remark": candidate.remark,
    }


def _own_row(one: OwnParameter) -> dict[str, Any]:
    return {
        "effect": one.owner,
        "parameter": one.name,
        "declared": one.declared,
        "value": one.value,
        "unit": one.unit,
        "deviations": round(one.deviations, 3),
        "one_sd": one.one_sd,
        "at_limit": one.at_limit,
    }


def _file_rows(found: Discovery) -> list[dict[str, Any]]:
    rows = []
    for f in found.files:
        gain, low, high = (MV_PER_V * v if np.isfinite(v) else None for v in f.gain_v)
        errors = {state: f.errors(state) for state in STATES}
        rmse = {f"{s}_mv": None if told is None else MV_PER_V * told.rmse_v for s, told in errors.items()}
        gains = {"gain_mv": gain, "gain_low_mv": low, "gain_high_mv": high}
        rows.append({"name": f.name, "part": f.part, **rmse, **gains, "hold": f.hold})
    return rows


def _dependence(found: Discovery) -> list[dict[str, Any]]:
    before, after = found.before.shares, found.after.shares
    return [{"variable": name, "before": before[name], "after": after.get(name, 0.0)} for name in before]


def _step_resistance(found: Discovery) -> dict[str, list[dict[str, Any]]]:
    """Rows by state of charge and by current: the resistance within seconds of a step, measured and of each state,
    milliohm; none where no record shows it."""
    records = [
        CurrentSteps.of(
            f.time_s, f.current_a, f.soc, {MEASURED: f.measured_v} | {s: f.voltages[s] for s in STATES}
        )
        for f in found.files
    ]
    with_steps = [one for one in records if one is not None]
    if not with_steps:
        return {"by_soc": [], "by_current": []}
    steps = CurrentSteps.together(with_steps)
    return {
        "by_soc": _resistance_rows("soc", steps.by_soc()),
        "by_current": _resistance_rows("current_a", steps.by_current()),
    }


def _resistance_rows(variable: str, found: StepResistance) -> list[dict[str, Any]]:
    return [
        {variable: float(x)}
        | {
            f"{name}_mohm": MILLI * float(ohm[k]) if np.isfinite(ohm[k]) else None
            for name, ohm in found.ohm.items()
        }
        for k, x in enumerate(found.x)
    ]


def _pointers(found: Discovery) -> list[dict[str, Any]]:
    """Rows for each group of variables; none where the data were too few for a correction, before or after."""
    before, after = found.before.yardstick.pointers, found.after.yardstick.pointers
    if not before or not after:
        return []
    none = Pointer(0.0)
    return [
        {
            "says": text,
            "before": before.get(text, none).share,
            "after": after.get(text, none).share,
            "terms": list(before.get(text, none).terms),
            "terms_after": list(after.get(text, none).terms),
        }
        for text in POINTS_TO
    ]


def discovery_view(
    found: Discovery, content: Mapping[str, Any], title: str, mlflow_run_id: str = ""
) -> DiscoveryView:
    """The view that the report is made of."""
    titles = {name: _title(name) for name in (*CATALOGUE, *(c.effect for c in found.candidates))}
    return DiscoveryView(
        title=title,
        cell=found.cell.name,
        discovery=content,
        traces=tuple(
            DiscoveryTrace(
                f.name,
                f.part,
                f.time_s,
                f.current_a,
                f.soc,
                f.measured_v,
                f.voltages["before"],
                f.voltages["recalibrated"],
                f.voltages["after"],
                f.hold,
            )
            for f in found.files
        ),
        effects=tuple(_effect_view(found, name) for name in found.verdict.effects),
        files=tuple(content["files"]),
        dependence=tuple(content["dependence"]),
        points_to=tuple(content["points_to"]),
        experiments=tuple(content["experiments"]),
        titles=titles,
        notes=tuple(content["notes"]),
        versions={name: version(name) for name in ("aesi", "numpy", "scipy")},
        mlflow_run_id=mlflow_run_id,
        seconds=found.seconds,
    )


def _title(effect: str) -> str:
    return " ".join(ABBREVIATIONS.get(word, word) for word in effect.split("_"))


def _effect_view(found: Discovery, name: str) -> EffectView:
    effect = found.effects[name]
    candidate = next(c for c in found.candidates if c.effect == name)
    rows = tuple(
        {
            "name": key,
            "unit": p.unit,
            "value": p.value,
            "low": p.low,
            "high": p.high,
            "bounds": effect.parameters[key].bounds,
            "description": effect.parameters[key].description,
        }
        for key, p in candidate.parameters.items()
    )
    return EffectView(
        id=name,
        title=_title(name),
        kind=effect.kind,
        equation=effect.equation,
        validity=effect.validity,
        source=effect.source,
        parameters=rows,
    )
