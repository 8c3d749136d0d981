"""A section of a run's report: a title, pairs of name and value, sentences, and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from aesi.pipeline.report.views import RunView

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


def _no_figures(view: RunView) -> Mapping[str, Figure]:
    return {}


def _no_sentences(view: RunView) -> Sequence[str]:
    return ()


def _no_pairs(view: RunView) -> Mapping[str, Any]:
    return {}


@dataclass(frozen=True)
class ReportSection:
    """The content under one heading.

    id : anchor of the page.  shows : names of figures in order, of its own or of the paper's; those a run has not are
    left out.  figures : further figures by name.  sentences, pairs : text above the figures.
    """

    id: str
    title: str
    shows: tuple[str, ...] = ()
    figures: Callable[[RunView], Mapping[str, Figure]] = _no_figures
    sentences: Callable[[RunView], Sequence[str]] = _no_sentences
    pairs: Callable[[RunView], Mapping[str, Any]] = _no_pairs
