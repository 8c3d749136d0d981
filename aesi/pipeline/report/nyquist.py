"""Measured spectra and the model's beside them, a figure a temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from aesi.constants import MILLI
from aesi.pipeline.report import style

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from aesi.pipeline.impedance import SpectrumError

SHOWN = 6
"""Most spectra of one temperature in a figure."""


def nyquist(spectra: Sequence[SpectrumError], title: str) -> Figure:
    """Measured points and the model's line, a colour a spectrum; axes of one scale, mOhm."""
    from plotly.colors import sample_colorscale

    shown = spectra[:: max(1, -(-len(spectra) // SHOWN))]
    fitted = sum(spectrum.fitted for spectrum in spectra)
    of_all = f"{fitted} of {len(spectra)} spectra"
    how = f"the model was fitted to {of_all}" if fitted else "nothing was fitted to them"
    caption = f"Points are measured, lines the model's; {how}."
    if len(shown) < len(spectra):
        caption += f" {len(shown)} of {len(spectra)} spectra are drawn."
    figure = style.figure(title, caption, 560)
    colours = sample_colorscale("Viridis", [k / max(len(shown) - 1, 1) for k in range(len(shown))])
    for spectrum, colour in zip(shown, colours, strict=True):
        z, name = spectrum.measured.z_ohm, f"{100 * spectrum.soc:.0f} % charge"
        text = [f"{f:.3g} Hz" for f in spectrum.measured.frequency_hz]
        figure.add_scatter(
            x=MILLI * z.real, y=-MILLI * z.imag, mode="markers", name=f"{name}, measured", text=text,
            marker={"color": colour, "size": 6}, legendgroup=name,
        )  # fmt: skip
        figure.add_scatter(
            x=MILLI * spectrum.z_ohm.real, y=-MILLI * spectrum.z_ohm.imag, mode="lines", name=f"{name}, model",
            line={"color": colour}, legendgroup=name, text=text,
        )  # fmt: skip
    figure.update_layout(margin_t=2 * style.HEADROOM)  # the legend has two lines or three
    figure.update_xaxes(title_text="real part, mOhm", constrain="domain")
    figure.update_yaxes(title_text="negative imaginary part, mOhm", scaleanchor="x", constrain="domain")
    return figure


def nyquist_figures(spectra: Sequence[SpectrumError]) -> dict[str, Figure]:
    """A figure for each temperature, by its name on the page."""
    groups: dict[str, list[SpectrumError]] = {}
    for spectrum in spectra:
        degc = spectrum.measured.temperature_degc
        groups.setdefault(
            "at an unknown temperature" if degc is None else f"at {round(degc):d} degC", []
        ).append(spectrum)
    return {
        f"nyquist_{k}": nyquist(group, f"Nyquist plot {at}") for k, (at, group) in enumerate(groups.items())
    }
