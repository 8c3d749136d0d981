"""Prediction intervals of the voltage error: one step ahead, online; and free run, by horizon."""

from aesi.conformal.free_run import FreeRunBands
from aesi.conformal.horizon_band import WHOLE_DRIVE, TooFewPieces
from aesi.conformal.intervals import Intervals
from aesi.conformal.online.calibrated import Calibrated, Stream
from aesi.conformal.online.method import Method
from aesi.conformal.refitted import RefittedForest, RefittedIntervals
from aesi.conformal.registry import COMPARED, DEFAULT_METHOD, METHODS
from aesi.conformal.saved import calibrated_from_dict

__all__ = [
    "COMPARED",
    "DEFAULT_METHOD",
    "METHODS",
    "WHOLE_DRIVE",
    "Calibrated",
    "FreeRunBands",
    "Intervals",
    "Method",
    "RefittedForest",
    "RefittedIntervals",
    "Stream",
    "TooFewPieces",
    "calibrated_from_dict",
]
