"""A tracking store that is made anew."""

from types import SimpleNamespace

import pytest
from alembic.runtime.migration import HeadMaintainer

from aesi.errors import InputError
from flows.tracking.store import Store, StoreAway


def test_a_store_that_was_interrupted_while_it_was_made_could_never_be_used(tmp_path, monkeypatch):
    uri, move_on, steps = f"sqlite:///{tmp_path}/mlflow.db", HeadMaintainer.update_to_step, []

    def interrupted(self, step):
        steps.append(step)
        if len(steps) == 40:  # of some fifty that MLflow changes its tables in
            raise KeyboardInterrupt
        move_on(self, step)

    with monkeypatch.context() as patch:
        patch.setattr(HeadMaintainer, "update_to_step", interrupted)
        with pytest.raises(KeyboardInterrupt):
            Store(uri)
    assert Store(uri).experiment("again")


@pytest.fixture
def made(monkeypatch):
    """Names of the experiments that a store without a database behind it makes, with the places of their files."""
    places = {}
    client = SimpleNamespace(
        search_experiments=lambda max_results: [],
        get_experiment_by_name=lambda name: None,
        create_experiment=lambda name, place: places.setdefault(name, place),
    )
    monkeypatch.setattr("mlflow.MlflowClient", lambda **_: client)
    for reach in ("_reach", "_reach_database"):
        monkeypatch.setattr(f"flows.tracking.store.{reach}", lambda uri: None)
    return places


def test_files_of_a_run_in_a_database_were_left_in_the_folder_that_the_command_was_started_in(
    made, workspace, tmp_path_factory, monkeypatch
):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    Store("postgresql://me@there/tracking").experiment("drive")
    assert made == {"drive": (workspace / "mlartifacts" / "drive").as_uri()}


def test_a_server_keeps_the_files_of_runs_where_it_says(made):
    for uri in ("http://there:5000", "databricks"):
        Store(uri).experiment(uri)
    assert made == {"http://there:5000": None, "databricks": None}


def test_files_of_a_run_were_left_at_the_path_of_another_machine(tracked, tmp_path_factory):
    store, there = Store(), tmp_path_factory.mktemp("there") / "mlartifacts" / "drive"
    number = store.client.create_experiment("drive", there.as_uri())
    with pytest.raises(
        StoreAway, match=f"keeps its artifacts in {there}, which is not on this machine; mount"
    ):
        store.experiment("drive")
    run = store.client.create_run(number)
    beside = tracked / "mlartifacts" / "drive"
    away = f"its files are in {there}, which is not here; mount or restore it at that path, or copy it to {beside}"
    assert store.files_away(run) == away
    for name in (
        "summary.json",
        "inputs/records.json",
    ):  # of the latter nothing was said but that it is missing
        with pytest.raises(InputError, match=f"carries no {name}: {away}"):
            store.read(run, name)
    assert not there.exists()
    there.mkdir(parents=True)
    assert store.experiment("drive") == number
    with pytest.raises(InputError, match=r"summary\.json\.$"):
        store.read(run, "summary.json")


def test_an_experiment_whose_folder_was_not_made_yet_is_at_home(tracked):
    store = Store()
    number = store.client.create_experiment("drive", (tracked / "mlartifacts" / "drive").as_uri())
    assert store.experiment("drive") == number
