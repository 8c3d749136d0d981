"""Records of an experiment: what is refused of a file names the key of the experiment that says it."""

from pathlib import Path

import numpy as np
import pytest

from aesi.data.reading import Reading
from aesi.errors import DataError
from aesi.pipeline.experiment.sources import _record, with_keys


def written(folder: Path, header: str, sign: float = 1.0) -> Path:
    time = np.arange(200.0)
    current = np.where((time // 10) % 2 == 0, 5.0, -2.0)
    rows = "\n".join(f"{t},{sign * i},{3.7 - 0.01 * i}" for t, i in zip(time, current, strict=True))
    path = folder / "drive.csv"
    path.write_text(f"{header}\n{rows}\n")
    return path


@pytest.mark.parametrize(
    ("header", "sign", "key"),
    [
        ("time_s,current_a,voltage_v", -1.0, "in an experiment file: data.sign"),
        ("time_s,I[A],voltage_v", 1.0, "in an experiment file: data.sign, data.columns"),
    ],
)
def test_an_option_that_a_run_does_not_have_was_recommended(tmp_path, header, sign, key):
    with pytest.raises(DataError) as caught:
        _record(written(tmp_path, header, sign), Reading())
    assert key in str(caught.value)


def test_what_needs_no_option_is_told_as_it_is(tmp_path):
    path = tmp_path / "empty.csv"
    path.touch()
    with pytest.raises(DataError, match=r"at least two rows\.$"):
        _record(path, Reading())


def test_a_state_of_charge_that_a_run_may_be_given_was_called_by_a_command_s_option():
    sentence = "drive starts under 1 A at 3.9 V: state of charge 0.7 +/- 0.1; give --soc0 if it is known."
    assert with_keys(sentence).endswith("if it is known (in an experiment file: cell.soc0).")
