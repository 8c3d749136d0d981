"""The solver of the sparse model as a scikit-learn regressor, for pipelines, cross-validation and grid search.

    GridSearchCV(STRidgeRegressor(), {"lambda1": np.logspace(-6, 0, 7), "lambda2": [0.01, 0.1]})

No other module imports it: scikit-learn takes a second to load.
"""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import _check_sample_weight, check_is_fitted, validate_data

from aesi.numerics.typing import Array
from aesi.sparse.stridge import STRidge


class STRidgeRegressor(RegressorMixin, BaseEstimator):
    """Sequentially thresholded ridge regression (see stridge.py) as a scikit-learn regressor.

    lambda1 : ridge weight, >= 0.  lambda2 : smallest coefficient kept, in the units of y over those of X, so scale
    both.  There is no intercept: centre X and y, or give a column of ones.

    After `fit`: coef_ (n_features,), n_features_in_.
    """

    def __init__(self, lambda1: float = 1e-3, lambda2: float = 1e-2) -> None:
        self.lambda1 = lambda1
        self.lambda2 = lambda2

    def fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> Self:
        """X : (n, n_features).  y : (n,).  sample_weight : (n,) >= 0.

        Raises ParameterError for inadmissible settings, and scikit-learn's ValueError for unusable data.
        """
        solver = STRidge(self.lambda1, self.lambda2)
        theta, target = validate_data(self, X, y, dtype=float, y_numeric=True)
        weights = None
        if sample_weight is not None:
            weights = _check_sample_weight(sample_weight, theta, dtype=float, ensure_non_negative=True)
        self.coef_ = solver.fit(theta, np.asarray(target, dtype=float), weights)
        return self

    def predict(self, X: ArrayLike) -> Array:
        """(n,) in the unit of y."""
        check_is_fitted(self)
        return np.asarray(validate_data(self, X, dtype=float, reset=False) @ self.coef_)
