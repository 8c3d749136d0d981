"""White noise on top of a slowly wandering model error: whitening and log-determinant in one pass.

    y_k = a_k sum_j x_j(t_k) + w_k v_k,   x_j Ornstein-Uhlenbeck of unit variance / m and correlation length tau_j   (1)

a (n,) and w (n,) are the standard deviations of the model error and of the white noise in each row. Equal shares over
correlation lengths a factor of thirty apart stand for a spectrum that falls as one over the frequency between them.
The Kalman filter of (1) is linear in y, so that it whitens a residual and its sensitivities alike. The process starts
afresh at each block, so that blocks are independent and any of them can be left out in closed form.
Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001) 425, for the model error; Durbin & Koopman, Time Series Analysis by
State Space Methods, 2nd ed. (2012), chapters 4 and 7, for the filter.
"""

from __future__ import annotations

import numpy as np

from aesi.numerics.compiled import kept_njit
from aesi.numerics.typing import Array, IntArray

CORRELATION_LENGTHS_S = (2.0, 60.0, 1800.0)
"""From just slower than a sample to the slowest that a drive of an hour shows; a convention."""


@kept_njit(nogil=True)
def _filter(columns, time_s, opens, amplitude, white, tau_s):  # type: ignore[no-untyped-def]
    """The Kalman filter of (1) row by row; opens : (n,) True where a block begins.  tau_s : (processes,).  Else and
    what comes back as in `whiten`.

    state : (processes, m) means of the x_j by the rows so far, of each column.  covariance : (processes, processes) of
    the x_j about them.  kept : (processes,) what is kept of each x_j from a row to the next.
    gain : (processes,) covariance of each x_j with the row's y.
    """
    n, m = columns.shape
    processes = len(tau_s)
    out = np.empty((n, m))
    log_det = np.empty(n)
    state = np.zeros((processes, m))
    covariance = np.zeros((processes, processes))
    kept = np.empty(processes)
    gain = np.empty(processes)
    share = 1.0 / processes
    last_gap = -1.0
    for i in range(n):
        if opens[i]:
            state[:] = 0.0
            covariance[:] = 0.0
            for a in range(processes):
                covariance[a, a] = share
        else:
            gap = time_s[i] - time_s[i - 1]
            if gap != last_gap:
                last_gap = gap
                for a in range(processes):
                    kept[a] = np.exp(-gap / tau_s[a])
            for a in range(processes):
                for b in range(processes):
                    covariance[a, b] *= kept[a] * kept[b]
                covariance[a, a] += share * (1.0 - kept[a] * kept[a])
                for j in range(m):
                    state[a, j] *= kept[a]
        scale = amplitude[i]
        variance = white[i] * white[i]
        for a in range(processes):
            total = 0.0
            for b in range(processes):
                total += covariance[a, b]
            gain[a] = total * scale
            variance += gain[a] * scale
        root = 1.0 / np.sqrt(variance)
        for j in range(m):
            predicted = 0.0
            for a in range(processes):
                predicted += state[a, j]
            innovation = columns[i, j] - scale * predicted
            out[i, j] = innovation * root
            step = innovation / variance
            for a in range(processes):
                state[a, j] += gain[a] * step
        for a in range(processes):
            for b in range(processes):
                covariance[a, b] -= gain[a] * gain[b] / variance
        log_det[i] = np.log(variance)
    return out, log_det


def whiten(
    columns: Array,
    time_s: Array,
    starts: IntArray,
    amplitude: Array,
    white: Array,
) -> tuple[Array, Array]:
    """Whitened columns (n, m), of unit variance, and the log-determinant of the covariance row by row (n,).

    columns : (n, m).  time_s : (n,) s, rising within each block.  starts : first rows of the blocks.
    amplitude, white : (n,) standard deviations of model error and noise, in the unit of `columns`.
    """
    opens = np.zeros(len(time_s), dtype=np.bool_)
    opens[starts] = True
    table = np.ascontiguousarray(columns, dtype=float)
    out = _filter(table, time_s, opens, amplitude, white, np.array(CORRELATION_LENGTHS_S))
    return out[0], out[1]
