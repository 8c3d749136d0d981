"""Functions of one variable written as text, as BPX files carry them: parsed, never executed.

The text is read by Python's own grammar into a tree, every node is checked against a short list, and the
tree is turned into numpy calls. A name, an attribute, a call or an operator outside the list is refused.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from aesi.errors import CellError
from aesi.numerics.typing import Array

VARIABLE = "x"
FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    name: getattr(np, name)
    for name in ("exp", "tanh", "cosh", "sinh", "sin", "cos", "tan", "sqrt", "log", "log10", "abs")
}
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: np.power,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
MAX_CHARACTERS = 20_000
"""Of one expression: far more than any published potential takes."""

Function = Callable[[Array], Array]
Operand = np.float64 | Callable[[Array], Any]
"""Of an expression: a function of the variable, or a number where that does not occur. Numbers are worked out when the
text is read, and not at each of the thousand calls of a fit."""


@lru_cache(maxsize=256)
def compile_expression(text: str) -> Function:
    """A function of an array from `text`, an expression in `x`.

    Raises CellError naming the text and the part of it that is not admissible.
    """
    if len(text) > MAX_CHARACTERS:
        raise CellError(f"an expression of {len(text)} characters is too long; give a table instead.")
    try:
        part = _part(ast.parse(text.strip(), mode="eval").body, text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, CellError):
            raise
        why = error.msg if isinstance(error, SyntaxError) else error
        raise CellError(f"cannot read the expression {_short(text)!r}: {why}.") from None
    if isinstance(part, np.float64):
        return lambda x: np.full(np.shape(x), part)
    return part


def _part(node: ast.expr, text: str) -> Operand:
    value = node.value if isinstance(node, ast.Constant) else None
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return np.float64(value)
        except OverflowError:
            raise CellError(
                f"the expression {_short(text)!r} holds a whole number of more than 308 digits; correct it."
            ) from None
    if isinstance(node, ast.Name) and node.id == VARIABLE:
        return lambda x: x
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return _of_two(OPERATORS[type(node.op)], _part(node.left, text), _part(node.right, text))
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        return _of_one(OPERATORS[type(node.op)], _part(node.operand, text))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id in FUNCTIONS and len(node.args) == 1:
            return _of_one(FUNCTIONS[node.func.id], _part(node.args[0], text))
        raise CellError(
            f"{node.func.id!r} cannot be called in the expression {_short(text)!r}; "
            f"admissible, with one argument: {', '.join(sorted(FUNCTIONS))}."
        )
    raise CellError(
        f"{ast.unparse(node)!r} is not admissible in the expression {_short(text)!r}; "
        f"use numbers, {VARIABLE}, + - * / ** and {', '.join(sorted(FUNCTIONS))}."
    )


def _of_one(apply: Callable[[Any], Any], argument: Operand) -> Operand:
    if isinstance(argument, np.float64):
        return _number(apply, argument)
    return lambda x: apply(argument(x))


def _of_two(apply: Callable[[Any, Any], Any], left: Operand, right: Operand) -> Operand:
    if isinstance(left, np.float64):
        return (
            _number(apply, left, right) if isinstance(right, np.float64) else lambda x: apply(left, right(x))
        )
    if isinstance(right, np.float64):
        return lambda x: apply(left(x), right)
    return lambda x: apply(left(x), right(x))


def _number(apply: Callable[..., Any], *numbers: np.float64) -> np.float64:
    """What is not finite is told where the expression is used."""
    with np.errstate(all="ignore"):
        return np.float64(apply(*numbers))


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
