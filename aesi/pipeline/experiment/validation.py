"""The validation figure that stands beside the test figure: from drives that chose nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.experiment.physics_models import DECLARED, PHYSICS_NAMES
from aesi.sparse import Candidate, Problem
from aesi.sparse.search.nested import nested_shares


def validation_mser(
    loaded: Loaded, problem: Problem, candidates: Sequence[Candidate]
) -> dict[str, float]:
    """Model -> reduction of the squared error against the declared physics, per cent, over left-out training drives.

    Physics is refitted without each drive, and AESI I and II are chosen without it (`nested_shares`); what they leave
    of the error of physics that saw the drive is taken for what they leave of the error of physics that did not.
    Empty where the search had one training drive, or pieces of drives, to leave out.
    """
    drives = loaded.left_out
    if len(drives) < 2 or problem.folds != problem.spans:
        return {}
    declared = np.array([np.sum(drive.left_by(DECLARED) ** 2) for drive in drives])
    base = np.array([np.sum(drive.error_v**2) for drive in drives])
    left = {
        name: np.array([np.sum(drive.left_by(name) ** 2) for drive in drives]) for name in PHYSICS_NAMES
    }
    for number, name in enumerate(("AESI I", "AESI II")):
        left[name] = base * nested_shares(problem, candidates, number)
    return {name: float(100.0 * (1.0 - each.sum() / declared.sum())) for name, each in left.items()}
