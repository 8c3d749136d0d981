"""Numbers that decide: each says what it is and on what it rests, by itself or together with its neighbours."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def numeric(node: ast.expr | None) -> bool:
    """A number, or a row of numbers; not what is computed, and not what a record explains field by field."""
    match node:
        case ast.Constant(value=bool()):
            return False
        case ast.Constant(value=int() | float()):
            return True
        case ast.UnaryOp(operand=inner):
            return numeric(inner)
        case ast.BinOp(left=left, right=right):
            return numeric(left) and numeric(right)
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            return bool(parts) and all(numeric(part) for part in parts)
    return False


def constants(module: ast.Module) -> list[tuple[int, str, bool]]:
    """Place in the body, name, and whether a docstring follows, of each number at the top of a module; of several
    in one line the names together."""
    found = []
    for place, node in enumerate(module.body):
        match node:
            case (
                ast.Assign(targets=[ast.Name() | ast.Tuple() as target], value=value)
                | ast.AnnAssign(target=ast.Name() as target, value=value)
            ):
                name = ast.unparse(target).strip("()")
                if name.isupper() and numeric(value):
                    after = module.body[place + 1] if place + 1 < len(module.body) else None
                    found.append((place, name, text_of(after) != ""))
    return found


def text_of(node: ast.stmt | None) -> str:
    match node:
        case ast.Expr(value=ast.Constant(value=str() as text)):
            return text
    return ""


def unexplained(source: str) -> Iterator[str]:
    """Numbers without a docstring, that no docstring of the module names, and no commented line defines.

    A number that stands right above an explained one shares its docstring.
    """
    module, lines = ast.parse(source), source.splitlines()
    texts = " ".join(text_of(node) for node in ast.walk(module) if isinstance(node, ast.Expr))
    explained: dict[int, bool] = {}
    for place, name, has_text in reversed(constants(module)):
        node = module.body[place]
        commented = "#" in lines[node.end_lineno - 1] or lines[node.lineno - 2].startswith("#")
        shared = explained.get(place + 1, False)
        explained[place] = has_text or shared
        named = all(re.search(rf"\b_?{each.strip('_ ')}\b", texts) for each in name.split(","))
        if not (explained[place] or commented or named):
            yield name


MOST_SHARING = 5
"""Numbers that one docstring explains together: of ten in a row nobody could tell which it was about."""


def crowded(source: str) -> Iterator[str]:
    """The last of numbers in a row that share one docstring and are too many."""
    found = {place: (name, has_text) for place, name, has_text in constants(ast.parse(source))}
    sharing: dict[int, int] = {}
    for place, (name, has_text) in found.items():
        above = sharing.get(place - 1, 0)
        sharing[place] = above + len(name.split(","))
        if has_text:
            if sharing[place] > MOST_SHARING and above:
                yield name
            sharing[place] = 0


def test_every_number_that_decides_says_what_it_rests_on():
    silent = {
        path.relative_to(ROOT).as_posix(): names
        for path in sorted((ROOT / "aesi").rglob("*.py"))
        if (names := sorted(unexplained(path.read_text(encoding="utf-8"))))
    }
    assert silent == {}, "say below each what it is, and what measured it or that it is a convention"


def test_a_silent_number_would_be_seen():
    source = (
        'A = 1.0\nB = 2\n"""What both are."""\n\nC = (3, 4)\nD = 5  # of a day\n\nE = "text"\nF = -1e-3\n'
    )
    assert sorted(unexplained(source)) == ["C", "F"]
    assert list(unexplained(source + '"""Ten times less than C."""\n')) == []
    assert list(unexplained("G, H = 1.0, 2.0\nI = 'text'\n")) == ["G, H"]
    assert list(unexplained('"""What the LIMITS are."""\nJ = 1\n\nLIMIT = 2\n')) == ["LIMIT", "J"]
    assert list(unexplained('G, H = 1.0, 2.0\n"""What both are."""\n')) == []


def test_ten_limits_of_a_cell_shared_one_docstring():
    crowds = {
        path.relative_to(ROOT).as_posix(): names
        for path in sorted((ROOT / "aesi").rglob("*.py"))
        if (names := list(crowded(path.read_text(encoding="utf-8"))))
    }
    assert crowds == {}, "one number a line, each with its unit and why"
    assert list(crowded('A, B = 1, 2\nC = 3\nD, E, F = 4, 5, 6\n"""Of all."""\n')) == ["D, E, F"]
