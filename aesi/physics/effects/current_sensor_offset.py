"""The current sensor reads the true current plus a constant.

    I_read = I_true + offset        I > 0 on discharge

Leaves out drift. Holds for a Hall sensor after a change of magnetisation or temperature. The cell responds as to a
leakage_current of the opposite sign; only the ohmic drop of the leads distinguishes the two.

Source: definition; range from zero-current errors of automotive Hall sensors.
"""

from dataclasses import replace

from aesi.parameters import Parameter
from aesi.physics.effect import Effect, Record

PARAMETERS = {
    "offset_a": Parameter(
        -0.05,
        "A",
        bounds=(-10.0, 10.0),
        neutral=0.0,
        source="zero-current error of up to 1 % of a sensor's range, 1000 A at most; 1 % of 5C is expected",
        description="reading minus true current",
        expected=0.05,
        capacity_power=1,
    )
}


def undo_offset(record: Record, *, offset_a: float) -> Record:
    """The record with the true current, from the reading."""
    return replace(record, current_a=record.current_a - offset_a)


EFFECT = Effect("current_sensor_offset", "instrument", __doc__, PARAMETERS, on_record=undo_offset)
