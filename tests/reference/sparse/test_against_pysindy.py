"""Against PySINDy on well-conditioned problems, and against a QR of the rows on ill-conditioned ones."""

import numpy as np
import pytest

from aesi.bench.hybrid.ensemble import synthetic_record
from aesi.records import Split
from aesi.sparse import Library, Options, Problem, STRidge
from aesi.sparse.pysindy_adapter import chebyshev_library, stridge_optimizer
from aesi.sparse.terms.inputs import with_inputs


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(5)
    theta = rng.normal(size=(2000, 40)) + 0.3 * rng.normal(size=(2000, 1))
    truth = np.where(rng.random(40) < 0.4, rng.normal(size=40), 0.0)
    return theta, theta @ truth + 0.1 * rng.normal(size=2000)


@pytest.mark.parametrize(("lambda1", "lambda2"), [(1e-10, 0.05), (1e-3, 0.2), (1.0, 0.5)])
def test_agrees_with_stlsq_to_1e_8(case, lambda1, lambda2):
    from pysindy import STLSQ

    theta, y = case
    peer = STLSQ(threshold=lambda2, alpha=lambda1, unbias=False).fit(theta, y[:, None])
    ours = STRidge(lambda1, lambda2).fit(theta, y)
    assert 0 < np.count_nonzero(ours) < 40
    np.testing.assert_allclose(ours, peer.coef_[0], atol=1e-8)


@pytest.mark.parametrize("lambda1", [1e-13, 3.57e-12, 1e-6])
def test_agrees_with_a_qr_of_the_rows_where_normal_equations_fail(lambda1):
    # Sixty smooth functions of five correlated states; at this lambda1 normal equations have lost all digits.
    # Fast path and rows both solve a backward-stable QR; they differ by round-off times the condition of the
    # ridge problem: eps * sqrt(|Theta|**2 / lambda1), that is 1e-16 * 1e9 at the smallest lambda1.
    names = ("I", "c_sp", "c_sn", "c_e0", "c_eL")
    record = synthetic_record(6001, 1)
    problem = Problem.build(
        Split((with_inputs(record, names),), (), ()),
        Options(resamples=3, block=300),
        Library.build(names, p_c=2, d=2, mixed=False),
    )
    theta = problem.theta(np.arange(len(problem.library))).T
    assert np.linalg.cond(theta) > 1e7
    solver = STRidge(lambda1, 0.0)
    for k in range(3):
        by_rows = solver.fit(theta, problem.target, problem.weights(k))
        fast = solver.fit_factor(problem.factors[k])
        assert np.abs(fast - by_rows).max() < 1e-6 * np.abs(by_rows).max()


def test_the_library_and_the_optimizer_serve_pysindy():
    from pysindy import DiscreteSINDy

    rng = np.random.default_rng(2)
    u = rng.uniform(-1, 1, (600, 1))
    x = np.zeros((600, 1))
    for k in range(599):
        x[k + 1] = 0.6 * x[k] + 0.3 * u[k] * x[k] - 0.2 * (2 * u[k] ** 2 - 1)
    library = Library.build(("u",), p_c=2, d=2, special=False)
    model = DiscreteSINDy(optimizer=stridge_optimizer(1e-8, 0.05), feature_library=chebyshev_library(library))
    model.fit(x, t=1.0, u=u, feature_names=["e", "u"])
    found = dict(zip(model.get_feature_names(), model.coefficients()[0], strict=True))
    assert {name for name, c in found.items() if c} == {"T1(e)", "T1(e)*T1(u)", "T2(u)"}
    assert found["T1(e)*T1(u)"] == pytest.approx(0.3, abs=1e-6)


def test_stlsq_on_the_triangular_factor_is_stlsq_on_the_rows(case):
    from pysindy import STLSQ

    from aesi.sparse.baselines.sindy_c import _stlsq
    from aesi.sparse.stridge import triangle

    theta, y = case
    rows = STLSQ(threshold=0.2, alpha=1e-3, unbias=False).fit(theta, y[:, None])
    factor = triangle(np.column_stack([theta, y]))
    np.testing.assert_allclose(_stlsq(1e-3, 0.2, factor), rows.coef_[0], atol=1e-8)
