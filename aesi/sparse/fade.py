"""Shrinkage of a correction towards the physics: as a whole, by its slope on left-out drives, and far from fitted rows.

    c'(x) = a w(x) c(x),     w = n(x) / (1 + KAPPA max(h(x) / h_u - 1, 0)**2)                               (1)
    a = b - t s_b,     b = sum_d <e_d, n c_d> / sum_d (|n c_d|**2 + DOUBT |e_d|**2)    within [0, 1]                (2)

c is the sum of the terms, h the leverage of x in their fit (leverage.py), n the nearness of x to the fitted rows
(trained_region.py). The amplitude a is the slope b of the error e on the correction, over drives d that were left out
of the fit of c_d, minus t times its standard error s_b. s_b is a jackknife over drives; parts of one drive have similar
errors and count as one. t is the quantile of Student's distribution for so many drives at the level of one standard
error of a normal distribution (one-standard-error rule, SE below): two drives agree by chance more often than six.
DOUBT is a ridge on the slope: where each drive lies outside the range of the others, n c is close to zero on all of
them, and the slope would be undetermined.
The leverage is neither in (2) nor in the losses of a search: only the chosen ensembles have it, and w = n without it.
The ridge on the coefficients shrinks them for the noise within drives, (2) shrinks their sum for differences between
drives. Efron & Morris, J. Am. Stat. Assoc. 68 (1973) 117.

Only models without terms in the error fade: with feedback, an amplitude would change the dynamics.

The cost of alternatives was measured over the development splits of the NMC drive in `aesi bench splits` (16
candidates), as a change of the reduction of the squared error, in percentage points: for the declared model in the
mean; for the recalibrated one in the mean and at worst. Half of SE: -1.1; -2.5, -3.4; none of it: -2.3; -5.2, -7.1.
DOUBT of 0.003: -0.4; -1.0, -1.5; of 0.1: 0.0; -0.1, 0.5. KAPPA of 0.1 in place of none, as it was in all of these:
-0.2; -1.0, 4.7; of 1: -4.2; -12.3, 8.3: it avoids harm by a correction, and reduces its benefit. Drives and t, in
place of halves of drives and a t of 1 as in all of these: -0.1; -0.5, 1.0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.special import ndtr, stdtrit

from aesi.numerics.blocks import Span
from aesi.numerics.files.restored import saved_number
from aesi.numerics.typing import Array, IntArray
from aesi.sparse.trained_region import TrainedRegion

KAPPA = 0.1
"""Weight of the excess leverage in (1)."""
SE = 1.0
"""Standard errors of a normal distribution that are subtracted from the slope, the level of t in (2)."""
DOUBT = 0.03
"""Ridge on the slope in (2), as a share of the squared error of a drive."""


@dataclass(frozen=True, eq=False)
class Fade:
    """The weight of a correction.  amplitude : a of (2).  region : range of the rows that the terms were fitted to."""

    amplitude: float
    region: TrainedRegion

    def weight(
        self, scaled: Array, soc: Array, temperature_degc: Array | None, excess: Array | None
    ) -> Array:
        """(n,) a w; arguments as of `kept`."""
        return self.amplitude * self.kept(scaled, soc, temperature_degc, excess)

    def kept(self, scaled: Array, soc: Array, temperature_degc: Array | None, excess: Array | None) -> Array:
        """(n,) w of (1).

        scaled : (n, n_inputs) scaled inputs, not clipped.  soc : (n,).  temperature_degc : (n,) degC, or None.
        excess : (n,) of the leverage; None takes w = n.
        """
        leverage = 0.0 if excess is None else KAPPA * excess**2
        near = self.region.nearness(scaled, soc, temperature_degc)
        return np.asarray(near / (1.0 + leverage))

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {"amplitude": self.amplitude, "region": self.region.to_dict()}

    @classmethod
    def from_dict(cls, data: dict[str, Any], n_inputs: int) -> Self:
        """Inverse of `to_dict`, for so many inputs.  Raises ValueError for anything else."""
        amplitude = saved_number(data["amplitude"], "amplitude", 0.0, 1.0)
        return cls(amplitude, TrainedRegion.from_dict(data["region"], n_inputs))


def amplitude(
    error: Array, correction: Array, folds: Sequence[Span], drives: IntArray, weights: Array
) -> float:
    """a of (2).  error : (n,) e.  correction : (n,) n c.  weights : (n,) of the rows.  drives : (n_folds,) number of
    the drive of each fold."""
    sums = [
        (w @ e**2, w @ (e * c), w @ c**2)
        for e, c, w in ((error[a:b], correction[a:b], weights[a:b]) for a, b in folds)
    ]
    return shrunken_slope(np.array(sums), drives)


def shrunken_slope(sums: Array, drives: IntArray) -> float:
    """a of (2) from (n_folds, 3) sums of e**2, e n c and (n c)**2; 0 where these do not determine it.

    drives : (n_folds,) number of the drive of each fold; with a single drive its folds count as drives. A single fold
    has no standard error, so that nothing is subtracted.
    """
    if not np.isfinite(sums).all() or not sums[:, 2].sum() > 0.0:
        return 0.0
    numbers = np.unique(drives)
    by_drive = (
        sums if len(numbers) == 1 else np.array([sums[drives == number].sum(axis=0) for number in numbers])
    )
    n_drives, total = len(by_drive), by_drive.sum(axis=0)
    slope = _slope(total[None, :])[0]
    if n_drives == 1:
        return float(np.clip(slope, 0.0, 1.0))
    others = total - by_drive
    if not others.any(axis=1).all():
        return 0.0  # without one drive nothing is left that has a slope, so that s_b is not determined
    slopes = _slope(others)
    scatter = float(np.sqrt((n_drives - 1) / n_drives * np.sum((slopes - slopes.mean()) ** 2)))
    return float(np.clip(slope - stdtrit(n_drives - 1, ndtr(SE)) * scatter, 0.0, 1.0))


def _slope(sums: Array) -> Array:
    """(n,) b of (2) from (n, 3) sums of e**2, e n c and (n c)**2."""
    return np.asarray(sums[:, 1] / (sums[:, 2] + DOUBT * sums[:, 0]))
