"""Prediction intervals of the voltage error: one step ahead by conformal prediction, online."""

from aesi.conformal.calibrated import Calibrated, Stream
from aesi.conformal.intervals import Intervals
from aesi.conformal.method import Method
from aesi.conformal.registry import METHODS

__all__ = ["METHODS", "Calibrated", "Intervals", "Method", "Stream"]
