"""Restore calibrated intervals from their saved state, which may contain the bands and regressors of this version."""

from __future__ import annotations

from aesi.conformal.bands.band import Band
from aesi.conformal.online.calibrated import SCHEMA, Calibrated
from aesi.conformal.online.method import check_settings
from aesi.conformal.online.scale import Scale
from aesi.conformal.regressors.model import QuantileModel
from aesi.errors import InputError
from aesi.numerics.files.restored import LEAST_POSITIVE, reading_back, saved_array, saved_count, saved_number
from aesi.numerics.typing import SavedState


def calibrated_from_dict(state: SavedState) -> Calibrated:
    """Inverse of `Calibrated.to_dict`; arrays may come back as lists.

    Raises InputError for another schema, a kind of band this version does not know, and anything else.
    """
    with reading_back("intervals"):
        if state.get("schema") != SCHEMA:
            raise InputError(f"intervals have schema {state.get('schema')!r}, this version reads {SCHEMA!r}.")
        # All of them are known: importing any module of this package imports the registered methods.
        bands = {band.kind: band for band in Band.__subclasses__()}
        regressors = {model.kind: model for model in QuantileModel.__subclasses__()}
        kind = state["band_kind"]
        if kind not in bands:
            raise InputError(f"unknown kind of band {kind!r}; this version knows {', '.join(sorted(bands))}.")
        alpha, window = state["alpha"], saved_count(state["window"], "window")
        check_settings(alpha, window)
        low, high = saved_array(state["marginal_v"], "marginal_v", (2,)).tolist()
        if low > high:
            raise ValueError(f"marginal_v falls from {low:g} to {high:g} V")
        return Calibrated(
            method=str(state["method"]),
            alpha=float(alpha),
            window=window,
            band=bands[kind].from_state(state["band"], regressors),
            scale=Scale.from_state(state["scale"]),
            rate=saved_number(state["rate"], "rate", 0.0),
            marginal_v=(low, high),
            floor_v=saved_number(state["floor_v"], "floor_v", LEAST_POSITIVE),
        )
