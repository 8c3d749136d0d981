"""The voltmeter reads the true voltage plus a constant.

    V_read = V_true + offset

Leaves out gain and drift. Holds for any voltmeter. Its effect equals a constant shift of an open-circuit potential.

Source: definition; range from accuracy classes of battery test channels, 0.02 to 1 % of 5 V.
"""

from aesi.numerics.typing import Array
from aesi.parameters import Parameter, Spread
from aesi.physics.effect import Effect, Trace

PARAMETERS = {
    "offset_v": Parameter(
        0.005,
        "V",
        bounds=(-0.05, 0.05),
        neutral=0.0,
        source="accuracy classes up to 1 % of 5 V",
        description="reading minus true voltage",
        spread=Spread(3e-4, 1e-3, "0.006 and 0.02 % of 5 V, good cyclers' data sheets"),
    )
}


def add_offset(trace: Trace, *, offset_v: float) -> Array:
    """The reading, (n,) V."""
    return trace.voltage_v + offset_v


EFFECT = Effect(
    "voltage_sensor_offset",
    "instrument",
    __doc__,
    PARAMETERS,
    on_reading=add_offset,
    told_apart={
        "ocp_shape": "a second voltmeter on the terminals at rest",
        "lithium_inventory_loss": (
            "a second voltmeter at rest, or a full C/20 discharge between the voltage limits and the "
            "coulombs that go back in"
        ),
    },
)
