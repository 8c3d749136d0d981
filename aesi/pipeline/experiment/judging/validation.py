"""The validation figure that stands beside the test figure: from drives that chose nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.experiment.physics_models import DECLARED, PHYSICS_NAMES
from aesi.sparse import Candidate, Problem
from aesi.sparse.search.fold_models import fold_samples
from aesi.sparse.search.nested import nested_shares


def validation_mser(loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]) -> dict[str, float]:
    """Model -> reduction of the squared error against the declared physics, per cent, over left-out parts of drives.

    Physics is refitted without each part, and AESI I and II are chosen without it (`nested_shares`); what they leave
    of the error of physics that saw it is taken for what they leave of the error of physics that did not.
    Empty where the search left out other pieces than drives or their parts.
    """
    if len(problem.folds) < 2 or not problem.folds_are_drives:
        return {}
    parts = [
        each.series.take(fold_samples(problem, a, b)[1])
        for each, (a, b) in zip(loaded.left_out, problem.folds, strict=True)
    ]
    left = {name: np.array([np.sum(part.left_by(name) ** 2) for part in parts]) for name in PHYSICS_NAMES}
    base = np.array([np.sum(part.error_v**2) for part in parts])
    for number, name in enumerate(("AESI I", "AESI II")):
        left[name] = base * nested_shares(problem, candidates, number)
    declared = left[DECLARED].sum()
    return {name: float(100.0 * (1.0 - each.sum() / declared)) for name, each in left.items()}
