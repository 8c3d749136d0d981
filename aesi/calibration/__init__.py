"""Fit the parameters of a cell's file to records, of one or several temperatures."""

from aesi.calibration.fit import calibrate
from aesi.calibration.records.conditions import Conditions
from aesi.calibration.result import Calibration, RecordError

__all__ = ["Calibration", "Conditions", "RecordError", "calibrate"]
