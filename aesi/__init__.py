"""Hybrid lithium-ion cell models that know what they lack.

| symbol | meaning | unit |
|---|---|---|
| I | cell current, positive on discharge | A |
| e | voltage error, V_measured - V_model | V |
| c_sp, c_sn | lithium concentration at the particle surface, positive and negative electrode | mol/m3 |
| c_e0, c_eL | electrolyte concentration at the negative and the positive current collector | mol/m3 |
| eta | kinetic overpotential | V |
| U | open-circuit potential | V |
| Theta, xi | library of candidate terms, sparse coefficients | - |
| lambda1, lambda2, tau | ridge weight, threshold, inclusion threshold | - |

Names are imported where they are first used, so that `import aesi` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aesi.data import read_measurement
    from aesi.physics import Cell, impedance, simulate
    from aesi.pipeline.api import calibrate, discover
    from aesi.pipeline.cross_check import cross_check
    from aesi.pipeline.product.hybrid import HybridModel
    from aesi.records import Measurement

__version__ = "0.1.0"

_HOME = {
    "Cell": "aesi.physics",
    "simulate": "aesi.physics",
    "impedance": "aesi.physics",
    "read_measurement": "aesi.data",
    "Measurement": "aesi.records",
    "HybridModel": "aesi.pipeline.product.hybrid",
    "calibrate": "aesi.pipeline.api",
    "discover": "aesi.pipeline.api",
    "cross_check": "aesi.pipeline.cross_check",
}

__all__ = [
    "Cell",
    "HybridModel",
    "Measurement",
    "calibrate",
    "cross_check",
    "discover",
    "impedance",
    "read_measurement",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'aesi' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
