"""Features of the current for the next error: its value, and its latest jumps.

    I, |I|, dI, |dI|, dI_1, |dI_1|, |dI_2|         dI_j = I[k-j] - I[k-j-1]

The current of sample k is known when its voltage is predicted, so its row may hold I[k]. Jumps before the first
sample are 0.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.typing import Array

N_RECENT = 4
"""Number of currents that one row needs: those of the sample itself and of the three before it."""

N_DRIVE_FEATURES = 7
"""Number of columns of `drive_features`."""


def drive_features(current_a: Array) -> Array:
    """(n, 7) features of a continuous record of currents (n,) A."""
    jumps = np.diff(current_a, prepend=current_a[:1])
    before = np.concatenate([np.zeros(min(2, len(jumps))), jumps])
    last, last_but_one = before[1 : len(jumps) + 1], before[: len(jumps)]
    return np.column_stack(
        [current_a, np.abs(current_a), jumps, np.abs(jumps), last, np.abs(last), np.abs(last_but_one)]
    )


def drive_row(recent: Array) -> Array:
    """(7,) features from the last currents, A, at most N_RECENT of them, that of the sample itself last."""
    padded = np.full(N_RECENT, recent[0])
    padded[N_RECENT - len(recent) :] = recent
    return np.asarray(drive_features(padded)[-1])
