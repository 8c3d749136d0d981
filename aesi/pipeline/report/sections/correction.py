"""The section on the sparse correction: terms, their coefficients, and the search that found them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from aesi.pipeline.report.plots import ensemble
from aesi.pipeline.report.sections.section import ReportSection
from aesi.pipeline.report.views import RunView
from aesi.sparse.search.genome import GENE_WORDS

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


def _figures(view: RunView) -> dict[str, Figure]:
    figures = {"front": ensemble.front_figure(view.candidates)} if view.candidates else {}
    coefficients = ensemble.coefficient_figure(view.terms)
    return figures if coefficients is None else figures | {"coefficients": coefficients}


def _settings(view: RunView) -> Mapping[str, Any]:
    return {GENE_WORDS.get(name, name): value for name, value in view.settings.items()}


SECTION = ReportSection(
    "model",
    "What the correction consists of",
    shows=("ranking", "coefficients", "front", "bootstrap_coverage"),
    figures=_figures,
    pairs=_settings,
)
