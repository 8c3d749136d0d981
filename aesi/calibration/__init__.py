"""Fit a cell's own parameters to records of any temperatures together."""

from aesi.calibration.fit import Calibration, RecordError, calibrate

__all__ = ["Calibration", "RecordError", "calibrate"]
