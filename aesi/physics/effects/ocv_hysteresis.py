"""One-state hysteresis of the open-circuit voltage.

    V = V_cell + M(z) h,   dh/dt = -k |I| / Q (h + sign I)     -1 <= h <= 1, I > 0 on discharge, Q nominal capacity
    M(z) = magnitude (1 + low_soc_excess (1 - 2 z))            z state of charge

On a long discharge h tends to -1, on a long charge to +1; at rest it is constant.

Leaves out minor loops that close faster than h, and a decay of h with time. Holds where the open-circuit voltage
depends on the direction from which it was reached. A fit may make the magnitude negative, which is not physical, so
that the estimate for a cell without hysteresis is not limited to one side; a significantly negative magnitude has
another cause.

Source: Plett, J. Power Sources 134 (2004) 262, doi:10.1016/j.jpowsour.2004.02.032; Axen et al., J. Energy
Storage 48 (2022) 103985, doi:10.1016/j.est.2022.103985.
"""

from aesi.parameters import Parameter
from aesi.physics.effect import Contribution, Effect, Trace
from aesi.physics.throughput import step_charges_ah

PARAMETERS = {
    "magnitude_v": Parameter(
        0.01,
        "V",
        bounds=(-0.1, 0.1),
        neutral=0.0,
        source="a few mV (graphite, layered oxides) to 100 mV (silicon); no cell has a negative one",
        description="half the gap between the branches at half charge",
    ),
    "rate": Parameter(
        20.0,
        "dimensionless",
        bounds=(1.0, 500.0),
        log=True,
        source="from a whole charge to 0.2 % of the capacity to change branches",
        description="branch changes per nominal capacity of throughput, k",
    ),
    "low_soc_excess": Parameter(
        0.0,
        "dimensionless",
        bounds=(-1.0, 1.0),
        source="the magnitude may vanish at one end but not change sign",
        description="relative excess of the magnitude at low state of charge",
    ),
    "start": Parameter(
        0.0,
        "dimensionless",
        bounds=(-1.0, 1.0),
        source="the range of the state",
        description="state at the first sample: +1 after a charge, -1 after a discharge",
    ),
}


def hysteresis(
    trace: Trace, *, magnitude_v: float, rate: float, low_soc_excess: float, start: float
) -> Contribution:
    """M(z) h (n,) V, and h (n,) as the state `hysteresis`."""
    from aesi.physics.relaxation import relax

    before, after = step_charges_ah(trace)
    state = relax(before, after, rate / trace.model.cell.nominal_capacity_ah, start)
    magnitude = magnitude_v * (1.0 + low_soc_excess * (1.0 - 2.0 * trace.series["soc"]))
    return Contribution(magnitude * state, {"hysteresis": state})


EFFECT = Effect(
    "ocv_hysteresis",
    "physics",
    __doc__,
    PARAMETERS,
    on_voltage=hysteresis,
    of_every_record=True,
    experiment="rests of some hours at the same state of charge, reached by charge and by discharge",
)
