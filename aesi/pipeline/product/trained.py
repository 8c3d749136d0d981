"""Distance of a record from the training data of a correction, and the share of the correction that is applied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from aesi.conformal import FreeRunBands
from aesi.numerics.typing import Array, BoolArray
from aesi.numerics.visited import Visited
from aesi.records import ErrorModel, ErrorSeries
from aesi.sparse import SparseModel

ALL_PCT, NONE_PCT = 99.5, 0.5
"""A share, per cent, is reported as 100 from the first on, and as 0 up to the second."""
NOWHERE = "the correction improved no left-out training drive, so that it is applied nowhere"
TELLING_K = 2.0
"""K by which the mean temperature has to be off to be told: by itself that leaves 94 % of a fading correction at 25
degC, and 88 % at -20 degC."""


def trained_on(model: ErrorModel | None, bands: FreeRunBands | None) -> Visited | None:
    """The charges and temperatures that a correction was trained on; None where there is no correction, or it does
    not know."""
    if not isinstance(model, SparseModel):
        return None
    if model.fade is not None:
        return model.fade.region.visited
    return None if bands is None else bands.seen


def outside_trained(inputs: BoolArray, series: ErrorSeries, visited: Visited | None) -> BoolArray:
    """(n,) True where an input lies outside the range that a correction was trained on, or the temperature does.

    inputs : (n,) True where any of its inputs does.
    """
    return inputs if visited is None else inputs | ~visited.knows(series.degc_or_nan)


def trained_figures(
    outside: BoolArray,
    temperature_degc: Array | None,
    model: ErrorModel,
    visited: Visited | None,
    kept: Array,
) -> dict[str, float | None]:
    """Distance of a record from the training data of a correction.

    outside, kept : (n,), of `outside_trained` and of `SparseModel.kept`.
    Returns outside_pct; kept_pct of the correction in the mean, and its amplitude (fade.py), both None of one that does
    not fade; mean_degc; beyond_k, how far that lies above the trained temperatures, negative below them. None also
    stands for what is not known.
    """
    fade = model.fade if isinstance(model, SparseModel) else None
    mean = None if temperature_degc is None else float(np.mean(temperature_degc))
    beyond = None if mean is None or visited is None else float(visited.beyond_k(np.array([mean]))[0])
    return {
        "outside_pct": 100.0 * float(np.mean(outside)),
        "kept_pct": None if fade is None else 100.0 * float(np.mean(kept)),
        "amplitude": None if fade is None else fade.amplitude,
        "mean_degc": mean,
        "beyond_k": beyond,
    }


def trained_sentence(
    name: str, figures: Mapping[str, Any], *, one_step: bool = False, first_measured: bool = True
) -> str:
    """A sentence from the figures on a record of that name, predicted in free run or one step ahead.

    first_measured : whether the first voltage is measured, whose error a free run starts with.
    """
    share, kept = figures["outside_pct"], figures["kept_pct"]
    head = f"{name}: {percent_words(share)} of the rows lie outside the range the correction was trained on"
    where, beyond = "", figures["beyond_k"] or 0.0
    if abs(beyond) >= TELLING_K or (beyond and share >= ALL_PCT):  # a small one puts all rows outside, too
        side = "below" if beyond < 0 else "above"
        where = f"at {figures['mean_degc']:.1f} degC, {_kelvin_words(abs(beyond))} {side} what it was trained at, "
    if kept is None:
        return f"{head}; {where}inputs beyond it are held at its edge." if share else f"{head}."
    if kept >= ALL_PCT:
        return f"{head}; {where}all of the correction is applied." if where else f"{head}."
    if kept >= NONE_PCT:
        share_kept = percent_words(kept)
        return f"{head}; {where}the correction fades towards the physics, to {share_kept} of its size on average."
    alone = "the physics model"
    if one_step:
        alone += " and its last measured error"
    elif first_measured:
        alone += " and the error of the first measured voltage, which decays"
    if is_applied_nowhere(figures):
        return f"{head}; {NOWHERE}: this is {alone}."
    return f"{head}; {where}none of the correction is applied: this is {alone}."


def is_applied_nowhere(figures: Mapping[str, Any]) -> bool:
    """Whether the correction of these figures is applied to no record, wherever that lies."""
    return figures.get("amplitude") == 0.0


def percent_words(percent: float) -> str:
    """A share in per cent, as text: all of it from `ALL_PCT` on."""
    return f"{percent:.2g} %" if percent < ALL_PCT else "100 %"


def _kelvin_words(size: float) -> str:
    return f"{size:.0f} K" if size >= 10.0 else f"{size:.2g} K"
