"""The figures of the paper, from the view of one run: name -> plotly figure, in the paper's order.

Figures without data in the view (no bootstrap, no intervals, no validation record) are left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aesi.numerics.typing import Array
from aesi.pipeline.report import style
from aesi.pipeline.report.plots import ensemble, maps, records
from aesi.pipeline.report.views import RecordTrace, RunView
from aesi.records import ROLES

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

ZOOM_S = 120.0
"""Length of the zoom on the prediction intervals."""
MOST_VIOLINS = 5
"""Models whose residuals stand side by side; those of more are too narrow to compare."""


def paper_figures(view: RunView) -> dict[str, Figure]:
    """All figures of the paper that the view has data for.

    Keys: bootstrap_coverage, profile_{current,voltage}, error_map_espm_{train,valid,test},
    error_map_{before,after}, voltage_{train,valid,test}, violin, violin_rest, ranking, intervals_<n>,
    intervals_<n>_zoom.
    """
    figures: dict[str, Figure | None] = {}
    if view.bootstrap is not None:
        figures["bootstrap_coverage"] = ensemble.bootstrap_figure(view.bootstrap)
    if view.traces:
        for quantity in ("current", "voltage"):
            figures[f"profile_{quantity}"] = records.profile_figure(view.traces, quantity, view.hold)
    figures |= physics_maps(view)
    figures |= before_and_after_maps(view)
    for role in ROLES:
        if view.of(role):
            figures[f"voltage_{role}"] = records.voltage_figure(view.of(role), view.chosen, view.corrected)
    figures |= violins(view)
    figures["ranking"] = ensemble.importance_figure(view.terms)
    for i, model in enumerate(predicted_models(view), start=1):
        figures[f"intervals_{i}"] = records.interval_figure(view.of("test"), model)
        figures[f"intervals_{i}_zoom"] = records.interval_figure(view.of("test"), model, ZOOM_S)
    return {name: fig for name, fig in figures.items() if fig is not None}


def physics_maps(view: RunView) -> dict[str, Figure | None]:
    """Mean signed error of the physics model over (current, SOC), one map a role, one colour range."""
    parts = {role: _joined(view.of(role)) for role in ROLES if view.of(role)}
    limit = max((maps.shared_limit(x, y, [error], False) for x, y, error in parts.values()), default=0.0)
    return {
        f"error_map_espm_{role}": maps.map_figure(
            current,
            soc,
            error,
            f"Error of the {view.corrected}, {records.ROLE_WORDS[role]} set",
            False,
            limit,
        )
        for role, (current, soc, error) in parts.items()
    }


def before_and_after_maps(view: RunView) -> dict[str, Figure | None]:
    """Mean absolute error on the test records, physics alone and with the chosen model in free run."""
    tested = [t for t in view.of("test") if view.chosen in t.predictions]
    if not tested:
        return {}
    current, soc, before = _joined(tested)
    after = np.concatenate([t.measured_v - t.predictions[view.chosen].free_run_v for t in tested])
    limit = maps.shared_limit(current, soc, [before, after], True)
    return {
        "error_map_before": maps.map_figure(current, soc, before, f"{view.corrected}, test set", True, limit),
        "error_map_after": maps.map_figure(
            current, soc, after, f"{view.chosen} in free run, test set", True, limit
        ),
    }


def violins(view: RunView) -> dict[str, Figure]:
    """Squared residuals in free run on the test records: of the physics and the corrections that err least, the chosen
    model and what it corrects among them whatever they err; and of the rest, where there are more."""
    tested = view.of("test")
    if not tested:
        return {}
    residuals = {view.corrected: _joined(tested)[2]}
    for name in predicted_models(view):
        parts = [t.measured_v - t.predictions[name].free_run_v for t in tested if name in t.predictions]
        residuals[name] = np.concatenate(parts)
    named = (view.chosen, view.corrected, view.physics)
    ranked = sorted(residuals, key=lambda name: (name not in named, _rms_or_last(residuals[name])))
    colours = {name: style.CHOSEN if " + " in name else style.PHYSICS for name in ranked}
    colours |= {name: style.GREY for name in ranked if " + " in name and name != view.chosen}
    shown, rest = ranked[:MOST_VIOLINS], ranked[MOST_VIOLINS:]
    figures = {"violin": maps.violin_figure({name: residuals[name] for name in shown}, colours)}
    if rest:
        figures["violin_rest"] = maps.violin_figure({name: residuals[name] for name in rest}, colours)
    return figures


def _rms_or_last(residual_v: Array) -> float:
    """RMS, infinite of a model that diverged."""
    square = float(np.mean(residual_v**2))
    return square**0.5 if np.isfinite(square) else float("inf")


def predicted_models(view: RunView) -> list[str]:
    """Names of the hybrid models that predicted the test records, the chosen one first."""
    names = dict.fromkeys(name for trace in view.of("test") for name in trace.predictions)
    names.pop(view.corrected, None)
    return sorted(names, key=lambda name: name != view.chosen)


def _joined(traces: tuple[RecordTrace, ...] | list[RecordTrace]) -> tuple[Array, Array, Array]:
    """Current, SOC and error of the physics model over several records."""
    return (
        np.concatenate([t.current_a for t in traces]),
        np.concatenate([t.soc for t in traces]),
        np.concatenate([t.measured_v - t.physics_v for t in traces]),
    )
