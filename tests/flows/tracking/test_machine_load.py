"""The load of the machine, which is tracked beside a run."""

import errno
import os
import threading

from aesi.pipeline.experiment.sections import TrackingConfig
from flows.tracking.tracker import Subject, Tracker

WATCHED = Subject("small", 0, "digest", "discovery", TrackingConfig(log_model=False))


def test_a_full_disk_ended_the_readings_in_a_traceback(store, said, monkeypatch):
    monkeypatch.setattr("flows.tracking.tracker.SAMPLE_S", 0.02)
    tried_again, tries = threading.Event(), []

    def full(outbox, item):
        tries.append(item)
        if len(tries) > 1:
            tried_again.set()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as disk:
        disk.setattr("flows.tracking.outbox.Outbox.put", full)
        tracker = Tracker(store, WATCHED, said.append)
        assert tried_again.wait(10)
    assert tracker.end("FAILED") == 0
    assert said == []
