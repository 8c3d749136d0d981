"""What share of its active material a cell has left in each record, before anything is fitted.

    ln share_i = W(t_i) + s_i e_i,     W(t_0) = 0,   W(t) - W(t') ~ N(0, WALK_SD^2 |t - t'|)                    (1)

W is one course of the cell, a random walk over the days t: records of one day are in one state, those of months apart
differ by what such cells lose in months. Between two records its expectation runs straight, before the first and after
the last it stays. s_i is what a record may differ by from the course; of a record without a date, which has nothing but
this, from the file. The file is in the state of day t_0: the last on which a dated record has a load, as the cell was
last seen, or another that is given.

Leaves out that cells age by use more than by days, that they only lose, and that their resistance grows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np

from aesi.calibration.records.prepared import Prepared
from aesi.errors import DataError
from aesi.numerics.typing import Array

SLOW_SD, LOADED_SD = 0.03, 0.002
"""Of the logarithm of the capacity of a record's cell over the file's. Slow records are there for the potentials, and a
cell ages between its tests: a convention, of the size of what is found, 3 % of the LG 18650HG2 within a week. Records
with a load are what a file is simulated for, in the one state that it has. Theirs is what a charge is measured to, by
the zero of a cycler that whole cycles tell to 0.2 %: more is believed where a record says it loudly. With 3 % for all,
a calibrated LG 18650HG2 as it is misses its fitted 1C discharge and drive by 119 and 4.9 mV, and the 1C discharge of
two days later, fitted to nothing, by 10.3; with these by 17.6, 8.7 and 14.1. A record with a date has the second
whatever its rate: its day says the rest."""
MOST_AGE = 0.3
"""Of the same without dates: no record is further from the file. A convention that nothing ends on. Descents scale
their steps by bounds: with and without it they end elsewhere along what data at one temperature leave open."""
WALK_SD = 0.0075
"""Of (1), a day's: 4 % in a month, 7 % in three. The eight steps between the fitted records of an LG 18650HG2 and a
Panasonic NCR18650PF, 1 to 42 days apart, are of 0 to 1.5 % times the root of their days, 0.8 % root mean square (fitted
with 0.5 %)."""


@dataclass(frozen=True, eq=False)
class Ageing:
    """Prior of the records' shares: ln shares = root @ z, z standard normal deviates.

    root : (records, records) lower triangular.  day : of the file's state; None where no record has a date.
    """

    root: Array
    day: date | None

    @classmethod
    def of(cls, records: Sequence[Prepared], dates: Mapping[str, date], as_of: date | None = None) -> Ageing:
        """dates : by record name.  as_of : day of the file's state; None takes the last with a load.

        Raises DataError for a date of a record that is not there, and for a day without any date.
        """
        check_dates([r.name for r in records], dates)
        if as_of is not None and not dates:
            raise DataError(f"--as-of {as_of}: no record has a date; give theirs, --date FILE=YYYY-MM-DD.")
        days = tuple(dates.get(r.name) for r in records)
        told = [d for d in days if d is not None]
        loaded = [d for r, d in zip(records, days, strict=True) if d is not None and not r.slow]
        day = as_of or max(loaded or told, default=None)
        own = [SLOW_SD if r.slow and d is None else LOADED_SD for r, d in zip(records, days, strict=True)]
        covariance = np.diag(np.square(own))
        if day is not None:
            since = np.array([0.0 if d is None else (d - day).days for d in days])
            apart = np.abs(since[:, None] - since[None, :])
            size = np.abs(since)
            # A walk from nought: what two days share is the way that both have come.
            covariance += WALK_SD**2 * 0.5 * (size[:, None] + size[None, :] - apart)
        return cls(np.linalg.cholesky(covariance), day)

    @property
    def dated(self) -> bool:
        """Are there records of a course?"""
        return self.day is not None

    @property
    def most(self) -> Array:
        """(records,) bounds of the working coordinates."""
        own = np.diag(self.root)
        return np.full(len(own), np.inf) if self.dated else MOST_AGE / own

    def share(self, index: int, z: Array) -> float:
        """Of its active material that the cell of a record has, at working coordinates z (records,)."""
        return float(np.exp(self.root[index] @ z))

    @property
    def sentences(self) -> tuple[str, ...]:
        """On the file's state, for a reader."""
        if self.day is None:
            return ()
        return (f"the file is in the state of {self.day}.",)


def check_dates(names: Sequence[str], dates: Mapping[str, date]) -> None:
    """Raises DataError for a date of a record that is not among the names."""
    for name in dates:
        if name not in names:
            raise DataError(
                f"--date {name}=...: there is no such record; there are {', '.join(sorted(names))}."
            )
