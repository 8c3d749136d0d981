"""The picture of a finding, from the folder that `aesi discover` wrote, whatever it found:

    python docs/hooks/finding.py FOLDER docs/images/finding.svg [--thermocouple RECORD [--until-s S]] [--reference TEXT]

The measured voltage, its residual as declared, recalibrated and with what was found, the name and size of that, and
what was measured beside it: RECORD, one whose temperature the loop was not given, or TEXT in your own words. Errors
are of the part that was held out, shaded here. All curves are those that the folder's report carries.
"""

from __future__ import annotations

import argparse
import json
import re
from dataclasses import dataclass
from html import escape
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from picture import POINTS, Series, nice, series_of

from aesi.data import read_measurement
from aesi.data.catalogue import locate
from aesi.numerics.typing import Array
from aesi.pipeline.report import style
from aesi.pipeline.report.arrays.decimate import envelope
from aesi.pipeline.report.words.sizes import finding_line

WIDTH, HEIGHT = 860, 490
LEFT, RIGHT = 64, 16
VOLTAGE, RESIDUAL = (116, 246), (282, 444)
"""Top and bottom of the two panels."""
PARTS = ("residual_fit", "residual_test")
AXES = {"voltage": "y", "residual": "y3"}
GREY = "#57606a"
AXIS_LINE = 13
"""From one line beside an axis to the next."""
LETTERS = 105
"""Of a line of the finding."""


@dataclass(frozen=True)
class Panel:
    """Where a panel stands, and what its axis spans."""

    top: float
    bottom: float
    low: float
    high: float
    end: float

    def place(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Points of the picture for (time, value), values beyond the axis at its end."""
        across = LEFT + (WIDTH - LEFT - RIGHT) * x / self.end
        share = (np.clip(y, self.low, self.high) - self.low) / (self.high - self.low)
        return across, self.bottom - (self.bottom - self.top) * share


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description="Draw a finding.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument(
        "--thermocouple", help="file of the record with its temperature, or SET/NAME of a data set"
    )
    parser.add_argument("--until-s", type=float, help="seconds of that record that the loop was given")
    parser.add_argument("--reference", default="", help="what was measured beside it, in words")
    asked = parser.parse_args()
    reference = asked.reference
    if asked.thermocouple:
        reference = thermocouple_line(asked.thermocouple, asked.until_s)
    asked.out.write_text(draw(asked.folder, reference), encoding="utf-8")
    print(asked.out)


def thermocouple_line(record: str, until_s: float | None) -> str:
    """A line on the mean temperature that the thermocouple of a record measured, up to `until_s` (s)."""
    place, _, name = record.partition("/")
    path = Path(record) if Path(record).exists() else locate(place, name)
    measured = read_measurement(path, stop_s=until_s).temperature_degc
    if measured is None:
        raise SystemExit(f"{record} has no temperature.")
    return f"thermocouple on the case, not given to the loop: {np.mean(measured):.1f} degC in the mean"


def draw(folder: Path, reference: str) -> str:
    """The picture as SVG.  reference : line on what was measured beside the records, below the finding."""
    content = json.loads((folder / "discovery.json").read_text(encoding="utf-8"))
    payload = _payload(folder / "report.html")
    parts = [part for part in PARTS if part in payload["figures"]]
    voltage, residual = ({p: _series(payload, p, axis) for p in parts} for axis in AXES.values())
    starts, end = _starts(residual)
    unit = _unit(payload, parts[-1])
    tested = parts[-1]
    body = [_shade(starts[tested], end) if len(parts) > 1 else ""]
    body += _panel(voltage, starts, end, VOLTAGE, "voltage, V", symmetric=False)
    body += _panel(residual, starts, end, RESIDUAL, "residual, mV", symmetric=True)
    body += [_label(one, k) for k, one in enumerate(residual[tested])]
    body.append(_text(WIDTH - RIGHT, VOLTAGE[0] - 8, "black: measured", colour=GREY, anchor="end"))
    if len(parts) > 1:
        body.append(
            _text(WIDTH - RIGHT, RESIDUAL[0] - 8, "RMSE: of the shaded part", colour=GREY, anchor="end")
        )
    lines = wrap(finding_line(content), LETTERS)
    body += [_text(LEFT, 20 + 19 * k, line, weight=600) for k, line in enumerate(lines)]
    body.append(_text(LEFT, 20 + 19 * len(lines), reference))
    body.append(_time_axis(end, unit))
    title = f"{finding_line(content)}. {reference}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-size="13" '
        f'font-family="system-ui, sans-serif" role="img" aria-label="{escape(title)}">'
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>{"".join(body)}</svg>\n'
    )


def _payload(report: Path) -> dict[str, Any]:
    found = re.search(r'id="payload">(.*?)</script>', report.read_text(encoding="utf-8"), re.DOTALL)
    if found is None or not any(part in found[1] for part in PARTS):
        raise SystemExit(f"{report} is not the report of a discovery.")
    return dict(json.loads(found[1]))


def _series(payload: dict[str, Any], part: str, axis: str) -> list[Series]:
    return series_of(payload["figures"][part], axis, payload["arrays"])


def _unit(payload: dict[str, Any], part: str) -> str:
    return "h" if payload["figures"][part]["layout"]["xaxis3"]["title"]["text"].endswith("h") else "s"


def _starts(parts: dict[str, list[Series]]) -> tuple[dict[str, float], float]:
    """When each part begins, one after the other, and the end."""
    starts, at = {}, 0.0
    for part, series in parts.items():
        first = min(float(x[0]) for one in series for x, _ in one.records)
        starts[part] = at - first
        at += max(float(x[-1]) for one in series for x, _ in one.records) - first
    return starts, at


def _shade(start: float, end: float) -> str:
    x = LEFT + (WIDTH - LEFT - RIGHT) * start / end
    right, top, bottom = WIDTH - RIGHT, VOLTAGE[0], RESIDUAL[1]
    return (
        f'<rect x="{x:.1f}" y="{top}" width="{right - x:.1f}" height="{bottom - top}" fill="#f3f5f8"/>'
        + _text(x + 6, top + 16, "held out", colour=GREY)
    )


def _panel(
    parts: dict[str, list[Series]],
    starts: dict[str, float],
    end: float,
    place: tuple[float, float],
    title: str,
    symmetric: bool,
) -> list[str]:
    every = np.concatenate([y for series in parts.values() for one in series for _, y in one.records])
    low, high = (float(v) for v in np.nanpercentile(every, [0.1, 99.9]))
    if symmetric:
        high = max(abs(low), abs(high))
        low = -high
    step = nice((high - low) / 3)
    panel = Panel(*place, step * np.floor(low / step), step * np.ceil(high / step), end)
    out = [_level(panel, v) for v in np.arange(panel.low, panel.high + step / 2, step)]
    words = [title]
    if np.nanmin(every) < panel.low:
        words.append(f"(axis from {panel.low:g})")
    elif np.nanmax(every) > panel.high:
        words.append(f"(axis to {panel.high:g})")
    # A line each: one after the other they are longer than a panel is high, and run into those of the other.
    out += [_upright(line, AXIS_LINE * (k + 1), panel) for k, line in enumerate(words)]
    for part, series in parts.items():
        out += [_line(one, panel, starts[part]) for one in series]
    return out


def _upright(words: str, x: float, panel: Panel) -> str:
    middle = (panel.top + panel.bottom) / 2
    turned = f'transform="translate({x:g} {middle}) rotate(-90)"'
    return f'<text {turned} text-anchor="middle" fill="{GREY}">{words}</text>'


def _level(panel: Panel, value: float) -> str:
    _, (y,) = panel.place(np.zeros(1), np.array([value]))
    line = f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="#e1e4e8"/>'
    return line + _text(LEFT - 8, y + 4, f"{value:g}", colour=GREY, anchor="end")


def _line(one: Series, panel: Panel, start: float) -> str:
    paths = []
    for x, y in one.records:
        rows = envelope(y, POINTS // len(one.records))
        points = zip(*panel.place(x[rows] + start, y[rows]), strict=True)
        paths.append("M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in points))
    return f'<path d="{"".join(paths)}" fill="none" stroke="{one.colour}" stroke-width="1"/>'


def _label(one: Series, position: int) -> str:
    x = LEFT + 0.29 * position * (WIDTH - LEFT)
    words = _text(x + 24, 93, f"{one.name}: {one.rmse_mv:.1f} mV RMSE")
    return f'<rect x="{x}" y="86" width="18" height="4" fill="{one.colour}"/>{words}'


def _time_axis(end: float, unit: str) -> str:
    out = []
    for value in np.arange(0, end, nice(end / 4)):
        x = LEFT + (WIDTH - LEFT - RIGHT) * value / end
        out.append(_text(x, RESIDUAL[1] + 18, f"{value:g}", colour=GREY, anchor="middle"))
    return "".join(out) + _text((LEFT + WIDTH) / 2, HEIGHT - 8, f"time, {unit}", colour=GREY, anchor="middle")


def _text(
    x: float,
    y: float,
    text: str,
    *,
    weight: int = 400,
    colour: str = style.INK,
    anchor: str = "start",
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-weight="{weight}" fill="{colour}" '
        f'text-anchor="{anchor}">{escape(text)}</text>'
    )


if __name__ == "__main__":
    main()
