"""The logger's clock runs fast or slow, or its voltage channel lags behind its current channel.

    t_true = t_first + (t_logged - t_first) / (1 + skew),   V_read(t) = V_true(t - lag)

Leaves out jitter of single stamps. Holds for a lag that is short compared with the record; before the first and after
the last sample the current is taken as constant. The current keeps its rows, held or linear between them: under a lag
it moves the same charge, under a skew 1 / (1 + skew) of it, since it flows for another time. The voltage is evaluated
at instants between the rows.

Source: definition; range from quartz oscillators (100 ppm) to two unsynchronised loggers.
"""

from dataclasses import replace

import numpy as np

from aesi.numerics.typing import Array
from aesi.parameters import Parameter, Spread
from aesi.physics.effect import Effect, Record

PARAMETERS = {
    "skew": Parameter(
        0.01,
        "dimensionless",
        bounds=(-0.1, 0.1),
        neutral=0.0,
        expected=0.02,
        source="100 ppm of a quartz to 10 % of a wrong sampling rate",
        description="relative excess of logged over true time",
    ),
    "lag_s": Parameter(
        0.0,
        "s",
        bounds=(-10.0, 10.0),
        neutral=0.0,
        expected=2.0,
        spread=Spread(0.1, 0.2, "channels are read in turn: 0.14 and 0.24 s on six records of two cyclers"),
        source="filters and polling of loggers, up to 10 s",
        description="delay of the voltage channel behind the current channel",
    ),
}


def true_record(record: Record, *, skew: float, lag_s: float) -> Record:
    """The record on the cell's own clock, with the true instants of its voltages."""
    first = record.time_s[0]

    def true_s(logged_s: Array) -> Array:
        return np.asarray(first + (logged_s - first) / (1.0 + skew))

    time = true_s(record.time_s)
    read = None if record.read_s is None else true_s(record.read_s)
    if lag_s != 0.0:
        read = (time if read is None else read) - lag_s
    return replace(record, time_s=time, read_s=read)


EFFECT = Effect("clock_skew", "instrument", __doc__, PARAMETERS, on_record=true_record)
