import numpy as np

from aesi.numerics.drive import N_RECENT, drive_features, drive_row


def test_features_of_a_record_worked_by_hand() -> None:
    # 1, 3, -2 A: jumps 0, 2, -5; at the third sample the jump before was 2, and the one before that none.
    np.testing.assert_array_equal(drive_features(np.array([1.0, 3.0, -2.0]))[-1], [-2, 2, -5, 5, 2, 2, 0])


def test_a_row_from_recent_currents_is_the_row_of_the_record(rng: np.random.Generator) -> None:
    current = rng.standard_normal(12)
    rows = drive_features(current)
    for k in range(12):
        np.testing.assert_array_equal(drive_row(current[max(0, k + 1 - N_RECENT) : k + 1]), rows[k])


def test_an_empty_record_has_no_row_of_features() -> None:
    assert drive_features(np.empty(0)).shape == (0, 7)
