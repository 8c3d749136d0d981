"""What a user would pick instead, on the same features, splits and regimes; each a function of problem and seed."""

from collections.abc import Callable

from aesi.records import ErrorModel
from aesi.sparse.baselines.boosting import gradient_boosting
from aesi.sparse.baselines.ridge import plain_ridge
from aesi.sparse.baselines.sindy_c import tuned_sindy_c
from aesi.sparse.problem import Problem

BASELINES: dict[str, Callable[[Problem, int], ErrorModel]] = {
    "SINDy-C": tuned_sindy_c,
    "ridge": plain_ridge,
    "gradient boosting": gradient_boosting,
}
"""Name -> function of the problem and a seed."""

__all__ = ["BASELINES", "gradient_boosting", "plain_ridge", "tuned_sindy_c"]
