"""What several records have in common is said once."""

from aesi.pipeline.notes import together


def test_records_with_the_same_note_share_it():
    notes = [
        "a: resampled to 1 s",
        "b: resampled to 1 s",
        "b: 3 rows dropped: no voltage",
        "a: resampled to 1 s",
    ]
    assert together(notes) == ("a, b: resampled to 1 s", "b: 3 rows dropped: no voltage")


def test_a_note_about_nothing_in_particular_stays_as_it_is():
    assert together(["The data could not be had.", "a: x"]) == ("a: x", "The data could not be had.")
    assert together([]) == ()
