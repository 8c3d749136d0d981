"""Errors of a measured cell's model within seconds: told apart from those that last, and what of them is expected."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.bench.fast_error import lasts_s
from aesi.physics.effects import CATALOGUE
from aesi.tracer.case.blocks import Windows, blocks_of
from aesi.tracer.case.problem import OHMIC_SHARE
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.likelihood.gaussian import block_sums
from aesi.tracer.likelihood.growth import EffectGrowth, Parent
from aesi.tracer.likelihood.model_error import MEASURED_V, PRIORS, Size, SplitTable, amplitude_v, whitened
from aesi.tracer.likelihood.size_sums import SizeSums
from aesi.tracer.likelihood.surrogates import _whitened_surrogates
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.hypothesis_fits import base_of, fitted_hypothesis

SIZE = Size(9e-3, 3e-3)


@pytest.fixture
def problem(cell, few, make):
    data = make(n=1200)
    return replace(inverse_problem(cell, [data], 0.9, 0.0, few), trust="measured")


def test_windows_end_with_their_block_and_a_lone_row_has_no_freedom_left():
    time = np.array([0.0, 1.0, 2.0, 19.0, 21.0, 100.0, 200.0, 201.0])
    windows = Windows.within(np.array([0, 2, 8]), time, np.ones(8), 20.0)
    assert windows.of_row.tolist() == [0, 0, 1, 1, 1, 2, 3, 3]
    means = windows.means(np.arange(8.0)[:, None])[:, 0]
    assert means == pytest.approx([0.5, 0.5, 3.0, 3.0, 3.0, 5.0, 6.5, 6.5])
    assert windows.fast_dof == pytest.approx([0.5, 0.5, *[2 / 3] * 3, 0.0, 0.5, 0.5])


def test_what_lasts_counts_as_before_and_what_is_gone_by_its_own_size(problem):
    blocks = blocks_of(problem)
    slow = np.full((len(problem.time_s), 1), 0.02)
    fast = 0.004 * np.where(np.arange(len(slow)) % 2, 1.0, -1.0)[:, None]
    fast = fast - blocks.windows.means(fast)
    amplitude = amplitude_v(problem.ocv_slope_v, SIZE.delta_v, "measured")
    white = whitened(problem, blocks, slow, SIZE)[0]
    assert white[:, 0] == pytest.approx(np.sqrt(problem.independent) / amplitude * 0.02)
    gone = whitened(problem, blocks, fast, SIZE)[0]
    by_rows = problem.independent @ (fast[:, 0] / SIZE.fast_v) ** 2
    assert np.sum(gone**2) == pytest.approx(by_rows)
    both = whitened(problem, blocks, slow + fast, SIZE)[0]
    assert both == pytest.approx(white + gone)
    assert np.sum(both**2) == pytest.approx(np.sum(white**2) + by_rows, rel=0.01)


@pytest.mark.parametrize("trust", ["lasting", "measured"])
def test_a_density_is_that_of_as_many_normal_samples_as_are_independent(problem, trust):
    problem = replace(problem, trust=trust)
    blocks = blocks_of(problem)
    amplitude = amplitude_v(problem.ocv_slope_v, SIZE.delta_v, trust)
    _, log_det = whitened(problem, blocks, np.zeros((len(problem.time_s), 1)), SIZE)
    normal = problem.independent @ np.log(2.0 * np.pi * amplitude**2)
    if trust == "measured":  # of k rows of a window, one degree of freedom is its mean's
        rows = np.bincount(blocks.windows.of_row)
        each = np.bincount(blocks.windows.of_row, problem.independent) / rows
        normal += each @ (rows - 1) * np.log(2.0 * np.pi * SIZE.fast_v**2)
    assert np.sum(log_det) + len(log_det) * np.log(2.0 * np.pi) == pytest.approx(normal)


def test_the_charge_that_a_measured_cells_model_errs_by_is_that_of_its_records():
    flat, steep = amplitude_v(np.array([0.0, 1e4]), MEASURED_V, "measured")
    assert flat == pytest.approx(MEASURED_V)
    assert 1e-3 < steep / 1e4 < 6e-3  # of the charge, as far as development records were off


def test_a_table_is_split_once_for_all_sizes_of_the_model_error(problem, monkeypatch):
    blocks = blocks_of(problem)
    table = np.random.default_rng(0).normal(0.0, 5e-3, (len(problem.time_s), 3))
    sizes = PRIORS["measured"].sizes
    one_by_one = [whitened(problem, blocks, table, size) for size in sizes]
    means, calls = Windows.means, []
    monkeypatch.setattr(Windows, "means", lambda *given: calls.append(1) or means(*given))
    at_once = SplitTable(problem, blocks, table)
    for size, (white, log_det) in zip(sizes, one_by_one, strict=True):
        assert np.array_equal(at_once.whitened(size)[0], white)
        assert np.array_equal(at_once.whitened(size)[1], log_det)
    assert len(calls) == 1


@pytest.mark.parametrize("trust", ["measured", "lasting", "tight"])
def test_sums_at_a_size_are_those_of_the_rows_whitened_at_it(problem, trust):
    problem = replace(problem, trust=trust)
    blocks = blocks_of(problem)
    table = np.random.default_rng(1).normal(0.0, 5e-3, (len(problem.time_s), 4))
    sums = SizeSums(SplitTable(problem, blocks, table))
    for size in PRIORS[trust].sizes[::7]:
        there, rows = sums.at(size), block_sums(blocks, *whitened(problem, blocks, table, size))
        for name in ("square", "moment", "gram", "log_det", "rows"):
            expected = getattr(rows, name)
            least = 1e-12 * np.abs(expected).max()
            assert getattr(there, name) == pytest.approx(expected, rel=1e-12, abs=least), (name, size)


def test_sizes_of_both_are_tried_together_where_they_are_told_apart():
    both, one = PRIORS["measured"], PRIORS["loose"]
    assert len(both.sizes) == len(both.sizes_v) * len(both.fast.sizes_v)
    assert {size.fast_v for size in one.sizes} == {0.0}
    assert both.nearest(Size(10e-3)) == both.median
    assert both.log_density(both.median) > both.log_density(Size(both.median_v, 2 * both.fast.median_v))


def test_the_file_may_be_off_in_contacts_and_in_what_careful_parametrisations_differ_by(problem):
    off = problem.file_errors_v(())
    current = np.concatenate([data.current_a for data in problem.fit_parts])
    resistance = -off[:, 0] @ current / (current @ current) / OHMIC_SHARE
    assert 1e-4 < resistance < 1e-2  # ohm, of a cell of 30 Ah
    assert off.shape[1] == 3  # that, and the diffusivities of both electrodes
    assert problem.file_errors_v(("series_resistance",)).shape[1] == 2
    for other in ("tight", "loose", "beside"):
        assert replace(problem, trust=other).file_errors_v(()).shape[1] == 0


def test_an_ohmic_effect_takes_the_place_of_what_the_contacts_may_be_off_by_whatever_it_is_called(problem):
    own = replace(CATALOGUE["series_resistance"], id="busbar")
    problem = replace(problem, effects=problem.effects | {"busbar": own})
    assert problem.file_errors_v(("busbar",)).shape[1] == problem.file_errors_v(()).shape[1] - 1


def test_a_search_for_one_effect_alone_on_a_measured_cell_has_nothing_else_that_may_be_off(problem):
    alone = replace(problem, effects={"series_resistance": CATALOGUE["series_resistance"]})
    blocks, archive = blocks_of(alone), Archive(None, "")
    assert alone.file_errors_v(("series_resistance",)).shape == (len(alone.time_s), 0)
    fit = fitted_hypothesis(alone, blocks, ("series_resistance",), base_of(alone, blocks, archive), archive)
    assert np.isfinite(fit.score.total)


def test_a_lag_of_a_second_says_more_where_seconds_count(cell, few, make):
    effects = few | {"clock_skew": CATALOGUE["clock_skew"]}
    data = make()
    late = replace(data, voltage_v=np.interp(data.time_s - 1.0, data.time_s, data.voltage_v))
    problem = replace(inverse_problem(cell, [late], 0.9, 0.0, effects), trust="measured")
    blocks = blocks_of(problem)

    def said(blocks):
        base = base_of(problem, blocks, Archive(None, ""))
        grown = EffectGrowth(Parent(problem, blocks, base), "clock_skew", PRIORS["measured"].median).grow()
        return grown.score.total - base.score.total, grown.values_by_key["clock_skew", "lag_s"]

    fine, lag = said(blocks)
    coarse, _ = said(replace(blocks, windows=None))
    assert fine > 2 * coarse
    assert lag == pytest.approx(1.0, abs=0.1)


def test_draws_move_a_fast_column_by_as_much_as_it_weighs(problem):
    blocks = blocks_of(problem)
    draws = _whitened_surrogates(problem, blocks.windows, 2000, np.random.default_rng(0))
    column = np.where(np.arange(len(draws)) % 2, 4e-3, -4e-3)[:, None]
    white = whitened(problem, blocks, column - blocks.windows.means(column), SIZE)[0][:, 0]
    assert np.var(white @ draws) == pytest.approx(white @ white, rel=0.1)
    # What is gone within seconds has no mean over its window: that is of what lasts, once over its deviation.
    means = blocks.windows.means(draws / np.sqrt(problem.independent)[:, None])
    assert np.var(means) == pytest.approx(1.0, rel=0.1)


def test_how_long_an_error_lasts():
    time = np.arange(100_000.0)
    error = np.zeros(len(time))
    for k, shock in enumerate(np.random.default_rng(0).normal(size=len(time) - 1)):
        error[k + 1] = 0.8 * error[k] + shock
    of_an_autoregression_s = (1.0 + 0.8) / (1.0 - 0.8)
    assert lasts_s(time, error) == pytest.approx(of_an_autoregression_s, rel=0.15)
