"""Fit a cell's own parameters to records of any temperatures together."""

from aesi.calibration.fit import calibrate
from aesi.calibration.records.conditions import Conditions
from aesi.calibration.result import Calibration, RecordError

__all__ = ["Calibration", "Conditions", "RecordError", "calibrate"]
