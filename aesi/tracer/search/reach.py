"""Whether all effects together could explain the error of the bare model. If not, no hypothesis is fitted: on a
measured cell this saves most of the time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.numerics.threads import side_by_side
from aesi.numerics.typing import Array
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.growth import EffectGrowth
from aesi.tracer.search.archive import Archive, fit_name
from aesi.tracer.search.growths import grow_all

REACH_FACTOR = 2.0
"""Factor on the error that a right hypothesis may leave. Each effect has columns: the changes of voltage that it can
make (`EffectGrowth.possible_changes_v`). Where a least-squares fit of the columns of all effects leaves more, no few
effects can explain the data either, as far as they act linearly. With columns where the effects end, they left at most
0.47 times that on ten blind cases of seed 13, and 3.5 (M50T), 5.4 (NMC) and 11 times (HG2) on measured records. With
columns where their fits begin, which cost a fifth, 0.29 instead of 0.44 times on the hardest of five blind cases, and
2.5 instead of 2.9 and 2.6 times on one drive of the HG2 and of the Panasonic. The columns of few effects prove nothing:
four effects tried on a check-up of a cell that lost a tenth of its lithium, two of which explain it, left 4.4 times
that (0.5 with columns where they end, with which five measured cases took 1.4 times as long)."""


def reach_check(
    problem: InverseProblem,
    base: FittedHypothesis,
    growths: Sequence[EffectGrowth],
    reach_v: float,
    archive: Archive,
) -> tuple[float, list[EffectGrowth]]:
    """(error beyond noise that all effects together leave, V; the growths to use from here on).

    reach_v : error, V, above which the check is repeated with more columns, since large changes of voltage are not
    linear: effects that move a declared parameter which the base left at a limit descend from their own starts, and
    have columns at their ends, too. A lag of 2.6 s in rows of 10 Hz (blind set, seed 31, case 78) leaves 3.4 times what
    a right hypothesis may by the first check, and 0.4 times by both. Five measured development records, on which
    nothing is in reach, take 3 % more processor time with it, and 42 % with the six effects that by themselves leave
    least.
    archive : keeps the first result, so that a later search with more effects gets the same one.
    """
    key = fit_name(problem, "least left", ())
    known = archive.get(key, 1)
    if known is not None:
        return float(known[0]), list(growths)
    changes_v = list(side_by_side(EffectGrowth.possible_changes_v, growths))
    least_v, grown = least_error_v(base, changes_v, problem.white_v), list(growths)
    if least_v > reach_v:
        at_limit = {f.owner for f, x in zip(base.free, base.point.x, strict=True) if f.own and any(f.ends(x))}
        grown = [one.from_own_starts() if one.effect in at_limit else one for one in growths]
        restarted = [one for one in grown if one.effect in at_limit]
        list(grow_all(restarted, archive))
        changes_v += side_by_side(EffectGrowth.possible_changes_v, restarted)
        least_v = least_error_v(base, changes_v, problem.white_v)
    archive.put(key, np.array([least_v]))
    return least_v, grown


def least_error_v(base: FittedHypothesis, changes_v: Sequence[Array], white_v: Array) -> float:
    """RMS error beyond noise on the fitted rows, V, after a linear least-squares fit of the sensitivities of the own
    parameters and the columns of all effects.

    changes_v : (n, c) V of each effect.  white_v : (n,) V, standard deviation of the noise in each row.
    """
    error = base.point.residual_v
    table = np.hstack([base.point.jacobian_v, *changes_v]) / white_v[:, None]
    sizes = np.linalg.norm(table, axis=0)
    table = table[:, sizes > 0] / sizes[sizes > 0]
    best = np.linalg.lstsq(table, error / white_v, rcond=1e-10)[0]
    remaining = error - white_v * (table @ best)
    return float(np.sqrt(max(np.mean(remaining**2) - np.mean(white_v**2), 0.0)))
