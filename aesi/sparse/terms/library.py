"""The library of candidate terms: products of functions of the scaled error and inputs.

For variables e, U_1, ..., U_m the complete library holds

- the constant;
- Chebyshev polynomials of one variable, T_i(x), i <= p_c;
- their products over two or three different variables, with i + j + k <= d;
- sin, cos, tan, sinh, cosh and tanh of one variable;
- each of these times T_1 of another variable (`mixed`).

The paper counts 626 terms for six variables and does not list them. With p_c = d = 5 this reading has
1 + 30 + 150 + 200 polynomial terms, 36 functions and 180 mixed terms: 597. With p_c = 1, d = 2 and no mixed
terms it has 58, the size at which the paper's search ended.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, permutations, product

import numpy as np

from aesi.errors import InputError, in_words
from aesi.numerics.files.restored import saved_count
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records.checked import numbers
from aesi.sparse.terms.basis import FUNCTIONS, MAX_ORDER, SPECIAL, slopes, values

ERROR = "e"
"""The name of the first variable, the voltage error fed back."""

Factor = tuple[int, int]
"""Number of the variable, number of the function."""


@dataclass(frozen=True)
class Term:
    """A product of functions, at most one a variable; no factor at all is the constant."""

    factors: tuple[Factor, ...] = ()

    def name(self, variables: Sequence[str]) -> str:
        """Readable name, such as `T1(I)*T1(c_e0)`."""
        return "*".join(f"{FUNCTIONS[f]}({variables[v]})" for v, f in self.factors) or "1"

    @property
    def order(self) -> int:
        """The highest Chebyshev order among the factors; 0 where there is none."""
        return max((f for _, f in self.factors if f <= MAX_ORDER), default=0)

    @property
    def degree(self) -> int:
        """Sum of the Chebyshev orders; any other function counts as one."""
        return sum(f if f <= MAX_ORDER else 1 for _, f in self.factors)

    @property
    def feedback(self) -> int:
        """The function of the fed-back error among the factors, 0 for none."""
        return next((f for v, f in self.factors if v == 0), 0)

    def without_error(self) -> Term:
        """The term without its factor in the error: it depends on the inputs alone."""
        return Term(tuple(factor for factor in self.factors if factor[0] != 0))


@dataclass(frozen=True)
class Library:
    """An ordered list of terms over named variables, the error first."""

    variables: tuple[str, ...]
    terms: tuple[Term, ...]

    @classmethod
    def build(
        cls,
        inputs: Sequence[str],
        p_c: int = MAX_ORDER,
        d: int = MAX_ORDER,
        factors: int = 3,
        special: bool = True,
        mixed: bool = True,
    ) -> Library:
        """All terms over the error and the named inputs.

        p_c : highest order of a polynomial, 0 to 5.  d : highest total degree.  factors : most variables in a
        product.  special : with trigonometric and hyperbolic functions.  mixed : and their products with T1.
        Raises InputError for an order or a degree that there is none of or that is no whole number, and for inputs that
        are no list of different names other than `e`.
        """
        for name, value in (("p_c", p_c), ("d", d), ("factors", factors)):
            if not isinstance(value, int | np.integer):
                raise InputError(f"{name} = {in_words(value)} is not a whole number; give one.")
        if not 0 <= p_c <= MAX_ORDER or d < 0:
            raise InputError(f"p_c = {p_c} must lie in 0 to {MAX_ORDER}, and d = {d} must not be negative.")
        if isinstance(inputs, str):
            raise InputError(
                f"the inputs are the text {inputs!r}; give their names as a list, as in [{inputs!r}]."
            )
        names = (ERROR, *inputs)
        if len(set(names)) != len(names):
            raise InputError(f"the inputs {', '.join(inputs)} repeat a name, or use {ERROR!r} itself.")
        every = [Term(), *_polynomials(len(names), p_c, d, factors)]
        if special:
            every += [Term(((v, f),)) for v in range(len(names)) for f in SPECIAL]
        if special and mixed and p_c >= 1 and d >= 2 and factors >= 2:
            every += [
                Term(tuple(sorted([(v, f), (w, 1)])))
                for v, w in permutations(range(len(names)), 2)
                for f in SPECIAL
            ]
        return cls(names, tuple(every))

    @classmethod
    def of_saved(cls, variables: Sequence[str], terms: Iterable[Iterable[Factor]]) -> Library:
        """The library of a saved model: names of the variables, the error first, and the factors of each term.

        Raises ValueError for other names, no term, and a factor of no variable or no function.
        """
        names = tuple(variables)
        if names[:1] != (ERROR,) or not all(isinstance(name, str) for name in names):
            raise ValueError(f"the variables {variables!r} are no names, {ERROR!r} first")
        factors = [
            tuple((saved_count(v, "a variable", 0), saved_count(f, "a function", 0)) for v, f in term)
            for term in terms
        ]
        if not factors:
            raise ValueError("it has no terms")
        for term in factors:
            held = [v for v, _ in term]
            if len(set(held)) < len(held) or any(v >= len(names) or f >= len(FUNCTIONS) for v, f in term):
                raise ValueError(
                    f"the term {term} is no product of functions of the variables {', '.join(names)}"
                )
        return cls(names, tuple(Term(term) for term in factors))

    def __len__(self) -> int:
        return len(self.terms)

    def __repr__(self) -> str:
        return f"Library({len(self)} terms over {', '.join(self.variables)})"

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Readable names, one a term."""
        return tuple(term.name(self.variables) for term in self.terms)

    @cached_property
    def orders(self) -> IntArray:
        """(m,) highest Chebyshev order of each term."""
        return np.array([term.order for term in self.terms])

    @cached_property
    def degrees(self) -> IntArray:
        """(m,) total degree of each term."""
        return np.array([term.degree for term in self.terms])

    @cached_property
    def feedbacks(self) -> IntArray:
        """(m,) the function of the error in each term, 0 for none."""
        return np.array([term.feedback for term in self.terms])

    @cached_property
    def input_products(self) -> tuple[tuple[Term, ...], IntArray]:
        """The distinct parts without the error, and (m,) which of them each term has."""
        numbers: dict[Term, int] = {}
        which = [numbers.setdefault(term.without_error(), len(numbers)) for term in self.terms]
        return tuple(numbers), np.array(which)

    def admitted(self, p_c: int, d: int, feedback: bool = True) -> BoolArray:
        """(m,) the terms within order p_c and total degree d; without `feedback`, those free of the error."""
        within = (self.orders <= p_c) & (self.degrees <= d)
        return within if feedback else within & (self.feedbacks == 0)

    def take(self, which: Iterable[int]) -> Library:
        """The library of the given terms."""
        return Library(self.variables, tuple(self.terms[int(j)] for j in which))

    def evaluate(self, scaled: Array) -> Array:
        """Every term along scaled data.

        scaled : (n, 1 + n_inputs), the error first.  Returns (n, m), stored by columns.
        Raises InputError for another shape, and for what are no numbers.
        """
        rows = numbers(scaled, "scaled")
        if rows.ndim != 2 or rows.shape[1] != len(self.variables):
            raise InputError(
                f"scaled has the shape {rows.shape}; give (n, {len(self.variables)}), a column for each of "
                f"{', '.join(self.variables)}."
            )
        return evaluate_terms(self.terms, rows).T


def evaluate_terms(terms: Sequence[Term], scaled: Array, overshoot: Array | None = None) -> Array:
    """(m, n): each term along scaled data (n, n_variables); each single function is computed once.

    overshoot : (n, n_variables), distance by which each function is extrapolated from there along its slope.
    """
    series = np.ascontiguousarray(np.asarray(scaled, dtype=float).T)
    known: dict[Factor, Array] = {}
    out = np.empty((len(terms), series.shape[1]))
    for row, term in zip(out, terms, strict=True):
        row[:] = 1.0
        for factor in term.factors:
            if factor not in known:
                variable, function = factor
                known[factor] = values(function, series[variable])
                if overshoot is not None:
                    known[factor] += slopes(function, series[variable]) * overshoot[:, variable]
            row *= known[factor]
    return out


def _polynomials(n_variables: int, p_c: int, d: int, factors: int) -> list[Term]:
    """The products of Chebyshev polynomials of up to `factors` different variables, of order 1 to p_c each and of total
    degree d at most."""
    return [
        Term(tuple(zip(which, orders, strict=True)))
        for size in range(1, factors + 1)
        for which in combinations(range(n_variables), size)
        for orders in product(range(1, p_c + 1), repeat=size)
        if sum(orders) <= d
    ]
