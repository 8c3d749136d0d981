"""Self-discharge or a parasitic side current within the cell.

    I_reaction = I + I_leak        I_leak > 0 discharges the cell

Leaves out its dependence on voltage and temperature, and its heat (I_leak V, in self_heating). I_leak is included in
the ohmic drop of the leads, although it does not flow through them: an error of I_leak R. Holds over a record, where it
is nearly constant.

Source: Roth & Doughty, J. Power Sources 128 (2004) 308, doi:10.1016/j.jpowsour.2003.09.068, for
self-discharge rates.
"""

from dataclasses import replace

from aesi.parameters import Parameter
from aesi.physics.effect import Effect, Record

PARAMETERS = {
    "leakage_a": Parameter(
        0.05,
        "A",
        bounds=(0.0, 10.0),
        neutral=0.0,
        source="up to a short of 10 A, 20 h to empty are expected; negative would be a source within the cell",
        description="side current, discharging where positive",
        expected=0.05,
        capacity_power=1,
    )
}


def leak(record: Record, *, leakage_a: float) -> Record:
    """The record with the current of the electrodes, I + I_leak."""
    return replace(record, current_a=record.current_a + leakage_a)


EFFECT = Effect(
    "leakage_current",
    "physics",
    __doc__,
    PARAMETERS,
    on_record=leak,
    experiment="a rest of some days at open circuit",
    told_apart={
        "current_sensor_offset": (
            "a rest of some days: a leak lowers the voltage of the open cell, an offset of the sensor "
            "does not; or a second current sensor in series"
        ),
    },
)
