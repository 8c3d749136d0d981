"""Training drives are left out under physics that has not seen them."""

from __future__ import annotations

from small_experiment import experiment, write_record

from aesi.pipeline.experiment.load import load
from aesi.pipeline.experiment.physics_models import PhysicsModels


def test_the_records_are_simulated_once_for_each_piece_that_is_left_out(tmp_path, monkeypatch):
    small = experiment(write_record(tmp_path))
    recalibrated = small.cell.model_copy(update={"start": "recalibrated"})
    counted = []
    whole = PhysicsModels.series
    monkeypatch.setattr(PhysicsModels, "series", lambda *given: counted.append(1) or whole(*given))
    left_out = load(small.model_copy(update={"cell": recalibrated})).left_out
    assert len(counted) == 1 + len(left_out.parts) + len(left_out.drives)
