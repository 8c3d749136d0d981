"""Frozen records that pass between the rooms: data, simulations, error series, failures.

SI units and seconds; current is positive on discharge; voltage error e = V_measured - V_model, in volts.
"""

from aesi.records.error_series import INPUT_NAMES, ErrorModel, ErrorSeries, FreeRun
from aesi.records.failed import Failed
from aesi.records.measurement import (
    HOLD_WORDS,
    LABORATORY,
    OTHER_HOLD,
    Hold,
    InferredHold,
    Measurement,
    Spectrum,
    assumed_hold,
    at_its_temperature,
    digest,
    hold_sentence,
    measured_on_case,
)
from aesi.records.run import Run
from aesi.records.split import ROLES, HeldOutDrive, LeftOutDrives, Role, Split

__all__ = [
    "HOLD_WORDS",
    "INPUT_NAMES",
    "LABORATORY",
    "OTHER_HOLD",
    "ROLES",
    "ErrorModel",
    "ErrorSeries",
    "Failed",
    "FreeRun",
    "HeldOutDrive",
    "Hold",
    "InferredHold",
    "LeftOutDrives",
    "Measurement",
    "Role",
    "Run",
    "Spectrum",
    "Split",
    "assumed_hold",
    "at_its_temperature",
    "digest",
    "hold_sentence",
    "measured_on_case",
]
