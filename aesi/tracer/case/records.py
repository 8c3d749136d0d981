"""Measured records made ready for fits: noise, initial state of charge, the part that may be looked at.

Fits run on a thinned copy: averages over symmetric windows, of current and voltage alike, so that charge and the
linear part of the response are kept; of tests at steady currents with pulses and rests, and of records with uneven
times, rows that are dense after each step. What thinning does to the voltage of the declared model is taken off the
measured one, so that the rest of the response is kept too. Reported errors are always those of the record as measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.data.thinning import Spacing, averaged_over, condensed
from aesi.errors import AesiError
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.initial_state import Basis, initial_state
from aesi.records import Hold, Measurement, assumed_hold, hold_sentence
from aesi.tracer.case.fit_simulation import fit_simulation

THIN_STEP_S = 1.0
"""Fits see at most one sample a second: nothing in the catalogue is faster than that and yet
above the noise."""
FIT_SAMPLES = 12_000
"""Of all records together: above it windows are doubled, since the time of a fit grows with its rows."""
STEADY_SAMPLES = 600
"""Rows that a record of steady currents is spread over."""
STEADY_SPACING = Spacing(first_s=0.5, growth=0.25)
THINNED_SHARE = 0.5
"""Of what thinning does to the declared model, what it may do to another one: with kinetics 1.4 times as fast 0.38 to
0.48 of it are left on eight drives of blind cases at 10 Hz (seeds 13 and 18)."""
CONTINUATION_STEPS = 3.0
"""A file that starts within this many samples of another's end, on the same clock, continues it."""
SMALLEST_NOISE_V = 5e-5
"""No cycler writes less: a virtual record without noise would count each microvolt."""


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One measurement as the tracer uses it.

    data : as measured.  thin : what fits run on, fit and held-out part.  n_fit : rows of `thin` that fits may see.
    fit_until_s : the time where the fit part of `data` ends (inf for all).  soc0, soc0_sd : initial state of charge
    and what it is uncertain by.  seen_rows : rows at the start that only lead to what is judged.
    soc0_doubt : how far the voltage's own reading is from a state of charge that was given.
    good : known to be good: nothing is looked for in it, and what others have beside it is what is different there.
    hold, thin_hold : how the current runs between the samples of either.  white_v : (n_thin,) V, standard deviation of
    the white noise in each row of `thin`.  noise_full_v : of that in `data`.
    """

    data: Measurement
    thin: Measurement
    n_fit: int
    fit_until_s: float
    soc0: float
    soc0_sd: float
    hold: Hold
    thin_hold: Hold
    white_v: Array
    noise_full_v: float
    rest_voltage_v: float | None = None
    basis: Basis = "rest"
    soc0_doubt: float = 0.0
    seen_rows: int = 0
    notes: tuple[str, ...] = ()
    good: bool = False

    @property
    def name(self) -> str:
        """The measurement's name."""
        return self.data.name

    @property
    def soc0_given(self) -> bool:
        """True where the user said at which state of charge the record starts."""
        return self.basis == "given"

    @property
    def noise_v(self) -> float:
        """Root mean square of the white noise of the rows that fits see, V."""
        return float(np.sqrt(np.mean(self.white_v[: self.n_fit] ** 2)))

    @property
    def seen_rows_thin(self) -> int:
        """Rows of `thin` that only serve to get to the part that is judged."""
        if not self.seen_rows:
            return 0
        return int(np.searchsorted(self.thin.time_s, self.data.time_s[self.seen_rows]))

    @property
    def fit_rows_full(self) -> int:
        """Rows of `data` that belong to the fit part."""
        return int(np.searchsorted(self.data.time_s, self.fit_until_s))


def noise_floor_v(voltage_v: Array, current_a: Array) -> float:
    """Deviation of the white noise, from second differences where the current is steady.

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
    step_s: float = THIN_STEP_S,
    *,
    given: Sequence[ActiveEffect] = (),
    shared: bool = False,
) -> PreparedRecord:
    """A record with its noise, its initial state of charge and its fit part.

    holdout : share of the time, at the end, that fits may not see (0 for none).  given : effects that the declared
    model has.  shared : True where `soc0` was given for several records.
    Raises DataError where the record is too short or its initial state cannot be known.
    """
    hold: Hold = data.hold or assumed_hold(data.time_s)
    duration = float(data.time_s[-1] - data.time_s[0])
    thin, rows = _thinned(cell, data, step_s)
    thin_hold: Hold = hold if thin is data else "linear" if rows is None else "backward"
    until = data.time_s[0] + (1.0 - holdout) * duration if holdout > 0 else np.inf
    n_fit = int(np.searchsorted(thin.time_s, until))
    start = initial_state(cell, data, soc0, hold, given, shared=shared)
    lost_v = _lost_v(cell, data, thin, step_s, start.soc, given, hold, thin_hold)
    thin = replace(thin, voltage_v=thin.voltage_v - lost_v)
    notes = () if start.basis == "given" and not start.contradicted else (start.sentence,)
    notes = (*notes, hold_sentence(data.name, hold, data.hold is not None), *_temperature_noted(data))
    noise_full = noise_floor_v(data.voltage_v, data.current_a)
    if rows is None:
        averaged = noise_floor_v(thin.voltage_v[:n_fit], thin.current_a[:n_fit])
        # Averages have no more of it than rows: what a drive that never rests moves them by is not noise.
        noise = min(averaged, noise_full)
        white = np.full(len(thin), noise)
    else:  # what lies between rows that far apart is no noise
        white = np.maximum(noise_full / np.sqrt(rows), SMALLEST_NOISE_V)
    white = np.hypot(white, THINNED_SHARE * lost_v)
    return PreparedRecord(
        data,
        thin,
        n_fit,
        until,
        start.soc,
        start.sd,
        hold,
        thin_hold,
        white,
        noise_full,
        start.rest_voltage_v,
        start.basis,
        start.doubt,
        notes=notes,
    )


def _thinned(cell: Cell, data: Measurement, step_s: float) -> tuple[Measurement, Array | None]:
    """The record as fits see it, and how many rows each of its rows stands for; None for a drive."""
    longest_s = float(data.time_s[-1] - data.time_s[0]) / STEADY_SAMPLES
    steady = condensed(data, cell.nominal_capacity_ah, longest_s, STEADY_SPACING)
    return (averaged_over(data, step_s), None) if steady is None else steady


def _lost_v(
    cell: Cell,
    data: Measurement,
    thin: Measurement,
    step_s: float,
    soc0: float,
    given: Sequence[ActiveEffect],
    hold: Hold,
    thin_hold: Hold,
) -> Array:
    """(n_thin,) V: the thinned voltage of the declared model less that of the thinned record; nought where it cannot be
    simulated. Kinetics are no linear function of the current, and averages over a step of it are those of neither
    side."""
    if len(thin) == len(data):
        return np.zeros(len(thin))
    try:
        whole = fit_simulation(cell, data, soc0, given, hold).voltage_v
        reduced = fit_simulation(cell, thin, soc0, given, thin_hold).voltage_v
    except AesiError:
        return np.zeros(len(thin))
    lost = _thinned(cell, replace(data, voltage_v=whole), step_s)[0].voltage_v - reduced
    return np.asarray(np.where(np.isfinite(lost), lost, 0.0))


def _temperature_noted(data: Measurement) -> tuple[str, ...]:
    if data.temperature_degc is None:
        return ()
    low, high = float(np.min(data.temperature_degc)), float(np.max(data.temperature_degc))
    return (
        f"{data.name}: simulated at its measured temperature, {low:.1f} to {high:.1f} degC; effects that would infer "
        "it (self_heating, ambient_temperature) do not compete for this record.",
    )


def prepare_test(
    cell: Cell,
    data: Measurement,
    seen: Sequence[Measurement],
    soc0: float | None,
    given: Sequence[ActiveEffect] = (),
) -> PreparedRecord:
    """A record that chooses nothing.

    Where it is the continuation of a record that fits have seen, or has such a record as its beginning, the model
    runs through that and only what comes after is judged.
    """
    for known in seen:
        n = len(known)
        same = len(data) > n and np.array_equal(data.time_s[:n], known.time_s)
        if same and np.array_equal(data.voltage_v[:n], known.voltage_v):
            return replace(prepare(cell, data, soc0, 0.0, given=given, shared=True), seen_rows=n)
        gap = float(data.time_s[0] - known.time_s[-1])
        if 0.0 < gap <= CONTINUATION_STEPS * float(np.median(np.diff(known.time_s))):
            return replace(
                prepare(cell, _joined(known, data), soc0, 0.0, given=given, shared=True), seen_rows=n
            )
    return prepare(cell, data, soc0, 0.0, given=given, shared=True)


def _joined(first: Measurement, second: Measurement) -> Measurement:
    temperatures = (first.temperature_degc, second.temperature_degc)
    both = None not in temperatures
    return replace(
        second,
        time_s=np.concatenate([first.time_s, second.time_s]),
        current_a=np.concatenate([first.current_a, second.current_a]),
        voltage_v=np.concatenate([first.voltage_v, second.voltage_v]),
        temperature_degc=np.concatenate([t for t in temperatures if t is not None]) if both else None,
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
    step = THIN_STEP_S
    every = (*measurements, *good)
    while step <= 30.0 and sum(len(_thinned(cell, m, step)[0]) for m in every) > FIT_SAMPLES:
        step *= 2.0
    shared = len(measurements) > 1
    return (
        *(prepare(cell, m, soc0, holdout, step, given=given, shared=shared) for m in measurements),
        *(replace(prepare(cell, m, None, 0.0, step, given=given), good=True) for m in good),
    )
