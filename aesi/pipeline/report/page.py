"""One HTML file with everything inside: template, style, script, plotly.js and the figures."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aesi.numerics.files.whole import write_whole
from aesi.pipeline.digits import resolving
from aesi.pipeline.report.arrays.embed import ArrayStore, Embedded, embed
from aesi.pipeline.report.table_formats import ABSENT

if TYPE_CHECKING:
    from jinja2 import Environment
    from plotly.graph_objects import Figure

HERE = Path(__file__).parent


def write_page(path: str | Path, template: str, figures: Mapping[str, Figure], **context: Any) -> Path:
    """Render `template` with its figures into one offline file, and return its path."""
    from plotly.offline import get_plotlyjs

    store = ArrayStore()
    embedded = {name: embed(fig, store) for name, fig in figures.items()}
    return write_plain_page(
        path,
        template,
        {"figures": {name: each.data for name, each in embedded.items()}, "arrays": store.arrays},
        figures={name: _describe(fig, embedded[name]) for name, fig in figures.items()},
        plotly_js=get_plotlyjs(),
        report_js=beside("report.js"),
        **context,
    )


def write_plain_page(path: str | Path, template: str, payload: Any, **context: Any) -> Path:
    """Render `template` into one offline file, and return its path.

    The file replaces an older one in one step, so that an interrupted write leaves the old page readable.
    payload : what the page's script reads, as JSON.
    """
    html = (
        _environment()
        .get_template(template)
        .render(payload=_script_safe(payload), style_css=beside("report.css"), **context)
    )
    write_whole(Path(path), html)
    return Path(path)


def beside(name: str) -> str:
    """A file beside this module, as text."""
    return (HERE / name).read_text(encoding="utf-8")


def _environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= FILTERS
    environment.tests["of_models"] = lambda cell, models: cell.rpartition(", ")[0] in models
    return environment


def _describe(fig: Figure, embedded: Embedded) -> dict[str, Any]:
    meta = fig.layout.meta
    return {
        "title": meta["title"],
        "caption": meta["caption"] + _thinning(embedded),
        "height": int(fig.layout.height),
    }


def _thinning(embedded: Embedded) -> str:
    if embedded.drawn >= embedded.samples:
        return ""
    kept = "every sample"
    if embedded.kept < embedded.samples:
        kept = f"an envelope of {embedded.kept:,} of them"
    return (
        f" Drawn as the envelope (lowest and highest sample of each bucket) of up to {embedded.samples:,} "
        f"samples a record; zooming in shows {kept}."
    )


def _script_safe(content: Any) -> str:
    """JSON that cannot close the script element it stands in."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _fixed(value: Any, digits: int = 1, unit: str = "") -> str:
    if not _known(value):
        return ABSENT
    text = f"{value:,.{digits}f}"
    if float(text.replace(",", "")) == 0.0:
        text = text.removeprefix("-")  # a rounded-away minus says nothing
    return text + (f"\u00a0{unit}" if unit else "")


def _significant(value: Any, digits: int = 3) -> str:
    """The number in so many significant digits, without a power of ten up to a million."""
    if not _known(value):
        return ABSENT
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}" if "e+" in text and abs(value) < 1e6 else text


def _resolving(interval: Mapping[str, Any]) -> int:
    """Significant digits of a parameter that show its interval's width to two, at least three and at most six."""
    low, high, value = (interval.get(key) for key in ("low", "high", "value"))
    return 3 if low is None or high is None else resolving(value or 0.0, low, high)


def _known(value: Any) -> bool:
    """Whether a cell holds a number; rows may lack a key, which Jinja hands on as an Undefined."""
    return isinstance(value, int | float) and value == value


def _tied(text: str) -> str:
    """Numbers stay on the line of their unit."""
    return re.sub(r"(\d) (?=(?:mV|%|s|V|A)(?!\w))", "\\1\u00a0", text)


FILTERS = {
    "fixed": _fixed,
    "significant": _significant,
    "resolving": _resolving,
    "tied": _tied,
    "dedented": textwrap.dedent,
}
