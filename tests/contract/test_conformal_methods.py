"""What every registered method promises, whatever it does inside."""

import io
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import pandas as pd
import pytest

from aesi.conformal import COMPARED, METHODS, Calibrated, calibrated_from_dict
from aesi.conformal.online.calibrated import SCHEMA
from aesi.conformal.online.spci import SPCI
from aesi.conformal.regressors.model import FitTask, QuantileModel
from aesi.errors import FitError, InputError

WINDOW = 50


def series(n: int, seed: int) -> np.ndarray:
    """AR(1) with a slowly changing scale, in volts."""
    rng = np.random.default_rng(seed)
    scale = 1e-4 * np.exp(0.7 * np.sin(2 * np.pi * np.arange(n) / 900))
    out = np.zeros(n)
    for k in range(1, n):
        out[k] = 0.8 * out[k - 1] + scale[k] * rng.standard_normal()
    return out


@pytest.fixture(scope="module", params=sorted(METHODS))
def calibrated(request: pytest.FixtureRequest) -> Calibrated:
    return METHODS[request.param].fit([series(1000, 1), series(600, 2)], window=WINDOW)


def test_covers_near_the_nominal_level(calibrated: Calibrated) -> None:
    # Independent residuals, 4,000 to test with: four standard deviations of the share are 1.9 %, and the
    # calibration on 2,000 of them adds about as much.
    method, rng = METHODS[calibrated.method], np.random.default_rng(3)
    fitted = method.fit([1e-4 * rng.standard_normal(2000)], window=WINDOW)
    fresh = 1e-4 * rng.standard_normal(4000)
    assert fitted.intervals(fresh).covers(fresh).mean() == pytest.approx(0.9, abs=0.035)


def test_an_interval_uses_only_what_came_before(calibrated: Calibrated) -> None:
    record = series(600, 4)
    changed = record.copy()
    changed[400:] = 1.0
    before, after = calibrated.intervals(record), calibrated.intervals(changed)
    np.testing.assert_array_equal(before.lower_v[:401], after.lower_v[:401])
    np.testing.assert_array_equal(before.upper_v[:401], after.upper_v[:401])


def test_the_stream_gives_the_intervals_of_the_replay(calibrated: Calibrated) -> None:
    record = series(700, 5)
    record[[100, 300, 301]] = np.nan
    replay = replace(calibrated, rate=0.05).intervals(record)
    stream = replace(calibrated, rate=0.05).stream()
    bounds = []
    for error in record:
        bounds.append(stream.interval())
        stream.update(float(error))
    low, high = np.array(bounds).T
    np.testing.assert_array_equal(low, replay.lower_v)
    np.testing.assert_array_equal(high, replay.upper_v)


@pytest.fixture(scope="module", params=sorted(METHODS))
def driven(request: pytest.FixtureRequest) -> Calibrated:
    pairs = [driven_series(1500, seed) for seed in (1, 2)]
    errors, currents = zip(*pairs, strict=True)
    return METHODS[request.param].fit(errors, window=WINDOW, current_a=currents)


def driven_series(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(residual, current): noise that is ten times larger just after the current has jumped."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.choice([0.0, 2.0, 5.0], n // 5), 5)
    jump = np.abs(np.diff(current, prepend=current[0])) > 0
    return 1e-4 * np.where(jump, 10.0, 1.0) * rng.standard_normal(n), current


def test_the_stream_gives_the_intervals_of_the_replay_with_current(driven: Calibrated) -> None:
    record, current = driven_series(500, 5)
    record[[0, 100, 300, 301]] = np.nan
    replay = driven.intervals(record, current)
    stream = driven.stream()
    bounds = []
    for error, now in zip(record, current, strict=True):
        bounds.append(stream.interval(float(now)))
        stream.update(float(error))
    low, high = np.array(bounds).T
    np.testing.assert_array_equal(low, replay.lower_v)
    np.testing.assert_array_equal(high, replay.upper_v)


def test_a_current_that_was_calibrated_with_is_asked_for(driven: Calibrated) -> None:
    record, current = driven_series(50, 6)
    if not driven.needs_current:
        np.testing.assert_array_equal(
            driven.intervals(record, current).lower_v, driven.intervals(record).lower_v
        )
        return
    with pytest.raises(InputError, match="give current_a"):
        driven.intervals(record)
    with pytest.raises(InputError, match="interval\\(current_a\\)"):
        driven.stream().interval()
    with pytest.raises(InputError, match="interval\\(current_a\\)"):
        driven.stream().update(1e-4)
    current[7] = np.nan
    with pytest.raises(InputError, match="row 8, counted from 1"):
        driven.intervals(record, current)
    with pytest.raises(InputError, match="shape"):
        driven.intervals(record, current[:5])


def test_a_known_current_widens_the_band_where_it_jumps(driven: Calibrated) -> None:
    record, current = driven_series(2000, 7)
    replay = driven.intervals(record, current)
    jump = np.abs(np.diff(current, prepend=current[0])) > 0
    ratio = replay.width_v[jump].mean() / replay.width_v[~jump].mean()
    if driven.needs_current:
        assert ratio > 4
    else:
        assert ratio < 2  # it cannot know


def test_survives_a_file_without_pickle(calibrated: Calibrated) -> None:
    state = calibrated.to_dict()
    arrays: dict[str, np.ndarray] = {}
    bare = _pull_arrays(state, "", arrays)
    file = io.BytesIO()
    np.savez(file, **arrays)
    file.seek(0)
    with np.load(file, allow_pickle=False) as stored:
        restored = calibrated_from_dict(_put_arrays(bare, stored))
    record = series(400, 6)
    np.testing.assert_array_equal(restored.intervals(record).lower_v, calibrated.intervals(record).lower_v)
    np.testing.assert_array_equal(restored.intervals(record).upper_v, calibrated.intervals(record).upper_v)


@dataclass(frozen=True, eq=False)
class Alike(QuantileModel):
    """Quantiles that are the same whatever the history.  levels_v : (2 B,) V."""

    levels_v: np.ndarray
    kind: ClassVar[str] = "alike"

    @classmethod
    def fit(cls, task: FitTask) -> Self:
        return cls(np.quantile(task.targets, task.levels))

    def quantiles(self, rows):
        return np.tile(self.levels_v, (len(rows), 1))

    def check_columns(self, count):
        pass

    def to_state(self):
        return {"levels_v": self.levels_v}

    @classmethod
    def from_state(cls, state, kinds):
        return cls(np.asarray(state["levels_v"]))


def test_a_regressor_that_was_added_had_to_be_listed_once_more_to_be_read_back() -> None:
    fitted = SPCI(name="alike", fitter=Alike.fit).fit([series(1000, 1)], window=WINDOW)
    record = series(400, 6)
    restored = calibrated_from_dict(fitted.to_dict())
    np.testing.assert_array_equal(restored.intervals(record).lower_v, fitted.intervals(record).lower_v)


@pytest.mark.parametrize("content", [{"schema": SCHEMA}, [], None])
def test_intervals_of_a_schema_alone_ended_in_a_key(content) -> None:
    with pytest.raises(
        InputError, match=r"the saved intervals cannot be read back: .*; save the model again"
    ):
        calibrated_from_dict(content)


def test_intervals_of_a_state_that_lacks_any_key_are_refused(calibrated: Calibrated) -> None:
    state = calibrated.to_dict()
    for key in state:
        with pytest.raises(InputError, match="schema" if key == "schema" else f"it lacks '{key}'"):
            calibrated_from_dict({name: value for name, value in state.items() if name != key})


def first_split_to_itself(forest: dict) -> dict:
    left = forest["left"].copy()
    left[np.flatnonzero(forest["feature"] >= 0)[0]] = 0
    return {"left": left}


def first_leaf_beyond(forest: dict) -> dict:
    left = forest["left"].copy()
    left[np.flatnonzero(forest["feature"] < 0)[0]] = len(forest["leaf_cdf"])
    return {"left": left}


@pytest.mark.parametrize(
    ("name", "inside", "damage", "told"),
    [
        ("spci_linear", (), lambda m: {"slope": m["slope"][:-1]}, "slope has 19 rows for 20 columns"),
        ("spci_boosted", ("inner",), lambda m: {"feature": m["feature"] + 21}, "and a row has 21 columns"),
        ("spci_boosted", (), lambda m: {"n_history": 99}, "n_history is 99, and a row has 20 columns"),
        ("spci_boosted", ("line",), lambda m: {"slope": m["slope"][1:]}, "slope has 19 rows for 20 columns"),
        (
            "spci_forest",
            (),
            lambda m: {"feature": np.where(m["feature"] < 0, -1, m["feature"] + WINDOW)},
            f"and a row has {WINDOW} columns",
        ),
        ("spci_forest", (), first_split_to_itself, "a split leads to no node after it"),
        ("spci_forest", (), first_leaf_beyond, "a split leads to no leaf"),
        ("spci_forest", (), lambda m: {"grid": m["grid"][1:]}, "leaf_cdf has the shape"),
        ("spci_forest", (), lambda m: {"start": m["start"][1:]}, "start has the shape"),
        ("spci_forest", (), lambda m: {"roots": m["roots"] + 10**6}, "roots holds 1e"),
    ],
)
def test_a_damaged_regressor_read_beyond_its_rows(name, inside, damage, told) -> None:
    """Compiled code read whatever lay there in memory, or followed a split for ever."""
    state = METHODS[name].fit([series(1000, 1), series(600, 2)], window=WINDOW).to_dict()
    model = state["band"]["model"]
    for part in inside:
        model = model[part]
    model |= damage(model)
    with pytest.raises(InputError, match=f"the saved intervals cannot be read back: .*{told}"):
        calibrated_from_dict(state)


def _pull_arrays(value, path, arrays):
    if isinstance(value, dict):
        return {k: _pull_arrays(v, f"{path}/{k}", arrays) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return {"array": path}
    assert isinstance(value, (str, int, float, list))
    return value


def _put_arrays(value, arrays):
    if isinstance(value, dict):
        if set(value) == {"array"}:
            return arrays[value["array"]]
        return {k: _put_arrays(v, arrays) for k, v in value.items()}
    return value


def test_fitting_twice_gives_the_same_intervals() -> None:
    for method in METHODS.values():
        first, second = (
            method.fit([series(700, 1)], window=WINDOW).intervals(series(200, 2)) for _ in range(2)
        )
        np.testing.assert_array_equal(first.lower_v, second.lower_v)


def test_a_constant_stretch_never_gets_a_band_of_width_zero(calibrated: Calibrated) -> None:
    record = np.zeros(2000)
    widths = replace(calibrated, rate=0.05).intervals(record).width_v
    assert widths.min() >= calibrated.floor_v > 0


@pytest.mark.parametrize("name", METHODS)
def test_the_interval_that_stands_in_had_no_width_where_most_residuals_are_alike(name: str) -> None:
    some = np.arange(4000) % 40 == 0
    residuals = np.where(some, 1e-3 * np.random.default_rng(0).standard_normal(4000), 0.0)
    calibrated = METHODS[name].fit([residuals], current_a=[np.where(some, 5.0, 0.0)])
    found = calibrated.intervals(residuals[:300], current_a=np.where(some, 5.0, 0.0)[:300])
    assert calibrated.floor_v > 0.0
    assert found.width_v.min() >= calibrated.floor_v * (1.0 - 1e-9)
    stream = calibrated.stream()
    low, high = stream.interval(5.0 if calibrated.needs_current else None)
    assert high - low >= calibrated.floor_v * (1.0 - 1e-9)


def test_a_missing_residual_brings_back_the_marginal_interval(calibrated: Calibrated) -> None:
    record = series(400, 7)
    record[200] = np.nan
    replay = calibrated.intervals(record)
    assert np.all(np.isfinite(replay.width_v))
    assert not replay.covers(record)[200]
    if calibrated.method not in ("split", "aci"):
        assert not replay.warm[201]
        assert (replay.lower_v[201], replay.upper_v[201]) == calibrated.marginal_v
        assert replay.warm[201 + WINDOW :].all()


def test_a_record_shorter_than_the_window_gets_valid_bands(calibrated: Calibrated) -> None:
    replay = calibrated.intervals(series(5, 8))
    assert len(replay) == 5
    assert np.all(replay.width_v > 0)
    assert len(calibrated.intervals(np.empty(0))) == 0


@pytest.mark.parametrize("name", sorted(METHODS))
def test_constant_residuals_are_refused(name: str) -> None:
    with pytest.raises(FitError, match="says nothing about the spread"):
        METHODS[name].fit([np.full(1000, 1e-3)], window=WINDOW)


@pytest.mark.parametrize("name", sorted(METHODS))
def test_too_few_residuals_are_refused(name: str) -> None:
    with pytest.raises(FitError, match="need"):
        METHODS[name].fit([series(12, 9)], window=WINDOW)
    with pytest.raises(FitError, match="need"):
        METHODS[name].fit([], window=WINDOW)


def test_half_of_the_miss_rate_that_was_given_was_told() -> None:
    with pytest.raises(FitError, match=r"cannot support a miss rate of 0\.0001: at least 19999 are needed"):
        METHODS["split"].fit([series(1000, 9)], alpha=1e-4)


@pytest.mark.parametrize("name", sorted(COMPARED))
@pytest.mark.parametrize("as_given", [np.asarray, list, pd.Series])
def test_one_record_without_a_list_was_taken_for_as_many_records_of_a_sample(
    name: str, as_given: Any
) -> None:
    """Some methods gave intervals of it, the others said that they lack history."""
    with pytest.raises(
        InputError, match=r"^residuals is one row of 1000 numbers; give a list of records, as in \["
    ):
        COMPARED[name].fit(as_given(series(1000, 1)), current_a=as_given(series(1000, 2)))


@pytest.mark.parametrize("name", sorted(METHODS))
def test_an_impossible_level_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="share of misses"):
        METHODS[name].fit([series(1000, 9)], alpha=1.5)


@pytest.mark.parametrize("name", sorted(COMPARED))
@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"alpha": 0.0}, "not a share of misses"),
        ({"window": 1}, "too short a history"),
        ({"window": 50.5}, "not a number of samples"),
    ],
)
def test_settings_that_no_method_can_have_are_refused(name: str, asked: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        COMPARED[name].fit([series(1000, 1)], **asked)


@pytest.mark.parametrize("name", sorted(COMPARED))
def test_no_record_to_calibrate_on_is_refused(name: str) -> None:
    with pytest.raises(FitError):
        COMPARED[name].fit([])
