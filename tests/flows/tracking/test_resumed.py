"""A run that is gone on with: what it was begun with stays tracked."""

import json

import pytest

from aesi.pipeline.experiment.sections import TrackingConfig
from flows.tracking.tracker import BegunOtherwise, Subject, Tracker

QUIET = Subject("small", 0, "digest", "discovery", TrackingConfig(system_metrics=False, log_model=False))


def test_a_resumed_run_with_another_setting_lost_all_of_its_parameters(store, said):
    begun = Tracker(store, QUIET, said.append)
    begun.parameters({"search.workers": 1, "seed": 0})
    assert begun.end("FAILED") == 0
    resumed = Tracker(store, QUIET, said.append, begun.run_id)
    resumed.parameters({"search.workers": 2, "seed": 0, "chosen_candidate": 3}, {"aesi.setting": "x"})
    assert resumed.end("FINISHED") == 0
    run = store.run(begun.run_id)
    assert run.data.params == {"search.workers": "1", "seed": "0", "chosen_candidate": "3"}
    assert run.data.tags["aesi.setting"] == "x"
    assert said == ["tracking: the run stays tracked as it was begun, with search.workers = 1 (now 2)."]


def test_a_resumed_run_took_other_data_for_those_it_was_begun_with(store, said):
    held = {"data_digest": "aa, bb", "cell_digest": "cc"}
    begun = Tracker(store, QUIET, said.append)
    begun.as_begun(held)  # nothing yet
    begun.parameters(held)
    assert begun.end("FAILED") == 0
    resumed = Tracker(store, QUIET, said.append, begun.run_id)
    resumed.as_begun(held)
    with pytest.raises(
        BegunOtherwise, match=f"run {begun.run_id} was begun with records or a cell file that are others"
    ):
        resumed.as_begun(held | {"data_digest": "aa, bd"})
    assert resumed.end("FAILED") == 0


def test_a_run_with_an_item_of_another_version_could_not_be_gone_on_with(store, said, workspace):
    begun = Tracker(store, QUIET, said.append)
    assert begun.end("FAILED") == 0
    box = workspace / ".aesi" / "outbox" / begun.run_id
    box.mkdir(parents=True)
    for number, kind in enumerate(("run", "batch"), 1):
        (box / f"0000000{number}.json").write_text(json.dumps({"kind": kind}))
    resumed = Tracker(store, QUIET, said.append, begun.run_id)
    resumed.parameters({"seed": 0})
    assert resumed.end("FINISHED") == 0
    assert store.run(begun.run_id).data.params == {"seed": "0"}
    assert [line.count("of another version") for line in said] == [1, 1]
