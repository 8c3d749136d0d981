"""Resistance of a surface film that grows with charge throughput and with time.

    V = V_cell - I R_f,   R_f = a Q + b sqrt(t)     Q = integral |I| dt since the start, I > 0 on discharge

Leaves out the charge that growth consumes (see lithium_inventory_loss), the dependence of growth on temperature and
voltage, and the heat of R_f. Holds for growth that is slow compared with the record, limited by diffusion (b) or
cracking (a).

Source: sqrt(t): Ploehn, Ramadass & White, J. Electrochem. Soc. 151 (2004) A456, doi:10.1149/1.1644601;
throughput: Smith et al., Appl. Energy 2012, NREL/CP-5400-53817.
"""

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.parameters import Parameter
from aesi.physics.effect import Contribution, Effect, Trace
from aesi.physics.throughput import throughput_ah

PARAMETERS = {
    "per_throughput_ohm_ah": Parameter(
        1e-4,
        "ohm/(A*hour)",
        bounds=(0.0, 1e6),
        neutral=0.0,
        source="zero to a doubling of a 1 kohm cell of 1 mAh within its capacity; 1.5 doublings of 10 mohm over 3 Ah",
        description="growth per charge throughput, a",
        expected=0.045,
        capacity_power=-2,
    ),
    "per_root_time_ohm": Parameter(
        0.0,
        "ohm/hour**0.5",
        bounds=(0.0, 1e3),
        neutral=0.0,
        source="zero to a doubling of a 1 kohm cell of 1 mAh within one hour; half a doubling of 10 mohm at 3 Ah",
        description="growth per square root of time, b",
        expected=0.015,
        capacity_power=-1,
    ),
}


def film_drop(trace: Trace, *, per_throughput_ohm_ah: float, per_root_time_ohm: float) -> Contribution:
    """-I R_f (n,) V, and the resistance (n,) ohm as the state `film_ohm`."""
    hours = (trace.time_s - trace.time_s[0]) / SECONDS_PER_HOUR
    resistance = per_throughput_ohm_ah * throughput_ah(trace) + per_root_time_ohm * np.sqrt(hours)
    return Contribution(-trace.current_a * resistance, {"film_ohm": resistance})


EFFECT = Effect(
    "film_growth",
    "physics",
    __doc__,
    PARAMETERS,
    on_voltage=film_drop,
    of_age=True,
    experiment="the same pulse before and after some hundred hours or cycles",
)
