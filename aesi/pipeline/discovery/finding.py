"""The result of `aesi.discover`: the verdict, its figures as a table and a plot, and the resulting model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aesi.errors import InputError
from aesi.physics.arguments import check_choice
from aesi.pipeline.discovery.discover import (
    Case,
    case_model,
    discovery_content,
    discovery_view,
    write_discovery,
)
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.report.words.discoveries import part_words
from aesi.tracer import Discovery
from aesi.tracer.report.outcome import Part, State

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure

LABELS = {"before": "as declared", "recalibrated": "recalibrated", "after": "after"}


@dataclass(frozen=True, eq=False)
class Finding:
    """The result of a discovery.  case : the arguments of the call.  found : the full outcome of the tracer."""

    case: Case
    found: Discovery

    def __repr__(self) -> str:
        kept_back = bool(self.content["before"]["test"])
        part: Part = "test" if kept_back else "fit"
        where = part_words(part, self.content)
        named = f" {', '.join(self.effects)}" if self.effects else ""
        errors = (
            f"{self.rmse_mv('before', part):.2f} mV as declared, {self.rmse_mv('after', part):.2f} mV after"
        )
        return f"Finding({self.verdict}{named}, {errors}, {where})"

    @property
    def verdict(self) -> str:
        """`found`, `none` or `unknown`."""
        return str(self.content["verdict"])

    @property
    def effects(self) -> tuple[str, ...]:
        """Ids of the effects that were found, in the order in which they were added."""
        return tuple(self.content["effects"])

    @property
    def confidence(self) -> float:
        """Confidence of the verdict, between 0 and 1."""
        return float(self.content["confidence"])

    @property
    def reason(self) -> str:
        """The figures behind the verdict, in words."""
        return str(self.content["reason"])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences where the test part contradicts the verdict, where a record contradicts its temperature, and where
        the written model is worse than another one."""
        return tuple(self.content["warnings"])

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on assumptions, and on changes that the reader made to the data."""
        return tuple(self.content["notes"])

    def rmse_mv(
        self,
        state: State = "after",
        part: Part = "test",
    ) -> float:
        """RMS voltage error of a model, mV; NaN where there is no such part, or the model cannot be simulated on it.

        state : "before", the declared model; "recalibrated"; or "after", the written model.
        part : "test", to which nothing was fitted, or "fit".  Raises InputError for other words.
        """
        check_choice("state", state, State)
        check_choice("part", part, Part)
        return float(self.content[state][part].get("rmse_mv", float("nan")))

    @cached_property
    def content(self) -> dict[str, Any]:
        """The content of discovery.json."""
        return discovery_content(self.found, self.case.notes, self.case.seen)

    @cached_property
    def model(self) -> HybridModel:
        """The written model, with the effects that were found, for `predict` and `save`."""
        return case_model(self.case, self.found)

    def to_frame(self) -> pd.DataFrame:
        """The candidates, best first: one row per parameter, with its 90 % interval."""
        import pandas as pd

        rows = []
        for candidate in self.content["candidates"]:
            about = {key: candidate[key] for key in ("effect", "kind", "score", "test_rmse_mv")}
            for name, values in (candidate["parameters"] or {None: {}}).items():
                rows.append(about | {"parameter": name} | values)
        columns = ("effect", "kind", "score", "test_rmse_mv", "parameter", "value", "low", "high", "unit")
        return pd.DataFrame(rows, columns=list(columns))

    def plot(self, part: Part = "test") -> Figure:
        """Measured voltage, current, and the residual of each model over time: a plotly figure.

        Raises InputError for the test part of a search that held none out, and for another word than "test" or "fit".
        """
        check_choice("part", part, Part)
        from aesi.pipeline.report.plots.records import residual_figure

        traces = discovery_view(self.found, self.content, "").of(part)
        if not traces:
            raise InputError(
                f"nothing was held out, so that there is no {part} part to plot; give part='fit'."
            )
        return residual_figure(traces, LABELS)

    def save(self, out: str | Path) -> Path:
        """Write discovery.json, report.html and model/ to a folder, as `aesi discover` does; returns the folder."""
        write_discovery(Path(out), self.case, self.found)
        return Path(out)
