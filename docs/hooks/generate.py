"""Pages made at build time: effects, benchmarks, commands, keys of experiments, and files of the repository."""

from __future__ import annotations

import re
import sys
import textwrap
from collections.abc import Callable
from functools import partial
from pathlib import Path
from runpy import run_path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:  # mkdocs imports a hook by its path
    sys.path.insert(0, str(ROOT))

KINDS = {
    "physics": "Physics the model lacks",
    "parameter": "Parameters that may be declared wrongly",
    "instrument": "Instrument faults that imitate physics",
    "numerics": "Numerics of the declared model",
}

BENCH = re.compile(r"<!-- generated: bench (?P<name>\w+) -->")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace `<!-- generated: name -->` by what the generator of that name writes; `bench NAME` is a table of it."""
    for name, write in GENERATORS.items():
        marker = f"<!-- generated: {name} -->"
        if marker in markdown:
            markdown = markdown.replace(marker, write())
    return BENCH.sub(lambda found: recorded(found["name"]), markdown)


def catalogue() -> str:
    """Every effect of the catalogue, by kind: all in short, then each by itself."""
    from aesi.physics.effects import CATALOGUE

    kinds = {title: [e for e in CATALOGUE.values() if e.kind_told == kind] for kind, title in KINDS.items()}
    parts = ["| effect | what it is |", "|---|---|"]
    for title, effects in kinds.items():
        parts += [f"| **{title}** | |", *(f"| [{e.id}](#{e.id}) | {e.summary} |" for e in effects)]
    for title, effects in kinds.items():
        parts += [f"\n## {title}\n", *(_effect(effect) for effect in effects)]
    return "\n".join(parts)


def _effect(effect: Any) -> str:
    lines = [
        f"### {effect.id}\n",
        f"{effect.summary}.\n",
        "```{ .text .no-copy }",  # the button would lie over the end of a line
        textwrap.dedent(effect.equation),
        "```\n",
    ]
    if effect.validity:
        lines.append(f"{effect.validity}\n")
    if effect.source:
        lines.append(f"Source: {effect.source}\n")
    if effect.parameters:
        lines += [
            "| parameter | unit | typical | range | meaning |",
            "|---|---|---:|---:|---|",
            *(_parameter(name, parameter) for name, parameter in effect.parameters.items()),
            "",
        ]
    return "\n".join(lines)


def _parameter(name: str, parameter: Any) -> str:
    low, high = parameter.bounds
    scale = " (log)" if parameter.log else ""
    about = [parameter.description] if parameter.description else []
    if parameter.neutral is not None:
        about.append(f"without effect at {parameter.neutral:g}")
    about.append(f"range: {parameter.source}")
    limits = f"{low:g} to {high:g}{scale}"
    cells = (f"`{name}`", parameter.unit, f"{parameter.default:g}", limits, "; ".join(about))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def recorded(bench: str) -> str:
    """What docs/benchmarks.json holds of a benchmark, as tables."""
    return str(_hook("recorded")["table_of"](bench, _history()))


def over_time() -> str:
    """How watched figures of docs/benchmarks.json moved."""
    return str(_hook("recorded")["over_time"](_history()))


def beside_peers(subject: str) -> str:
    """How fast a part of the package is beside its peers, or what a run costs, from the newest recorded lines.

    subject : name of a function in `parts/speed.py`.
    """
    from flows.benchmarks.history import latest

    return str(_hook("speed")[subject]([line for _, line in latest(_history()).values()]))


def dfn_curve() -> str:
    """Error against time of the porous electrode, from the newest recorded lines."""
    from flows.benchmarks.history import latest

    lines = [line for _, line in latest(_history()).values() if line["bench"] == "dfn" and "who" in line]
    return str(_hook("curve")["curve"](lines))


def bands() -> str:
    """The free-run bands of virtual cells in short, from the newest recorded lines."""
    return str(_hook("recorded")["bands"](_history()))


def experiment() -> str:
    """Every key of an experiment file, a table a section."""
    from aesi.conformal import COMPARED, METHODS
    from aesi.pipeline.experiment.config import ExperimentConfig, model_names

    choices = {"models": model_names(), "conformal.method": METHODS, "conformal.compare": COMPARED}
    return str(_hook("experiment")["tables"](ExperimentConfig, choices))


def _hook(name: str) -> dict[str, Any]:
    """What a file of `parts/` defines: mkdocs imports a hook by its path, without a package."""
    return run_path(str(Path(__file__).with_name("parts") / f"{name}.py"))


def _history() -> list[Any]:
    from flows.benchmarks.history import read_history

    by_one_less = _hook("recorded")["by_one_less"]
    return [by_one_less(entry) for entry in read_history(ROOT / "docs" / "benchmarks.json")]


def command_line() -> str:
    """`--help` of every command."""
    from typer.main import get_command

    from flows.cli import app

    root: Any = get_command(app)
    parts = []
    for name, command in _commands(root, "aesi"):
        context = command.make_context(name, [], resilient_parsing=True)
        parts += [f"## {name}\n", "```text", command.get_help(context), "```\n"]
    return "\n".join(parts)


def _commands(group: Any, prefix: str) -> list[tuple[str, Any]]:
    found = []
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            found += _commands(command, f"{prefix} {name}")
        else:
            found.append((f"{prefix} {name}", command))
    return found


def opening() -> str:
    """The questions, terms and first picture of README.md, which begin the first page of the site as well."""
    return (
        _from_root("README.md").split("<!-- opening -->")[1].split("<!-- end of the opening -->")[0].strip()
    )


def contributing() -> str:
    """CONTRIBUTING.md of the repository, with its links as the site has them."""
    return _from_root("CONTRIBUTING.md")


def changelog() -> str:
    """CHANGELOG.md of the repository."""
    return _from_root("CHANGELOG.md")


def _from_root(name: str) -> str:
    text = (ROOT / name).read_text(encoding="utf-8")
    return text.replace("](docs/", "](").replace("](CHANGELOG.md)", "](changelog.md)")


GENERATORS: dict[str, Callable[[], str]] = {
    "catalogue": catalogue,
    "over time": over_time,
    "speed of the physics": partial(beside_peers, "physics"),
    "speed of the intervals": partial(beside_peers, "intervals"),
    "speed of the search": partial(beside_peers, "search"),
    "costs of a run": partial(beside_peers, "costs"),
    "dfn curve": dfn_curve,
    "bands in short": bands,
    "experiment": experiment,
    "command line": command_line,
    "opening": opening,
    "contributing": contributing,
    "changelog": changelog,
}
