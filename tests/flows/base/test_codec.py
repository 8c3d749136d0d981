"""Records to bytes and back: whole, without pickle, and never wrong in silence."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aesi.records import ErrorSeries, Failed, HeldOutDrive, LeftOutDrives, Split
from flows.base import codec

plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner) | st.tuples(inner, inner) | st.dictionaries(st.text(), inner),
    max_leaves=10,
)


def series(n=5):
    time = np.arange(n, dtype=float)
    return ErrorSeries("r", 1.0, time, time / 3, np.outer(time, np.ones(5)), time, time)


@given(plain)
def test_plain_values_come_back_as_they_were(value):
    again = codec.loads(codec.dumps(value))
    assert again == value
    assert type(again) is type(value)


def test_nested_records_come_back_to_the_last_bit():
    split = Split((series(),), (series(3),), ())
    again = codec.loads(codec.dumps({"split": split, 3: (np.float32(0.1), np.array([True, False]))}))
    assert again["split"].train[0].digest == split.train[0].digest
    assert again["split"].valid[0].name == "r"
    assert again[3][0] == np.float32(0.1)
    assert again[3][1].dtype == bool
    assert codec.loads(codec.dumps(Failed("why", 2.0))) == Failed("why", 2.0)


class Named(NamedTuple):
    """A tuple that came back without its names."""

    size_v: float


@pytest.mark.parametrize("value", [lambda: 1, object(), np.array([object()]), {1, 2}, open, Named(1e-3)])
def test_what_is_no_data_is_refused(value):
    with pytest.raises(codec.Uncodable):
        codec.dumps(value)


@pytest.mark.parametrize("position", [200, 1000, -30])
def test_one_altered_byte_is_noticed(position):
    data = bytearray(codec.dumps(series(100)))
    data[position] ^= 0xFF
    with pytest.raises(codec.Damaged):
        codec.loads(bytes(data))


@pytest.mark.parametrize("cut", [0, 1, 100, -1])
def test_a_truncated_file_is_noticed(cut):
    with pytest.raises(codec.Damaged):
        codec.loads(codec.dumps(series(100))[:cut])


def test_a_foreign_class_is_not_built():
    for module, name in (("subprocess", "Popen"), ("aesi.records", "np"), ("aesi.errors", "DataError")):
        tree = f'{{"class": ["{module}", "{name}"], "fields": {{}}}}'
        with pytest.raises(codec.Damaged):
            codec.loads(_with_tree(tree))


def _with_tree(tree):
    import hashlib
    import io

    buffer = io.BytesIO()
    np.savez(buffer, **{codec.TREE: np.frombuffer(tree.encode(), dtype=np.uint8)})
    body = buffer.getvalue()
    return codec.MAGIC + hashlib.sha256(body).digest() + body


def test_left_out_rows_come_back():
    left_out = LeftOutDrives((HeldOutDrive.of((series(3), series(5)), 1, slice(2, 4)),))
    (again,) = codec.loads(codec.dumps(left_out)).parts
    assert (again.place, again.rows) == (1, slice(2, 4))
    np.testing.assert_array_equal(again.series.inputs, series(5).inputs)
    assert [len(error_v) for error_v in again.errors_v] == [3, 5]
