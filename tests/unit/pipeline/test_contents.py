"""Keys of what rests on a saved model follow the effect of the user's own that it names."""

import json

import pytest
from lead_effect import OWN
from small_experiment import BPX, SOC0, experiment, write_record

from aesi import Cell, HybridModel
from aesi.physics.effects import load_effect
from aesi.pipeline.batch.plan import Job
from aesi.pipeline.experiment.load import load
from aesi.pipeline.product.contents import contents, effect_files


@pytest.fixture
def own(tmp_path):
    file = tmp_path / "lead.py"
    file.write_text(OWN)
    return file


@pytest.fixture
def model(tmp_path, own):
    """The folder of a saved model that names the effect elsewhere, as before a copy lay in it."""
    (effect,) = effects = (load_effect(own).activate(lead_ohm=1e-3),)
    folder = HybridModel(Cell.from_bpx(BPX), effects).save(tmp_path / "found")
    (folder / "lead.py").unlink()
    (folder / "effects.json").write_text(json.dumps([effect.to_dict()]))
    return folder


def edit(file):
    file.write_text(file.read_text().replace("-lead_ohm * trace", "-2 * lead_ohm * trace"))


def test_runs_of_a_saved_model_whose_effect_was_edited_were_taken_for_seeds_of_one_setting(
    tmp_path, own, model
):
    config = experiment(write_record(tmp_path), cell={"bpx": str(model), "soc0": SOC0, "start": "declared"})
    before = load(config)
    assert load(config).setting == before.setting
    edit(own)
    after = load(config)
    assert after.split.train[0].digest != before.split.train[0].digest
    assert after.setting != before.setting


def test_a_job_of_a_batch_took_the_row_of_a_saved_model_whose_effect_was_edited_since(tmp_path, own, model):
    job = Job("one", model, (write_record(tmp_path),))
    before = job.key("")
    assert job.key("") == before
    edit(own)
    assert job.key("") != before


@pytest.mark.parametrize("effects", ["no JSON", "{}", '[3, {"file": 3}, {"effect": "lead"}]'])
def test_a_folder_that_is_no_model_has_the_files_in_it_alone(tmp_path, effects):
    (tmp_path / "effects.json").write_text(effects)
    assert effect_files(tmp_path) == []
    assert contents([tmp_path, tmp_path / "gone"]) == [effects.encode()]


def test_an_effect_file_that_is_gone_is_no_content(model, own):
    of_both = contents([model])
    own.unlink()
    assert contents([model]) == of_both[:-1]


def test_the_copy_of_an_effect_in_a_saved_model_is_content_once(tmp_path, own):
    folder = HybridModel(Cell.from_bpx(BPX), (load_effect(own).activate(),)).save(tmp_path / "copied")
    assert effect_files(folder) == [folder / "lead.py"]
    assert contents([folder]).count(own.read_bytes()) == 1
