"""Measured records made ready for fits: noise, initial state of charge, the part that may be looked at.

Fits run on a thinned copy (`thinned.py`). What thinning does to the voltage of the declared model is taken off the
measured one, so that what it does not keep by itself is kept too. Reported errors are always those of the record as
measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.initial_state import InitialState, initial_state
from aesi.physics.rest.open_circuit import GOOD_READING_V
from aesi.records import Hold, Measurement, at_its_temperature, hold_sentence
from aesi.tracer.case.thinned import ThinnedRecord, lost_v, thinned_record, thinned_together

THINNED_SHARE = 0.5
"""Share of the voltage that thinning takes from the declared model that counts as noise, since it takes another
amount from another model: with kinetics 1.4 times as fast 0.38 to 0.48 of it are left on eight drives of blind cases
at 10 Hz (seeds 13 and 18)."""
CONTINUATION_STEPS = 3.0
"""A file that starts within this many samples of another's end, on the same clock, continues it."""
HOLD_OPTION = "--hold {0} (in an experiment discover.hold: {0})"
"""How a user declares another hold, for `hold_sentence`."""
HALF_FULL = 0.5
"""Above this state of charge a smaller one is safer to simulate, below it a larger one: the middle, whatever the
cell."""
SMALLEST_NOISE_V = 5e-5
"""Least noise that is assumed, V: no cycler writes less, and in a virtual record without noise each microvolt would
count."""


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One measurement as the tracer uses it.

    data : as measured.  thin : what fits run on, fit and held-out part.  n_fit : rows of `thin` that fits may see.
    fit_until_s : the time where the fit part of `data` ends (inf for all).  start : the state at the first row.
    hold, thin_hold : how the current runs between the samples of either.  white_v : (n_thin,) V, standard deviation of
    the white noise in each row of `thin`.  noise_full_v : of that in the fit part of `data`.
    lead_rows : rows of `data` at the start that only lead to what is judged.
    good : known to be good: nothing is looked for in it, and what others have beside it is what is different there.
    continues : number of the record that fits have seen and that this one begins with, where it does.
    """

    data: Measurement
    thin: Measurement
    n_fit: int
    fit_until_s: float
    start: InitialState
    hold: Hold
    thin_hold: Hold
    white_v: Array
    noise_full_v: float
    lead_rows: int = 0
    notes: tuple[str, ...] = ()
    good: bool = False
    continues: int | None = None

    @property
    def name(self) -> str:
        """The measurement's name."""
        return self.data.name

    @property
    def soc0(self) -> float:
        """State of charge at the first row."""
        return self.start.soc

    @property
    def soc0_sd(self) -> float:
        """Standard deviation of `soc0`. It is at least the difference between a state that was given and the one
        that the voltage reads as: of two that disagree neither is known better than that."""
        return max(self.start.sd, self.start.doubt)

    @property
    def other_soc0(self) -> float:
        """A state of charge one standard deviation from that, towards the middle: the side that is safe to
        simulate."""
        return self.soc0 + (-self.soc0_sd if self.soc0 > HALF_FULL else self.soc0_sd)

    @property
    def noise_v(self) -> float:
        """Root mean square of the white noise of the rows that fits see, V."""
        return rms(self.white_v[: self.n_fit])

    @property
    def lead_rows_thin(self) -> int:
        """Rows of `thin` that only serve to get to the part that is judged."""
        if not self.lead_rows:
            return 0
        return int(np.searchsorted(self.thin.time_s, self.data.time_s[self.lead_rows]))

    @property
    def n_fit_whole(self) -> int:
        """Rows of `data` that belong to the fit part."""
        return int(np.searchsorted(self.data.time_s, self.fit_until_s))


def noise_floor_v(voltage_v: Array, current_a: Array) -> float:
    """Standard deviation of the white noise, V, from second differences where the current is steady.

    voltage_v, current_a : (n,).  The scale is robust to the steps that remain; the smallest
    voltage step over the root of twelve is the least it can be.
    """
    if len(voltage_v) < 8:
        return SMALLEST_NOISE_V
    second = voltage_v[2:] - 2.0 * voltage_v[1:-1] + voltage_v[:-2]
    change = np.abs(np.diff(current_a))
    change = np.maximum(change[1:], change[:-1])
    calm = change <= np.quantile(change, 0.3)
    kept = second[calm]
    limit = 3.5 * max(np.median(np.abs(kept)) / 0.6745, 1e-9)
    kept = kept[np.abs(kept) <= limit] if np.count_nonzero(np.abs(kept) <= limit) > 5 else kept
    steps = np.diff(np.unique(np.round(voltage_v, 6)))
    quantum = float(steps.min()) if len(steps) else 0.0
    return max(float(np.sqrt(np.mean(kept**2) / 6.0)), quantum / np.sqrt(12.0), SMALLEST_NOISE_V)


def prepare(
    cell: Cell,
    data: Measurement,
    soc0: float | None,
    holdout: float,
    *,
    given: Sequence[ActiveEffect] = (),
    shared: bool = False,
) -> PreparedRecord:
    """A record with its noise, its initial state of charge and its fit part.

    holdout : share of the time, at the end, that fits may not see (0 for none).  given : effects that the declared
    model has.  shared : True where `soc0` was given for several records.
    Raises DataError where the record is too short or its initial state cannot be known.
    """
    return _prepared(cell, thinned_record(cell, data), soc0, holdout, given, shared)


def _prepared(
    cell: Cell,
    record: ThinnedRecord,
    soc0: float | None,
    holdout: float,
    given: Sequence[ActiveEffect],
    shared: bool,
) -> PreparedRecord:
    data = record.whole
    start = initial_state(cell, data, soc0, record.hold, given, shared=shared, potentials_v=GOOD_READING_V)
    lost = lost_v(cell, record, start.soc, given)
    thin = replace(record.thin, voltage_v=record.thin.voltage_v - lost)
    duration = float(data.time_s[-1] - data.time_s[0])
    until = data.time_s[0] + (1.0 - holdout) * duration if holdout > 0 else np.inf
    n_fit = int(np.searchsorted(thin.time_s, until))
    fitted = data.take(slice(0, int(np.searchsorted(data.time_s, until))))
    noise_full = noise_floor_v(fitted.voltage_v, fitted.current_a)
    white = _white_v(record, thin.take(slice(0, n_fit)), noise_full)
    as_given = start.basis == "given" and not (start.contradicted or start.doubted)
    said = () if as_given else (start.sentence,)
    return PreparedRecord(
        data=data,
        thin=thin,
        n_fit=n_fit,
        fit_until_s=until,
        start=start,
        hold=record.hold,
        thin_hold=record.thin_hold,
        white_v=np.hypot(white, THINNED_SHARE * lost),
        noise_full_v=noise_full,
        notes=(
            *said,
            hold_sentence(data.name, record.hold, data.hold is not None, HOLD_OPTION),
            *_temperature_noted(data),
        ),
    )


def _white_v(record: ThinnedRecord, seen: Measurement, noise_full_v: float) -> Array:
    """(n_thin,) V: white noise of the rows of `thin`, told from those that fits see."""
    if record.rows is not None:  # what lies between rows that far apart is no noise
        return np.maximum(noise_full_v / np.sqrt(record.rows), SMALLEST_NOISE_V)
    # Averages have no more of it than rows: what a drive that never rests moves them by is not noise.
    noise = min(noise_floor_v(seen.voltage_v, seen.current_a), noise_full_v)
    return np.full(len(record.thin), noise)


def _temperature_noted(data: Measurement) -> tuple[str, ...]:
    if data.temperature_degc is None:
        return ()
    return (
        f"{data.name}: simulated {at_its_temperature(data.temperature_degc)}; effects that would infer it "
        "(self_heating, ambient_temperature) do not compete for this record.",
    )


def led_by(data: Measurement, seen: Sequence[Measurement]) -> tuple[int, Measurement] | None:
    """The record among those that fits have seen that `data` goes on from: its index, and both as one record; None
    where there is none.

    It is the longest that `data` begins with, or else the first that `data` continues. The latter are not joined where
    only one of the two has a temperature, since no simulation could run at half a column.
    """
    begun = [index for index, known in enumerate(seen) if _begins_with(data, known)]
    if begun:
        return max(begun, key=lambda index: len(seen[index])), data
    index = next((index for index, known in enumerate(seen) if _continues(data, known)), None)
    return None if index is None else (index, joined(seen[index], data))


def _begins_with(data: Measurement, known: Measurement) -> bool:
    n = len(known)
    same = len(data) > n and np.array_equal(data.time_s[:n], known.time_s)
    return same and np.array_equal(data.voltage_v[:n], known.voltage_v)


def _continues(data: Measurement, known: Measurement) -> bool:
    gap = float(data.time_s[0] - known.time_s[-1])
    alike = (data.temperature_degc is None) == (known.temperature_degc is None)
    return alike and 0.0 < gap <= CONTINUATION_STEPS * float(np.median(np.diff(known.time_s)))


def prepare_test(
    cell: Cell,
    data: Measurement,
    seen: Sequence[Measurement],
    soc0: float | None,
    given: Sequence[ActiveEffect] = (),
) -> PreparedRecord:
    """A test record, which chooses nothing, made ready.

    Where a record that fits have seen leads to it (`led_by`), the model runs through that and only what comes after is
    judged; its notes say so in place of a state that its own first row would give.
    """
    led = led_by(data, seen)
    if led is None:
        return prepare(cell, data, soc0, 0.0, given=given, shared=True)
    index, whole = led
    prepared = prepare(cell, whole, soc0, 0.0, given=given, shared=True)
    said = (
        f"{data.name} is judged from {stamp(float(whole.time_s[len(seen[index])]))} s on, after the rows of "
        f"{seen[index].name} that were fitted; the model is run from {stamp(float(whole.time_s[0]))} s to get there."
    )
    notes = (said, *(note for note in prepared.notes if note != prepared.start.sentence))
    return replace(prepared, lead_rows=len(seen[index]), continues=index, notes=notes)


def joined(first: Measurement, second: Measurement) -> Measurement:
    """The rows of `first` and then those of `second`, under the name of `second` and with all else of it."""
    temperatures = [t for t in (first.temperature_degc, second.temperature_degc) if t is not None]
    return replace(
        second,
        time_s=np.concatenate([first.time_s, second.time_s]),
        current_a=np.concatenate([first.current_a, second.current_a]),
        voltage_v=np.concatenate([first.voltage_v, second.voltage_v]),
        temperature_degc=np.concatenate(temperatures) if temperatures else None,
    )


def prepare_all(
    cell: Cell,
    measurements: Sequence[Measurement],
    soc0: float | None,
    holdout: float,
    given: Sequence[ActiveEffect] = (),
    good: Sequence[Measurement] = (),
) -> tuple[PreparedRecord, ...]:
    """`prepare` over several measurements, thinned until their sum is within what fits can afford.

    good : those that are known to be good, which stand last. They are fitted whole, and start where their voltage says.
    """
    rows = thinned_together(cell, (*measurements, *good))
    shared = len(measurements) > 1
    return (
        *(_prepared(cell, one, soc0, holdout, given, shared) for one in rows[: len(measurements)]),
        *(
            replace(_prepared(cell, one, None, 0.0, given, False), good=True)
            for one in rows[len(measurements) :]
        ),
    )
