"""Cases of the tracer from experiment files."""

from pathlib import Path

from aesi.pipeline.discovery.cases import case_of_experiment
from aesi.pipeline.experiment.config import read_experiment

EXPERIMENTS = Path(__file__).resolve().parents[3] / "experiments"


def test_the_measured_case_is_judged_where_its_fit_ends(shared_data, monkeypatch):
    monkeypatch.setenv("AESI_DATA", str(shared_data / "measured"))
    case = case_of_experiment(read_experiment(EXPERIMENTS / "measured_nmc.yaml", []))
    assert [m.name for m in case.measurements] == ["C20", "C2", "1C", "drive_cycle"]
    assert case.measurements[0].time_s[-1] > 70_000
    assert case.measurements[-1].time_s[-1] == 4000
    assert case.tests[0].time_s[-1] == 8000
