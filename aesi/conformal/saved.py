"""Restore calibrated intervals from their saved state; the kinds that a saved file may contain are listed here."""

from __future__ import annotations

from aesi.conformal.bands.band import Band
from aesi.conformal.bands.marginal import FixedBand, RollingBand
from aesi.conformal.bands.regression import RegressionBand
from aesi.conformal.online.calibrated import SCHEMA, Calibrated
from aesi.conformal.online.method import check_settings
from aesi.conformal.online.scale import Scale
from aesi.conformal.regressors.boosted import BoostedQuantiles
from aesi.conformal.regressors.forest import ForestQuantiles
from aesi.conformal.regressors.linear import LinearQuantiles
from aesi.conformal.regressors.model import QuantileModel
from aesi.conformal.regressors.normalised import NormalisedQuantiles
from aesi.errors import InputError
from aesi.numerics.files.restored import LEAST_POSITIVE, reading_back, saved_array, saved_count, saved_number
from aesi.numerics.typing import SavedState

BANDS: dict[str, type[Band]] = {band.kind: band for band in (FixedBand, RollingBand, RegressionBand)}
REGRESSORS: dict[str, type[QuantileModel]] = {
    model.kind: model for model in (LinearQuantiles, ForestQuantiles, BoostedQuantiles, NormalisedQuantiles)
}


def calibrated_from_dict(state: SavedState) -> Calibrated:
    """Inverse of `Calibrated.to_dict`; arrays may come back as lists.

    Raises InputError for another schema, a kind of band this version does not know, and anything else.
    """
    with reading_back("intervals"):
        if state.get("schema") != SCHEMA:
            raise InputError(f"intervals have schema {state.get('schema')!r}, this version reads {SCHEMA!r}.")
        kind = state["band_kind"]
        if kind not in BANDS:
            raise InputError(f"unknown kind of band {kind!r}; this version knows {', '.join(sorted(BANDS))}.")
        alpha, window = state["alpha"], saved_count(state["window"], "window")
        check_settings(alpha, window)
        low, high = saved_array(state["marginal_v"], "marginal_v", (2,)).tolist()
        if low > high:
            raise ValueError(f"marginal_v falls from {low:g} to {high:g} V")
        return Calibrated(
            method=str(state["method"]),
            alpha=float(alpha),
            window=window,
            band=BANDS[kind].from_state(state["band"], REGRESSORS),
            scale=Scale.from_state(state["scale"]),
            rate=saved_number(state["rate"], "rate", 0.0),
            marginal_v=(low, high),
            floor_v=saved_number(state["floor_v"], "floor_v", LEAST_POSITIVE),
        )
