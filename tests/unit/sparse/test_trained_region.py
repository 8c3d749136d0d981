"""A sample is remote where it lies outside the trained ranges, or in a gap between the drives."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.numerics.visited import LENGTH, RESOLUTION
from aesi.records import Split
from aesi.sparse import Options, Problem
from aesi.sparse.trained_region import DISTANCE, TrainedRegion

OPTIONS = Options(p_c=1, d=1, special=False, mixed=False, resamples=5, block=60, fade=True)


def region(soc):
    scaled = np.column_stack([np.linspace(-1.0, 1.0, len(soc)), np.linspace(1.0, -1.0, len(soc))])
    return TrainedRegion.of(scaled, soc, np.linspace(24.0, 30.0, len(soc)))


def test_inside_all_is_near_and_one_and_two_distances_outside_the_weight_is_that_of_a_normal_curve():
    trained = region(np.linspace(1.0, 0.0, 500))
    scaled = np.array([[0.0, 0.0], [1.0, -1.0], [1.0 + DISTANCE, 0.0], [0.0, 1.0 + 2.0 * DISTANCE]])
    np.testing.assert_allclose(
        trained.nearness(scaled, np.full(4, 0.5), None), [1.0, 1.0, np.exp(-0.5), np.exp(-2.0)]
    )


def test_a_gap_between_two_drives_is_remote_though_it_is_within_every_range():
    trained = region(np.concatenate([np.linspace(1.0, 0.8, 200), np.linspace(0.2, 0.0, 200)]))
    near = trained.nearness(np.zeros((3, 2)), np.array([0.9, 0.8 - LENGTH, 0.5]), None)
    assert near[0] == 1.0
    assert near[1:] == pytest.approx(np.exp(-0.5 * (np.array([LENGTH, 0.3]) / LENGTH) ** 2), rel=0.1)
    assert RESOLUTION < 0.1 * LENGTH


def test_the_search_judges_left_out_drives_by_the_rows_of_the_others():
    first, other = make_record(600, seed=0), make_record(600, seed=1)
    apart = replace(other, name="other", soc=other.soc - 2.0)
    problem = Problem.build(Split((first, apart), (), ()), OPTIONS)
    assert problem.nearness.max() < 0.01
    beside = Problem.build(Split((first, replace(first, name="other")), (), ()), OPTIONS)
    np.testing.assert_allclose(beside.nearness, 1.0)


def test_it_is_saved_with_the_model():
    trained = region(np.linspace(0.9, 0.4, 50))
    again = TrainedRegion.from_dict(json.loads(json.dumps(trained.to_dict())), 2)
    scaled, soc = np.random.default_rng(1).uniform(-2, 2, (20, 2)), np.linspace(0, 1, 20)
    warm = np.linspace(20.0, 35.0, 20)
    np.testing.assert_array_equal(again.nearness(scaled, soc, warm), trained.nearness(scaled, soc, warm))


def test_at_another_ambient_next_to_nothing_is_left_and_within_the_trained_temperatures_all():
    trained = region(np.linspace(1.0, 0.0, 500))
    degc = np.array([24.0, 27.0, 30.0, 22.0, 10.0, 45.0, np.nan])
    near = trained.nearness(np.zeros((7, 2)), np.full(7, 0.5), degc)
    np.testing.assert_array_equal(near[[0, 1, 2, 6]], 1.0)
    # 40 kJ/mol / R (1 / 295.15 K - 1 / 297.15 K) = 0.110 of an e-fold, against DISTANCE; 0.798 and 0.748 are remote.
    assert near[3] == pytest.approx(np.exp(-0.5 * (0.110 / DISTANCE) ** 2), abs=2e-3)
    assert near[4:6].max() < 0.05


def test_drives_at_one_ambient_do_not_speak_for_another():
    first, other = make_record(600, seed=0), make_record(600, seed=1)
    at = [replace(first, temperature_degc=np.full(600, 25.0))]
    cold = replace(other, name="cold", temperature_degc=np.full(600, 5.0))
    assert Problem.build(Split((*at, cold), (), ()), OPTIONS).nearness.max() < 0.05
    warm = replace(other, name="warm", temperature_degc=np.full(600, 25.0))
    np.testing.assert_allclose(Problem.build(Split((*at, warm), (), ()), OPTIONS).nearness.max(), 1.0)
