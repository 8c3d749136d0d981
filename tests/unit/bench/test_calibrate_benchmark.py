"""`aesi bench calibrate`: records of a known cell, the last of which enters no fit."""

from pathlib import Path

import pytest

from aesi.bench.physics.calibrate import run

CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"


@pytest.mark.slow
def test_a_few_steps_lower_the_errors_of_the_fitted_records_and_of_the_unseen_one():
    *records, summary = run(str(CELL), evaluations=3)
    assert [row["record"] for row in records] == ["drive", "1C", "unseen drive"]
    assert all(row["calibrated_mv"] < row["declared_mv"] for row in records)
    assert summary["unseen_mv"] == records[-1]["calibrated_mv"]
    assert summary["contact_low_mohm"] <= summary["contact_mohm"] <= summary["contact_high_mohm"]
