"""A run that is gone on with: what it was begun with stays tracked."""

from aesi.pipeline.experiment.sections import TrackingConfig
from flows.tracking.tracker import Subject, Tracker

QUIET = Subject("small", 0, "digest", TrackingConfig(system_metrics=False, log_model=False))


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
