"""What a residual depends on: the share of its variance that each family of variables explains on left-out rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.numerics.blocks import dealt_folds
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.records import Run

MEMORIES_S = (10.0, 60.0, 300.0, 1800.0)
"""Time constants, s, of low-pass filters of the current, as substitutes for slow states."""
TURNS_S = (120.0, 900.0)
"""Time constants, s, of low-pass filters of the sign of the current, as substitutes for hysteresis."""
REST_SHARE = 0.02
"""Share of the RMS of all records' current below which a current has no sign."""
FOLDS = 5
"""Sets of blocks, each left out in turn."""
BLOCKS = 25
"""Contiguous blocks of rows, dealt out to the folds in turn; long against the correlation of neighbours."""
RIDGES = (1e-4, 1e-2, 1.0, 1e2, 1e4)
"""Ridge weights that are tried; the one that predicts left-out blocks best is used."""
SATURATION = 0.5
"""Share of the RMS of all records' current at which the saturating feature bends."""


@dataclass(frozen=True)
class Scales:
    """Scales of current and state of charge, the same in all records, so that a column means the same in each.

    current_a : RMS of the current, A.  least_soc, most_soc : range of the states of charge.
    """

    current_a: float
    least_soc: float
    most_soc: float

    @classmethod
    def of(cls, runs: Sequence[Run]) -> Scales:
        """The scales from all rows of some records."""
        soc = np.concatenate([run.series["soc"] for run in runs])
        current_a = rms(np.concatenate([run.current_a for run in runs])) + 1e-12
        return cls(current_a, float(soc.min()), float(soc.max()))

    def soc(self, soc: Array) -> Array:
        """(n,) from -1 to 1 over the states of charge of all records."""
        return np.asarray(2.0 * (soc - self.least_soc) / max(self.most_soc - self.least_soc, 1e-6) - 1.0)


def features(run: Run, scales: Scales) -> dict[str, Array]:
    """Family -> (n, k) columns of one record: what a residual may depend on.  scales : of all records."""
    t, current = run.time_s, run.current_a
    i = current / scales.current_a
    z = scales.soc(run.series["soc"])
    slow = [_filtered(t, i, tau) for tau in MEMORIES_S]
    heat = _filtered(t, i**2, MEMORIES_S[-1])
    sign = np.sign(i) * (np.abs(i) > REST_SHARE)
    turn = [_filtered(t, sign, tau) for tau in TURNS_S]
    throughput = np.concatenate([[0.0], np.cumsum(np.abs(current[1:]) * np.diff(t))])
    electrolyte = run.series["c_e0"] - run.series["c_eL"]
    surface = [run.series[n] for n in ("c_sn", "c_sp")]
    return {
        "current": np.column_stack([i, np.tanh(i / SATURATION), i * z, i * z**2]),
        "sign of current": np.column_stack([sign]),
        "state of charge": np.polynomial.chebyshev.chebvander(z, 6)[:, 1:],
        "electrolyte": np.column_stack([electrolyte, electrolyte * z]),
        "particle surfaces": np.column_stack(surface),
        "recent current": np.column_stack([*slow[:2], slow[0] * z, slow[1] * z]),
        "history": np.column_stack([*slow[2:], *turn]),
        "heat": np.column_stack([heat, heat * i]),
        "throughput": np.column_stack([throughput, throughput * i]),
        "time": np.column_stack([t - t[0]]),
    }


def _filtered(time_s: Array, signal: Array, tau_s: float) -> Array:
    """(n,) first-order low-pass of a signal that is constant from the row before, starting at zero. Rows may be
    unevenly spaced, as in thinned records of steady currents."""
    kept = np.exp(-np.diff(time_s) / tau_s)
    out = np.zeros(len(signal))
    for row, (share, value) in enumerate(zip(kept.tolist(), signal[1:].tolist(), strict=True), start=1):
        out[row] = share * out[row - 1] + (1.0 - share) * value
    return out


def explain(runs: Sequence[Run], residuals: Sequence[Array]) -> dict[str, float]:
    """Family of variables -> share of the residual's variance that it explains alone, 0 to 1.

    By ridge regression, judged on blocks that it was not fitted on.
    runs, residuals : one a record, (n,) V measured - model.
    """
    scales = Scales.of(runs)
    families = [features(r, scales) for r in runs]
    target = np.concatenate(residuals)
    folds = np.concatenate([dealt_folds(len(e), BLOCKS, FOLDS) for e in residuals])
    variance = float(np.mean((target - target.mean()) ** 2)) + 1e-30
    tables = {name: _standard(np.concatenate([f[name] for f in families])) for name in families[0]}
    return {name: max(0.0, 1.0 - _unseen(table, target, folds) / variance) for name, table in tables.items()}


def _standard(table: Array) -> Array:
    centred = table - table.mean(axis=0)
    return centred / (centred.std(axis=0) + 1e-12)


def _unseen(table: Array, target: Array, folds: Array) -> float:
    """Mean square error on left-out rows, with the ridge weight where it is smallest."""
    design = np.column_stack([np.ones(len(table)), table])
    errors = np.zeros(len(RIDGES))
    for fold in range(FOLDS):
        out = folds == fold
        if not out.any() or out.all():
            continue
        x, y = design[~out], target[~out]
        gram, moment = x.T @ x, x.T @ y
        for j, ridge in enumerate(RIDGES):
            penalty = ridge * np.eye(len(gram))
            penalty[0, 0] = 0.0
            weights = np.linalg.solve(gram + penalty + 1e-9 * np.eye(len(gram)), moment)
            errors[j] += float(np.sum((target[out] - design[out] @ weights) ** 2))
    return float(errors.min() / len(target))
