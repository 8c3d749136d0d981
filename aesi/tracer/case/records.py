"""Measured records made ready for fits: initial state of charge, noise of the rows, the part that may be looked at.

Fits run on a thinned copy (`thinned.py`). Thinning changes the voltage of the declared model a little; this change is
subtracted from the measured voltage, so that the residual does not contain it. Reported errors are always those of the
record as measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.initial_state import InitialState, initial_state
from aesi.physics.rest.open_circuit import GOOD_READING_V
from aesi.records import Hold, InferredHold, Measurement, at_its_temperature, hold_sentence
from aesi.tracer.case.noise import SMALLEST_NOISE_V, Noise, noise_of, quantum_v
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


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One measurement as the tracer uses it.

    data : as measured.  thin : thinned rows for fits, fit part and held-out part.  n_fit : rows of `thin` in the fit
    part, none of which averages over rows that are held out.  fit_until_s : time at which the fit part of `data` ends,
    s (inf for all).  start : state at the first row.
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
    held_back = record.averaged((data.time_s >= until).astype(float)) > 0.0  # in whole or in part
    n_fit = int(np.argmax(held_back)) if held_back.any() else len(thin)
    fitted = data.take(slice(0, int(np.searchsorted(data.time_s, until))))
    noise = noise_of(fitted, cell.nominal_capacity_ah)
    thin_noise = noise_of(thin.take(slice(0, n_fit)), cell.nominal_capacity_ah)
    white = _white_v(record, noise, thin_noise)
    equivalent = _equivalent_white_v(record, noise, thin_noise, white, n_fit, quantum_v(fitted.voltage_v))
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
            start.sentence,
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
    record: ThinnedRecord, noise: Noise, thin_noise: Noise, white_v: Array, n_fit: int, resolution_v: float
) -> Array:
    """(n_thin,) V, `PreparedRecord.equivalent_white_v` for the noise `white_v` (n_thin,) of the rows.

    Rows that share one value of the noise carry the information of a single row: rows over which a channel is smooth,
    and rows that were rounded to one value, which share the rounding error `noise.resolution_v`.
    resolution_v : V, of the fit part (`quantum_v`).
    """
    share = np.maximum(noise.rows / record.rows, 1.0) if record.rows is not None else float(thin_noise.rows)
    if not noise.resolution_v:
        return np.sqrt(share) * white_v
    code = np.round(record.thin.voltage_v / resolution_v)
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
    """The rows of `first` and then those of `second`, under the name of `second` and with all else of it but where it
    begins."""
    temperatures = [t for t in (first.temperature_degc, second.temperature_degc) if t is not None]
    return replace(
        second,
        time_s=np.concatenate([first.time_s, second.time_s]),
        current_a=np.concatenate([first.current_a, second.current_a]),
        voltage_v=np.concatenate([first.voltage_v, second.voltage_v]),
        temperature_degc=np.concatenate(temperatures) if temperatures else None,
        soc0=first.soc0,
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
