"""Prior of the share of active material that a cell has left in each record.

A cell only loses material. Records with a date form one course of ageing: between a record of day t and its neighbour
of day t', towards the day of the file's state, there is one loss,

    ln share(t) - ln share(t') = +-l,      l = s |e|,      s = LOSS_SD |t - t'|^(1/2)                           (1)

with e a standard normal deviate, plus for a record before the file's day and minus for one after it. Records of one day
have the same state. The working coordinate z of a loss is a normal deviate of the same probability,
|e| = P^-1((1 + P(z))/2) with P the normal distribution. For a record without a date ln share is s z, relative to the
file. The file has the state of the last day on which a dated record has a load, or of another day that is given.

Slow records determine the loss of silicon (`aesi.calibration.silicon`), each by a coordinate of its own relative to the
file, valid on its day. Between two such days, the file's included, the logarithm of the share is interpolated linearly
over time; before the first and after the last it is constant. Records with a load take this share.

Left out: ageing by use and not by days, recovery at rest, and growing resistance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np
from scipy.special import ndtr, ndtri

from aesi.calibration.records.prepared import Prepared
from aesi.errors import DataError
from aesi.numerics.typing import Array, BoolArray
from aesi.over_time import range_words
from aesi.physics.cell.health import day_of

SLOW_SD, LOADED_SD = 0.03, 0.002
"""Standard deviations, for records without dates, of ln(capacity of the cell in a record / capacity in the file).
SLOW_SD, for slow records, is a convention: they are fitted for the potentials, and a cell ages between its tests, by 3
% for the LG 18650HG2 within a week. LOADED_SD, for records with a load, is the accuracy of the measured charge (whole
cycles determine the zero of a cycler to 0.2 %): such records are what a file is simulated for, in a single state. A
record with stronger evidence may still end further away.
With 3 % for all, a calibrated LG 18650HG2, as it is simulated, misses its fitted 1C discharge and drive by 119 and 4.9
mV, and the 1C discharge of two days later, fitted to nothing, by 10.3; with these by 17.6, 8.7 and 14.1."""
MOST_AGE = 0.3
"""Bound of the same logarithm for a record without a date. A convention that no fit reaches; but descents scale their
steps by bounds, so that without it they end elsewhere along directions that data at one temperature do not
determine."""
LOSS_SD = 0.0075
"""s of (1) for one day: 4 % in a month, 7 % in three. The eight losses between the fitted records of an LG 18650HG2 and
a Panasonic NCR18650PF, 1 to 42 days apart, are 0 to 1.5 % times the root of their days, 0.8 % root mean square (fitted
with 0.5 %).
With steps of either sign the HG2 had gained 5 % in a 1C discharge at -8 degC, six weeks after its drives: the age
compensated an effect of the cold. The file as simulated missed the discharge by 264 mV, and by 9.3 with losses alone. A
fit without that discharge, whose two C/20 at other temperatures then bend the energies less, misses it by 92 mV instead
of 1.6 V."""
MOST_DEVIATIONS = 4.0
"""Bound of the working coordinate of a loss, standard deviations."""


@dataclass(frozen=True, eq=False)
class Ageing:
    """Prior of the records' shares of active material, of standard normal deviates z (records,):

        share_i = exp(chain_i . (sd a)),      a_j = |e_j| of a loss (1), z_j of a record without a date

    chain : (records, records) identity for records without a date; else chain[i, j] is 1 where loss j lies between
    record i and a later day of the file, -1 where it lies between the file's day and a later record i.
    sd : (records,) s of (1).  silicon_weights : (records, records) weights of the records' own silicon logarithms in
    the one of each record.  losses : (records,) True for a loss (1).  day : of the file's state; None where no record
    has a date.
    """

    chain: Array
    silicon_weights: Array
    sd: Array
    losses: BoolArray
    day: date | None

    @classmethod
    def of(cls, records: Sequence[Prepared], dates: Mapping[str, date], as_of: date | None = None) -> Ageing:
        """The prior for some records.

        dates : record name -> day of its test.  as_of : day of the file's state; None takes the last with a load.
        Raises DataError for a date of an unknown record, for `as_of` without any date, and for an `as_of` outside the
        dates, where no record shows the state of the cell.
        """
        check_dates([r.name for r in records], dates)
        if as_of is not None and not dates:
            raise DataError(f"as of {as_of}: no record has a date; give theirs (--date FILE=YYYY-MM-DD).")
        days = [day_of(dates[r.name]) if r.name in dates else None for r in records]
        day = _file_day(records, days, None if as_of is None else day_of(as_of))
        since = np.array([0 if d is None or day is None else (d - day).days for d in days])
        losses = np.array([d is not None for d in days], dtype=bool)
        chain, loss_sd = _chain_and_sd(since, losses)
        sd = np.where(losses, loss_sd, [SLOW_SD if r.slow else LOADED_SD for r in records])
        return cls(chain, _silicon_weights(records, since, losses), sd, losses, day)

    @property
    def dated(self) -> bool:
        """Whether any record has a date."""
        return self.day is not None

    @property
    def bounds(self) -> Array:
        """(records,) largest magnitude of each working coordinate."""
        return np.where(self.losses, MOST_DEVIATIONS, MOST_AGE / np.where(self.sd > 0.0, self.sd, 1.0))

    @property
    def z_of_file_state(self) -> Array:
        """(records,) working coordinates of records in the file's state; -inf for a loss, whose |e| is 0 there."""
        return np.where(self.losses, -np.inf, 0.0)

    def share(self, index: int, z: Array) -> float:
        """Share of its active material that the cell of a record has, at working coordinates z (records,)."""
        return float(np.exp(self.chain[index] @ (self.sd * np.where(self.losses, _size(z), z))))

    def slopes(self, index: int, z: Array) -> Array:
        """(records,) slopes of the logarithm of a record's share over the working coordinates z."""
        # derivative of |e| = P^-1((1 + P(z))/2) from the densities on both sides
        bend = 0.5 * np.exp(0.5 * (_size(z) ** 2 - z**2))
        return self.chain[index] * self.sd * np.where(self.losses, bend, 1.0)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences on the file's state."""
        if self.day is None:
            return ()
        return (f"the file describes the cell as of {self.day}.",)


def _file_day(records: Sequence[Prepared], days: Sequence[date | None], as_of: date | None) -> date | None:
    """Day of the file's state: the one asked for, else the last with a load, else the last; None without any date.

    Raises DataError for one asked for that is not between the first and the last.
    """
    dated = [d for d in days if d is not None]
    if as_of is not None and not min(dated) <= as_of <= max(dated):
        of_days = range_words(f"{min(dated)}", f"{max(dated)}")
        raise DataError(
            f"as of {as_of}: the dated records are of {of_days}, and nothing shows what the cell "
            "was on another day; give a day from the first to the last of them."
        )
    loaded = [d for r, d in zip(records, days, strict=True) if d is not None and not r.slow]
    return as_of or max(loaded or dated, default=None)


def _chain_and_sd(since: Array, dated: BoolArray) -> tuple[Array, Array]:
    """(`Ageing.chain`, (records,) standard deviations of the losses of dated records, 0 for others).

    Losses accumulate away from the file's day, before and after it: record i has all losses between the file's day and
    its own, and the last of these has number i.
    since : (records,) days from the file's state.  dated : (records,) True for records with a date.
    """
    chain, sd = np.eye(len(since)), np.zeros(len(since))
    before = sorted(np.flatnonzero(dated & (since <= 0)), key=lambda i: abs(since[i]))
    after = sorted(np.flatnonzero(dated & (since > 0)), key=lambda i: abs(since[i]))
    for sign, outwards in ((1, before), (-1, after)):
        for k, i in enumerate(outwards):
            nearer = abs(since[outwards[k - 1]]) if k else 0
            sd[i] = LOSS_SD * np.sqrt(abs(since[i]) - nearer)
            chain[i, outwards[: k + 1]] = sign
    return chain, sd


def _silicon_weights(records: Sequence[Prepared], since: Array, dated: BoolArray) -> Array:
    """`Ageing.silicon_weights`.  since : (records,) days from the file's state."""
    slow = np.array([r.slow for r in records], dtype=bool)
    own = np.diag((slow & ~(dated & (since == 0))).astype(float))
    tell = slow & dated & (since != 0)
    at = np.unique(np.append(since[tell], 0))
    known = (tell & (since == at[:, None])).astype(float)
    known /= np.maximum(known.sum(axis=1, keepdims=True), 1.0)  # the mean of those of one day
    for i in np.flatnonzero(~slow & dated):
        own[i] = [np.interp(since[i], at, column) for column in known.T]
    return own


def _size(z: Array) -> Array:
    """|e| of (1)."""
    return np.asarray(-ndtri(0.5 * ndtr(-z)))


def check_dates(names: Sequence[str], dates: Mapping[str, date]) -> None:
    """Raises DataError for a date of a record that is not among the names."""
    for name in dates:
        if name not in names:
            raise DataError(f"the date of {name}: there is no such record among {', '.join(sorted(names))}.")
