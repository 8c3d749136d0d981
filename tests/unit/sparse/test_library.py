import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import chebyshev

from aesi.errors import InputError
from aesi.records import INPUT_NAMES
from aesi.sparse import Genome, Library
from aesi.sparse.terms.basis import FUNCTIONS, MAX_ORDER, clipped_values, slopes, values
from aesi.sparse.terms.library import evaluate_terms


def test_the_whole_library_has_the_terms_it_says():
    # 1 + 6 * 5 + 15 * 10 + 20 * 10 polynomials, 6 * 6 functions, 6 * 6 * 5 mixed terms.
    library = Library.build(INPUT_NAMES)
    assert len(library) == 1 + 30 + 150 + 200 + 36 + 180 == 597
    assert len(set(library.names)) == 597


def test_the_library_of_the_papers_optimum_has_58_terms():
    assert len(Library.build(INPUT_NAMES, p_c=1, d=2, mixed=False)) == 1 + 6 + 15 + 36


def test_names_read_as_formulas():
    names = Library.build(INPUT_NAMES, p_c=2, d=3).names
    assert names[0] == "1"
    assert {"T1(I)*T1(c_e0)", "T1(e)*T2(I)", "tanh(I)", "T1(e)*T1(I)*T1(c_sp)", "T1(I)*sin(c_sn)"} <= set(
        names
    )


def test_bounds_on_order_and_degree_hold():
    library = Library.build(INPUT_NAMES)
    admitted = library.admitted(p_c=2, d=3)
    assert admitted.any()
    assert (library.orders[admitted] <= 2).all()
    assert (library.degrees[admitted] <= 3).all()
    assert not any("(e)" in name for name in np.array(library.names)[library.admitted(5, 5, feedback=False)])


@pytest.mark.parametrize("order", range(1, MAX_ORDER + 1))
def test_polynomials_are_those_of_numpy(order):
    x = np.linspace(-1, 1, 101)
    expected = chebyshev.chebval(x, np.eye(MAX_ORDER + 1)[order])
    np.testing.assert_allclose(values(order, x), expected, atol=1e-14)


@pytest.mark.parametrize("function", range(MAX_ORDER + 1, len(FUNCTIONS)))
def test_functions_are_those_of_numpy_also_in_the_vectorised_form(function):
    x = np.linspace(-1, 1, 1001)
    expected = getattr(np, FUNCTIONS[function])(x)
    np.testing.assert_allclose(values(function, x), expected, rtol=1e-15, atol=1e-16)
    out = np.empty((len(FUNCTIONS), len(x)))
    clipped_values(np.array([function]), x, out)
    np.testing.assert_allclose(out[function], expected, rtol=1e-15, atol=1e-16)


@pytest.mark.parametrize("function", range(len(FUNCTIONS)))
def test_slopes_are_derivatives(function):
    x, h = np.linspace(-0.99, 0.99, 51), 1e-6
    central = (values(function, x + h) - values(function, x - h)) / (2 * h)
    np.testing.assert_allclose(slopes(function, x), central, atol=1e-7)  # round-off over 2 h


@given(st.integers(0, 3), st.integers(1, 4))
def test_evaluation_multiplies_the_factors(p_c, d):
    library = Library.build(("I", "soc"), p_c, d)
    x = np.random.default_rng(1).uniform(-1, 1, (7, 3))
    theta = library.evaluate(x)
    assert theta.shape == (7, len(library))
    for j, term in enumerate(library.terms):
        expected = np.prod([values(f, x[:, v].copy()) for v, f in term.factors] or [np.ones(7)], axis=0)
        np.testing.assert_allclose(theta[:, j], expected, rtol=1e-14)


def test_a_repeated_name_is_refused():
    with pytest.raises(InputError, match="repeat a name"):
        Library.build(("I", "I"))
    with pytest.raises(InputError, match="p_c = 6"):
        Library.build(("I",), p_c=6)


def test_the_hash_of_a_genome_is_that_of_the_terms_it_admits():
    small = Library.build(INPUT_NAMES, p_c=2, d=2)
    whole = Library.build(INPUT_NAMES)
    with_feedback, without = (Genome.whole(whole, 1.0, 1.0, p_c=2, d=2, feedback=f) for f in (True, False))
    assert with_feedback.digest(whole) != without.digest(whole)
    assert with_feedback.digest(whole) == Genome.whole(small, 1.0, 1.0).digest(small)


def test_terms_go_on_along_the_slope_of_each_function():
    library = Library.build(["I"], p_c=3, d=3)
    at = np.array([[1.0, -1.0], [-1.0, 1.0]])
    on, step = np.array([[0.5, 0.0], [0.0, 2.0]]), 1e-6
    gone = evaluate_terms(library.terms, at, on)
    after, before = (evaluate_terms(library.terms, at + sign * step * on) for sign in (1, -1))
    tangent = evaluate_terms(library.terms, at) + (after - before) / (2 * step)
    single = [len(term.factors) < 2 for term in library.terms]
    np.testing.assert_allclose(gone[single], tangent[single], atol=1e-6)
    np.testing.assert_allclose(gone[library.names.index("T1(e)*T1(I)")], (at + on).prod(axis=1))


def test_inputs_that_are_one_text_are_refused():
    with pytest.raises(InputError, match=r"give their names as a list, as in \['c_sp'\]"):
        Library.build("c_sp")


@pytest.mark.parametrize(
    ("shape", "words"), [((4, 2), r"\(4, 2\)"), ((4, 6), r"\(4, 6\)"), ((3,), r"\(3,\)"), ((), r"\(\)")]
)
def test_columns_too_many_were_left_out_without_a_word_and_too_few_ended_in_an_index_error(shape, words):
    library = Library.build(["i", "soc"], p_c=1, d=1)
    with pytest.raises(InputError, match=f"the shape {words}; give .n, 3., a column for each of e, i, soc"):
        library.evaluate(np.zeros(shape))
    assert library.evaluate([[0, 0, 0]]).shape == (1, len(library))


@pytest.mark.parametrize("changes", [{"p_c": "2"}, {"p_c": 1.5}, {"d": None}, {"factors": 2.0}])
def test_an_order_that_is_no_whole_number_ended_in_a_type_error(changes):
    with pytest.raises(InputError, match="is not a whole number; give one"):
        Library.build(["i"], **({"p_c": 2, "d": 2} | changes))


def test_a_library_prints_its_variables_and_not_its_terms():
    assert repr(Library.build(["i", "soc"], p_c=1, d=1)) == "Library(22 terms over e, i, soc)"
