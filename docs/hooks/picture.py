"""The picture of the README, from a report: `python docs/hooks/picture.py REPORT.html docs/images/before-after.svg`.

Draws the voltage error on the test records before and after, with the RMSE of what is drawn. Everything comes
from the arrays that the report carries, so the picture shows what the run showed.
"""

from __future__ import annotations

import argparse
import base64
import json
import re
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from aesi.numerics.typing import Array
from aesi.pipeline.report import style
from aesi.pipeline.report.arrays.decimate import envelope
from aesi.pipeline.report.plots.timeline import OUTSIDE

WIDTH, HEIGHT = 860, 300
LEFT, RIGHT, TOP, BOTTOM = 64, 16, 56, 44
POINTS = 1600
AXES = {"voltage_test": "y2", "residual_test": "y3"}
"""Figure of a report -> the axis that shows its errors in mV."""


@dataclass(frozen=True)
class Series:
    """One model's error: name, colour, records as (x, y) with y in mV."""

    name: str
    colour: str
    records: tuple[tuple[Array, Array], ...]

    @property
    def rmse_mv(self) -> float:
        """Over all records."""
        return float(np.sqrt(np.mean(np.concatenate([y for _, y in self.records]) ** 2)))


def main(report: str, out: str) -> None:
    """Write the picture."""
    html = Path(report).read_text(encoding="utf-8")
    found = re.search(r'id="payload">(.*?)</script>', html, re.DOTALL)
    if found is None:
        raise SystemExit(f"{report} is not a report of this project.")
    payload = json.loads(found[1])
    name = next(figure for figure in AXES if figure in payload["figures"])
    figure = payload["figures"][name]
    unit = "h" if figure["layout"]["xaxis" + AXES[name][1:]]["title"]["text"].endswith("h") else "s"
    svg = draw(series_of(figure, AXES[name], payload["arrays"]), unit)
    Path(out).write_text(svg, encoding="utf-8")
    print(out)


def series_of(figure: dict[str, Any], axis: str, arrays: dict[str, Any]) -> list[Series]:
    """The lines on the error axis, records of one name together; bands and marks are left out."""
    lines: dict[str, list[dict[str, Any]]] = {}
    for trace in figure["data"]:
        is_line = trace["meta"]["keep"] == "minmax" and trace["name"] != OUTSIDE
        if trace.get("yaxis") == axis and is_line:
            lines.setdefault(trace["name"], []).append(trace)
    return [
        Series(name, traces[0]["line"]["color"], tuple(_samples(trace, arrays) for trace in traces))
        for name, traces in lines.items()
    ]


def _samples(trace: dict[str, Any], arrays: dict[str, Any]) -> tuple[Array, Array]:
    meta = trace["meta"]
    if "x" not in meta:
        return np.array(trace["x"], dtype=float), np.array(trace["y"], dtype=float)
    x, y = (_array(arrays[meta[key]]) for key in ("x", "y"))
    return x, y


def _array(stored: dict[str, str]) -> Array:
    return np.frombuffer(base64.b64decode(stored["data"]), dtype=f"<{stored['dtype']}").astype(float)


def draw(series: list[Series], unit: str) -> str:
    """The picture as SVG."""
    end = max(x[-1] for one in series for x, _ in one.records)
    limit = max(float(np.percentile(np.abs(y), 99.8)) for one in series for _, y in one.records)
    step = nice(limit / 2)
    limit = step * np.ceil(limit / step)
    body = [_axes(end, limit, step, unit)]
    body += [_line(one, end, limit) for one in series]
    body += [_label(one, i) for i, one in enumerate(series)]
    title = "; ".join(f"{one.name}: {one.rmse_mv:.1f} mV" for one in series)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-size="13" '
        f'font-family="system-ui, sans-serif" role="img" aria-label="Voltage error on test data. {escape(title)}">'
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>{"".join(body)}</svg>\n'
    )


def nice(value: float) -> float:
    """The next 1, 2 or 5 times a power of ten below or at `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(m * power for m in (1, 2, 5) if m * power <= value))


def _place(x: Array, y: Array, end: float, limit: float) -> tuple[Array, Array]:
    across = LEFT + (WIDTH - LEFT - RIGHT) * x / end
    middle, half = (TOP + HEIGHT - BOTTOM) / 2, (HEIGHT - BOTTOM - TOP) / 2
    return across, middle - half * np.clip(y / limit, -1, 1)


def _line(one: Series, end: float, limit: float) -> str:
    paths = []
    for x, y in one.records:
        rows = envelope(y, POINTS // len(one.records))
        points = zip(*_place(x[rows], y[rows], end, limit), strict=True)
        paths.append("M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in points))
    return f'<path d="{"".join(paths)}" fill="none" stroke="{one.colour}" stroke-width="1"/>'


def _label(one: Series, position: int) -> str:
    x = LEFT + 0.33 * position * (WIDTH - LEFT)
    return (
        f'<rect x="{x}" y="18" width="18" height="4" fill="{one.colour}"/>'
        f'<text x="{x + 24}" y="25" fill="{style.INK}">{escape(one.name)}: '
        f'<tspan font-weight="600">{one.rmse_mv:.1f} mV</tspan> RMSE</text>'
    )


def _axes(end: float, limit: float, step: float, unit: str) -> str:
    parts = []
    for value in np.arange(-limit, limit + step / 2, step):
        _, (y,) = _place(np.zeros(1), np.array([value]), end, limit)
        parts.append(f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="#e6e9ed"/>')
        parts.append(
            f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end" fill="#57606a">{value:g}</text>'
        )
    for value in np.arange(0, end, nice(end / 3)):
        (x,), _ = _place(np.array([value]), np.zeros(1), end, limit)
        y = HEIGHT - BOTTOM + 18
        parts.append(f'<text x="{x:.1f}" y="{y}" text-anchor="middle" fill="#57606a">{value:g}</text>')
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(
        f'<text transform="translate(18 {middle}) rotate(-90)" text-anchor="middle" fill="#57606a">'
        f"voltage error, mV</text>"
    )
    parts.append(
        f'<text x="{(LEFT + WIDTH) / 2}" y="{HEIGHT - 8}" text-anchor="middle" fill="#57606a">'
        f"time on test data, {unit}</text>"
    )
    return "".join(parts)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Draw the errors of a report.")
    parser.add_argument("report")
    parser.add_argument("out")
    main(**vars(parser.parse_args()))
