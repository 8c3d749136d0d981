"""Which rows train: the repeats of a record, cut by their period."""

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.pipeline.experiment.drives import training_drives
from aesi.pipeline.experiment.physics_models import no_rows
from aesi.pipeline.experiment.sections import DataConfig
from aesi.records import Measurement

TIME_S = np.arange(3000.0)
RECORDS = {"a.csv": no_rows(Measurement(TIME_S, np.ones(3000), np.full(3000, 3.7), name="a"), 0.5)}
ROLES = {"train": (), "valid": (), "test": ()}


def data(**repeats):
    return DataConfig(kind="files", record="a.csv", repeats={"period_s": 600.0, "test": [2], **repeats})


def test_the_rows_of_a_training_repeat_end_where_it_validates():
    assert training_drives(data(train=[1, 3], valid_share=0.25), RECORDS, ROLES) == [
        ("a.csv", slice(0, 450)),
        ("a.csv", slice(1200, 1650)),
    ]


@pytest.mark.parametrize("numbers", [{"train": [1, 9]}, {"train": [1], "test": [9]}])
def test_a_repeat_the_record_does_not_have_was_named_after_all_physics_was_fitted(numbers):
    with pytest.raises(DataError, match="a lasts 2999 s and has no repeat 9 of 600 s"):
        training_drives(data(**numbers), RECORDS, ROLES)


def test_a_period_of_a_row_is_told_at_once_too():
    with pytest.raises(DataError, match="a repeat of 1 s holds no two rows 1 s apart"):
        training_drives(data(train=[1], period_s=1.0), RECORDS, ROLES)


def test_a_share_that_leaves_no_rows_to_train_on_is_told():
    expected = r"repeat 3: with repeats.valid_share 0\.999 it trains on 1 of its 600 rows"
    with pytest.raises(DataError, match=expected):
        training_drives(data(train=[3], valid_share=0.999), RECORDS, ROLES)
