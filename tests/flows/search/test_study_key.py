"""What a stored candidate is of: all that decides what becomes of its genome."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.pipeline.experiment.config import parse_experiment
from aesi.records import HeldOutDrive, Split
from aesi.sparse import Genome, Options, Problem, evaluate
from flows.search.study import study_key

CONFIG = parse_experiment({"name": "small", "data": {"kind": "virtual"}})


def built(records, left_out=()):
    options = Options(p_c=1, d=1, mixed=False, resamples=8, block=50, feedback=False, fade=True)
    return Problem.build(Split(tuple(records), (), ()), options, left_out=left_out)


def warm(record):
    """The record with a temperature that was measured, and moves nothing."""
    return replace(record, temperature_degc=np.full(len(record), 25.0))


def elsewhere(record):
    """The record at other states of charge."""
    return replace(record, soc=0.5 * record.soc)


def under_worse_physics(records):
    """The records left out in turn under physics that errs by twice as much."""
    doubled = [replace(record, error_v=2.0 * record.error_v) for record in records]
    return [HeldOutDrive.of(doubled, k, slice(0, len(record))) for k, record in enumerate(doubled)]


def test_the_same_records_have_the_same_key(problem):
    records = problem.split.train
    assert study_key(built(records), CONFIG) == study_key(built(records), CONFIG)


@pytest.mark.parametrize(
    "other",
    [
        lambda records: built([warm(record) for record in records]),
        lambda records: built([records[0], elsewhere(records[1])]),
        lambda records: built(records, under_worse_physics(records)),
    ],
    ids=["temperatures", "charges", "left-out physics"],
)
def test_a_candidate_of_other_temperatures_charges_or_left_out_physics_was_taken_from_the_store(
    problem, other
):
    one, another = built(problem.split.train), other(problem.split.train)
    genome = Genome.whole(one.library, 1.0, 1e-3, 0.5, 1, 1, feedback=False)
    fades = [evaluate(each, genome).bagging.fade for each in (one, another)]
    assert fades[0].to_dict() != fades[1].to_dict()
    assert study_key(one, CONFIG) != study_key(another, CONFIG)
