"""A model on disk: read as it was written, or refused in one sentence."""

import numpy as np
import pytest

from aesi.errors import InputError
from aesi.pipeline.product import model_folder
from aesi.pipeline.product.model_folder import read_model, write_model

NUMBERS = np.random.default_rng(0).normal(size=500)
PARTS = {"correction": {"weights": NUMBERS, "names": ["a", "b"]}}


def test_what_was_written_is_read(tmp_path):
    write_model(tmp_path / "model", {"dt_s": 1.0}, PARTS, {})
    head, parts = read_model(tmp_path / "model")
    assert head["dt_s"] == 1.0
    np.testing.assert_array_equal(parts["correction"]["weights"], NUMBERS)


def test_arrays_with_any_byte_changed_are_refused(tmp_path):
    write_model(tmp_path, {}, PARTS, {})
    file = tmp_path / model_folder.ARRAYS
    whole = file.read_bytes()
    # Header, compressed stream and directory; a byte of a time of day, say, does not matter.
    for place in range(0, len(whole) - 60, 5):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            _, parts = read_model(tmp_path)
        except InputError:
            continue
        np.testing.assert_array_equal(parts["correction"]["weights"], NUMBERS)


def test_empty_arrays_are_refused(tmp_path):
    write_model(tmp_path, {}, PARTS, {})
    (tmp_path / model_folder.ARRAYS).write_bytes(b"")
    with pytest.raises(InputError, match=r"arrays\.npz cannot be read"):
        read_model(tmp_path)


def test_a_folder_that_was_half_written_over_is_no_model(tmp_path, monkeypatch):
    write_model(tmp_path, {}, PARTS, {})

    def killed(*_args, **_named):
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez_compressed", killed)
    with pytest.raises(KeyboardInterrupt):
        write_model(tmp_path, {}, PARTS, {})
    with pytest.raises(InputError, match=r"holds no model\.json"):
        read_model(tmp_path)
