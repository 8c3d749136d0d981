"""`aesi calibrate` as plain functions: measurements in; a calibrated BPX file and its report out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from aesi.pipeline.belonging import check_belongs
from aesi.pipeline.notes import together
from aesi.pipeline.product.declared import declared_model
from aesi.records import Measurement
from aesi.tracer.calibrate import Calibration, calibrate

SCHEMA = "aesi.calibration/1"
MV = 1e3


def calibrate_files(
    cell: Path, measurements: Sequence[Measurement], out: Path, soc0: float | None = None, seed: int = 0
) -> dict[str, Any]:
    """Calibrate the cell of a BPX file; writes `out` (BPX) and the report beside it, and returns the report.

    Raises CellError or DataError, one sentence, for what cannot be used.
    """
    declared = declared_model(cell).cell
    check_belongs(declared, measurements)
    found = calibrate(declared, measurements, soc0=soc0, seed=seed)
    content = to_json(found, [note for m in measurements for note in m.notes])
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(found.cell.to_bpx(), indent=1) + "\n", encoding="utf-8")
    report = out.with_suffix(".report.json")
    report.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    out.with_suffix(".report.md").write_text(to_text(content), encoding="utf-8")
    return content


def to_json(found: Calibration, read: Sequence[str] = ()) -> dict[str, Any]:
    """The report: errors by file, parameters with intervals, what stays open.

    read : what a reader dropped, mapped or averaged in the files.
    """
    return {
        "schema": SCHEMA,
        "cell": found.cell.name,
        "files": [
            {"name": f.name, "before_rmse_mv": MV * f.before_v, "after_rmse_mv": MV * f.after_v}
            for f in found.files
        ],
        "parameters": {
            name: {"value": p.value, "low": p.low, "high": p.high, "unit": p.unit}
            for name, p in found.parameters.items()
        },
        "capacity_ah": found.cell.capacity_ah,
        "declared_capacity_ah": found.declared.capacity_ah,
        "undetermined": list(found.undetermined),
        "at_bounds": list(found.at_bounds),
        "notes": list(together((*read, *found.notes))),
        "seconds": round(found.seconds, 2),
    }


def to_text(content: dict[str, Any]) -> str:
    """The report as Markdown."""
    lines = [f"# Calibration of {content['cell']}", "", "| file | before, mV | after, mV |", "|---|---|---|"]
    lines += [
        f"| {f['name']} | {f['before_rmse_mv']:.2f} | {f['after_rmse_mv']:.2f} |" for f in content["files"]
    ]
    lines += ["", "Errors are RMSE on the data that were fitted.", ""]
    lines += ["| parameter | value | 95 % interval | unit |", "|---|---|---|---|"]
    lines += [
        f"| {name} | {p['value']:.4g} | {p['low']:.4g} to {p['high']:.4g} | {p['unit']} |"
        for name, p in content["parameters"].items()
    ]
    for title, key in (
        ("Left open by these data", "undetermined"),
        ("On a bound", "at_bounds"),
        ("Notes", "notes"),
    ):
        if content[key]:
            lines += ["", f"## {title}", "", *(f"- {text}" for text in content[key])]
    return "\n".join(lines) + "\n"
