"""The library and the solver for PySINDy: a feature library and an optimizer.

    model = pysindy.DiscreteSINDy(feature_library=chebyshev_library(library), optimizer=stridge_optimizer(1e-3, 0.1))

PySINDy takes seconds to import, so that its classes are derived only when they are needed.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from aesi.numerics.typing import Array
from aesi.sparse.stridge import STRidge
from aesi.sparse.terms.library import Library


def chebyshev_library(library: Library) -> Any:
    """A PySINDy feature library with the terms of `library`; its variables are scaled x, then u, in order."""
    return _feature_library_class()(library)


def stridge_optimizer(lambda1: float, lambda2: float, max_iter: int = 20) -> Any:
    """A PySINDy optimizer that solves by orthogonal factors (see stridge.py), without its unbiasing step."""
    return _optimizer_class()(lambda1=lambda1, lambda2=lambda2, max_iter=max_iter)


@cache
def _feature_library_class() -> Any:
    from pysindy.feature_library.base import BaseFeatureLibrary, x_sequence_or_item
    from pysindy.utils import AxesArray

    class ChebyshevLibrary(BaseFeatureLibrary):
        """Terms of an `aesi.sparse.Library`."""

        def __init__(self, library: Library) -> None:
            super().__init__()
            self.library = library

        @x_sequence_or_item
        def fit(self, x_full: Any, y: Any = None) -> Any:
            n_variables = x_full[0].n_coord
            if n_variables != len(self.library.variables):
                raise ValueError(
                    f"the data have {n_variables} variables, the library {len(self.library.variables)}: "
                    f"{', '.join(self.library.variables)}."
                )
            self.n_features_in_ = n_variables
            self.n_output_features_ = len(self.library)
            return self

        @x_sequence_or_item
        def transform(self, x_full: Any) -> Any:
            return [
                AxesArray(self.library.evaluate(np.asarray(x)), {"ax_time": 0, "ax_coord": 1}) for x in x_full
            ]

        def get_feature_names(self, input_features: Any = None) -> list[str]:
            names = self.library.variables if input_features is None else input_features
            return [term.name(names) for term in self.library.terms]

    return ChebyshevLibrary


@cache
def _optimizer_class() -> Any:
    from pysindy.optimizers.base import BaseOptimizer

    class STRidgeOptimizer(BaseOptimizer):
        """Sequentially thresholded ridge regression by orthogonal factors."""

        def __init__(self, lambda1: float = 0.05, lambda2: float = 0.1, max_iter: int = 20) -> None:
            super().__init__(max_iter=max_iter, unbias=False)
            self.lambda1 = lambda1
            self.lambda2 = lambda2

        def _reduce(self, x: Array, y: Array) -> None:
            solver = STRidge(self.lambda1, self.lambda2, self.max_iter)
            self.coef_ = np.stack([solver.fit(np.asarray(x), np.asarray(target)) for target in y.T])
            self.history_.append(self.coef_)

    return STRidgeOptimizer
