"""The tables of the paper, from plain rows.

A row is an entry of `models` in a run's summary.json. Every value is optional and shows as a dash where it is absent;
in addition to the published schema a row may have

    validation_mser_pct   over training drives left out in turn
    free_run   {train,valid,test}_{mser_pct,mser_recalibrated_pct,rmse_mv,until_ran_out_rmse_mv}, the last where a
               simulation did; diverged (the number of test records on which the correction diverged), outside_pct
               (test)
    one_step   {train,valid,test}_rmse_mv, persistence_rmse_mv (test)
    k_step     {"1": mV, "10": mV, ...}: test RMSE by horizon in seconds; likewise k_step_persistence
    intervals  nominal_pct, coverage_pct, average_width_v, winkler_v, worst_bin_coverage_pct, low_minutes_pct (one step
               ahead)
    intervals_by_method  {method: the same keys, ...}
    free_run_intervals   the same keys, in free run; with inside_coverage_pct, pieces and worst_piece_coverage_pct of
                         the calibration, and start_v, change of the voltage by a standard deviation of the start
    bands_by_horizon     {"1": the same keys, ...}, by the time since the last measurement in seconds
    test_records         {record: rmse_mv, mser_pct, outside_pct, kept_pct, amplitude, mean_degc, beyond_k; where a
                         simulation ran out ran_out_s, until_ran_out_mv}, in free run
    seeds      how many runs the row is the mean of; a group then holds spread, {key: [lowest, highest]}
    seconds    wall time of fit and evaluation

Captions name the regime, because figures of the two regimes must never be read side by side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from aesi.conformal.scores import MIN_BIN_SAMPLES
from aesi.constants import MV_PER_V
from aesi.pipeline.report.table_formats import ABSENT, Table, to_csv, to_latex, to_markdown
from aesi.pipeline.report.views import Row

TableFormat = Literal["md", "tex", "csv"]
OWN_METHOD = "as in Table 2"
WORST_BIN = (
    f"Worst bin: the lowest coverage in a (current, SOC) bin of more than {MIN_BIN_SAMPLES} samples; smaller bins are "
    "joined to their neighbours."
)


def free_run_table(models: Sequence[Row]) -> Table:
    """Table 1: mean squared error reduction against the bare physics, in free run."""
    columns: list[Column] = [
        ("MSER train, %", lambda row: _number(row, "free_run.train_mser_pct", 2)),
        ("MSER valid, %", lambda row: _number(row, "free_run.valid_mser_pct", 2)),
        ("MSER, training drives left out in turn, %", lambda row: _number(row, "validation_mser_pct", 2)),
        ("MSER test, %", _test_mser),
        ("against recalibrated, %", lambda row: _ranged(row, "free_run", "test_mser_recalibrated_pct")),
        ("RMSE test, mV", lambda row: _number(row, "free_run.test_rmse_mv", 2)),
        ("terms", lambda row: _number(row, "terms", 0)),
        ("time, s", lambda row: _number(row, "seconds", 1)),
    ]
    physics = next((row["name"] for row in models if row["name"] in ("ESPM", "DFN")), "physics")
    caption = (
        f"Table 1. Mean squared error reduction (MSER) of the voltage against the declared {physics}, and on the test "
        f"set against the {physics} recalibrated on the training set. Regime: free run, no measured voltage "
        "is used after the first sample. Time: of fit and evaluation."
    )
    if any(row.get("validation_mser_pct") is not None for row in models):
        caption += " Training drives left out in turn: each of them by physics and a model that never saw it."
    return _table("mser", caption + _brackets(models), columns, models)


def interval_table(models: Sequence[Row]) -> Table:
    """Table 2: prediction intervals one step ahead."""
    caption = (
        "Table 2. Prediction intervals on the test set. Regime: one step ahead, the measured voltage of the "
        f"step before is given. {WORST_BIN} Low minutes: minute-long windows with under 70 % coverage. Winkler score: "
        "width plus the penalty for misses; lower is better."
    )
    rows = _having(models, "intervals")
    return _table("intervals", caption + _brackets(models), _interval_columns("intervals"), rows)


def method_table(models: Sequence[Row]) -> Table:
    """Prediction intervals by method, calibrated on the same residuals."""
    rows = [
        {"name": f"{row['name']}, {method}", "by_method": figures}
        for row in _having(models, "intervals_by_method")
        for method, figures in ({OWN_METHOD: row["intervals"]} | row["intervals_by_method"]).items()
    ]
    caption = (
        "Prediction intervals on the test set by method, calibrated on the same residuals. Regime: one step ahead, "
        "the measured voltage of the step before is given. Low minutes: minute-long windows with under 70 % coverage. "
        f"Rows {OWN_METHOD} are of the experiment's own method."
    )
    return _table("interval-methods", caption + _brackets(models), _interval_columns("by_method"), rows)


def free_run_band_table(models: Sequence[Row]) -> Table:
    """Prediction bands without measured voltage, by the time since the last measurement."""
    rows = [
        {"name": f"{row['name']}, {horizon}", "bands": figures}
        for row in _having(models, "free_run_intervals")
        for horizon, figures in (
            *((f"{key} s", row["bands_by_horizon"][key]) for key in _horizons(row)),
            ("whole drive", row["free_run_intervals"]),
        )
    ]
    caption = (
        "Prediction bands on the test set. Regime: the measured voltage is given once, the stated time before "
        f"the sample that is predicted, and not again; whole drive: a free run from the first sample. {WORST_BIN} "
        "Inside: of the samples within the trained range, of temperature too; outside of it the band is wider by how "
        "far the model would go on, which is not calibrated. Pieces: how many calibrated the band, and the lowest "
        "coverage among them when each is left out; one drive may scatter as far."
    )
    columns = [
        *_interval_columns("bands"),
        ("coverage inside, %", lambda row: _number(row, "bands.inside_coverage_pct", 2)),
        ("pieces", lambda row: _number(row, "bands.pieces", 0)),
        ("worst piece, %", lambda row: _number(row, "bands.worst_piece_coverage_pct", 1)),
    ]
    return _table("free-run-bands", caption + _brackets(models), columns, rows)


def record_table(models: Sequence[Row]) -> Table:
    """Free run on each test record, where the other tables pool several."""
    rows = [
        {"name": f"{row['name']}, {record}", "record": figures}
        for row in _having(models, "test_records")
        if len(row["test_records"]) > 1
        for record, figures in row["test_records"].items()
    ]
    columns: list[Column] = [
        ("RMSE, mV", lambda row: _number(row, "record.rmse_mv", 2)),
        ("MSER, %", lambda row: _number(row, "record.mser_pct", 2)),
        ("mean temperature, degC", lambda row: _number(row, "record.mean_degc", 1)),
        ("outside, %", lambda row: _number(row, "record.outside_pct", 1)),
        ("kept, %", lambda row: _number(row, "record.kept_pct", 1)),
    ]
    caption = (
        "Each test record by itself. Regime: free run. MSER: against the declared physics. Outside: share of samples "
        "with an input, or the temperature, outside the range that the correction was trained on. Kept: what is left "
        "of a correction that fades towards the physics with the distance from there, in the mean; nothing anywhere of "
        "one that improved no left-out training drive."
    )
    return _table("records", caption, columns, rows)


def one_step_table(models: Sequence[Row]) -> Table:
    """One step ahead, beside persistence."""
    columns: list[Column] = [
        ("RMSE train, mV", lambda row: _number(row, "one_step.train_rmse_mv", 3)),
        ("RMSE valid, mV", lambda row: _number(row, "one_step.valid_rmse_mv", 3)),
        ("RMSE test, mV", lambda row: _number(row, "one_step.test_rmse_mv", 3)),
        ("persistence test, mV", lambda row: _number(row, "one_step.persistence_rmse_mv", 3)),
    ]
    caption = (
        "Voltage error one step ahead. Regime: one step ahead, the measured voltage of the step before is "
        "given. Persistence repeats the last measured error; a model that does not beat it learnt an echo."
    )
    return _table("one-step", caption, columns, _having(models, "one_step"))


def k_step_table(models: Sequence[Row]) -> Table:
    """Test RMSE by horizon, between one step ahead and free run."""
    rows = _having(models, "k_step")
    horizons = sorted({key for row in rows for key in row["k_step"]}, key=float)
    columns = [(f"{horizon} s, mV", _k_step_cell(horizon)) for horizon in horizons]
    persistence = next((row["k_step_persistence"] for row in rows if row.get("k_step_persistence")), None)
    if persistence is not None:
        rows = [*rows, {"name": "persistence", "k_step": persistence}]
    caption = (
        "Voltage RMSE on the test set by horizon. Regime: the measured voltage is given once, the stated "
        "time before the sample that is predicted, and not again. Persistence holds that error."
    )
    return _table("k-step", caption, columns, rows)


TABLES: tuple[Callable[[Sequence[Row]], Table], ...] = (
    free_run_table,
    record_table,
    one_step_table,
    k_step_table,
    interval_table,
    method_table,
    free_run_band_table,
)


def all_tables(models: Sequence[Row]) -> tuple[Table, ...]:
    """Every table that has at least one row and one column of values."""
    built = (build(models) for build in TABLES)
    return tuple(table for table in built if table.rows and len(table.header) > 1)


def render(models: Sequence[Row], format: TableFormat = "md") -> str:
    """All tables of one run as one text, in the given format."""
    write = {"md": to_markdown, "tex": to_latex, "csv": to_csv}[format]
    return "\n".join(write(table) for table in all_tables(models))


Column = tuple[str, Callable[[Row], str]]


def _table(key: str, caption: str, columns: Sequence[Column], models: Sequence[Row]) -> Table:
    """Set the columns that have a value in at least one row."""
    cells = [[cell(row) for row in models] for _, cell in columns]
    kept = [i for i, column in enumerate(cells) if any(cell != ABSENT for cell in column)]
    header = ("model", *(columns[i][0] for i in kept))
    rows = tuple((str(row["name"]), *(cells[i][j] for i in kept)) for j, row in enumerate(models))
    return Table(key, caption, header, rows)


def _interval_columns(group: str) -> list[Column]:
    return [
        ("nominal, %", lambda row: _as_asked(row, f"{group}.nominal_pct")),
        ("coverage, %", lambda row: _ranged(row, group, "coverage_pct")),
        ("worst bin, %", lambda row: _number(row, f"{group}.worst_bin_coverage_pct", 2)),
        ("low minutes, %", lambda row: _number(row, f"{group}.low_minutes_pct", 2)),
        ("average width, mV", lambda row: _number(row, f"{group}.average_width_v", 3, MV_PER_V)),
        ("Winkler, mV", lambda row: _number(row, f"{group}.winkler_v", 3, MV_PER_V)),
    ]


def _test_mser(row: Row) -> str:
    text = _ranged(row, "free_run", "test_mser_pct")
    diverged = _find(row, "free_run.diverged")
    return f"{text} ({int(diverged)} diverged)" if diverged else text


def _ranged(row: Row, group: str, key: str) -> str:
    """A number to two digits with its range over seeds, where the row is of several."""
    text, ends = _number(row, f"{group}.{key}", 2), _find(row, f"{group}.spread.{key}")
    low, high = ("", "") if ends is None else (_formatted(end, 2) for end in ends)
    return text if low == high else f"{text} [{low}, {high}]"


def _k_step_cell(horizon: str) -> Callable[[Row], str]:
    return lambda row: _formatted(row["k_step"].get(horizon), 2)


def _horizons(row: Row) -> list[str]:
    return sorted(row.get("bands_by_horizon", ()), key=float)


def _brackets(models: Sequence[Row]) -> str:
    """A sentence for the caption on the figures in brackets; '' where each row is of one run."""
    seeds = max((int(row.get("seeds") or 0) for row in models), default=0)
    return f" In brackets: lowest and highest of {seeds} seeds." if seeds else ""


def _having(models: Sequence[Row], group: str) -> list[Row]:
    return [row for row in models if row.get(group)]


def _find(row: Row, path: str) -> Any:
    value: Any = row
    for key in path.split("."):
        if not isinstance(value, Mapping) or key not in value:
            return None
        value = value[key]
    return value


def _number(row: Row, path: str, digits: int, factor: float = 1.0) -> str:
    value = _find(row, path)
    return _formatted(None if value is None else value * factor, digits)


def _as_asked(row: Row, path: str) -> str:
    """A number that was asked for, which is exact: 97.5 is not 98."""
    value = _find(row, path)
    return ABSENT if value is None else f"{value:g}"


def _formatted(value: float | None, digits: int) -> str:
    if value is None or math.isnan(value):
        return ABSENT
    return f"{value:.{digits}f}"
