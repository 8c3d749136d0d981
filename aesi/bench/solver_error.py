"""How much do our model and an independent solver of the same cell differ? Measures the prior of the model error under
the right hypothesis.

The label of each development case of `aesi bench blind` is fitted to the laboratory's records. The likelihood of unseen
data at each size of the model error is a likelihood of that size. The sizes of all cases have a log-normal prior, whose
median and deviation maximise the likelihood of all cases.

    python -m aesi.bench.solver_error --seed 0 --cases 40

prints one line per case and a last one with that prior.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp

from aesi.bench.blind import chosen
from aesi.bench.detectable import label_problem
from aesi.constants import MV_PER_V
from aesi.data.blind import BlindCase, cells_in, generate
from aesi.errors import SimulationError
from aesi.numerics.typing import Array
from aesi.tracer.case.blocks import blocks_of
from aesi.tracer.likelihood.fit import said_at
from aesi.tracer.likelihood.model_error import Size, SplitTable
from aesi.tracer.likelihood.size_sums import SizeSums
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.fitted import fitted_hypothesis

SIZES_V = 1e-3 * np.geomspace(0.003125, 25.6, 14)
"""Tried sizes, V, a factor of two apart: two more than needed at both ends."""


def said_by_size(case: BlindCase) -> Array | None:
    """(n_sizes,) log likelihood of unseen data, nats, under the label at each size, minus the largest; None where the
    label cannot be simulated or is outside the catalogue."""
    if case.label == "unknown":
        return None
    problem = label_problem(case)
    blocks = blocks_of(problem)
    fit = fitted_hypothesis(problem, blocks, case.effects, None, Archive(None, ""))
    if fit is None:
        return None
    sums = SizeSums(SplitTable(problem, blocks, fit.point.table()))
    said = np.array([said_at(sums, fit.point, Size(size)).total for size in SIZES_V])
    return said - said.max()


def most_likely_prior(said: Sequence[Array]) -> tuple[float, float, float]:
    """(median, V; standard deviation of the logarithm; log likelihood) of the prior with the largest likelihood.

    said : (n_sizes,) log likelihoods of each case, nats.
    """
    table, logs = np.array(said), np.log(SIZES_V)

    def against(x: Array) -> float:
        return -log_likelihood(table, float(np.exp(x[0])), float(np.exp(x[1])))

    starts = [np.array([logs[k], 0.0]) for k in range(0, len(logs), 2)]
    best = min((minimize(against, x, method="Nelder-Mead") for x in starts), key=lambda r: float(r.fun))
    return float(np.exp(best.x[0])), float(np.exp(best.x[1])), -float(best.fun)


def log_likelihood(said: Array, median_v: float, sd: float) -> float:
    """Log likelihood, nats, of a log-normal prior over the sizes: the sum over cases of the log of the mean likelihood.

    said : (n_cases, n_sizes) log likelihoods, nats.
    """
    prior = -0.5 * (np.log(SIZES_V / median_v) / sd) ** 2
    return float(np.sum(logsumexp(said + (prior - logsumexp(prior)), axis=1)))


def row(case: BlindCase) -> dict[str, Any]:
    """The printed row of one case."""
    said = said_by_size(case)
    told: dict[str, Any] = {"case": case.spec.name, "cell": case.spec.cell, "label": case.label}
    if said is None:
        return told | {"said": None}
    return told | {
        "most_likely_mv": MV_PER_V * float(SIZES_V[np.argmax(said)]),
        "said": said.round(2).tolist(),
    }


def main() -> None:
    """Print one line per case and the prior."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--cells", default="experiments/cells")
    options = parser.parse_args()
    said = []
    for spec in chosen(options.cases, seed=options.seed):
        try:
            case = generate(spec, cells_in(Path(options.cells)))
        except SimulationError:  # the laboratory cannot make it as planned
            continue
        one = row(case)
        print(json.dumps(one), flush=True)
        if one["said"] is not None:
            said.append(np.array(one["said"]))
    median_v, sd, best = most_likely_prior(said)
    print(
        json.dumps(
            {"summary": True, "cases": len(said), "median_mv": MV_PER_V * median_v, "sd": sd, "nats": best}
        )
    )


if __name__ == "__main__":
    main()
