"""The evaluating function from the experiment alone, for processes that share no memory with the one that asks."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

from aesi.pipeline.experiment.candidate import ScoredCandidate, scorer
from aesi.records import Failed
from flows.base import environment


def build_scorer(content: str, base: str) -> partial[ScoredCandidate | Failed]:
    """The evaluating function of an experiment given as JSON; `base` is the folder its paths start from."""
    from aesi.pipeline.experiment.config import parse_experiment
    from aesi.pipeline.experiment.fit import build_problem
    from aesi.pipeline.experiment.load import load

    environment.prepare_process()
    config = parse_experiment(json.loads(content), Path(base))
    return scorer(build_problem(load(config), config), config)
