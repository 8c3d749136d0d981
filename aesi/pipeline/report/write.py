"""The two reports: which figures and sentences stand on the page of a run and of a discovery."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aesi.pipeline.report import sections, tables
from aesi.pipeline.report.figures import paper_figures, predicted_models
from aesi.pipeline.report.page import write_page
from aesi.pipeline.report.plots import hypotheses, maps, records, step_response
from aesi.pipeline.report.views import DiscoveryTrace, DiscoveryView, Row, RunView
from aesi.pipeline.report.words import discoveries, runs
from aesi.pipeline.report.words.moved import (
    deviation_words,
    moved_findings,
    moved_value,
    parameter_words,
)

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

TELLING_SHARE = 0.01
"""A share of the residual's variance below this is not worth a bar."""

NOT_COMPARED: dict[str, Any] = {"free_run": None, "one_step": None, "intervals": None}
"""Figures that a row may lack: all of them of a model that the experiment does not name among those that it compares,
intervals of one that none could be calibrated for."""


def write_run_report(path: str | Path, view: RunView) -> Path:
    """Write the report of one run to `path` and return it."""
    figures = paper_figures(view)
    for section in sections.SECTIONS:
        figures.update(section.figures(view))
    chosen, physics = (
        {**NOT_COMPARED, **(view.model(name) or {"name": name})} for name in (view.chosen, view.physics)
    )
    return write_page(
        path,
        "run.html",
        figures,
        title=f"{view.experiment}: hybrid model of {view.cell}",
        view=view,
        chosen=chosen,
        physics=physics,
        corrected_mv=runs.corrected_mv(view),
        headline_digits=runs.headline_digits(view),
        own_share=runs.own_share(view),
        finding=runs.run_finding(view),
        sentences=_said(
            runs.refit_finding(view),
            runs.constant_finding(view),
            runs.others_finding(view),
            runs.persistence_finding(chosen),
            runs.interval_finding(chosen),
            runs.outside_finding(chosen),
            runs.validation_finding(view),
        ),
        tables=tables.all_tables(view.models),
        models=predicted_models(view),
        sections=sections.SECTIONS,
    )


def write_discovery_report(path: str | Path, view: DiscoveryView) -> Path:
    """Write the report of one discovery to `path` and return it."""
    return write_page(
        path,
        "discovery.html",
        discovery_figures(view),
        title=f"{view.title}: what the model of {view.cell} lacks",
        view=view,
        discovery=view.discovery,
        states=discoveries.states_of(view.discovery),
        digits={part: discoveries.error_digits(view.discovery, part) for part in ("fit", "test")},
        written=discoveries.discovery_consequence(view),
        finding=discoveries.discovery_finding(view),
        sentences=_said(
            discoveries.reason_finding(view.discovery, view.titles),
            discoveries.next_finding(view.discovery, view.titles),
            discoveries.look_alike_finding(view.discovery, view.titles),
            *moved_findings(view.discovery),
            discoveries.span_finding(view),
        ),
        rest=discoveries.rest_finding(view.discovery),
        look_alikes=discoveries.look_alike_names(view.discovery, view.titles),
        closest=discoveries.closest_finding(view),
        moved=_moved_rows(view.discovery),
        candidates=[
            row | {"title": discoveries.hypothesis_title(row, view.titles)}
            for row in view.discovery["candidates"]
        ],
    )


def _said(*sentences: str) -> list[str]:
    return [sentence for sentence in sentences if sentence]


def _moved_rows(discovery: Mapping[str, Any]) -> list[Row]:
    """One row per declared parameter: its meaning, its value in the refit and, with a finding, in the fit with that."""
    own = discovery.get("own_parameters", {})
    rows: dict[str, dict[str, str]] = {}
    for state in discoveries.states_of(discovery):
        for row in own.get(state, ()):
            where = f"{moved_value(row)}{', at its limit' if row['at_limit'] else ''}"
            rows.setdefault(parameter_words(row), {})[state] = (
                f"{where} ({row['deviations']:+.1f} x {deviation_words(row)})"
            )
    return [{"name": name, **where} for name, where in rows.items()]


def discovery_figures(view: DiscoveryView) -> dict[str, Figure]:
    """All figures of a discovery, by name."""
    figures: dict[str, Figure] = {}
    states = discoveries.states_of(view.discovery)
    tested = view.of("test") or view.of("fit")
    for part in ("test", "fit"):
        if view.of(part):
            figures[f"residual_{part}"] = records.residual_figure(view.of(part), states)
    if tested:
        figures |= _over_the_range(tested, states)
    figures |= step_response.figures(view.discovery.get("step_resistance", {}), states)
    if view.discovery["candidates"]:
        figures["scores"] = hypotheses.ranking_figure(
            view.discovery["candidates"], view.titles, view.discovery["effects"]
        )
    if view.files:
        figures["files"] = hypotheses.files_figure(view.files, states)
    if any(max(row["before"], row["after"]) > TELLING_SHARE for row in view.dependence):
        figures["dependence"] = hypotheses.dependence_bars(view.dependence, states)
    return figures


def _over_the_range(traces: Sequence[DiscoveryTrace], states: Mapping[str, str]) -> dict[str, Figure]:
    """Residual against current and SOC, and maps over both, at each of the states that can be simulated there."""
    current = np.concatenate([t.current_a for t in traces])
    soc = np.concatenate([t.soc for t in traces])
    errors = {
        state: np.concatenate([t.measured_v - getattr(t, f"{state}_v") for t in traces]) for state in states
    }
    errors = {state: error for state, error in errors.items() if np.isfinite(error).any()}
    if not errors:
        return {}
    limit = maps.shared_limit(current, soc, list(errors.values()), False)
    return {
        "against_current": maps.dependence_figure(current, errors, states, "current, A (discharge > 0)"),
        "against_soc": maps.dependence_figure(100 * soc, errors, states, "SOC, %"),
    } | {
        f"map_{state}": maps.map_figure(current, soc, errors[state], f"Mean error, {words}", False, limit)
        for state, words in states.items()
        if state in errors
    }
