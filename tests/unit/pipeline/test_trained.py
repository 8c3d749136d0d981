"""What is said of a record's distance from the training data of a correction."""

from aesi.pipeline.product.trained import trained_sentence

AT_25 = {"outside_pct": 100.0, "kept_pct": 99.9, "amplitude": 1.0, "mean_degc": 25.3, "beyond_k": 0.3}


def test_rows_outside_by_their_temperature_alone_were_told_without_the_reason():
    """A correction of drives without a temperature column was trained at one temperature, the cell file's."""
    assert trained_sentence("drive", AT_25) == (
        "drive: 100 % of the rows lie outside the range the correction was trained on; at 25.3 degC, 0.3 K above what "
        "it was trained at, all of the correction is applied."
    )
    inside = trained_sentence("drive", AT_25 | {"outside_pct": 0.0, "beyond_k": 0.0})
    assert inside == "drive: 0 % of the rows lie outside the range the correction was trained on."
