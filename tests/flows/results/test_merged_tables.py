"""Rows of several seeds as one: means, and the range of what tables show with it."""

import pytest

from flows.results.tables import merged
from flows.tracking.store import JOB, KIND, Store
from flows.tracking.view import NOTE


def run(mser: float, coverage: float, forest: float | None):
    by_method = {} if forest is None else {"spci_refitted": {"coverage_pct": forest}}
    return [
        {
            "name": "ESPM + AESI I",
            "free_run": {"test_mser_pct": mser, "test_rmse_mv": 2.0, "diverged": int(mser < 0)},
            "intervals": {"coverage_pct": coverage},
            "intervals_by_method": by_method,
        }
    ]


def test_means_stand_with_the_range_over_seeds():
    (row,) = merged([run(30.0, 90.0, 87.0), run(45.0, 91.0, 88.0), run(36.0, 90.5, None)])
    assert row["seeds"] == 3
    assert row["free_run"]["test_mser_pct"] == pytest.approx(37.0)
    assert row["free_run"]["spread"] == {"test_mser_pct": [30.0, 45.0]}
    assert row["intervals"]["spread"] == {"coverage_pct": [90.0, 91.0]}
    assert row["intervals_by_method"]["spci_refitted"]["spread"] == {"coverage_pct": [87.0, 88.0]}


def test_a_lone_run_stays_as_it_is():
    rows = run(30.0, 90.0, None)
    assert merged([rows]) == rows


def test_records_that_diverged_are_counted_over_the_seeds():
    (row,) = merged([run(30.0, 90.0, None), run(-45.0, 91.0, None), run(-36.0, 90.5, None)])
    assert row["free_run"]["diverged"] == 2


def test_runs_that_were_named_were_averaged_as_seeds_whatever_they_were_of(call, tracked):
    store = Store()
    experiment = store.experiment("two")
    ids = []
    for setting, seed in (("a", 0), ("a", 1), ("b", 1), ("a", 1)):
        run_id = store.create_run(experiment, "two", {KIND: "run", "aesi.setting": setting})
        store.client.log_param(run_id, "seed", seed)
        store.client.log_dict(run_id, {"models": run(30.0, 90.0, None)}, "summary.json")
        store.client.set_terminated(run_id)
        ids.append(run_id)

    def named(*numbers):
        return call("tables", "two", *(word for number in numbers for word in ("--run", ids[number])))

    code, out, _ = named(0, 1)
    assert code == 0
    assert "Mean over 2 seeds" in out
    assert "Mean over" not in named(0, 0)[1]
    for other in ((0, 2), (1, 3)):
        code, _, err = named(*other)
        assert code == 2
        assert f"`aesi compare {ids[other[0]]} {ids[other[1]]}` shows them" in err


def test_runs_of_two_versions_of_the_program_were_averaged_as_seeds_of_one_setting(call, tracked):
    store = Store()
    experiment = store.experiment("two")
    ids = []

    def finish(seed, mser, *code):
        tags = {KIND: "run", "aesi.setting": "a"} | dict(zip(["aesi.code"], code, strict=False))
        run_id = store.create_run(experiment, "two", tags)
        store.client.log_param(run_id, "seed", seed)
        store.client.log_dict(run_id, {"models": run(mser, 90.0, None)}, "summary.json")
        store.client.set_terminated(run_id)
        ids.append(run_id)

    def tables(*arguments):
        return call("tables", "two", "--format", "csv", *arguments)[1]

    finish(0, 10.0)
    finish(1, 20.0)
    assert f"Mean over 2 seeds. Experiment two, tracked runs {ids[0]} (seed 0), {ids[1]}" in tables()
    finish(1, 30.0, "new")
    shown = tables()
    assert f"tracked run {ids[2]} (seed 1)." in shown
    assert shown.rstrip().endswith(f"Left out, as of another version of the program: {ids[0]} (seed 0).")
    finish(0, 40.0, "new")
    assert (
        f"Mean over 2 seeds. Experiment two, tracked runs {ids[3]} (seed 0), {ids[2]} (seed 1)." in tables()
    )
    assert "Left out" not in tables()
    code, _, err = call("tables", "two", "--run", ids[0], "--run", ids[2])
    assert code == 2
    assert "do not differ by their seeds alone" in err


def test_runs_of_other_settings_were_dropped_without_a_word(call, tracked):
    store = Store()
    ids = []
    for setting, candidates in (("a", 2), ("b", 31), ("b", 31), ("c", 60)):
        run_id = store.create_run(store.experiment("two"), "two", {KIND: "run", "aesi.setting": setting})
        for key, value in (("seed", 0), ("search.candidates", candidates), ("chosen_candidate", candidates)):
            store.client.log_param(run_id, key, value)
        store.client.log_dict(run_id, {"models": run(30.0, 90.0, None)}, "summary.json")
        store.client.set_terminated(run_id)
        ids.append(run_id)
    _, out, _ = call("tables", "two")
    others = ", ".join(i[:8] for i in (ids[2], ids[1], ids[0]))
    assert f"tracked run {ids[3]} (seed 0)." in out
    assert f"3 runs with other settings (search.candidates) left out: {others}; --run ID takes one." in out
    _, out, _ = call("tables", "two", "--run", ids[0][:8])
    assert f"tracked run {ids[0]} (seed 0)." in out
    assert "left out" not in out


@pytest.mark.parametrize("earlier", [False, True], ids=["now", "by an earlier version"])
@pytest.mark.parametrize(("job", "parameter"), [("batch", "cells"), ("benchmark", "cases")])
def test_a_batch_stood_for_the_newest_run_of_an_experiment_of_that_name(
    call, tracked, job, parameter, earlier
):
    store = Store()
    experiment = store.experiment("batch")

    def finish(tags, **parameters):
        run_id = store.create_run(experiment, "batch", {KIND: "run"} | ({} if earlier else tags))
        for key, value in parameters.items():
            store.client.log_param(run_id, key, value)
        return run_id

    of_batch = finish({JOB: job}, **{parameter: 3})
    store.client.set_terminated(of_batch)
    code, _, err = call("tables", "batch")
    assert (code, "'batch' has no finished run yet" in err) == (2, True)
    assert "aesi compare" not in err  # which takes two
    store.client.set_terminated(finish({JOB: job}, **{parameter: 3}))
    assert "`aesi compare batch` shows the 2 that are there" in call("tables", "batch")[2]
    ours = finish({JOB: "experiment"}, seed=0)
    store.client.log_dict(ours, {"models": run(30.0, 90.0, None)}, "summary.json")
    store.client.set_terminated(ours)
    store.client.set_terminated(finish({JOB: job}, **{parameter: 3}))
    code, out, _ = call("tables", "batch")
    assert (code, f"tracked run {ours} (seed 0)" in out) == (0, True)
    code, _, err = call("candidate", of_batch, "--out", tracked / "out")
    assert (code, "is no candidate of a search, nor the run of an experiment" in err) == (2, True)


@pytest.mark.parametrize(("note", "shown"), [("Our own cell", "(seed 1). Our own cell."), ("", "(seed 1).")])
def test_the_figures_of_one_seed_stood_below_the_mean_of_an_experiment_without_a_note(
    call, tracked, note, shown
):
    store = Store()
    for seed in (0, 1):
        tags = {KIND: "run", NOTE: f"{note}\n\nAESI I: 38.6 % less squared error.".strip()}
        run_id = store.create_run(store.experiment("two"), "two", tags)
        store.client.log_param(run_id, "seed", seed)
        store.client.log_dict(run_id, {"models": run(30.0, 90.0, None)}, "summary.json")
        store.client.set_terminated(run_id)
    assert call("tables", "two")[1].rstrip("\n").endswith(shown)
