"""A page of measured spectra and the model's beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from aesi.constants import MILLI
from aesi.numerics.files.whole import write_whole

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from aesi.pipeline.impedance import SpectrumError

SHOWN = 6
"""Spectra of one temperature that a figure can hold."""


def nyquist(spectra: Sequence[SpectrumError]) -> Figure:
    """Measured points and the model's line, a colour a spectrum; axes of one scale, mOhm."""
    from plotly.colors import sample_colorscale
    from plotly.graph_objects import Figure

    figure = Figure()
    shown = spectra[:: max(1, -(-len(spectra) // SHOWN))]
    colours = sample_colorscale("Viridis", [k / max(len(shown) - 1, 1) for k in range(len(shown))])
    for spectrum, colour in zip(shown, colours, strict=True):
        z, name = spectrum.measured.z_ohm, f"{100 * spectrum.soc:.0f} % state of charge"
        text = [f"{f:.3g} Hz" for f in spectrum.measured.frequency_hz]
        figure.add_scatter(
            x=MILLI * z.real, y=-MILLI * z.imag, mode="markers", name=f"{name}, measured", text=text,
            marker={"color": colour, "size": 6}, legendgroup=name,
        )  # fmt: skip
        figure.add_scatter(
            x=MILLI * spectrum.z_ohm.real, y=-MILLI * spectrum.z_ohm.imag, mode="lines", name=f"{name}, model",
            line={"color": colour}, legendgroup=name, text=text,
        )  # fmt: skip
    figure.update_xaxes(title="real part, mOhm", constrain="domain")
    figure.update_yaxes(title="negative imaginary part, mOhm", scaleanchor="x", constrain="domain")
    figure.update_layout(margin={"t": 40}, height=560)
    return figure


def write_nyquist(path: Path, cell: str, spectra: Sequence[SpectrumError]) -> Path:
    """One offline page, a figure a temperature."""
    from html import escape

    from plotly.offline import get_plotlyjs

    groups: dict[str, list[SpectrumError]] = {}
    for spectrum in spectra:
        degc = spectrum.measured.temperature_degc
        groups.setdefault("unknown" if degc is None else f"{round(degc):d}", []).append(spectrum)
    parts = [f"<h1>Impedance of {escape(cell)}</h1>"]
    for label, group in groups.items():
        parts.append(f"<h2>{label} degC: points measured, lines the model</h2>")
        figure = nyquist(group)
        parts.append(figure.to_html(full_html=False, include_plotlyjs=False, config={"responsive": True}))
    page = "\n".join(parts)
    write_whole(
        path,
        f"<!doctype html><html><head><meta charset='utf-8'><title>{escape(cell)}</title>"
        f"<script>{get_plotlyjs()}</script></head><body>{page}</body></html>\n",
    )
    return path
