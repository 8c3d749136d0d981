"""Could any hypothesis explain what is left? If not, none is fitted: on a measured cell that takes most of the time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.typing import Array
from aesi.tracer.likelihood.fit import FittedHypothesis

REACH = 2.0
"""Times what a right hypothesis may leave: where the marks of all effects together leave more, whatever their sizes, no
few of them leave so little, as far as they are linear. With marks where the effects end, they left at most 0.47 times
that on ten blind cases of seed 13, and 3.5 (M50T), 5.4 (NMC) and 11 times (HG2) on measured records. With marks
where their fits begin, which cost a fifth, 0.29 instead of 0.44 times on the hardest of five blind cases, and 2.5
instead of 2.9 and 2.6 times on one drive of the HG2 and of the Panasonic. Few marks are no such span: four effects
tried on a check-up of a cell that lost a tenth of its lithium, two of which explain it, left 4.4 times that (0.5 with
marks where they end, with which five measured cases took 1.4 times as long)."""


def least_left_v(base: FittedHypothesis, marks_v: Sequence[Array], white_v: Array) -> float:
    """Root mean square beyond noise that the own parameters and all effects together leave of what was fitted, each in
    whatever size serves best, V.

    marks_v : of each effect, (n, c) V.  white_v : (n,) V, standard deviation of the noise in each row.
    """
    error = base.point.residual_v
    table = np.hstack([base.point.jacobian_v, *marks_v]) / white_v[:, None]
    sizes = np.linalg.norm(table, axis=0)
    table = table[:, sizes > 0] / sizes[sizes > 0]
    best = np.linalg.lstsq(table, error / white_v, rcond=1e-10)[0]
    left = error - white_v * (table @ best)
    return float(np.sqrt(max(np.mean(left**2) - np.mean(white_v**2), 0.0)))
