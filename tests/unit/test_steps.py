"""Rows as they were measured, by the steps of an even grid: nothing of a row is known before it."""

import numpy as np

from aesi.records.steps import known_by, next_stamp, rows_until


def test_what_rows_until_a_stamp_tell_is_their_average_or_the_last_one():
    time_s, values = np.array([0.0, 0.4, 0.8, 1.0 + 1e-9, 3.5, 4.2]), np.array([1.0, 2.0, 4.0, 6.0, 8.0, 9.0])
    stamps_s = np.arange(5.0)
    # In (0, 1] lie three rows, the last of them at the stamp but for its last digits; in (1, 2] and (2, 3] none.
    np.testing.assert_allclose(known_by(time_s, values, stamps_s), [1.0, 4.0, 6.0, 6.0, 8.0])
    np.testing.assert_array_equal(next_stamp(time_s, stamps_s), [0, 1, 1, 1, 4, 4])
    np.testing.assert_array_equal(rows_until(time_s, stamps_s), [1, 4, 4, 4, 5])
