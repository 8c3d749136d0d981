"""The benchmark, small: its figures are those it says."""

import pytest

from aesi.bench.hybrid.ensemble import run


def test_a_line_for_each_size():
    lines = list(run(cases=((30, 1e-3), (40, 1e-12)), n=3000, candidates=3, resamples=10, peer_models=1))
    assert [line["terms"] for line in lines] == [30, 40]
    for line in lines:
        assert line["peer"] == "PySINDy STLSQ"
        assert line["rows"] == 3000
        assert line["peer_s"] == pytest.approx(line["peer_s_per_model"] * 3 * 10, rel=0.05, abs=0.1)
        assert line["ratio"] == pytest.approx(line["peer_s"] / line["ours_s"], rel=0.2)
        assert 0 <= line["coefficient_error"] < 1e-6
        assert line["peak_mb"] > 50
