"""The logger's clock runs fast or slow, or its voltage channel lags behind its current channel.

    t_true = t_first + (t_logged - t_first) / (1 + skew),   V_read(t) = V_true(t - lag)

Leaves out jitter of single stamps. Holds for a lag that is short against the record; before the first sample
the current is taken as constant.

Source: definition; range from quartz oscillators (100 ppm) to two unsynchronised loggers.
"""

from dataclasses import replace

import numpy as np

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
    """The record on the cell's own clock, the current as much later as the voltage is read: the same reading."""
    first = record.time_s[0]
    time = first + (record.time_s - first) / (1.0 + skew)
    if lag_s == 0.0:
        return replace(record, time_s=time)
    return replace(record, time_s=time, current_a=np.interp(time - lag_s, time, record.current_a))


EFFECT = Effect("clock_skew", "instrument", __doc__, PARAMETERS, on_record=true_record)
