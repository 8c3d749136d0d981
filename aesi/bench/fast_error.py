"""How large is the error of models of measured cells within seconds? Measures the fast model error of the tracer.

The records are the development controls of `aesi bench real` (no fault added) at 25 degC with a changing current. The
cell model is fitted to each as the tracer fits a measured cell. For the fast residual, which is the residual minus its
mean over `WINDOW_S` (aesi/tracer/case/blocks.py), the command prints the RMS, the correlation time, and the relative
error of the ohmic resistance that would explain it. Then each effect is fitted to first order. As no effect is present,
the fitted sizes over their standard deviations should scatter with a standard deviation of one; they do if the tracer
assumes the right number of independent samples. The effect `clock_skew` is left out of the mean over the effects,
because the voltage channel of one cycler really lags.

    python -m aesi.bench.fast_error

prints one line per record and, last, the means over the records.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from aesi.bench.real.case import RealCase
from aesi.bench.real.judge import declared_cell, taken
from aesi.bench.real.plan import chosen
from aesi.bench.real.repeatability import sizes_in_sds
from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.pipeline.discovery.discover import HOLDOUT
from aesi.tracer.case.blocks import blocks_of
from aesi.tracer.case.problem import OHMIC_SHARE
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.likelihood.growth import Parent
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.hypothesis_fits import base_of

RIGHT_TEMPERATURE = ("25degC", "drive_cycle")
"""Parts of the names of the records that were measured at the temperature of their cell file."""
CONSTANT = ("cap_1c",)
"""Parts of the names of the records with a constant current, which are left out: they show no fast response."""
THERE = "clock_skew"
"""Effect that is really present in some records: the voltage channel of one cycler lags by 0.12 s on three of them."""


def fast_controls() -> Iterator[RealCase]:
    """The development controls at the temperature of their cell file whose current changes."""
    for case in chosen(only="control-", development=True):
        if case.good or any(word in case.take.file for word in CONSTANT):
            continue
        if any(word in case.take.file for word in RIGHT_TEMPERATURE):
            yield case


def fast_error(case: RealCase) -> dict[str, Any]:
    """The row of one record.

    `rms_mv` is the RMS of the fast residual, `lasts_s` its correlation time, `resistance_off` the relative error of the
    ohmic resistance that explains it best (positive if the model's resistance is too low), and `sds` the fitted size of
    each effect over its standard deviation.  `failed` stands in their place if the model cannot be fitted.
    Raises DataError if the record or the cell file is not available.
    """
    problem = inverse_problem(
        declared_cell(case.cell, "experiments/cells"), [taken(case.take)], case.soc0, HOLDOUT
    )
    problem = replace(problem, trust="measured")
    blocks, archive = blocks_of(problem), Archive(None, "")
    base, windows = base_of(problem, blocks, archive), blocks.windows
    if base is None or windows is None:
        return {"case": case.name, "failed": True}
    left, contact = (
        column - windows.means(column[:, None])[:, 0]
        for column in (base.point.residual_v, base.point.fast_errors_v[:, 0])
    )
    return {
        "case": case.name,
        "rms_mv": MV_PER_V * float(np.sqrt(np.average(left**2, weights=windows.row_duration_s))),
        "lasts_s": lasts_s(problem.time_s, left),
        "resistance_off": OHMIC_SHARE * float(left @ contact) / float(contact @ contact),
        "sds": sizes_in_sds(Parent(problem, blocks, base), archive),
    }


def lasts_s(time_s: Array, error: Array) -> float:
    """Integral correlation time of an error, s: 1 s plus twice the sum of its autocorrelation over lags of whole
    seconds, up to the first lag without positive correlation and at most 119 s.

    time_s : (n,) s, increasing.  error : (n,) V.
    """
    every_s = np.arange(time_s[0], time_s[-1])
    e = np.interp(every_s, time_s, error)
    lags = [float(np.mean(e[k:] * e[: len(e) - k])) for k in range(min(len(e), 120))]
    ends = next((k for k, value in enumerate(lags) if value <= 0.0), len(lags))
    return 1.0 + 2.0 * sum(lags[1:ends]) / lags[0]


def main() -> None:
    """Print one line per record and the summary."""
    rows = []
    for case in fast_controls():
        rows.append(fast_error(case))
        print(json.dumps(rows[-1]), flush=True)
    print(json.dumps(_summary([row for row in rows if "sds" in row])))


def _summary(ran: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The summary over the records that could be fitted: geometric means of RMS (mV) and correlation time (s), RMS and
    median of the relative resistance errors, and the RMS of size over standard deviation by effect."""
    return {
        "summary": True,
        "records": len(ran),
        "rms_mv": round(float(np.exp(np.mean([np.log(row["rms_mv"]) for row in ran]))), 2),
        "lasts_s": round(float(np.exp(np.mean([np.log(row["lasts_s"]) for row in ran]))), 1),
        "resistance_off_rms": round(rms([row["resistance_off"] for row in ran]), 3),
        "resistance_off_median": round(float(np.median([abs(row["resistance_off"]) for row in ran])), 3),
        "rms_sds": {
            name: round(rms([row["sds"][name] for row in ran if name in row["sds"]]), 2)
            for name in sorted({name for row in ran for name in row["sds"]})
        },
        "rms_sds_of_others": round(
            rms([sds for row in ran for name, sds in row["sds"].items() if name != THERE]), 2
        ),
    }


if __name__ == "__main__":
    main()
