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

Node = Callable[[Array], Array]


@lru_cache(maxsize=256)
def compile_expression(text: str) -> Node:
    """A function of an array from `text`, an expression in `x`.

    Raises CellError naming the text and the part of it that is not admissible.
    """
    if len(text) > MAX_CHARACTERS:
        raise CellError(f"an expression of {len(text)} characters is too long; give a table instead.")
    try:
        tree = ast.parse(text.strip(), mode="eval")
        return _node(tree.body, text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        if isinstance(error, CellError):
            raise
        why = error.msg if isinstance(error, SyntaxError) else error
        raise CellError(f"cannot read the expression {_short(text)!r}: {why}.") from None


def _node(node: ast.expr, text: str) -> Node:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and node.value is not True:
        value = float(node.value)
        return lambda x: np.full_like(x, value)
    if isinstance(node, ast.Name) and node.id == VARIABLE:
        return lambda x: x
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        apply, left, right = OPERATORS[type(node.op)], _node(node.left, text), _node(node.right, text)
        return lambda x: apply(left(x), right(x))
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        apply_one, operand = OPERATORS[type(node.op)], _node(node.operand, text)
        return lambda x: apply_one(operand(x))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        if node.func.id in FUNCTIONS and len(node.args) == 1:
            function, argument = FUNCTIONS[node.func.id], _node(node.args[0], text)
            return lambda x: function(argument(x))
        raise CellError(
            f"{node.func.id!r} cannot be called in the expression {_short(text)!r}; "
            f"admissible, with one argument: {', '.join(sorted(FUNCTIONS))}."
        )
    raise CellError(
        f"{ast.unparse(node)!r} is not admissible in the expression {_short(text)!r}; "
        f"use numbers, {VARIABLE}, + - * / ** and {', '.join(sorted(FUNCTIONS))}."
    )


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
