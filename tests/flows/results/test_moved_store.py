"""A store that was copied with its artifacts, the original gone."""

import shutil

from flows.results.tables import tables_of
from flows.tracking.store import KIND, Store


def copied(source, target):
    target.mkdir()
    for path in source.glob("mlflow.db*"):
        shutil.copy(path, target)
    shutil.copytree(source / "mlartifacts", target / "mlartifacts")
    return target


def test_a_moved_store_carried_no_readable_summary(finished, tmp_path, monkeypatch):
    original = copied(finished, tmp_path / "original")
    here = f"sqlite:///{original / 'mlflow.db'}"
    before = tables_of("smoke", uri=here)
    moved = tmp_path / "a folder with spaces" / "moved"
    moved.parent.mkdir()
    shutil.copytree(original, moved)
    shutil.rmtree(original)
    uri = f"sqlite:///{moved / 'mlflow.db'}"
    store = Store(uri)
    (note,) = store.notes
    assert str(moved / "mlartifacts" / "smoke") in note
    assert tables_of("smoke", uri=uri) == before
    for run in store.runs(store.find_experiment("smoke"), ""):
        assert run.info.artifact_uri.startswith((moved / "mlartifacts").as_uri())
    assert not Store(uri).notes  # once is enough


def test_a_renamed_experiment_could_not_be_read_once_its_store_had_moved(finished, tmp_path):
    original = copied(finished, tmp_path / "original")
    store = Store(f"sqlite:///{original / 'mlflow.db'}")
    store.client.rename_experiment(store.find_experiment("smoke"), "the first try")
    before = tables_of("the first try", uri=store.uri)
    store.database.engine.dispose()
    moved = original.rename(tmp_path / "moved")
    assert tables_of("the first try", uri=f"sqlite:///{moved / 'mlflow.db'}") == before


def test_a_discovery_of_the_same_experiment_took_the_place_of_its_runs(finished, tmp_path):
    here = copied(finished, tmp_path / "here")
    uri = f"sqlite:///{here / 'mlflow.db'}"
    before = tables_of("smoke", uri=uri)
    store = Store(uri)
    later = store.create_run(store.find_experiment("smoke"), "drive", {KIND: "run", "verdict": "none"})
    store.client.set_terminated(later)
    assert tables_of("smoke", uri=uri) == before


def test_a_store_whose_artifacts_stayed_is_left_alone(finished, tmp_path):
    alone = tmp_path / "database only"
    alone.mkdir()
    for path in finished.glob("mlflow.db*"):
        shutil.copy(path, alone)
    store = Store(f"sqlite:///{alone / 'mlflow.db'}")
    assert not store.notes
    (run,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
    assert store.read(run, "summary.json").is_file()


def test_what_is_read_of_a_local_store_left_a_copy_in_the_folder_for_temporary_files(
    finished, tmp_path, monkeypatch
):
    here = copied(finished, tmp_path / "here")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    assert tables_of("smoke", uri=f"sqlite:///{here / 'mlflow.db'}")
    assert not list((tmp_path / "temporary").iterdir())


def test_artifacts_go_beside_the_database(tmp_path, empty_store, monkeypatch):
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(empty_store, other / "mlflow.db")
    store = Store(f"sqlite:///{other / 'mlflow.db'}")
    run_id = store.create_run(store.experiment("one"), "run", {})
    assert store.client.get_run(run_id).info.artifact_uri.startswith((other / "mlartifacts" / "one").as_uri())


def test_the_store_that_an_experiment_file_names_was_not_looked_into(finished, tmp_path, call):
    here = copied(finished, tmp_path / "here")
    file = tmp_path / "mine.yaml"
    file.write_text(
        "name: smoke\ndata: {kind: virtual}\n" + f"tracking: {{uri: 'sqlite:///{here / 'mlflow.db'}'}}\n"
    )
    code, out, err = call("tables", file)
    assert code == 0, err
    assert "tracked run" in out
