"""Constitutive relations: values, scaling, and the way into a file."""

import json
import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from aesi.errors import CellError
from aesi.physics.cell.relations import (
    Constant,
    Expression,
    LookupTable,
    Product,
    Scaled,
    Sum,
    hashed_once,
    relation,
    scaled,
    tabulated,
    to_bpx,
    value_at,
)
from aesi.physics.espm.tables import electrolyte_diffusion, ocp_table, solid_diffusion

X = np.linspace(0.0, 1.0, 7)
TABLE = LookupTable((0.0, 0.5, 1.0), (1.0, 3.0, 2.0))


def test_a_table_is_straight_between_its_points_and_constant_beyond():
    assert TABLE(np.array([-1.0, 0.25, 0.75, 2.0])) == pytest.approx([1.0, 2.0, 2.5, 2.0])


def test_sums_products_and_factors():
    mix = Sum(Scaled(TABLE, 2.0), Product(Constant(3.0), Expression("1 + 2 * x ** 2")))
    assert mix(X) == pytest.approx(2.0 * TABLE(X) + 3.0 * (1.0 + 2.0 * X**2))
    assert tabulated(mix, 0.0, 1.0, 7) == pytest.approx(mix(X))


@pytest.mark.parametrize(
    "item",
    [
        Constant(3.0),
        TABLE,
        Expression("2"),
        Expression("tanh(3 * x) - exp(-x ** 2.5) / (x - 0.5) + log(x)"),  # poles, as potentials have
        Sum(Scaled(TABLE, 2.0), Product(Constant(3.0), Expression("sqrt(x) * 10 ** x"))),
    ],
)
def test_a_value_is_to_the_last_digit_that_of_an_array(item):
    # A root that moves by round-off moves the slopes of a fit by a million times as much of them.
    each = [value_at(item, float(x)) for x in X]
    assert np.array_equal(each, [item(np.array([x]))[0] for x in X], equal_nan=True)


class Text(str):
    """A word that counts how often its hash is asked for."""

    asked = 0

    def __hash__(self):
        Text.asked += 1
        return super().__hash__()


@hashed_once
@dataclass(frozen=True)
class Held:
    word: str


def test_a_hash_is_worked_out_once_and_by_value():
    one = Held(Text("x"))
    assert hash(one) == hash(one) == hash(Held("x"))
    assert Text.asked == 1
    assert {one: 1}[Held("x")] == 1
    assert hash(one) != hash(Held("y"))


def test_a_pickle_holds_no_hash_since_words_have_another_one_in_each_process():
    hash(TABLE)
    there = pickle.loads(pickle.dumps(TABLE))
    assert set(vars(there)) <= {"x", "y", "_points"}
    assert there == TABLE
    assert hash(there) == hash(TABLE)


def test_a_factor_of_one_changes_nothing_and_factors_join():
    assert scaled(TABLE, 1.0) is TABLE
    assert scaled(Constant(2.0), 3.0) == Constant(6.0)
    assert scaled(scaled(TABLE, 2.0), 3.0) == Scaled(TABLE, 6.0)


@pytest.mark.parametrize(
    "item",
    [
        Constant(2.0),
        Expression("exp(x) - 2"),
        TABLE,
        Scaled(Expression("x ** 2"), 0.3),
        Sum(Expression("x"), Scaled(Constant(0.1), -2.0)),
        Scaled(Expression("x ** 2"), np.float64(0.3)),
        Product(Expression("x"), TABLE),
    ],
)
def test_what_a_file_holds_reads_back_as_the_same_function(item):
    back = relation(to_bpx(item), "test")
    assert back(X) == pytest.approx(item(X), abs=1e-6)  # mixtures with tables become tables


def test_what_effects_add_to_a_potential_with_a_pole_was_written_as_infinite():
    mixed = Sum(Expression("3.6 - x + 0.002 * log((1 - x) / x)"), LookupTable((0.1234, 0.7), (0.0, 0.01)))
    held = json.loads(json.dumps(to_bpx(mixed), allow_nan=False))
    assert np.array_equal(ocp_table(relation(held, "OCP"), "positive"), ocp_table(mixed, "positive"))


def test_sums_of_tables_are_written_by_their_own_points():
    mixed = Sum(TABLE, Scaled(LookupTable((0.123, 0.7), (0.0, 1.0)), 2.0))
    assert to_bpx(mixed)["x"] == [0.0, 0.123, 0.5, 0.7, 1.0]
    fine = np.linspace(-0.1, 1.1, 1001)
    assert relation(to_bpx(mixed), "OCP")(fine) == pytest.approx(mixed(fine), abs=1e-15)


def test_a_mixture_that_is_not_finite_inside_is_refused_in_one_sentence():
    with pytest.raises(CellError, match="not finite at 0, between -1 and 1"):
        to_bpx(Sum(Expression("log(x ** 2)"), TABLE), -1.0, 1.0)


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ({"x": [0, 1], "y": [1, "a"]}, "y of a table holds 'a', which is not a number"),
        ({"x": [0, 1], "y": [None, 1]}, "y of a table holds None, which is not a number"),
        ({"x": [0, True], "y": [0, 1]}, "x of a table holds True, which is not a number"),
        ({"x": 0, "y": 1}, "x of a table is 0, and has to be a list of numbers"),
        ({"x": "01", "y": [0, 1]}, "x of a table is '01', and has to be a list of numbers"),
        ({"x": [0, float("inf")], "y": [0, 1]}, "x of a table is inf in row 2, counted from 1; give finite"),
        ({"x": [0, 1], "y": [float("nan"), 1]}, "y of a table is nan in row 1, counted from 1; give finite"),
        (
            {"x": [0, 0.5, 0.5, 1], "y": [4, 3, 2, 1]},
            "x of a table does not rise to 0.5 in row 3, counted from 1",
        ),
        (
            {"x": [1, 0], "y": [4, 3]},
            "x of a table does not rise to 0 in row 2, counted from 1; sort its rows",
        ),
    ],
)
def test_a_table_of_what_is_no_number_was_an_error_of_python(table, told):
    with pytest.raises(CellError, match=f"Diffusivity: .*{told}"):
        relation(table, "Diffusivity")


def test_a_diffusivity_without_a_value_at_half_filling_was_told_as_that_of_anything():
    with pytest.raises(
        CellError, match=r"the diffusivity of an electrode is -1e-14 m2/s at a stoichiometry of 0\.5;"
    ):
        solid_diffusion(Expression("1e-14 - 4e-14 * x"))
    with pytest.raises(
        CellError, match="the electrolyte's diffusivity is -1e-10 m2/s at 1000 mol/m3; it has to be"
    ):
        electrolyte_diffusion(Expression("-1e-13 * x"), 1000.0)


@pytest.mark.parametrize("bad", [None, True, [1, 2], {"x": [0, 1]}, {"x": [1, 0], "y": [0, 1]}, "x +"])
def test_what_is_no_relation_is_named(bad):
    with pytest.raises(CellError, match="Diffusivity"):
        relation(bad, "Diffusivity")
