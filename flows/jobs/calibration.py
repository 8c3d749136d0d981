"""`aesi calibrate`: fit the model's own parameters, write the cell and the report."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from aesi.calibration.result import until_words
from aesi.pipeline.calibrate import Request, calibrate_files
from aesi.pipeline.notes import together
from aesi.pipeline.report.words.calibrations import errors_apart, open_line
from aesi.pipeline.written import calibration_files
from aesi.records import Measurement
from flows.base import environment
from flows.base.console import Console
from flows.base.interrupt import kept_on_interrupt


def calibrate(
    cell: Path, measurements: Sequence[Measurement], out: Path, request: Request | None = None
) -> dict[str, Any]:
    """Calibrate and say what came of it; returns the report."""
    environment.prepare_process()
    console = Console()
    names = [m.name for m in measurements]
    console.say(f"Fitting the model's own parameters to {', '.join(names)} ...")
    read = together((note for m in measurements for note in m.notes), names)
    for note in read:
        console.say(note)
    started_s = time.monotonic()

    def show_step(steps: int, cost_share: float) -> None:
        console.count(
            "steps of the fit",
            steps,
            started_s,
            f"at {100.0 * cost_share:.3g} % of the starting point's cost",
        )

    with kept_on_interrupt("Nothing of the fit is kept; the same command begins it anew."):
        content = calibrate_files(cell, measurements, out, request, show_step)
    for row in content["files"]:
        console.say(
            f"  {row['name']}: {row['before_rmse_mv']:.2f} mV before, {row['after_rmse_mv']:.2f} mV after, "
            f"{row['as_simulated_rmse_mv']:.2f} mV as the file is simulated"
            f"{until_words(row['ran_out_s'], row['until_ran_out_rmse_mv'])}"
        )
    if apart := errors_apart(content):
        console.say(f"  {apart}.")
    for row in content["impedance"]:
        low, high = row["band_hz"]
        outside = row["rms_pct"] is None
        off = f"no frequency from {low:g} to {high:g} Hz" if outside else f"|Z| {row['rms_pct']:.0f} % off"
        console.say(f"  {row['name']}, state of charge {row['soc']:.2f}: {off}")
    for note in content["notes"]:
        if note not in read:
            console.say(f"  {note}")
    if undetermined := open_line(content):
        console.say(f"  {undetermined} (each with its weights in the report)")
    if content["at_bounds"]:
        console.say(f"  on a bound, so not determined by the data: {', '.join(content['at_bounds'])}")
    for warning in content["warnings"]:
        console.say(f"  WARNING: {warning}")
    *_, page = calibration_files(out)
    console.say(f"Written: {out}. Report: {page}")
    return content
