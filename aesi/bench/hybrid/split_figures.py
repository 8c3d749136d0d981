"""Summary of the benchmark on splits of measured drives: mean and worst figures by cell, and the table of the docs.

The figures of a split are described in `splits.judged`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from aesi.bench import CaseRow
from aesi.bench.hybrid.splits import EXPERIMENTS, against
from aesi.bench.limit import NOT_RUN
from aesi.pipeline.experiment.physics_models import RECALIBRATED

BEST = "AESI I"
"""The model whose figures the table shows."""
SECOND = "AESI II"
"""The model that has a column of its own in the table of each split."""
IN_TABLE = (RECALIBRATED, BEST, SECOND)
"""Models without which `table` cannot be made."""
TITLES = {
    "nmc": "NMC pouch, parts of a drive",
    "lfp": "LFP 18650, parts of a drive",
    "m50t": "LG M50T, half of the UDDS",
    "panasonic": "Panasonic, 25 °C",
    "hg2": "LG HG2, 25 °C",
}


def summary(rows: Sequence[CaseRow]) -> dict[str, Any]:
    """Means and worst values by cell, over all splits (`all`) and over the test splits alone (`judging`).

    A run is one split with one seed. A failed run counts as a reduction of 0 % in every reduction of the squared error
    at the cell's own temperature, and in no other figure. A run whose data are not available counts in no figure.
    `best_in_hindsight` is the reduction by whichever model has the lowest error on each split, the recalibrated model
    included. It needs the test data, so that it is an upper bound for any choice of a model from the training drives.
    """
    ran = [row for row in rows if row.get("verdict") != NOT_RUN]
    return {
        "summary": True,
        "splits": len({row["split"] for row in ran}),
        "runs": len(ran),
        "not_run": [row["case"] for row in rows if row.get("verdict") == NOT_RUN],
        "failed": sum("error" in row for row in ran),
        "all": {cell: _cell_figures(of_cell) for cell, of_cell in _by_cell(ran).items()},
        "judging": {
            cell: _cell_figures(of_cell)
            for cell, of_cell in _by_cell([r for r in ran if not r["development"]]).items()
        },
    }


def _by_cell(rows: Sequence[CaseRow]) -> dict[str, list[CaseRow]]:
    by_cell = {cell: [row for row in rows if row["cell"] == cell] for cell in EXPERIMENTS}
    return {cell: of_cell for cell, of_cell in by_cell.items() if of_cell} | (
        {"every cell": [*rows]} if rows else {}
    )


def _cell_figures(rows: Sequence[CaseRow]) -> dict[str, Any]:
    """The figures of the runs of one cell: of each model, of the best model in hindsight, and the absolute difference
    of the validation figure and the test figure, in percentage points."""
    good = [row for row in rows if "error" not in row]
    figures: dict[str, Any] = {"splits": len({row["split"] for row in rows}), "runs": len(rows)}
    if not good:
        return figures
    of_failed = [0.0] * (len(rows) - len(good))
    home = [row["models"] for row in good]
    abroad = [test for row in good for test in row.get("abroad", {}).values()]
    for name in home[0]:
        of_model = [models[name] for models in home if name in models]
        figures[name] = (
            _mean_and_worst("mser_pct", [m["mser_pct"] for m in of_model], of_failed)
            | _mean_and_worst("mser_recalibrated_pct", _gains(name, home), of_failed)
            | _mean_and_worst("abroad_mser_recalibrated_pct", _gains(name, abroad))
            | _band_figures(of_model)
        )
    best = [
        max(against(models[name], models[RECALIBRATED]) for name in models)
        for models in home
        if RECALIBRATED in models
    ]
    if best:
        figures["best_in_hindsight"] = _mean_and_worst("mser_recalibrated_pct", best, of_failed)
    gaps = [abs(valid - test) for valid, test in _validated(good)]
    if gaps:
        figures["validation_minus_test"] = {"median": float(np.median(gaps)), "worst": max(gaps)}
    return figures


def _validated(rows: Sequence[CaseRow]) -> list[tuple[float, float]]:
    """(validation figure, test figure) of AESI I, per cent, for each run that has both; a split with fewer than two
    pieces to leave out has no validation figure."""
    return [
        (row["validation_mser_pct"][BEST], row["models"][BEST]["mser_pct"])
        for row in rows
        if BEST in row["models"] and BEST in row["validation_mser_pct"]
    ]


def _band_figures(models: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Coverage (per cent) and Winkler score (mV) over the rows of all splits, and the lowest coverage of a drive. Empty
    if the model has no band in one of the splits."""
    if not all("coverage_pct" in m for m in models):
        return {}
    counts = np.array([m["rows"] for m in models], dtype=float)
    return {
        "coverage_pct": float(counts @ [m["coverage_pct"] for m in models] / counts.sum()),
        "worst_drive_coverage_pct": min(m["worst_drive_coverage_pct"] for m in models),
        "winkler_mv": float(counts @ [m["winkler_mv"] for m in models] / counts.sum()),
    }


def _gains(name: str, tests: Sequence[Mapping[str, Any]]) -> list[float]:
    """Reduction of the recalibrated model's squared error by a model, per cent, for each test with both models."""
    both = [test for test in tests if name in test and RECALIBRATED in test]
    return [against(test[name], test[RECALIBRATED]) for test in both]


def _mean_and_worst(name: str, values: Sequence[float], failed: Sequence[float] = ()) -> dict[str, float]:
    """Mean and worst (lowest) value; empty if there are no values.  failed : values at which failed runs count."""
    if not values:
        return {}
    every = [*values, *failed]
    return {f"{name}_mean": float(np.mean(every)), f"{name}_worst": min(every)}


HEAD = [
    "| cell | splits | seeds | recalibrated, % | AESI I, % | AESI I against recalibrated, % "
    "| validation minus test, points | coverage of AESI I, % | Winkler score, recalibrated / AESI I, mV |",
    "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
]
EACH = [
    "| split | tested on | recalibrated, % | AESI I, % | AESI II, % | AESI I against recalibrated, % "
    "| validation, % | coverage of AESI I, % | worst drive, % | Winkler score, recalibrated / AESI I, mV |",
    "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|",
]


def table(rows: Sequence[CaseRow]) -> list[str]:
    """Lines of Markdown: a table with one line per cell and test temperature, then each split in a block to open.

    A field of the first table is `mean / worst split`, each split with its mean over the seeds. Columns named after a
    model are the reduction of the declared model's squared error by it, per cent. `validation minus test` is the
    absolute difference of these two reductions by AESI I, `median / worst`. `coverage` is over all rows, then that of
    the worst drive. Fields of a band are empty if a run has none, and those of the validation if no split has two
    pieces to leave out. Failed runs count as in `summary`, and are listed between the two tables.
    rows : each with the figures of all of IN_TABLE, or with an `error`.
    """
    ran = [row for row in rows if row.get("verdict") != NOT_RUN]
    lines, each = list(HEAD), list(EACH)
    for cell, title in TITLES.items():
        by_split = list(_by_split([row for row in ran if row["cell"] == cell]))
        splits = [_over_seeds(runs) for runs in by_split if not all("error" in run for run in runs)]
        lost = [runs for runs in by_split if all("error" in run for run in runs)]
        lines += _cell_rows(title, splits, lost)
        for split in splits:
            each += _split_lines(split)
    failed = [
        f"{row['case']} {row.get('verdict', 'failed')}: {row['error']}" for row in rows if "error" in row
    ]
    return [*lines, "", *failed, '??? note "Each split"', "", *(f"    {line}" for line in each)]


def _by_split(rows: Sequence[CaseRow]) -> Iterator[list[CaseRow]]:
    for name in dict.fromkeys(row["split"] for row in rows):
        yield [row for row in rows if row["split"] == name]


def _over_seeds(rows: Sequence[CaseRow]) -> dict[str, Any]:
    """The figures of one split, averaged over its seeds; at least one run has not failed.

    `home` and, for each test record at another temperature, `abroad` : model -> mean figures; `against` in them is the
    reduction of the recalibrated model's squared error, per cent. `validation` and `gap` : the validation figure and
    its absolute difference from the test figure, both of AESI I, percentage points; None if the split has none.
    """
    good = [row for row in rows if "error" not in row]
    first, share = good[0], len(good) / len(rows)
    validated = _validated(good)
    return {
        "split": first["split"],
        "seeds": len(rows),
        "one_drive": first["cell"] in ("hg2", "panasonic"),
        "home": _mean_figures([row["models"] for row in good], share),
        "abroad": {n: _mean_figures([row["abroad"][n] for row in good]) for n in first.get("abroad", {})},
        "validation": float(np.mean([valid for valid, _ in validated])) if validated else None,
        "gap": float(np.mean([abs(valid - test) for valid, test in validated])) if validated else None,
    }


FIGURES = ("mser_pct", "coverage_pct", "worst_drive_coverage_pct", "winkler_mv", "rows")


def _mean_figures(models: Sequence[Mapping[str, Any]], share: float = 1.0) -> dict[str, dict[str, float]]:
    """Model -> mean figures over the runs that did not fail.  share : share of these runs among all that count;
    reductions are multiplied by it, since a failed run counts as a reduction of 0 at the cell's own temperature."""
    out = {
        name: {
            key: float(np.mean([m[name][key] for m in models]))
            for key in FIGURES
            if all(key in m[name] for m in models)
        }
        for name in models[0]
    }
    for name, figures in out.items():
        figures["mser_pct"] *= share
        figures["against"] = share * float(np.mean(_gains(name, models)))
    return out


def _cell_rows(
    title: str, splits: Sequence[Mapping[str, Any]], lost: Sequence[Sequence[CaseRow]]
) -> Iterator[str]:
    """The lines of one cell in the first table, one for each temperature that it is tested at.

    lost : the runs of each split of which all failed; it counts as a reduction of 0 at the cell's own temperature.
    """
    failed = len(lost)
    if not splits:
        if lost:
            cells = (title, str(failed), str(len(lost[0])), *["0.0 / 0.0"] * 3, "", "", "")
            yield f"| {' | '.join(cells)} |"
        return
    gaps = [split["gap"] for split in splits if split["gap"] is not None]
    gap_words = f"{np.median(gaps):.1f} / {max(gaps):.1f}" if gaps else ""
    yield _cell_row(title, splits, [s["home"] for s in splits], failed, gap_words)
    for name in dict.fromkeys(name for split in splits for name in split["abroad"]):
        tested = [split for split in splits if name in split["abroad"]]
        models = [split["abroad"][name] for split in tested]
        yield _cell_row(f"{title.split(',')[0]}, {name}", tested, models, 0, "")


def _cell_row(
    title: str,
    splits: Sequence[Mapping[str, Any]],
    models: Sequence[Mapping[str, Any]],
    failed: int,
    gap: str,
) -> str:
    def spread(name: str, key: str) -> str:
        values = [*(m[name][key] for m in models), *[0.0] * failed]
        return f"{np.mean(values):.1f} / {min(values):.1f}"

    bands = {name: _band_figures([m[name] for m in models]) for name in (RECALIBRATED, BEST)}
    cells = (
        title,
        str(len(splits) + failed),
        str(splits[0]["seeds"]),
        spread(RECALIBRATED, "mser_pct"),
        spread(BEST, "mser_pct"),
        spread(BEST, "against"),
        gap,
        _fields((bands[BEST], "coverage_pct"), (bands[BEST], "worst_drive_coverage_pct")),
        _fields((bands[RECALIBRATED], "winkler_mv"), (bands[BEST], "winkler_mv")),
    )
    return f"| {' | '.join(cells)} |"


def _fields(*of_bands: tuple[Mapping[str, float], str]) -> str:
    """Figures of bands beside each other, with one decimal; empty if a band is missing."""
    if not all(key in figures for figures, key in of_bands):
        return ""
    return " / ".join(f"{figures[key]:.1f}" for figures, key in of_bands)


def _split_lines(split: Mapping[str, Any]) -> Iterator[str]:
    where = "that drive" if split["one_drive"] else "the others"
    validation = "" if split["validation"] is None else f"{split['validation']:.1f}"
    yield _split_row(split["split"], where, split["home"], validation)
    for name, models in split["abroad"].items():
        yield _split_row("", name, models, "")


def _split_row(split: str, where: str, models: Mapping[str, Any], validation: str) -> str:
    best, physics = models[BEST], models[RECALIBRATED]
    figures = (physics["mser_pct"], best["mser_pct"], models[SECOND]["mser_pct"], best["against"])
    cells = (
        split,
        where,
        *(f"{value:.1f}" for value in figures),
        validation,
        _fields((best, "coverage_pct")),
        _fields((best, "worst_drive_coverage_pct")),
        _fields((physics, "winkler_mv"), (best, "winkler_mv")),
    )
    return f"| {' | '.join(cells)} |"
