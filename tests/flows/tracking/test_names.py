"""Names that a user gives, of files and of cells, in a store that does not take every name."""

import pytest

from aesi.pipeline.experiment.sections import TrackingConfig
from flows.tracking.delivery import deliver
from flows.tracking.store import KIND
from flows.tracking.tracker import Subject, Tracker, flat

QUIET = Subject("small", 0, "digest", "discovery", TrackingConfig(system_metrics=False, log_model=False))


@pytest.mark.parametrize("file", ["drive(1).csv", "25 °C, US06.csv", "a+b.csv", "raw//a.csv", "x" * 250])
def test_a_file_with_a_bracket_in_its_name_lost_all_parameters_of_its_run(store, said, file):
    tracker = Tracker(store, QUIET, said.append)
    tracker.parameters(flat({"seed": 3, "data": {"from_s": {file: 600.0}}}), {"aesi.setting": "x"})
    assert (tracker.end("FINISHED"), said) == (0, [])
    run = store.run(tracker.run_id)
    assert run.data.params == {"seed": "3", "data.from_s": f'{{"{file}": 600.0}}'.replace("°", "\\u00b0")}
    assert run.data.tags["aesi.setting"] == "x"


def test_other_names_are_dotted_as_before():
    files = {"US06 25degC.csv": 600.0, "../raw/b-2.csv": 60.0}
    assert flat({"data": {"from_s": files, "columns": {}}}) == {
        **{f"data.from_s.{name}": value for name, value in files.items()},
        "data.columns": {},
    }


def test_a_discovery_of_many_records_had_a_longer_name_than_postgresql_takes(store, said):
    records = ", ".join(f"2024-03-{day:02d} drive cycle at 25 degC" for day in range(1, 31))
    tracker = Tracker(store, QUIET, said.append, title=records)
    tracker.nested("cell:1", records, "cell", {}, {})
    assert (tracker.end("FINISHED"), said) == (0, [])
    (nested,) = store.children(tracker.experiment_id, tracker.run_id).values()
    for run in (store.run(tracker.run_id), nested):
        assert len(run.info.run_name) == 250  # MLflow's column
        assert run.info.run_name.startswith(records[:249])


def test_a_cell_with_an_apostrophe_was_not_found_to_be_sent_before(store):
    experiment = store.experiment("cells")
    parent = store.create_run(experiment, "a run", {KIND: "run"})
    whose = {"experiment_id": experiment, "parent": parent, "label": "cell:Anna's", "name": "Anna's"}
    content = {"tags": {}, "params": {}, "metrics": {}, "files": {}}
    ended = {"status": "FINISHED", "start_ms": 1_000, "end_ms": 2_000}
    for again in (False, True):
        deliver(store, {"kind": "run"} | whose | content | ended, again)
    assert list(store.children(experiment, parent)) == ["cell:Anna's"]
    assert store.child(experiment, parent, "cell:Anna's").info.run_name == "Anna's"


def test_the_address_of_a_run_opened_the_pages_for_language_models(store, said):
    tracker = Tracker(store, QUIET, said.append)
    assert tracker.address.endswith(f"/runs/{tracker.run_id}?workflowType=machine_learning")
    tracker.end("FINISHED")
