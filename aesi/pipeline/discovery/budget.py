"""How many rows a search is run on: as many as the records that it fits leave it, whatever it is judged by.

What is fitted is thinned only where it has more than `MOST_ROWS` together, the longest records first. A test record
chooses nothing, not even this: it is thinned by its own length, and one that begins with a fitted record, or continues
it, as that one is as far as that goes, so that what was fitted is known again in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aesi.data.read import MAX_ROWS
from aesi.data.resample import decimate, in_runs, run_within
from aesi.pipeline.discovery.discover import Case
from aesi.records import Measurement
from aesi.tracer.case.records import joined, led_by

MOST_ROWS = 80_000
"""A hypothesis is simulated hundreds of times: more rows than these take hours, and tell hardly more."""


def within_budget(case: Case) -> Case:
    """The case with at most MOST_ROWS rows of what is fitted together, and of each test record behind what is fitted of
    it; a note of each record says where that told."""
    fitted = (*case.measurements, *case.good)
    most = most_rows_each([min(len(record), MAX_ROWS) for record in fitted], MOST_ROWS)
    return replace(
        case,
        measurements=tuple(_thinned(record, most) for record in case.measurements),
        good=tuple(_thinned(record, most) for record in case.good),
        tests=tuple(_judging(record, case.measurements, most) for record in case.tests),
    )


def most_rows_each(rows: Sequence[int], most: int) -> int:
    """The most rows that each record may have, so that all have at most `most` together: what short ones do not need is
    for the long ones.

    rows : of each.
    """
    left = most
    for done, n in enumerate(sorted(rows)):
        share = left // (len(rows) - done)
        if n > share:
            return share
        left -= n
    return max(rows, default=most)


def _thinned(record: Measurement, most: int) -> Measurement:
    """At most so many rows; first those of a file that is read by itself, so that one and its record are the same."""
    return decimate(decimate(record, MAX_ROWS), most)


def _judging(record: Measurement, fitted: Sequence[Measurement], most: int) -> Measurement:
    """A record that judges; where a fitted one leads to it, with that before it if either is thinned.

    fitted : as they were given.  most : rows that each of them may have.
    """
    led = led_by(record, fitted)
    if led is None:
        return _thinned(record, MOST_ROWS)
    index, whole = led
    lead = _thinned(whole.take(slice(0, len(fitted[index]))), most)
    last = int(np.searchsorted(whole.time_s, lead.time_s[-1]))
    run, behind = last // (len(lead) - 1), whole.take(slice(last, None))
    coarser = run * run_within(1 + (len(behind) - 1) // run, MOST_ROWS)
    if coarser == 1:
        return record
    note = f"{record.name}: goes on from {fitted[index].name}, which is fitted; what comes after that is thinned alone."
    behind = replace(behind, notes=(*behind.notes, note))
    return joined(lead, in_runs(behind, min(coarser, len(behind) - 1)).take(slice(1, None)))
