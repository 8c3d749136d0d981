"""`aesi run`, whole, on a small virtual experiment: outputs, tracking, tables, resumption."""

import json
import re
import shutil
import time
from pathlib import Path

import pandas as pd
import pytest

from flows.tracking.store import KIND, Store

METRICS = {
    "loss/oob",
    "loss/valid",
    "loss/sparse",
    "fitness",
    "pearson/train",
    "pearson/valid",
    "free_run/valid_mser_pct",
    "free_run/valid_mser_recalibrated_pct",
    "one_step/valid_rmse_mv",
    "intervals/valid_coverage_pct",
    "intervals/valid_width_v",
}
PARAMETERS = {
    "lambda1",
    "lambda2",
    "tau",
    "p_c",
    "d",
    "library_terms",
    "library_hash",
    "seed",
    "data_hashes",
    "versions",
}


def tracked_runs(workspace=None):
    store = Store(f"sqlite:///{workspace}/mlflow.db" if workspace else None)
    experiment = store.find_experiment("smoke")
    (parent, *others) = store.runs(experiment, f"tags.`{KIND}` = 'run'")
    assert not others
    return store, parent, store.children(experiment, parent.info.run_id)


def candidates(children):
    return {label: run for label, run in children.items() if label.startswith("candidate:")}


def fingerprint(children):
    """What decides whether two runs ended alike."""
    return {
        label: (run.data.params["lambda1"], run.data.params["library_hash"], run.data.metrics.get("fitness"))
        for label, run in candidates(children).items()
    }


def test_a_run_leaves_its_outputs(finished):
    (folder,) = (finished / "runs" / "smoke").iterdir()
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["schema"] == "aesi.summary/1"
    assert summary["mlflow_run_id"] == folder.name
    assert summary["candidates"] == 6
    assert [row["name"] for row in summary["models"]] == ["ESPM", "ESPM + AESI I", "ESPM + ridge"]
    assert summary["models"][0]["free_run"]["test_mser_pct"] == pytest.approx(0, abs=1e-9)
    for name in ("report.html", "tables.md", "tables.tex", "model/model.json"):
        assert (folder / name).stat().st_size > 100


@pytest.mark.parametrize("page", ["report.html", "figures/paper.html"])
def test_the_figures_of_the_paper_are_drawn(finished, page):
    (folder,) = (finished / "runs" / "smoke").iterdir()
    content = (folder / page).read_text()
    for figure in ("bootstrap_coverage", "error_map_after", "violin", "ranking", "intervals_1"):
        assert f'"{figure}":' in content


def test_settings_records_and_every_candidate_of_a_run_are_tracked(finished):
    store, parent, children = tracked_runs(finished)
    assert parent.info.status == "FINISHED"
    assert {"seed", "search.candidates", "versions", "chosen_candidate"} <= parent.data.params.keys()
    assert "aesi.dirty" in parent.data.tags
    roles = {tag.value for entry in parent.inputs.dataset_inputs for tag in entry.tags}
    assert roles == {"train", "valid", "test"}
    assert len(candidates(children)) == 6
    for child in candidates(children).values():
        assert child.data.params.keys() >= PARAMETERS
        assert child.info.status == ("FAILED" if "aesi.failed" in child.data.tags else "FINISHED")
        if child.info.status == "FINISHED":
            assert child.data.metrics.keys() >= METRICS
            path = store.client.download_artifacts(child.info.run_id, "coefficients.json")
            content = json.loads(Path(path).read_text())
            assert set(content) == {"bagging", "stability", "inclusion"}
            assert set(content["bagging"]) <= set(content["inclusion"])
            assert child.info.end_time > child.info.start_time
    headlines = {name.split("/")[0] for name in parent.data.metrics} - {
        "system",
        "terms",
        "fit_and_evaluation_s",
    }
    assert headlines == {"free_run", "one_step", "intervals", "tables"}
    of_candidates = {name for child in candidates(children).values() for name in child.data.metrics}
    assert not [name for name in of_candidates if "test" in name]  # only the chosen model meets the test set


def served_by_mlflow(workspace):
    """The model that a run of the small experiment registered, as MLflow loads it."""
    import mlflow

    before = mlflow.get_tracking_uri()
    mlflow.set_tracking_uri(f"sqlite:///{workspace}/mlflow.db")
    try:
        return mlflow.pyfunc.load_model("models:/smoke/1")
    finally:
        mlflow.set_tracking_uri(before)


def test_the_model_is_served_by_mlflow_and_is_the_saved_one(finished):
    import numpy as np
    import pandas as pd

    import aesi

    (folder,) = (finished / "runs" / "smoke").iterdir()
    assert not [path for path in (finished / "mlartifacts").rglob("*") if path.suffix in (".pkl", ".pickle")]
    served = served_by_mlflow(finished)
    time_s = np.arange(0.0, 60.0, 2.0)
    table = pd.DataFrame({"time_s": time_s, "current_a": np.full(30, 20.0)})
    ours = aesi.HybridModel.load(folder / "model").predict(time_s, table["current_a"].to_numpy(), soc0=0.7)
    assert np.array_equal(served.predict(table, params={"soc0": 0.7})["voltage_v"], ours.voltage_v)
    assert "read from voltage_v" in served.metadata.metadata["inputs"]["soc0"]


def test_a_measured_record_was_served_from_where_the_training_records_began(finished):
    import numpy as np
    import pandas as pd

    import aesi

    (folder,) = (finished / "runs" / "smoke").iterdir()
    model, served = aesi.HybridModel.load(folder / "model"), served_by_mlflow(finished)
    time_s = np.arange(0.0, 600.0, 2.0)
    current_a = np.where(time_s < 60.0, 0.0, 20.0)
    elsewhere = model.soc0 - 0.3
    voltage_v = model.predict(time_s, current_a, soc0=elsewhere).voltage_v
    table = pd.DataFrame({"time_s": time_s, "current_a": current_a})
    measured = table.assign(voltage_v=voltage_v)
    ours = model.predict(time_s, current_a, voltage_v=voltage_v)
    assert np.array_equal(served.predict(measured)["voltage_v"], ours.voltage_v)
    assert not np.allclose(
        served.predict(measured, params={"soc0": model.soc0})["voltage_v"], ours.voltage_v, atol=1e-4
    )
    assert np.array_equal(
        served.predict(table)["voltage_v"], model.predict(time_s, current_a, soc0=model.soc0).voltage_v
    )


@pytest.mark.slow
def test_the_model_answers_mlflows_own_command(finished, tmp_path):
    import os
    import subprocess
    import sys

    time_s = [float(t) for t in range(10)]
    rows = {"time_s": time_s, "current_a": [20.0] * 10}
    (tmp_path / "rows.csv").write_text(pd.DataFrame(rows).to_csv(index=False))
    command = [sys.executable, "-m", "mlflow", "models", "predict", "--model-uri", "models:/smoke/1"]
    command += ["--env-manager", "local", "--content-type", "csv", "--input-path", str(tmp_path / "rows.csv")]
    uri = {"MLFLOW_TRACKING_URI": f"sqlite:///{finished}/mlflow.db"}
    done = subprocess.run(command, env=os.environ | uri, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout.strip().splitlines()[-1])["predictions"]
    assert len(answer) == 10
    assert all(row["lower_v"] < row["voltage_v"] < row["upper_v"] for row in answer)


def test_tables_come_from_the_store_alone(finished, tmp_path, monkeypatch):
    from flows.results.tables import tables_of

    (folder,) = (finished / "runs" / "smoke").iterdir()
    before = (folder / "tables.md").read_text()
    uri = f"sqlite:///{finished}/mlflow.db"
    monkeypatch.setenv("AESI_HOME", str(tmp_path))  # a workspace without runs/ and .aesi/
    text = tables_of("smoke", uri=uri)
    assert text.startswith(before.rstrip("\n"))
    assert folder.name in text
    assert tables_of("smoke", "tex", uri=uri).count(r"\begin{tabular}") == before.count("|---|")
    assert 'model,"MSER train, %"' in tables_of("smoke", "csv", uri=uri)
    tables_of("smoke", figures=tmp_path / "figures", uri=uri)
    for page in ("report.html", "figures/paper.html"):
        assert (tmp_path / "figures" / folder.name / page).read_bytes() == (folder / page).read_bytes()


def test_predict_in_both_regimes(call, finished, current, tmp_path):
    (model,) = (finished / "runs/smoke").glob("*/model")
    code, _, err = call(
        "predict", "--model", model, "--current", current, "--out", tmp_path / "p.csv", "--soc0", 0.6
    )
    assert code == 0, err
    assert json.loads((model.parent / "summary.json").read_text())["finding"] in err
    free = pd.read_csv(tmp_path / "p.csv")
    assert {"time_s", "current_a", "voltage_v", "lower_v", "upper_v"} <= set(free)
    code, _, err = call(
        "predict", "--model", model, "--current", current, "--out", tmp_path / "q.csv", "--measured"
    )
    assert code == 2
    assert "has no voltage_v" in err
    free[["time_s", "current_a", "voltage_v"]].to_csv(tmp_path / "measured.csv", index=False)
    code, _, err = call(
        "predict",
        "--model",
        model,
        "--current",
        tmp_path / "measured.csv",
        "--out",
        tmp_path / "q.csv",
        "--measured",
    )
    assert code == 0, err
    assert (pd.read_csv(tmp_path / "q.csv")["upper_v"][5:] > free["voltage_v"][5:] - 1.0).all()


def test_seeds_become_mean_and_spread(run, finished, tracked):
    from flows.results.tables import tables_of

    shutil.copytree(finished, tracked, dirs_exist_ok=True)
    summaries = [next((tracked / "runs" / "smoke").iterdir()), run("seed=1")]
    one, two = (json.loads((folder / "summary.json").read_text()) for folder in summaries)
    text = tables_of("smoke")
    figures = [rows["models"][1]["free_run"]["test_mser_pct"] for rows in (one, two)]
    assert figures[0] != figures[1]
    assert f"{sum(figures) / 2:.2f} [{min(figures):.2f}, {max(figures):.2f}]" in text
    assert one["mlflow_run_id"] in text
    assert two["mlflow_run_id"] in text


@pytest.mark.slow
def test_interrupted_twice_says_how_to_go_on_and_resumes(aesi, arguments, tracked):
    process = aesi(*arguments("search.candidates=12"))
    wait_for(lambda: list((tracked / ".aesi/cache/candidates").glob("??/*.bin")), process)
    process.send_signal(2)
    time.sleep(0.05)
    process.send_signal(2)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert ("Stopped" in said) or ("Interrupted" in said)
    done = aesi(*arguments("search.candidates=12"), "--resume")
    _, said = done.communicate(timeout=120)
    assert done.returncode == 0, said
    assert "resumed" in said


@pytest.mark.slow
def test_a_killed_run_is_closed_by_the_next(aesi, arguments, tracked, run):
    process = aesi(*arguments())
    wait_for(lambda: list((tracked / ".aesi/state").glob("*.json")), process)
    process.kill()
    process.wait()
    run()
    store = Store()
    runs = list(store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'"))
    assert sorted(run.info.status for run in runs) == ["FINISHED", "KILLED"]


def test_a_baseline_that_cannot_be_fitted_ended_a_run_after_its_search(run):
    from flows.results.tables import tables_of

    folder = run("library.p_c=[0, 0]", "search.candidates=3", 'models=["ESPM", "AESI I", "DMD with control"]')
    summary = json.loads((folder / "summary.json").read_text())
    assert [row["name"] for row in summary["models"]] == ["ESPM", "ESPM + AESI I"]
    (note,) = [note for note in summary["notes"] if "left out" in note]
    assert note.startswith("DMD with control could not be fitted and is left out: ")
    assert note.endswith("raise p_c and d to at least 1.")
    assert note in (folder / "report.html").read_text()
    _, parent, _ = tracked_runs()
    assert parent.data.tags["aesi.unfitted"] == note
    assert note in tables_of("smoke")


def test_a_baseline_was_searched_again_by_every_run_that_went_on(run, monkeypatch, capsys):
    from aesi.sparse.baselines import BASELINES

    models = 'models=["ESPM", "AESI I", "SINDy-C", "gradient boosting"]'
    first = run(models)
    said = capsys.readouterr().err
    assert said.count("model gradient boosting: done (not stored") == 1
    assert {"validation: done", "comparison: done"} <= set(re.findall(r"\w+: done", said))
    monkeypatch.setitem(BASELINES, "SINDy-C", lambda *_: pytest.fail("it was searched again"))
    again = run(models)
    assert "model SINDy-C: from the cache" in capsys.readouterr().err
    one, two = (json.loads((folder / "summary.json").read_text())["models"] for folder in (first, again))
    assert [row["free_run"] for row in one] == [row["free_run"] for row in two]


def test_two_workers_give_the_candidates_of_one(run, finished):
    run("search.workers=2")
    assert fingerprint(tracked_runs()[2]) == fingerprint(tracked_runs(finished)[2])


def test_a_server_that_is_away_is_one_sentence(aesi, arguments):
    process = aesi(*arguments("tracking.uri=http://127.0.0.1:9"))
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said.count("\n") == 1  # before anything is begun
    assert "the tracking store http://127.0.0.1:9 cannot be used" in said
    assert "start the server" in said


def wait_for(condition, process, timeout_s=90):
    deadline = time.monotonic() + timeout_s
    while not condition():
        if process.poll() is not None:
            raise AssertionError(f"ended early: {process.communicate()[1]}")
        assert time.monotonic() < deadline
        time.sleep(0.02)
