"""The current sensor reads a multiple of the true current.

    I_read = g I_true

Leaves out nonlinearity and drift of the gain. Holds for a shunt or Hall sensor within its range.

Source: definition; range from accuracy classes of automotive current sensors, 0.5 to 5 %.
"""

from dataclasses import replace

from aesi.parameters import Parameter
from aesi.physics.effect import Effect, Record

PARAMETERS = {
    "gain": Parameter(
        1.02,
        "dimensionless",
        bounds=(0.8, 1.25),
        log=True,
        neutral=1.0,
        source="accuracy classes up to 5 %, and gross errors of scale",
        expected=0.05,
        description="reading over true current, g",
    )
}


def undo_gain(record: Record, *, gain: float) -> Record:
    """The record with the true current, from the reading."""
    return replace(record, current_a=record.current_a / gain)


EFFECT = Effect(
    "current_sensor_gain",
    "instrument",
    __doc__,
    PARAMETERS,
    on_record=undo_gain,
    told_apart={
        "active_material_loss_negative": (
            "a second current sensor in series, or a full C/20 discharge between the voltage limits and "
            "the coulombs that go back in: a gain scales all charges, a loss moves the steps of dV/dQ"
        ),
        "active_material_loss_positive": (
            "a second current sensor in series, or a full C/20 discharge between the voltage limits and "
            "the coulombs that go back in: a gain scales all charges, a loss moves the steps of dV/dQ"
        ),
    },
)
