"""The loop closed on measured data: calibration, competing hypotheses, selection, verdict."""

from aesi.tracer.calibrate import Calibration, calibrate
from aesi.tracer.discovery import Discovery, discover

__all__ = ["Calibration", "Discovery", "calibrate", "discover"]
