"""The content of a report as frozen records: arrays in SI units and plain rows, all computed beforehand.

Current is positive on discharge; voltage error e = V_measured - V_model, in volts here and in millivolts on
the page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from aesi.numerics.typing import Array, BoolArray
from aesi.records import Hold, Role

Row = Mapping[str, Any]

KIND_ORDER = ("physics", "parameter", "instrument")


@dataclass(frozen=True, eq=False)
class ModelVoltage:
    """One model's voltage over one record, (n,) V each; None where it was not computed.

    free_run_* : no measured voltage after the first sample.  one_step_* : the step before is given; None also of a
    record without two rows a step apart.
    outside : (n,) True where an input of the free run lies outside the range that this model was trained on.
    """

    free_run_v: Array
    free_run_lower_v: Array | None = None
    free_run_upper_v: Array | None = None
    one_step_v: Array | None = None
    one_step_lower_v: Array | None = None
    one_step_upper_v: Array | None = None
    diverged_at: int | None = None
    outside: BoolArray | None = None


@dataclass(frozen=True, eq=False)
class RecordTrace:
    """One record: what was measured, what the physics says, and what each model says.

    time_s, current_a, soc, measured_v, physics_v : (n,).  predictions : by the model's name.
    all_physics_v : (n,) V by the name of the physics; `physics_v` is of the one that the correction was learned on.
    """

    name: str
    role: Role
    time_s: Array
    current_a: Array
    soc: Array
    measured_v: Array
    physics_v: Array
    predictions: Mapping[str, ModelVoltage] = field(default_factory=dict)
    all_physics_v: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class BootstrapView:
    """The moving block bootstrap: samples of each record, over whose ends no block runs, length of a block, share of
    distinct samples in each resample."""

    lengths: tuple[int, ...]
    block: int
    unique_fraction: Array


@dataclass(frozen=True, eq=False)
class RunView:
    """Everything the report of a run shows.

    models : rows of summary.json (see `aesi.pipeline.report.tables`); `chosen`, `physics` (as declared) and `corrected`
    (the physics that the correction was learned on, which the traces show) name three of them.
    candidates : rows with oob, valid, terms and, where known, fitness, number, feasible, front, chosen.
    terms : rows with term and, where known, importance (SVD), bagging, stability, inclusion.
    settings : what the search picked (lambda1, lambda2, tau, ...), as text.
    fallback : why the run is not on the data that were asked for; empty where it is.
    seen : names of the test records that the declared model was fitted to.
    hold : how the current was taken to run between the rows.
    """

    experiment: str
    note: str
    cell: str
    chosen: str
    models: tuple[Row, ...]
    traces: tuple[RecordTrace, ...]
    candidates: tuple[Row, ...] = ()
    terms: tuple[Row, ...] = ()
    bootstrap: BootstrapView | None = None
    settings: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    mlflow_run_id: str = ""
    seconds: float | None = None
    physics: str = "ESPM"
    corrected: str = "ESPM"
    fallback: str = ""
    seen: tuple[str, ...] = ()
    hold: Hold = "linear"

    def of(self, role: Role) -> tuple[RecordTrace, ...]:
        """The records of one role, in order."""
        return tuple(trace for trace in self.traces if trace.role == role)

    def model(self, name: str) -> Row | None:
        """The row of that name, or None."""
        return next((row for row in self.models if row["name"] == name), None)


@dataclass(frozen=True, eq=False)
class DiscoveryTrace:
    """One measured file: (n,) V of the model as declared, with its own parameters refitted, and augmented.

    hold : how its current was taken to run between its rows.
    """

    name: str
    part: Literal["fit", "test"]
    time_s: Array
    current_a: Array
    soc: Array
    measured_v: Array
    before_v: Array
    recalibrated_v: Array
    after_v: Array
    hold: Hold = "linear"


@dataclass(frozen=True)
class EffectView:
    """An effect as the report explains it.

    parameters : rows with name, unit, value, low, high and, where known, bounds (low, high) and description.
    """

    id: str
    title: str
    kind: str
    equation: str
    validity: str
    source: str
    parameters: tuple[Row, ...] = ()


@dataclass(frozen=True, eq=False)
class DiscoveryView:
    """Everything the report of a discovery shows.

    discovery : the content of discovery.json.  effects : those added, in their order.
    files : rows with name, part, before_mv, recalibrated_mv, after_mv (RMSE) and, where known, gain_mv and
    gain_low_mv, gain_high_mv (recalibrated minus after, with its block-bootstrap interval).
    dependence : rows with variable, before, after: the share of the residual's variance that it explains.
    points_to : rows with says, before, after (the share of the mean square that such terms explain), terms,
    terms_after.
    experiments : rows with effects and experiment: what would tell the indistinguishable apart.
    """

    title: str
    cell: str
    discovery: Mapping[str, Any]
    traces: tuple[DiscoveryTrace, ...]
    effects: tuple[EffectView, ...] = ()
    files: tuple[Row, ...] = ()
    dependence: tuple[Row, ...] = ()
    points_to: tuple[Row, ...] = ()
    experiments: tuple[Row, ...] = ()
    titles: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    mlflow_run_id: str = ""
    seconds: float | None = None

    def of(self, part: Literal["fit", "test"]) -> tuple[DiscoveryTrace, ...]:
        """The files of one part, in order."""
        return tuple(trace for trace in self.traces if trace.part == part)
