"""How much do this package's model and an independent solver differ on the same virtual cell?

The answer is the prior of the model error under the right hypothesis on virtual cells. The effects of the label are
fitted to the records that PyBaMM simulated for each case of `aesi bench blind` (seed 0 is for development). The
likelihood of held-out data as a function of the size of the model error is the likelihood of that size. A log-normal
prior describes the sizes of all cases; its median and the standard deviation of its logarithm are those that maximise
the likelihood of all cases together.

    python -m aesi.bench.solver_error --seed 0 --cases 40

prints one line per case and, last, the prior.
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
from aesi.tracer.likelihood.fit import point_score_at_size
from aesi.tracer.likelihood.model_error import Size, SplitTable
from aesi.tracer.likelihood.size_sums import SizeSums
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.hypothesis_fits import fitted_hypothesis

SIZES_V = 1e-3 * np.geomspace(0.003125, 25.6, 14)
"""Sizes of the model error at which the likelihood is evaluated, V, a factor of two apart. The grid is two steps wider
at both ends than the sizes of the cases need."""


def said_by_size(case: BlindCase) -> Array | None:
    """Log likelihood of held-out data under the label at each of SIZES_V minus its maximum, (n_sizes,) nats.

    None if the label cannot be simulated or its effect is in no catalogue ('unknown').
    """
    if case.label == "unknown":
        return None
    problem = label_problem(case)
    blocks = blocks_of(problem)
    fit = fitted_hypothesis(problem, blocks, case.effects, None, Archive(None, ""))
    if fit is None:
        return None
    sums = SizeSums(SplitTable(problem, blocks, fit.point.table()))
    said = np.array([point_score_at_size(sums, fit.point, Size(size)).total for size in SIZES_V])
    return said - said.max()


def most_likely_prior(said: Sequence[Array]) -> tuple[float, float, float]:
    """The log-normal prior with the largest likelihood: (median, V; standard deviation of the natural logarithm; log
    likelihood, nats).

    said : of each case, the log likelihoods (n_sizes,) of `said_by_size`, nats.
    """
    table, logs = np.array(said), np.log(SIZES_V)

    def against(x: Array) -> float:
        return -log_likelihood(table, float(np.exp(x[0])), float(np.exp(x[1])))

    starts = [np.array([logs[k], 0.0]) for k in range(0, len(logs), 2)]
    best = min((minimize(against, x, method="Nelder-Mead") for x in starts), key=lambda r: float(r.fun))
    return float(np.exp(best.x[0])), float(np.exp(best.x[1])), -float(best.fun)


def log_likelihood(said: Array, median_v: float, sd: float) -> float:
    """Log likelihood of a log-normal prior over the sizes, nats: the sum over the cases of the logarithm of the case's
    likelihood, averaged over the sizes with the prior as weight.

    said : (n_cases, n_sizes) log likelihoods, nats.  median_v : V.  sd : standard deviation of the natural logarithm.
    """
    prior = -0.5 * (np.log(SIZES_V / median_v) / sd) ** 2
    return float(np.sum(logsumexp(said + (prior - logsumexp(prior)), axis=1)))


def row(case: BlindCase) -> dict[str, Any]:
    """The row of one case: its most likely size of the model error, mV, and the log likelihoods of all sizes, nats;
    `said` is None where `said_by_size` is."""
    said = said_by_size(case)
    told: dict[str, Any] = {"case": case.spec.name, "cell": case.spec.cell, "label": case.label}
    if said is None:
        return told | {"said": None}
    return told | {
        "most_likely_mv": MV_PER_V * float(SIZES_V[np.argmax(said)]),
        "said": said.round(2).tolist(),
    }


def main() -> None:
    """Print one line per case and, last, the prior with the largest likelihood."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--cells", default="experiments/cells")
    options = parser.parse_args()
    said = []
    for spec in chosen(options.cases, seed=options.seed):
        try:
            case = generate(spec, cells_in(Path(options.cells)))
        except SimulationError:  # the laboratory cannot simulate the case as planned
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
