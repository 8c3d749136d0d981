"""Nested runs in the store: whole, and one however often they are sent."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from mlflow.exceptions import MlflowException

from flows.tracking.delivery import deliver
from flows.tracking.outbox import Item, OfAnotherVersion
from flows.tracking.store import KIND
from flows.tracking.view import (
    DISCOVERY_COLUMNS,
    HOW_TO_READ,
    HOW_TO_READ_DISCOVERIES,
    NOTE,
    RUN_COLUMNS,
    VIEW,
    experiment_tags,
)

CONTENT = {"bagging": {"T1(I)": 0.25}}


@pytest.fixture
def item(store):
    """What a tracker hands over of a candidate; give another label for another run."""
    experiment = store.experiment("cells")
    parent = store.create_run(experiment, "a run", {KIND: "run"})

    def make(label, **changes):
        return {
            "kind": "run",
            "experiment_id": experiment,
            "parent": parent,
            "label": label,
            "name": "candidate 007",
            "tags": {KIND: "candidate"},
            "params": {"lambda1": "0.001", "versions": "python 3, numpy 2"},
            "metrics": {"fitness": 0.5, "loss/oob": 1e-9},
            "files": {"coefficients.json": json.dumps(CONTENT)},
            "status": "FINISHED",
            "start_ms": 1_000,
            "end_ms": 2_000,
        } | changes

    make.parent = parent
    return make


def children(store, item):
    return store.children(store.find_experiment("cells"), item.parent)


def coefficients(store, run):
    return json.loads(Path(store.client.download_artifacts(run.info.run_id, "coefficients.json")).read_text())


def test_sent_again_it_is_one_run(store, item):
    for again in (False, True, True):
        deliver(store, item("candidate:1"), again)
    (run,) = children(store, item).values()
    assert coefficients(store, run) == CONTENT
    assert run.data.metrics == {"fitness": 0.5, "loss/oob": 1e-9}
    assert (run.info.start_time, run.info.end_time) == (1_000, 2_000)


@pytest.mark.parametrize("local", [True, False])
@pytest.mark.parametrize("lacking", ["metrics", "params", "files", "status", "end_ms"])
def test_a_run_whose_item_lacks_a_part_was_made_in_the_store_and_stayed_running(
    store, item, monkeypatch, tracked, local, lacking
):
    monkeypatch.setattr(store, "local", local)
    of_another_version = Item(item("candidate:1"))
    del of_another_version[lacking]
    with pytest.raises(OfAnotherVersion, match=f"it lacks '{lacking}'"):
        deliver(store, of_another_version, again=False)
    assert children(store, item) == {}
    assert not list(tracked.rglob("coefficients.json"))


def test_a_run_of_which_the_store_refused_a_part_stayed_running(store, item, monkeypatch):
    monkeypatch.setattr(store, "local", False)
    refused = item("candidate:1", params={"lambda1": "0.001", "a;b": "no such name"})
    with pytest.raises(MlflowException, match="a;b"):
        deliver(store, refused, again=False)
    (run,) = children(store, item).values()
    assert (run.info.status, run.info.end_time) == ("FAILED", 2_000)
    deliver(store, item("candidate:1"), again=True)  # mended
    (run,) = children(store, item).values()
    assert (run.info.status, run.data.metrics["fitness"]) == ("FINISHED", 0.5)


def test_a_failed_candidate_has_neither_metrics_nor_files(store, item):
    deliver(store, item("candidate:1", metrics={}, files={}, status="FAILED"), again=False)
    (run,) = children(store, item).values()
    assert (run.info.status, run.data.metrics) == ("FAILED", {})


def test_a_candidate_is_marked_after_it_was_sent(store, item):
    for number in (1, 2):
        deliver(store, item(f"candidate:{number}"), again=False)
    deliver(
        store,
        {
            "kind": "mark",
            "experiment_id": store.find_experiment("cells"),
            "parent": item.parent,
            "label": "candidate:2",
            "tags": {"aesi.chosen": "true"},
        },
        again=False,
    )
    marked = {label: run.data.tags.get("aesi.chosen") for label, run in children(store, item).items()}
    assert marked == {"candidate:1": None, "candidate:2": "true"}


def test_what_a_person_wrote_about_an_experiment_stays(store):
    number = store.experiment("cells")
    store.client.set_experiment_tag(number, NOTE, "mine")
    tags = experiment_tags("ours", RUN_COLUMNS)
    deliver(store, {"kind": "experiment", "experiment_id": number, "tags": tags}, again=False)
    there = store.client.get_experiment(number).tags
    assert there[NOTE] == "mine"
    view = json.loads(there[f"mlflow.sharedViewState.{VIEW}"])
    assert view["searchFilter"] == f"tags.`{KIND}` = 'run'"  # the candidates of one run would fill the table
    columns = view["selectedColumns"]
    assert "metrics.`free_run/test_rmse_mv`" in columns


@pytest.mark.parametrize("kinds", [(RUN_COLUMNS, DISCOVERY_COLUMNS), (DISCOVERY_COLUMNS, RUN_COLUMNS)])
def test_a_run_after_a_discovery_of_one_name_was_shown_with_the_columns_of_discoveries(store, kinds):
    number = store.experiment("cells")

    first, second = kinds
    both = (*RUN_COLUMNS, *DISCOVERY_COLUMNS)
    for kind, shown in [(first, first), (first, first), (second, both), (first, both)]:
        item = {"kind": "experiment", "experiment_id": number, "tags": experiment_tags("", kind)}
        deliver(store, item, again=False)
        there = store.client.get_experiment(number).tags[f"mlflow.sharedViewState.{VIEW}"]
        assert json.loads(there)["selectedColumns"] == list(shown)


def test_the_client_told_on_stdout_where_a_run_is_amidst_the_tables_written_there(capsys, monkeypatch):
    from mlflow.store.tracking.rest_store import RestStore
    from mlflow.tracking import MlflowClient

    info = SimpleNamespace(run_name="a run", experiment_id="1")
    run = SimpleNamespace(info=info, data=SimpleNamespace(tags={}))
    monkeypatch.setattr(RestStore, "get_run", lambda *_: run)
    monkeypatch.setattr(RestStore, "update_run_info", lambda *_, **__: info)
    client = MlflowClient("http://127.0.0.1:9")
    client.set_terminated("ab" * 16)
    assert capsys.readouterr().out == ""
    monkeypatch.delenv("MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT")
    client.set_terminated("ab" * 16)
    assert "View run a run at" in capsys.readouterr().out  # else it is silenced in vain


@pytest.mark.parametrize("text", [HOW_TO_READ, HOW_TO_READ_DISCOVERIES])
def test_a_filter_for_nested_runs_was_said_to_list_what_mlflow_folds_away(text):
    """In the order of time, MLflow's own, a filtered table shows the runs that hold them."""
    assert "once they are sorted by a figure" in text
