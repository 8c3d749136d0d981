"""One offline page over several runs: what came of them, what differs in their settings, and where the error is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from aesi.advice import listed
from aesi.constants import MV_PER_V
from aesi.over_time import range_words
from aesi.pipeline.report.page import beside, write_plain_page
from aesi.pipeline.report.table_formats import ABSENT
from aesi.pipeline.written import COMPARISON_MARK
from aesi.sparse.search.genome import GENE_WORDS

FREE_RUN_MV, FREE_RUN_MSER = "free_run/test_rmse_mv", "free_run/test_mser_pct"
COLUMNS = {
    FREE_RUN_MV: "RMSE, free run, mV",
    FREE_RUN_MSER: "MSER, free run, %",
    "free_run/test_mser_recalibrated_pct": "against recalibrated, %",
    "one_step/test_rmse_mv": "RMSE, one step, mV",
    "one_step/persistence_rmse_mv": "persistence, one step, mV",
    "intervals/coverage_pct": "coverage, one step, %",
    "intervals/worst_bin_coverage_pct": "worst bin, %",
    "intervals/average_width_v": "width, one step, mV",
    "tables/free_run_intervals/coverage_pct": "coverage, free run, %",
    "terms": "terms",
    "before/test_rmse_mv": "as declared, test, mV",
    "recalibrated/test_rmse_mv": "recalibrated, test, mV",
    "after/test_rmse_mv": "as written, test, mV",
    "confidence": "confidence",
    "fit_and_evaluation_s": "fit and evaluation, s",
    "seconds": "time, s",
}
"""MLflow's name of a metric -> heading; a column is shown where a run has it, in mV where it is tracked in V."""
MACHINE = "system/"
"""Beginning of MLflow's names for what the machine did meanwhile."""
MSER = "MSER: by how much it lowers the mean squared error of the declared model, and of that model recalibrated."
RANGES = (
    "Ranges below a figure: 90 % over resampled eighths of the test records; they say how much the test itself "
    "scatters, not how much another seed would."
)
JOB_WORDS = {
    "experiment": ("run", "runs"),
    "discovery": ("discovery", "discoveries"),
    "batch": ("batch", "batches"),
    "benchmark": ("benchmark", "benchmarks"),
}
"""Kind of a tracked run -> what one is called, and what several are, in the order of the page."""
EMPTY = ("{}", "null")
"""What is tracked of a setting that is a mapping, where it holds nothing."""
MOST_COLUMNS = 40
"""Most runs that are shown side by side; more are summed up in one column."""


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """One tracked run.

    settings : dotted key -> text.  metrics : by MLflow's names.  chosen : the model that a search ended with.
    judged_on : the same text for runs whose errors are of the same test records at the same step.  job : see JOB_WORDS.
    finished : whether it ran to its end.
    comparison : see `aesi.pipeline.experiment.comparison`.  discovery : content of discovery.json.  away : where these
    two lie and what to do, if they are out of reach.
    """

    run_id: str
    name: str
    experiment: str
    started: str
    settings: Mapping[str, str]
    metrics: Mapping[str, float]
    chosen: str = ""
    judged_on: str = ""
    comparison: Mapping[str, Any] = field(default_factory=dict)
    discovery: Mapping[str, Any] = field(default_factory=dict)
    job: str = "experiment"
    finished: bool = True
    away: str = ""

    @property
    def label(self) -> str:
        """A name a person can tell from the others."""
        return f"{self.name} ({self.run_id[:8]})"


@dataclass(frozen=True)
class ComparedCell:
    """A cell of a table: its text, what it sorts by (None: the text), and the range below it."""

    text: str
    sort: float | None = None
    range: str = ""


@dataclass(frozen=True)
class PageTable:
    """A table of the page."""

    key: str
    title: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[ComparedCell, ...], ...]


def write_comparison(path: Path, runs: Sequence[ComparedRun]) -> Path:
    """Write the page, with tables of their own for each kind of run; runs of a kind keep their order."""
    maps = [
        (f"{run.label}: {model}", content)
        for run in runs
        for model, content in run.comparison.get("maps", {}).items()
    ]
    limit = _limit([content["mean_mv"] for _, content in maps])
    return write_plain_page(
        path,
        "compare.html",
        mark=COMPARISON_MARK,
        payload={"limit": limit, "maps": [content["mean_mv"] for _, content in maps]},
        compare_js=beside("compare.js"),
        title=f"{counted_jobs(runs)} compared",
        heading=_finding(runs),
        what=counted_jobs(runs),
        experiments=list(dict.fromkeys(run.experiment for run in runs)),
        tables=_tables(runs),
        maps=[{"label": label, "range": _range_of(content)} for label, content in maps],
        limit_mv=limit,
    )


def counted_jobs(runs: Sequence[ComparedRun]) -> str:
    """How many there are of each kind, such as `3 runs, 1 discovery`."""
    kinds = _by_job(runs)
    return ", ".join(f"{len(alike)} {_called(job, len(alike))}" for job, alike in kinds.items())


def _by_job(runs: Sequence[ComparedRun]) -> dict[str, list[ComparedRun]]:
    """Kind -> its runs, of the kinds that there are."""
    kinds: dict[str, list[ComparedRun]] = {job: [] for job in JOB_WORDS}
    for run in runs:
        kinds.setdefault(run.job, []).append(run)
    return {job: alike for job, alike in kinds.items() if alike}


def _called(job: str, count: int) -> str:
    """What so many runs of a kind are called; a kind of a later version goes by its own name."""
    one, several = JOB_WORDS.get(job, (job, job))
    return one if count == 1 else several


def _tables(runs: Sequence[ComparedRun]) -> list[PageTable]:
    """The tables of each kind of run, as the kinds differ in settings and figures; of several kinds the titles say
    which.
    """
    kinds = _by_job(runs)
    tables = []
    for job, alike in kinds.items():
        of_kind = [table for make in TABLES if (table := make(alike)) is not None]
        if len(kinds) > 1:
            of_kind = [
                replace(table, key=f"{job}-{table.key}", title=f"{table.title}: {_called(job, 2)}")
                for table in of_kind
            ]
        tables += of_kind
    return tables


def setting_keys(settings: Sequence[Mapping[str, str]]) -> list[str]:
    """Keys of the settings of runs, in the order of the first. A mapping that some of them leave empty and others fill
    is there by its entries alone."""
    keys = dict.fromkeys(key for each in settings for key in each)
    filled = {key[:end] for key in keys for end, letter in enumerate(key) if letter == "."}
    return [
        key
        for key in keys
        if key not in filled or any(each.get(key, EMPTY[0]) not in EMPTY for each in settings)
    ]


def differing_keys(settings: Sequence[Mapping[str, str]]) -> list[str]:
    """Those of `setting_keys` that do not hold the same in all runs."""
    return [key for key in setting_keys(settings) if len({each.get(key) for each in settings}) > 1]


def differing_settings(runs: Sequence[ComparedRun]) -> list[str]:
    """`differing_keys` of the runs."""
    return differing_keys([run.settings for run in runs])


def _finding(runs: Sequence[ComparedRun]) -> str:
    """A sentence on the runs: which errs least in free run, whether a correction helped, the verdicts, and what is not
    finished or out of reach."""
    sentences = (
        _least(runs),
        _worse_than_declared(runs),
        _verdict_counts(runs),
        _unfinished(runs),
        *out_of_reach(runs),
    )
    return " ".join(filter(None, sentences)) or f"{counted_jobs(runs)} compared."


def _least(runs: Sequence[ComparedRun]) -> str:
    """A sentence on the run that errs least, or on why none does: the runs were judged on different records, or the
    figures as shown do not tell it from the next."""
    if not _judged_alike(runs):
        count = sum(FREE_RUN_MV in run.metrics for run in runs)
        return (
            f"The {count} runs were not judged on the same test records at the same step, so that their errors do not "
            "compare."
        )
    known = sorted((run.metrics[FREE_RUN_MV], run.label) for run in runs if FREE_RUN_MV in run.metrics)
    if len(known) < 2:
        return ""
    (least, next_one, *_), most = [_text(value) for value, _ in known], _text(known[-1][0])
    if least == next_one:
        errors = " to ".join(dict.fromkeys((least, most)))
        return f"The {len(known)} runs err by {errors} mV RMSE in free run on test records."
    rest = "the other" if len(known) == 2 else f"the other {len(known) - 1}"
    errors = " to ".join(dict.fromkeys((next_one, most)))
    return f"{known[0][1]} errs least in free run on test records: {least} mV RMSE, {rest} by {errors} mV."


def _worse_than_declared(runs: Sequence[ComparedRun]) -> str:
    """A sentence on how many corrections err by more than the declared model in free run; '' if none does."""
    known = [(run.metrics[FREE_RUN_MSER], run.label) for run in runs if FREE_RUN_MSER in run.metrics]
    worse = sum(value < 0.0 for value, _ in known)
    if not worse:
        return ""
    all_of_them = known[0][1] if worse == 1 else "All"
    who = all_of_them if worse == len(known) else f"{worse} of {len(known)}"
    where = "" if _judged_alike(runs) else f" on {'its' if worse == 1 else 'their'} own test records"
    return f"{who} err{'s' if worse == 1 else ''} by more than the declared model alone{where}."


def _judged_alike(runs: Sequence[ComparedRun]) -> bool:
    """Whether the errors of those that have one are of the same test records at the same step."""
    return len({run.judged_on for run in runs if FREE_RUN_MV in run.metrics}) < 2


def _verdict_counts(runs: Sequence[ComparedRun]) -> str:
    """A sentence on the verdicts of the discoveries among the runs; '' without one."""
    verdicts = Counter(str(run.discovery["verdict"]) for run in runs if run.discovery)
    if not verdicts:
        return ""
    told = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common())
    return f"Of {verdicts.total()} {_called('discovery', verdicts.total())}: {told}."


def _unfinished(runs: Sequence[ComparedRun]) -> str:
    """A sentence on the runs that go on or were stopped, whose figures are missing; '' without one."""
    labels = [run.label for run in runs if not run.finished]
    if not labels:
        return ""
    return f"{listed(labels)} {'has' if len(labels) == 1 else 'have'} not finished."


def out_of_reach(runs: Sequence[ComparedRun]) -> list[str]:
    """Sentences on the runs whose files are not here, with what the page lacks for it."""
    told = dict.fromkeys((run.experiment, run.away) for run in runs if run.away)
    return [
        f"Ranges, terms, maps and verdicts of {experiment} are missing: {away}." for experiment, away in told
    ]


def _settings(runs: Sequence[ComparedRun]) -> PageTable | None:
    """The settings that differ, with a row for each run or, where there are more of them, for each setting: a page is
    longer than it is wide. None for a single run."""
    if len(runs) < 2:
        return None
    keys = differing_settings(runs)
    shared = len(setting_keys([run.settings for run in runs])) - len(keys)
    told = (
        f"Only the settings that differ; {shared} are the same in all."
        if keys
        else "All settings are the same."
    )
    rows = [
        ("run", *(run.label for run in runs)),
        ("started", *(run.started for run in runs)),
        *((key, *(run.settings.get(key, ABSENT) for run in runs)) for key in keys),
    ]
    if len(runs) >= len(keys):
        rows = list(zip(*rows, strict=True))
    head, *body = rows
    cells = tuple(tuple(ComparedCell(text) for text in row) for row in body)
    return PageTable("settings", "What was different", told, head, cells)


def _metrics(runs: Sequence[ComparedRun]) -> PageTable | None:
    """The figures of COLUMNS on test records, a run a row; without any (batches, benchmarks) all that were tracked."""
    tracked = {name for run in runs for name in run.metrics if not name.startswith(MACHINE)}
    on_test = [name for name in COLUMNS if name in tracked]
    names = on_test or sorted(tracked)
    chosen = ("model",) if any(run.chosen for run in runs) else ()
    if not names and not chosen:
        return None
    rows = tuple(
        (
            ComparedCell(run.label),
            *(ComparedCell(run.chosen or ABSENT) for _ in chosen),
            *(_figure(run, name) for name in names),
        )
        for run in runs
    )
    whose = "On test records" if _judged_alike(runs) else "On the test records of each run, which differ"
    captions = []
    if on_test:
        captions.append(f"{whose}, of the model that a run chose." if chosen else f"{whose}.")
    if any("_mser_" in name for name in names):
        captions.append(MSER)
    if any(cell.range for row in rows for cell in row):
        captions.append(RANGES)
    captions.append("A click on a heading sorts.")
    header = ("run", *chosen, *(COLUMNS.get(name, name) for name in names))
    return PageTable("metrics", "What came of it", " ".join(captions), header, rows)


def _figure(run: ComparedRun, name: str) -> ComparedCell:
    """The cell of a metric, of COLUMNS in mV where it is tracked in V, with its 90 % range in free run."""
    value = run.metrics.get(name)
    if value is None:
        return ComparedCell(ABSENT)
    regime, _, figure = name.partition("/")
    known = run.comparison.get("intervals", {}).get(run.chosen, {}) if regime == "free_run" else {}
    ends = known.get(figure)
    if name in COLUMNS and name.endswith("_v"):
        value *= MV_PER_V
    return ComparedCell(_text(value), value, range_words(*map(_text, ends)) if ends else "")


def _verdicts(runs: Sequence[ComparedRun]) -> PageTable | None:
    """The verdicts with the parameters of their effects, a discovery a row; None without one."""
    found = [run for run in runs if run.discovery]
    if not found:
        return None
    names = list(dict.fromkeys(name for run in found for name in _parameters(run)))
    return PageTable(
        "verdicts",
        "What was found to be missing",
        "Verdict and effects of each discovery, with the parameters of the effects and their 90 % intervals.",
        ("run", "verdict", "effects", *names),
        tuple(
            (
                ComparedCell(run.label),
                ComparedCell(str(run.discovery["verdict"])),
                ComparedCell(", ".join(run.discovery["effects"]) or "none"),
                *(_parameters(run).get(name, ComparedCell(ABSENT)) for name in names),
            )
            for run in found
        ),
    )


def _parameters(run: ComparedRun) -> dict[str, ComparedCell]:
    """effect.parameter -> value with unit, of the effects that were added."""
    cells = {}
    for candidate in run.discovery.get("candidates", ()):
        if candidate["effect"] in run.discovery["effects"]:
            for name, given in candidate["parameters"].items():
                low, high = given.get("low"), given.get("high")
                ends = range_words(_text(low), _text(high)) if low is not None and high is not None else ""
                cells[f"{candidate['effect']}.{name}"] = ComparedCell(
                    f"{_text(given['value'])} {given.get('unit', '')}".strip(), given["value"], ends
                )
    return cells


def _genes(runs: Sequence[ComparedRun]) -> PageTable | None:
    """The genes of the chosen candidates, a run a row; None if no run has them."""
    names = list(dict.fromkeys(name for run in runs for name in run.comparison.get("genome", {})))
    if not names:
        return None
    return PageTable(
        "genes",
        "What the search chose",
        "The genes of the chosen candidate.",
        ("run", *(GENE_WORDS.get(name, name) for name in names)),
        tuple(
            (ComparedCell(run.label), *(_value(run.comparison.get("genome", {}).get(name)) for name in names))
            for run in runs
        ),
    )


def _terms(runs: Sequence[ComparedRun]) -> PageTable | None:
    """The coefficients of the terms that not all runs hold, a term a row; None for fewer than two runs with terms."""
    having = [run for run in runs if run.comparison.get("terms")]
    if len(having) < 2:
        return None
    count = Counter(term for run in having for term in run.comparison["terms"])
    differing = sorted(
        (term for term in count if count[term] < len(having)), key=lambda term: (-count[term], term)
    )
    shared = len(count) - len(differing)
    if not differing:
        return PageTable("terms", "Terms", f"All {len(having)} runs hold the same {shared} terms.", (), ())
    caption = (
        f"Coefficients, on scaled variables, of the terms that not all runs hold; the other {shared} are in all "
        f"{len(having)} runs."
    )
    if len(having) > MOST_COLUMNS:
        counted = tuple(
            (ComparedCell(term), ComparedCell(str(count[term]), count[term])) for term in differing
        )
        return PageTable("terms", "Terms", caption, ("term", "in runs"), counted)
    rows = tuple(
        (ComparedCell(term), *(_value(run.comparison["terms"].get(term)) for run in having))
        for term in differing
    )
    return PageTable("terms", "Terms", caption, ("term", *(run.label for run in having)), rows)


TABLES: tuple[Callable[[Sequence[ComparedRun]], PageTable | None], ...] = (
    _metrics,
    _verdicts,
    _settings,
    _genes,
    _terms,
)
"""The tables of the page, in their order."""


def _value(value: Any) -> ComparedCell:
    if value is None:
        return ComparedCell(ABSENT)
    if isinstance(value, bool):
        return ComparedCell("yes" if value else "no")
    if not isinstance(value, int | float):
        return ComparedCell(str(value))
    return ComparedCell(_text(value), float(value))


def _text(value: float) -> str:
    return f"{value:.4g}"


def _limit(maps: Sequence[Sequence[Sequence[float | None]]]) -> float:
    """A colour range that single bins cannot stretch, mV."""
    values = sorted(abs(v) for rows in maps for row in rows for v in row if v is not None)
    return values[int(0.98 * (len(values) - 1))] if values else 1.0


def _range_of(content: Mapping[str, Any]) -> str:
    current, soc = content["current_a"], content["soc"]
    amperes, percent = (
        range_words(f"{each[0]:.3g}", f"{each[-1]:.3g}") for each in (current, [100 * share for share in soc])
    )
    return f"{amperes} A, {percent} % of charge"
