"""Measured records made ready for fits: noise, initial state of charge, the part that may be looked at.

Fits run on a thinned copy (`thinned.py`). Thinning changes the voltage of the declared model a little; this change is
subtracted from the measured voltage, so that the residual does not contain it. Reported errors are always those of the
record as measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.special import ndtri

from aesi.data.thinning import STEP_C_RATE
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.over_time import stamp
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.initial_state import InitialState, initial_state
from aesi.physics.rest.open_circuit import GOOD_READING_V
from aesi.records import Hold, InferredHold, Measurement, at_its_temperature, hold_sentence
from aesi.tracer.case.thinned import ThinnedRecord, thinned_record, thinned_together, thinning_error_v

THINNED_SHARE = 0.5
"""Share of the declared model's change by thinning that counts as noise, since another model changes by another amount:
with kinetics 1.4 times as fast 0.38 to 0.48 of it are left on eight drives of blind cases at 10 Hz (seeds 13 and
18)."""
CONTINUATION_STEPS = 3.0
"""A file that starts within this many samples of another's end, on the same clock, continues it."""
HOLD_OPTION = "--hold {0} (in an experiment discover.hold: {0})"
"""How a user declares another hold, for `hold_sentence`."""
HALF_FULL = 0.5
"""State of charge, share: above it a smaller one is safer to simulate, below it a larger one."""
FEWEST_ROWS = 8
"""Fewest rows from which noise is estimated; a shorter record gets SMALLEST_NOISE_V."""
STEADIEST_SHARE = 0.3
"""Share of the rows, those at which the current changes least, from which the noise is estimated. A convention."""
LARGEST_SDS = 3.5
"""A difference larger than this many standard deviations is a step of the voltage, not noise. A convention."""
HELD_SHARE = 0.75
"""Quantile of the differences in a steady stretch from which the scale of the noise is read: where a channel holds its
values for several rows, up to half of the differences are zero."""
HARMONICS = 200
"""Harmonics of the rounding error that are summed; 0.1 % of its mean square is in the others."""
SETTLED_S = 5.0
"""Time, s, for which the current must have been steady before noise is estimated at longer lags: faster relaxation is
then over."""
LONGEST_SMOOTH_S = 8.0
"""Longest lag, s, at which the noise of a filtered or holding channel is looked for: a convention, between the seconds
that such channels take and the minutes over which the voltage relaxes."""
SMOOTH_LAGS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Lags that are tried, rows."""
FEWEST_SPANS = 50
"""Fewest spans without overlap from which the noise at a lag is estimated, to a tenth of its value."""
EVEN_TIMES = 1.5
"""Longest duration of a span, over the typical time of so many rows: no third difference reaches over a gap."""
SMOOTH_TIMES = 1.25
"""Least ratio of the noise at a longer lag to that of neighbouring rows for a channel to count as filtered or holding:
two and a half of the standard deviations that `FEWEST_SPANS` leave. Otherwise the noise is white, as estimated from
neighbouring rows."""
SMALLEST_NOISE_V = 5e-5
"""Least noise that is assumed, V. No cycler has less, and in a virtual record without noise each microvolt would count
as evidence."""


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One measurement as the tracer uses it.

    data : as measured.  thin : thinned rows for fits, fit part and held-out part.  n_fit : rows of `thin` in the fit
    part.  fit_until_s : time at which the fit part of `data` ends, s (inf for all).  start : state at the first row.
    hold, thin_hold : how the current runs between the rows of `data` and of `thin`.  white_v : (n_thin,) V, standard
    deviation of the noise in each row of `thin`.  equivalent_white_v : (n_thin,) V, standard deviation of white noise
    with the same information, larger where rows share one value of the noise.  noise_full_v : standard deviation of the
    noise in the fit part of `data`, V.
    lead_rows : number of first rows of `data` that are simulated but not judged.
    good : known to be good: no effect acts on it, and the other records are compared with it.
    continues : number of the fitted record whose rows this one begins with, or None.
    """

    data: Measurement
    thin: Measurement
    n_fit: int
    fit_until_s: float
    start: InitialState
    hold: Hold
    thin_hold: Hold
    white_v: Array
    equivalent_white_v: Array
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
        """Standard deviation of `soc0`, at least the difference between the state that was given and the one that the
        voltage indicates: where the two disagree, neither is known better than that."""
        return max(self.start.sd, self.start.doubt)

    @property
    def other_soc0(self) -> float:
        """A state of charge one standard deviation from `soc0`, towards the middle: the side that is safe to
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


class Noise(NamedTuple):
    """Noise of a record's rows.

    sd_v : standard deviation, V.  resolution_v : the part of it that averaging over rows does not reduce, V: the
    rounding error, where noise does not scatter the voltage over several steps of the resolution.
    rows : number of consecutive rows that share one value of the remaining noise; 1 where that is white.
    """

    sd_v: float
    resolution_v: float
    rows: int

    def sd_of_means_v(self, rows: Array) -> Array:
        """(m,) V, standard deviations of means over `rows` (m,) rows each."""
        values = np.maximum(rows / self.rows, 1.0)
        return np.sqrt((self.sd_v**2 - self.resolution_v**2) / values + self.resolution_v**2)


def noise_of(data: Measurement, capacity_ah: float) -> Noise:
    """The noise of a record's voltage: white, unless differences over several rows show more of it than those of
    neighbouring rows (`_noise_by_lag_v`).

    capacity_ah : of the cell; a current counts as steady by its C-rate.
    """
    if len(data) < FEWEST_ROWS:
        return Noise(SMALLEST_NOISE_V, 0.0, 1)
    sd_v, rows = noise_floor_v(data.voltage_v, data.current_a), 1
    by_lag_v = _noise_by_lag_v(data, capacity_ah)
    most_v = max(by_lag_v.values(), default=0.0)
    if most_v > SMOOTH_TIMES * sd_v:
        sd_v, rows = most_v, next(lag for lag, v in by_lag_v.items() if SMOOTH_TIMES * v > most_v)
    scattered_v = max(_second_difference_sd_v(data.voltage_v, data.current_a), most_v)
    return Noise(sd_v, min(_rounding_error_v(_quantum_v(data.voltage_v), scattered_v), sd_v), rows)


def noise_floor_v(voltage_v: Array, current_a: Array) -> float:
    """Standard deviation of the white noise, V, from second differences where the current is steady.

    voltage_v, current_a : (n,) V, A.  The estimate is robust to voltage steps that remain. It is at least the smallest
    voltage step over the root of twelve.
    """
    if len(voltage_v) < FEWEST_ROWS:
        return SMALLEST_NOISE_V
    rounding = _quantum_v(voltage_v) / np.sqrt(12.0)
    return max(_second_difference_sd_v(voltage_v, current_a), float(rounding), SMALLEST_NOISE_V)


def _second_difference_sd_v(voltage_v: Array, current_a: Array) -> float:
    """As `noise_floor_v`, without its lower limits: RMS of the second differences over the root of 6, V, without the
    ohmic drop of a current that is never steady."""
    second_v, second_a = (one[2:] - 2.0 * one[1:-1] + one[:-2] for one in (voltage_v, current_a))
    change = np.abs(np.diff(current_a))
    change = np.maximum(change[1:], change[:-1])
    steadiest = change <= np.quantile(change, STEADIEST_SHARE)
    return _rms_without_outliers(_without_drop(second_v[steadiest], second_a[steadiest])) / float(
        np.sqrt(6.0)
    )


def _without_drop(second_v: Array, second_a: Array) -> Array:
    """(m,) V, second differences of a voltage minus their part that is proportional to those of the current (m,) A.

    Of the US06 schedule at 1 Hz, whose current changes in every row, 3.9 mV of noise were told where there are 0.2,
    and 0.5 are so; of the UDDS with 1 mV 1.8, and 1.0 are so.
    """
    left_v = second_v
    for _ in range(2):  # the second time without the outliers about the first drop
        kept = np.abs(left_v) <= LARGEST_SDS * _sd_of_quantile(left_v, 0.5)
        square = float(second_a[kept] @ second_a[kept])
        if not square > 0.0:
            return left_v
        left_v = second_v - float(second_a[kept] @ second_v[kept]) / square * second_a
    return left_v


def _sd_of_quantile(differences: Array, share: float) -> float:
    """Standard deviation of differences (m,), V, read from a quantile of their magnitude as of a normal distribution;
    at least 1 nV.  share : of that quantile."""
    sd = float(np.quantile(np.abs(differences), share)) / float(ndtri(0.5 * (1.0 + share)))
    return max(sd, 1e-9)


def _rms_without_outliers(differences: Array, share: float = 0.5) -> float:
    """RMS of differences (m,), without those of more than `LARGEST_SDS` standard deviations, which are no noise.

    share : quantile of their magnitude from which that standard deviation is read, as of a normal distribution.
    """
    kept = differences[np.abs(differences) <= LARGEST_SDS * _sd_of_quantile(differences, share)]
    return rms(kept if len(kept) > 5 else differences)


def _quantum_v(voltage_v: Array) -> float:
    """The smallest step of a voltage, V; zero where it has a single value."""
    steps = np.diff(np.unique(np.round(voltage_v, 6)))
    return float(steps.min()) if len(steps) else 0.0


def _rounding_error_v(quantum_v: float, scattered_v: float) -> float:
    """RMS error, V, of the mean of a constant voltage with white noise whose rows are rounded to multiples of a
    quantum: quantum / sqrt(12) without noise, a 200th of that with noise of half a quantum, which scatters the rows
    over neighbouring multiples.

    scattered_v : standard deviation of the rows, V, the part that rounding adds included.
    Widrow & Kollar, Quantization Noise (2008), chapter 4: the k-th harmonic of the error is q / (pi k) sin(2 pi k v/q),
    and is multiplied by exp(-2 (pi k s / q)**2) in the mean over noise of standard deviation s.
    """
    if not quantum_v:
        return 0.0
    noise_v2 = max(scattered_v**2 - quantum_v**2 / 12.0, 0.0)
    k = np.arange(1, HARMONICS + 1)
    harmonics_v2 = (
        0.5 * (quantum_v / (np.pi * k)) ** 2 * np.exp(-4.0 * np.pi**2 * k**2 * noise_v2 / quantum_v**2)
    )
    return float(np.sqrt(harmonics_v2.sum()))


def _noise_by_lag_v(data: Measurement, capacity_ah: float) -> dict[int, float]:
    """Lag (rows) -> standard deviation of the noise, V, from differences at that lag. It is the same at each lag for
    white noise, and grows with the lag for a channel that is filtered or holds its values.

    It comes from third differences in stretches of steady current, `SETTLED_S` after they begin. A relaxing voltage
    adds a part that grows as the cube of the lag: the lags end before one at which the noise grows by a larger factor
    than the lag, or which has fewer than `FEWEST_SPANS` spans that do not overlap.
    """
    typical = float(np.median(np.diff(data.time_s)))
    settled = max(int(np.ceil(SETTLED_S / typical)), 1)
    out: dict[int, float] = {}
    for lag in (one for one in SMOOTH_LAGS if one == 1 or one * typical <= LONGEST_SMOOTH_S):
        span = settled + 3 * lag
        if len(data) <= span:
            break
        v = data.voltage_v[settled:]
        third = v[3 * lag :] - 3.0 * v[2 * lag : -lag] + 3.0 * v[lag : -2 * lag] - v[: -3 * lag]
        steady = _steady_spans(data, span, EVEN_TIMES * span * typical, STEP_C_RATE * capacity_ah)
        if np.count_nonzero(steady) < FEWEST_SPANS * lag:
            break
        found_v = _rms_without_outliers(third[steady], HELD_SHARE) / float(np.sqrt(20.0))
        before = max(out, default=lag)
        if out and found_v > lag / before * max(out[before], SMALLEST_NOISE_V):
            break
        out[lag] = found_v
    return out


def _steady_spans(data: Measurement, span: int, longest_s: float, most_a: float) -> BoolArray:
    """(n - span,) True where the current is steady from a row to the one `span` rows later: among the spans of at most
    `longest_s` (s) whose current varies by at most `most_a` (A), the `STEADIEST_SHARE` that vary least."""
    inside = slice((span + 1) // 2, (span + 1) // 2 + len(data) - span)
    highest, lowest = (of(data.current_a, span + 1)[inside] for of in (maximum_filter1d, minimum_filter1d))
    moves = highest - lowest
    calm = (data.time_s[span:] - data.time_s[:-span] <= longest_s) & (moves <= most_a)
    return calm & (moves <= np.quantile(moves[calm], STEADIEST_SHARE)) if calm.any() else calm


def _prepared(
    cell: Cell,
    record: ThinnedRecord,
    soc0: float | None,
    holdout: float,
    given: Sequence[ActiveEffect],
    shared: bool,
    inferred: InferredHold | None,
) -> PreparedRecord:
    """A record with its noise, its initial state of charge and its fit part.

    holdout : share of the time, at the end, that fits may not see (0 for none).  given : effects that the declared
    model has.  shared : True where `soc0` was given for several records.  inferred : its hold where nobody declared
    that which it has.
    Raises DataError where its initial state cannot be known.
    """
    data = record.whole
    start = initial_state(cell, data, soc0, record.hold, given, shared=shared, potentials_v=GOOD_READING_V)
    lost = thinning_error_v(cell, record, start.soc, given)
    thin = replace(record.thin, voltage_v=record.thin.voltage_v - lost)
    duration = float(data.time_s[-1] - data.time_s[0])
    until = data.time_s[0] + (1.0 - holdout) * duration if holdout > 0 else np.inf
    n_fit = int(np.searchsorted(thin.time_s, until))
    fitted = data.take(slice(0, int(np.searchsorted(data.time_s, until))))
    noise = noise_of(fitted, cell.nominal_capacity_ah)
    thin_noise = noise_of(thin.take(slice(0, n_fit)), cell.nominal_capacity_ah)
    white = _white_v(record, noise, thin_noise)
    equivalent = _equivalent_white_v(record, noise, thin_noise, white, n_fit)
    as_given = start.basis == "given" and not (start.contradicted or start.doubted)
    start_note = () if as_given else (start.sentence,)
    return PreparedRecord(
        data=data,
        thin=thin,
        n_fit=n_fit,
        fit_until_s=until,
        start=start,
        hold=record.hold,
        thin_hold=record.thin_hold,
        white_v=np.hypot(white, THINNED_SHARE * lost),
        equivalent_white_v=np.hypot(equivalent, THINNED_SHARE * lost),
        noise_full_v=noise.sd_v,
        notes=(
            *start_note,
            hold_sentence(
                data.name,
                record.hold,
                data.hold is not None and inferred is None,
                HOLD_OPTION,
                why="" if inferred is None else inferred.reason,
            ),
            *_temperature_noted(data),
        ),
    )


def _white_v(record: ThinnedRecord, noise: Noise, thin_noise: Noise) -> Array:
    """(n_thin,) V, noise of each row of `thin`.  noise, thin_noise : of the fit part, as measured and thinned."""
    if record.rows is not None:  # rows are too far apart for their differences to be noise
        return np.maximum(noise.sd_of_means_v(record.rows), SMALLEST_NOISE_V)
    # Averages are no noisier than rows: a larger estimate comes from the load of a drive that never rests.
    return np.full(len(record.thin), min(max(thin_noise.sd_v, noise.resolution_v), noise.sd_v))


def _equivalent_white_v(
    record: ThinnedRecord, noise: Noise, thin_noise: Noise, white_v: Array, n_fit: int
) -> Array:
    """(n_thin,) V, `PreparedRecord.equivalent_white_v` for the noise `white_v` (n_thin,) of the rows.

    Rows that share one value of the noise carry the information of a single row: rows over which a channel is smooth,
    and rows that were rounded to one value, which share the rounding error `resolution_v`.
    """
    share = np.maximum(noise.rows / record.rows, 1.0) if record.rows is not None else float(thin_noise.rows)
    if not noise.resolution_v:
        return np.sqrt(share) * white_v
    code = np.round(record.thin.voltage_v / _quantum_v(record.whole.voltage_v))
    first_of_run = np.diff(code, prepend=np.nan) != 0.0
    first_of_run[n_fit : n_fit + 1] = True  # rows held back must not change the weight of fitted ones
    run = np.cumsum(first_of_run) - 1
    alike = np.bincount(run)[run]
    scattered_v2 = np.maximum(white_v**2 - noise.resolution_v**2, 0.0)
    return np.sqrt(share * scattered_v2 + alike * noise.resolution_v**2)


def _temperature_noted(data: Measurement) -> tuple[str, ...]:
    if data.temperature_degc is None:
        return ()
    return (
        f"{data.name}: simulated {at_its_temperature(data.temperature_degc)}; effects that would infer it "
        "(self_heating, ambient_temperature) do not compete for this record.",
    )


def leading_record(data: Measurement, seen: Sequence[Measurement]) -> tuple[int, Measurement] | None:
    """(index of the fitted record that leads to `data`, both as one record); None where no fitted record does.

    It is the longest one with whose rows `data` begins, else the first one that `data` continues. The latter is not
    joined where only one of the two has a temperature: a simulation needs the whole column.
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
    inferred: InferredHold | None = None,
) -> PreparedRecord:
    """A prepared test record, to which nothing is fitted.

    Where a fitted record leads to it (`leading_record`), the simulation starts with that record and only the later rows
    are judged. The notes then say so, in place of a state of charge read from the first row.

    inferred : how its current runs, where nobody declared that.
    """
    led = leading_record(data, seen)
    whole = _held(data if led is None else led[1], inferred)
    prepared = _prepared(cell, thinned_record(cell, whole), soc0, 0.0, given, True, inferred)
    if led is None:
        return prepared
    index = led[0]
    lead_note = (
        f"{data.name} is judged from {stamp(float(whole.time_s[len(seen[index])]))} s on, after the rows of "
        f"{seen[index].name} that were fitted; the model is run from {stamp(float(whole.time_s[0]))} s to get there."
    )
    notes = (lead_note, *(note for note in prepared.notes if note != prepared.start.sentence))
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


def _held(data: Measurement, inferred: InferredHold | None) -> Measurement:
    return data if inferred is None else data.held(inferred.hold)


def prepare_all(
    cell: Cell,
    measurements: Sequence[Measurement],
    soc0: float | None,
    holdout: float,
    given: Sequence[ActiveEffect] = (),
    good: Sequence[Measurement] = (),
    inferred: Mapping[int, InferredHold] = MappingProxyType({}),
) -> tuple[PreparedRecord, ...]:
    """The prepared records of one or several measurements, thinned together (`thinned_together`).

    soc0 : state of charge at the first row of each, None to read it.  holdout : share of the time of each, at its end,
    that fits may not see (0 for none).  given : effects that the declared model has.
    good : measurements that are known to be good. Their records come last, are fitted whole, and take the initial state
    of charge from their voltage.
    inferred : number of a record -> how its current runs, where nobody declared that.
    Raises DataError where an initial state cannot be known.
    """
    holds = [inferred.get(k) for k in range(len(measurements) + len(good))]
    rows = thinned_together(cell, list(map(_held, (*measurements, *good), holds)))
    shared, fitted = len(measurements) > 1, len(measurements)
    return (
        *(
            _prepared(cell, one, soc0, holdout, given, shared, hold)
            for one, hold in zip(rows[:fitted], holds[:fitted], strict=True)
        ),
        *(
            replace(_prepared(cell, one, None, 0.0, given, False, hold), good=True)
            for one, hold in zip(rows[fitted:], holds[fitted:], strict=True)
        ),
    )
