"""A sample is remote where it lies outside the trained ranges, or in a gap between the drives."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.numerics.visited import RESOLUTION
from aesi.records import Split
from aesi.sparse import Options, Problem
from aesi.sparse.trained_region import (
    DISTANCE,
    LEAST_TESTED,
    TrainedRegion,
    farthest_left_out,
)

OPTIONS = Options(p_c=1, d=1, special=False, mixed=False, resamples=5, block=60, fade=True)


def region(soc, tested=0.2):
    scaled = np.column_stack([np.linspace(-1.0, 1.0, len(soc)), np.linspace(1.0, -1.0, len(soc))])
    return TrainedRegion.of(scaled, soc, tested)


def test_inside_nothing_is_remote_and_at_the_stated_distance_the_weight_is_a_half():
    trained = region(np.linspace(1.0, 0.0, 500))
    scaled = np.array([[0.0, 0.0], [1.0, -1.0], [1.0 + DISTANCE, 0.0], [3.0, 0.0]])
    weight = 1.0 / (1.0 + trained.remoteness(scaled, np.full(4, 0.5)))
    np.testing.assert_allclose(weight, [1.0, 1.0, 0.5, 1.0 / 401.0])


def test_a_gap_between_two_drives_is_remote_though_it_is_within_every_range():
    trained = region(np.concatenate([np.linspace(1.0, 0.8, 200), np.linspace(0.2, 0.0, 200)]), tested=0.2)
    remote = trained.remoteness(np.zeros((3, 2)), np.array([0.9, 0.6, 0.5]))
    np.testing.assert_allclose(remote, [0.0, 1.0, 2.25], rtol=0.05)


def test_a_correction_counts_as_tested_as_far_as_left_out_drives_lay_from_the_others():
    soc = np.concatenate([np.linspace(1.0, 0.9, 100), np.linspace(0.6, 0.5, 100)])
    assert farthest_left_out(soc, [(0, 100), (100, 200)]) == pytest.approx(0.4, abs=RESOLUTION)
    assert farthest_left_out(np.tile(np.linspace(1.0, 0.0, 300), 2), [(0, 300), (300, 600)]) == 0.0
    assert region(np.linspace(1.0, 0.0, 300), tested=0.0).tested == LEAST_TESTED


def test_the_search_judges_left_out_drives_by_the_rows_of_the_others():
    first, other = make_record(600, seed=0), make_record(600, seed=1)
    apart = replace(other, name="other", soc=other.soc - 2.0)
    problem = Problem.build(Split((first, apart), (), ()), OPTIONS)
    assert problem.region.tested == pytest.approx(
        np.abs(first.soc[:, None] - apart.soc).min(axis=0).max(), rel=0.05
    )
    assert problem.fade.max() < 1.0
    beside = Problem.build(Split((first, replace(first, name="other")), (), ()), OPTIONS)
    np.testing.assert_allclose(beside.fade, 1.0)


def test_it_is_saved_with_the_model():
    trained = region(np.linspace(0.9, 0.4, 50))
    again = TrainedRegion.from_dict(json.loads(json.dumps(trained.to_dict())))
    scaled, soc = np.random.default_rng(1).uniform(-2, 2, (20, 2)), np.linspace(0, 1, 20)
    np.testing.assert_array_equal(again.remoteness(scaled, soc), trained.remoteness(scaled, soc))
