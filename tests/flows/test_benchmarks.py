"""The benchmarks of the platform, small: they measure what they say, and leave nothing behind."""

import pytest

from flows import benchmarks


def test_tracking_costs_something_and_leaves_the_workspace_alone(workspace):
    small = {"terms": 12, "n": 4000, "resamples": 10, "candidates": 2, "rounds": 1, "artifact_kb": 5.0}
    (line,) = benchmarks.run("tracking", **small)
    assert line["untracked_s"] > 0
    assert 0 < line["waits_s"] < 1
    assert line["artifact_kb"] == pytest.approx(5.0, rel=0.1)
    assert not list(workspace.iterdir())


@pytest.mark.slow
def test_two_dask_workers_share_the_work_evenly(workspace):
    from pathlib import Path

    smoke = Path(__file__).resolve().parents[2] / "experiments" / "smoke.yaml"
    (line,) = benchmarks.run(
        "scale", experiment=str(smoke), candidates=16, overrides=("search.resamples=100",)
    )
    assert line["ratio_by_processor"] > 1.5


@pytest.mark.slow
def test_tracking_adds_less_than_a_tenth_to_a_candidate_of_the_papers_size():
    (line,) = benchmarks.run("tracking", candidates=6)
    assert line["overhead_pct"] < 10, line
