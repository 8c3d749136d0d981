"""Sources of measurements: files, public data sets, drive schedules, a virtual laboratory, labelled blind cases.

Names are imported where they are first used: PyBaMM, pandas and pyarrow are heavy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aesi.data.read import read_measurement
    from aesi.data.resample import decimate, to_even
    from aesi.data.spectra import read_spectra
    from aesi.data.virtual import Laboratory, paper_experiment

_HOME = {
    "Laboratory": "aesi.data.virtual",
    "paper_experiment": "aesi.data.virtual",
    "read_measurement": "aesi.data.read",
    "read_spectra": "aesi.data.spectra",
    "decimate": "aesi.data.resample",
    "to_even": "aesi.data.resample",
}

__all__ = ["Laboratory", "decimate", "paper_experiment", "read_measurement", "read_spectra", "to_even"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'aesi.data' has no attribute {name!r}")
