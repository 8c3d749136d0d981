"""The measured NMC pouch cell, published parameters as they are: trained on repeats 1, 3 and 5 of its drive cycle.

Repeats 2 and 4 choose nothing: they are met once, by the model that the search picked.
"""

import numpy as np
import pytest

import aesi
from aesi.numerics.metrics import mser
from aesi.records import INPUT_NAMES, ErrorSeries, Split
from aesi.sparse import Options, Problem, evaluate, with_inputs
from flows.search.nsga2 import search

PERIOD = 1800


@pytest.fixture(scope="module")
def split(shared_data) -> Split:
    folder = shared_data / "measured" / "about_energy_nmc"
    data = aesi.read_measurement(folder / "drive_cycle.csv")
    run = aesi.simulate(
        aesi.Cell.from_bpx(folder / "cell.bpx.json"), data.time_s, data.current_a, soc0=1.0, hold="backward"
    )
    inputs = np.column_stack([data.current_a, *(run.series[name] for name in INPUT_NAMES[1:])])
    whole = with_inputs(
        ErrorSeries(
            "drive",
            1.0,
            data.time_s,
            data.voltage_v - run.voltage_v,
            inputs,
            run.series["soc"],
            run.voltage_v,
        ),
        ("I", "I_next", "I_60s", "soc"),
    )
    repeats = [
        whole.take(slice(k * PERIOD, min((k + 1) * PERIOD, len(whole))), f"repeat {k + 1}") for k in range(5)
    ]
    return Split((repeats[0], repeats[2], repeats[4]), (), (repeats[1], repeats[3]))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_free_run_on_unseen_repeats(split, seed):
    # A plain ridge without memory reaches 48 % of these; at least 60 % is asked of a tuned search.
    problem = Problem.build(split, Options(p_c=3, d=3, block=600, fold=600, seed=seed))
    candidate = evaluate(problem, search(problem, 200, seed).best().genome)
    truth = np.concatenate([record.error_v for record in split.test])
    for model in (candidate.bagging, candidate.stability):
        runs = [model.free_run(record) for record in split.test]
        assert all(run.diverged_at is None for run in runs)
        assert mser(truth, np.concatenate([run.error_v for run in runs])) > 60.0
    bagging = np.concatenate([candidate.bagging.one_step(record)[1:] for record in split.test])
    persistence = np.concatenate([record.error_v[:-1] for record in split.test])
    measured = np.concatenate([record.error_v[1:] for record in split.test])
    assert np.mean((measured - bagging) ** 2) < np.mean((measured - persistence) ** 2)
