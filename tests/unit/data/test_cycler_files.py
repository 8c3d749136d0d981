"""Cyclers' own files, through the Battery Data Alliance's reader."""

import sys

import numpy as np
import pytest

from aesi.data import read_measurement
from aesi.errors import DataError


@pytest.fixture
def mpt(tmp_path):
    """A BioLogic export: preamble, decimal commas, milliampere, positive on charge."""
    lines = ["EC-Lab ASCII FILE", "Nb header lines : 4", "", "time/s\tEcell/V\tI/mA\t"]
    for k in range(100):
        current_ma = -1000.0 if (k // 10) % 2 == 0 else 2000.0
        line = f"{k:.3f}\t{3.7 + 1e-5 * current_ma:.5f}\t{current_ma:.3f}\t"
        lines.append(line.replace(".", ","))
    path = tmp_path / "test.mpt"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="latin-1")
    return path


def test_a_biologic_file_comes_out_in_amperes_discharge_positive(mpt):
    pytest.importorskip("bdf")
    record = read_measurement(mpt)
    np.testing.assert_allclose(record.time_s, np.arange(100.0))
    np.testing.assert_allclose(record.current_a[:11], [*[1.0] * 10, -2.0])
    np.testing.assert_allclose(record.voltage_v[:11], [*[3.69] * 10, 3.72])
    assert any("batterydf" in note for note in record.notes)


def test_without_the_reader_it_says_what_to_install(mpt, monkeypatch):
    monkeypatch.setitem(sys.modules, "bdf", None)
    with pytest.raises(DataError, match="pip install batterydf"):
        read_measurement(mpt)


def test_a_damaged_file_is_one_sentence(tmp_path):
    pytest.importorskip("bdf")
    path = tmp_path / "test.ndax"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(DataError, match=r"test\.ndax") as caught:
        read_measurement(path)
    assert "\n" not in str(caught.value)
