"""The regressor keeps scikit-learn's conventions, and says what the solver says."""

import numpy as np
from sklearn.utils.estimator_checks import parametrize_with_checks

from aesi.sparse import STRidge
from aesi.sparse.sklearn_adapter import STRidgeRegressor


@parametrize_with_checks([STRidgeRegressor()])
def test_scikit_learns_own_checks(estimator, check):
    check(estimator)


def test_it_finds_what_the_solver_finds(rng):
    x = rng.normal(size=(200, 6))
    y = x @ [1.0, 0.0, -0.5, 0.0, 0.02, 0.0] + 1e-3 * rng.normal(size=200)
    found = STRidgeRegressor(lambda1=1e-6, lambda2=0.1).fit(x, y)
    np.testing.assert_array_equal(found.coef_, STRidge(1e-6, 0.1).fit(x, y))
    assert np.flatnonzero(found.coef_).tolist() == [0, 2]
    np.testing.assert_array_equal(found.predict(x), x @ found.coef_)
