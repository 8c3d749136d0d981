"""The number of rows for a search. It depends on the fitted records alone, not on test records.

Fitted records are thinned where they have more than `MOST_ROWS` together, the longest first. A test record chooses
nothing, not even this: it is thinned by its own length. One that begins with a fitted record, or continues it, is
thinned like that one as far as it goes, so that the fitted rows are recognised in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aesi.data.read import MAX_ROWS
from aesi.data.resample import decimate, in_runs, run_within
from aesi.pipeline.discovery.discover import Case
from aesi.records import Measurement
from aesi.tracer.case.records import joined, leading_record

MOST_ROWS = 80_000
"""Most rows of the fitted records together: a hypothesis is simulated hundreds of times, and more rows take hours
and tell hardly more."""


def within_budget(case: Case) -> Case:
    """The case with at most MOST_ROWS rows of the fitted records together, and as many of each test record behind
    its fitted part. A note of each thinned record says so."""
    fitted = (*case.measurements, *case.good)
    most = most_rows_each([min(len(record), MAX_ROWS) for record in fitted], MOST_ROWS)
    return replace(
        case,
        measurements=tuple(_thinned(record, most) for record in case.measurements),
        good=tuple(_thinned(record, most) for record in case.good),
        tests=tuple(_thinned_test(record, case.measurements, most) for record in case.tests),
    )


def most_rows_each(rows: Sequence[int], most: int) -> int:
    """The most rows that each record may have, so that all have at most `most` together. What short records do not need
    is left to the long ones.

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


def _thinned_test(record: Measurement, fitted: Sequence[Measurement], most: int) -> Measurement:
    """A test record, thinned by its own length. Where it begins with a fitted record, or continues one, and either is
    thinned, it begins with the thinned rows of that record.

    fitted : as they were given.  most : rows that each of them may have.
    """
    led = leading_record(record, fitted)
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
