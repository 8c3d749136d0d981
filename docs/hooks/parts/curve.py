"""What accuracy costs, as a picture: error against time of the lines that `aesi bench dfn` printed, as inline SVG."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 640, 360, 60, 44, 14
COLOURS = {"ours": "#1b6ca8", "PyBaMM DFN IDAKLU": "#c0392b"}
PER_MV = ("rmse_mv", "seconds")


def curve(lines: Sequence[dict[str, Any]]) -> str:
    """An SVG with a curve a load, ours and the peer's; seconds to the right, mV upwards, both logarithmic."""
    points = [line for line in lines if all(line.get(key, 0.0) > 0.0 for key in PER_MV)]
    if not points:
        return "No run has been recorded in this checkout; `aesi bench dfn` makes one."
    x = Axis([line["seconds"] for line in points], LEFT, WIDTH - 10)
    y = Axis([line["rmse_mv"] for line in points], HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" xmlns="http://www.w3.org/2000/svg" font-size="12" '
        'fill="currentColor" aria-label="Error against time of both models over the number of points">'
    ]
    parts += [
        f'<text x="{x(10.0**k):.0f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{10.0**k:g} s</text>'
        for k in x.decades
    ]
    for k in y.decades:
        at = y(10.0**k)
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - 10}" y1="{at:.0f}" y2="{at:.0f}" stroke="#8884"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{at + 4:.0f}" text-anchor="end">{10.0**k:g} mV</text>')
    for who, colour in COLOURS.items():
        for load in dict.fromkeys(line["load"] for line in points):
            mine = [line for line in points if line["who"] == who and line["load"] == load]
            places = [f"{x(line['seconds']):.1f},{y(line['rmse_mv']):.1f}" for line in mine]
            parts.append(
                f'<polyline points="{" ".join(places)}" fill="none" stroke="{colour}" opacity="0.5"/>'
            )
            parts += [
                f'<circle cx="{place.split(",")[0]}" cy="{place.split(",")[1]}" r="3" fill="{colour}"/>'
                for place in places
            ]
    for row, (who, colour) in enumerate(COLOURS.items()):
        at = HEIGHT - BOTTOM - 30 + 16 * row
        parts.append(f'<circle cx="{LEFT + 16}" cy="{at - 4}" r="4" fill="{colour}"/>')
        parts.append(f'<text x="{LEFT + 26}" y="{at}">{"this package" if who == "ours" else who}</text>')
    return "".join([*parts, "</svg>"])


class Axis:
    """Where a value stands on a logarithmic axis from `first` to `last`, and its decades."""

    def __init__(self, values: Sequence[float], first: float, last: float) -> None:
        self.low, self.high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
        self.first, self.last = first, last
        self.decades = range(self.low, self.high + 1)

    def __call__(self, value: float) -> float:
        share = (math.log10(value) - self.low) / max(self.high - self.low, 1)
        return self.first + share * (self.last - self.first)
