"""Experiments: what passes, and the one sentence that what does not pass gets."""

import json
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aesi.errors import ConfigError
from aesi.pipeline.experiment.config import ExperimentConfig, parse_experiment, read_experiment
from aesi.pipeline.experiment.load import load
from aesi.pipeline.experiment.sources import check_there

ROOT = Path(__file__).resolve().parents[3]
CONTENT = {"name": "x", "data": {"kind": "files", "train": ["a.csv"], "test": ["b.csv"]}}


def sentence(changes: dict) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_experiment({**CONTENT, **changes})
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("path", sorted((ROOT / "experiments").glob("*.yaml")), ids=lambda p: p.stem)
def test_every_experiment_of_the_project_is_valid_and_says_why(path):
    assert read_experiment(path).name == path.stem
    assert path.read_text().startswith("# Why: ")


@pytest.mark.parametrize(
    ("changes", "found", "near"),
    [
        ({"serch": {}}, "'serch'", "'search'"),
        ({"search": {"candidate": 3}}, "'search.candidate'", "'candidates'"),
        (
            {"fallback": {"data": {"kind": "virtual", "tran": ["a"]}, "cell": {}}},
            "'fallback.data.tran'",
            "'train'",
        ),
    ],
)
def test_an_unknown_key_is_named_with_its_nearest_match(changes, found, near):
    message = sentence(changes)
    assert found in message
    assert f"Did you mean {near}" in message


FILES = {"kind": "files", "train": ["a.csv"], "test": ["b.csv"]}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"search": {"candidates": 0}}, "search.candidates = 0"),
        ({"search": {"lambda1": [1e-1, 1e-3]}}, "[0.1, 0.001] is empty"),
        ({"search": {"weights": [-0.5, 0.5, 0.0]}}, "search.weights.0 = -0.5 is not admissible"),
        ({"search": {"weights": [0, 0, 0]}}, "search.weights: of the losses at least one has to count"),
        ({"library": {"p_c": [2, 1]}}, "[2, 1] is empty; give low <= high"),
        ({"search": {"timeout_s": float("nan")}}, "search.timeout_s"),
        ({"conformal": {"alpha": 1.5}}, "conformal.alpha = 1.5"),
        ({"cell": {"soh": "new"}}, "cell.soh"),
        ({"cell": {"soh": 80}}, "a state of health of 80: it is the share of the cell file's capacity"),
        ({"data": {"kind": "catalogue", "train": ["a"], "test": ["b"]}}, "needs `set`"),
        ({"data": {"kind": "files"}}, "experiment: data: give `train` and `test`"),
        ({"data": 3}, "data = 3 is not admissible: it takes keys: kind, set, record"),
        ({"library": {"d": [1]}}, "'library.d' lacks its value number 2; please give it"),
        ({"models": ["ESPN"]}, "known are 'ESPM', 'ESPM, one resistor', "),
        (
            {
                "data": {
                    "kind": "files",
                    "record": "a.csv",
                    "repeats": {"period_s": 10, "train": [1], "test": [1]},
                }
            },
            "repeat 1 is in train and in test",
        ),
        (
            {
                "data": {
                    "kind": "files",
                    "record": "a.csv",
                    "repeats": {"period_s": 10, "train": [1, 3, 1], "test": [2]},
                }
            },
            "repeat 1 is in train twice",
        ),
        ({"name": "Default"}, "'Default' is the name of MLflow's own experiment; give another"),
        ({"name": "a" * 101}, "has to be at most 100 letters, digits, `_` and `-`"),
        ({"models": []}, "models = [] is not admissible: it has to have at least 1 item."),
        ({"models": ["ESPM", "ESPM"]}, "models: ESPM is named twice"),
        (
            {"conformal": {"method": "spci"}},
            "conformal.method: there is no method 'spci'; there are: split, aci",
        ),
        (
            {"data": {"kind": "virtual", "dt_s": 2}, "conformal": {"horizons_s": [10, 1]}},
            "experiment: conformal.horizons_s: 1 s is no whole number of steps of data.dt_s, 2 s; give multiples",
        ),
        (
            {
                "data": FILES | {"kind": "catalogue", "set": "lg_18650hg2"},
                "fallback": {"data": {"kind": "virtual", "dt_s": 4}, "cell": {}},
                "conformal": {"horizons_s": [10]},
            },
            "10 s is no whole number of steps of data.dt_s, 4 s",
        ),
        ({"conformal": {"window": 9}}, "conformal: window = 9 samples is too short a history"),
        (
            {"conformal": {"window": 18}},
            "window = 18 cannot hold the 19 residuals that enbpi needs at alpha = 0.1",
        ),
        ({"data": {"kind": "virtual", "virtual": {"seed": -1}}}, "data.virtual.seed = -1"),
        (
            {"seed": 2**32},
            "seed = 4294967296 is not admissible: it has to be less than or equal to 4294967295",
        ),
        ({"data": {"kind": "files", "columns": "I"}}, "it takes keys with a value each, as in {KEY: VALUE}"),
        (
            {"library": {"special": "ja"}},
            "library.special = 'ja' is not admissible: it has to be true or false",
        ),
    ],
)
def test_an_inadmissible_value_is_named(changes, words):
    assert words in sentence(changes)


@pytest.mark.parametrize(
    "key",
    [
        *(f"search.{key}" for key in ("candidates", "population", "resamples", "block", "horizon", "fold")),
        "search.workers",
        "conformal.window",
        "data.repeats.train.0",
    ],
)
def test_a_count_that_no_array_holds_was_told_by_an_overflow_or_not_at_all(key):
    section, name, *_ = key.split(".")
    value = {"period_s": 1, "train": [10**400], "test": [1]} if name == "repeats" else 10**400
    kind = {"kind": "files", "record": "a.csv"} if section == "data" else {}
    found = sentence({section: kind | {name: value}})
    assert f"{key} = 1{'0' * 400} is not admissible: it has to be less than or equal to 1000000000." in found


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"data": FILES | {"valid": ["a.csv"]}}, "a.csv is in train and in valid"),
        ({"data": FILES | {"set": "lg_18650hg2"}}, "`set` is of kind: catalogue"),
        ({"data": FILES | {"virtual": {"seed": 3}}}, "`virtual` is of kind: virtual"),
        ({"data": FILES | {"record": "c.csv"}}, "`record` is cut by `repeats`"),
        ({"data": {"kind": "virtual", "sign": "charge-positive"}}, "`sign` is about files"),
        (
            {"discover": {"fit": ["a.csv"], "fit_until_s": {"a": 60}}},
            "fit_until_s cuts a, which is not in fit",
        ),
        (
            {"discover": {"fit": ["a.csv"], "until_s": 60}},
            "discover.until_s cuts test records, and discover.test names none; name them, or leave out until_s",
        ),
        (
            {"data": FILES | {"from_s": {"c.csv": 60}}},
            "data.from_s cuts c.csv, which is no record here; there are: a",
        ),
        (
            {"data": FILES, "cell": {"bpx": "b", "soc0_of": {"c.csv": 0.5}}},
            "cell.soc0_of is about c.csv, which is no record here; there are: a",
        ),
        ({"data": FILES, "cell": {"bpx": "b", "soc0_of": {"a.csv": 50}}}, "less than or equal to 1"),
        ({"data": {"kind": "virtual", "to_s": {"a.csv": 60}}}, "`to_s` is about files"),
        (
            {"data": FILES | {"from_s": {"a.csv": 60}, "to_s": {"a.csv": 60}}},
            "a.csv: from_s, 60 s, has to be before",
        ),
        ({"data": {"kind": "virtual"}, "discover": {"test": ["a"]}}, "leave out fit, test and good"),
        ({"data": {"kind": "virtual"}, "discover": {"hold": "backward"}}, "is known; leave out hold"),
        (
            {"data": {"kind": "virtual", "virtual": {"values": {"double_layer": {"capacity_f_m2": 3.0}}}}},
            "data.virtual: values is about double_layer, which the cell does not have; its effects are: ocv_hysteresis",
        ),
        (
            {"data": {"kind": "virtual", "virtual": {"effects": ["film_growth", "film_growth"]}}},
            "data.virtual: film_growth is in effects twice",
        ),
        ({"fallback": {"data": {"kind": "virtual"}, "cell": {}}}, "fallback: it stands in for a data set"),
    ],
)
def test_what_an_experiment_says_and_nothing_reads_was_passed_over_in_silence(changes, words):
    assert words in sentence(changes)


@pytest.mark.parametrize("said", [{}, {"hold": "backward"}])
def test_a_virtual_current_was_taken_as_a_loggers_where_nothing_said_how_it_runs(said):
    """The laboratory's current runs in straight lines: a cell that lacks nothing erred by more than its noise."""
    data = {"kind": "virtual", **said}
    config = parse_experiment({"name": "a", "data": data})
    assert config.data.hold == said.get("hold", "linear")
    files = {"kind": "catalogue", "set": "lg_18650hg2", "train": ["a"], "test": ["b"]}
    measured = parse_experiment({"name": "a", "data": files, "fallback": {"data": data, "cell": {}}})
    assert measured.data.hold == "backward"
    assert measured.data.declared_hold is None
    assert measured.fallback.data.hold == config.data.hold


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"search": {"candidates": True}}, "search.candidates: true is no number; give one."),
        ({"search": {"weights": [0.5, False, 0]}}, "search.weights: false is no number; give one."),
        (
            {"cell": {"effects": {"contact": {"resistance_ohm": True}}}},
            "cell.effects: true is no number; give one.",
        ),
        ({"seed": False}, "seed: false is no number; give one."),
    ],
)
def test_true_and_false_were_taken_for_1_and_0(changes, said):
    assert sentence(changes).endswith(said)
    assert parse_experiment({**CONTENT, "search": {"warm_start": False}}).search.warm_start is False


@pytest.mark.parametrize("name", ["../escape", "a/b", "", ".hidden", "a" * 200, "x\n"])
def test_a_name_cannot_leave_the_folder_of_runs(name):
    with pytest.raises(ConfigError):
        parse_experiment({**CONTENT, "name": name})


def test_overrides_reach_into_sections(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("name: x\ndata: {kind: files, train: [a.csv], test: [b.csv]}\n")
    config = read_experiment(
        path, ["search.candidates=7", "search.lambda1=[1e-6, 1]", "tracking.uri=http://a"]
    )
    assert config.search.candidates == 7
    assert config.search.lambda1 == (1e-6, 1.0)
    assert config.tracking.uri == "http://a"


def test_an_override_reaches_into_a_section_that_is_given_in_short(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("name: x\ndata: {kind: files, train: [a.csv], test: [b.csv]}\ncell: my_cell.bpx.json\n")
    cell = read_experiment(path, ["cell.soc0=0.8", "cell.start=declared"]).cell
    assert (cell.bpx, cell.soc0, cell.start) == ("my_cell.bpx.json", 0.8, "declared")


def test_the_name_of_a_record_was_taken_apart_at_its_dots(tmp_path):
    path = tmp_path / "one.yaml"
    path.write_text(
        "name: one\ndata: {kind: files, train: [a.csv], test: [b.csv.gz], from_s: {a.csv: 1}}\ncell: c.json\n",
        encoding="utf-8",
    )
    said = [
        "cell.soc0_of.b.csv.gz=0.6",
        "data.from_s.a.csv=60",
        "data.columns.time_s=t.s",
        "search.candidates=4",
    ]
    config = read_experiment(path, said)
    assert config.cell.soc0_of == {"b.csv.gz": 0.6}
    assert (config.data.from_s, config.data.columns) == ({"a.csv": 60}, {"time_s": "t.s"})
    nested = read_experiment(path, ["cell.effects.series_resistance.resistance_ohm=0.002"])
    assert nested.cell.effects == {"series_resistance": {"resistance_ohm": 0.002}}


def test_of_two_overrides_of_one_key_the_last_counted_and_nobody_was_told(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("name: x\ndata: {kind: files, train: [a.csv], test: [b.csv]}\n")
    with pytest.raises(ConfigError, match=r"x.yaml: 'seed' is overridden twice; give it once\."):
        read_experiment(path, ["seed=1", "seed =2"])


def test_an_override_was_lost_to_one_of_the_section_that_followed(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("name: x\ndata: {kind: files, train: [a.csv], test: [b.csv]}\n")
    with pytest.raises(
        ConfigError, match=r"'cell' replaces 'cell\.soc0', which is overridden before it; give 'cell' f"
    ):
        read_experiment(path, ["cell.soc0=0.8", "cell=my_cell.bpx.json"])
    cell = read_experiment(path, ["cell=my_cell.bpx.json", "cell.soc0=0.8"]).cell
    assert (cell.bpx, cell.soc0) == ("my_cell.bpx.json", 0.8)


@pytest.mark.parametrize(
    "override", ["seed", "=3", "seed.x=1", "search..x=1", "search.candidates=[", "seed=one"]
)
def test_a_bad_override_is_one_sentence(tmp_path, override):
    path = tmp_path / "x.yaml"
    path.write_text("name: x\nseed: 1\ndata: {kind: files, train: [a.csv], test: [b.csv]}\n")
    with pytest.raises(ConfigError) as caught:
        read_experiment(path, [override])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("note=2001-99-99", "--set note=2001-99-99: '2001-99-99' is not YAML: month must be in 1..12."),
        ("note=!!int x", "--set note=!!int x: '!!int x' is not YAML: invalid literal for int() "),
        ("cell={soc0: 0.1, soc0: 0.9}", "line 1, column 13: the key 'soc0' is there twice; keep one."),
    ],
)
def test_an_override_that_is_not_yaml_was_a_bug_or_lost_a_key(tmp_path, override, words):
    path = tmp_path / "x.yaml"
    path.write_text("name: x\nseed: 1\ndata: {kind: files, train: [a.csv], test: [b.csv]}\n")
    with pytest.raises(ConfigError, match=re.escape(words)):
        read_experiment(path, [override])


def test_a_missing_file_names_its_neighbour(tmp_path):
    (tmp_path / "smoke.yaml").write_text("name: smoke")
    with pytest.raises(ConfigError, match=r"Did you mean .*smoke\.yaml"):
        read_experiment(tmp_path / "smok.yaml")


def test_yaml_cannot_build_objects(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("name: !!python/object/apply:os.system ['touch owned']\n")
    with pytest.raises(ConfigError, match="is not YAML"):
        read_experiment(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name: x\nseed: 1\nname: y\n", r"at line 3, column 1: the key 'name' is there twice; keep one\.$"),
        ("name: x\ndata: {kind: files, kind: virtual}\n", "line 2, column 21: the key 'kind' is there twice"),
        ("name: [x\n", r"at line 2, column 1: while parsing a flow sequence, expected ',' or '\]'"),
        ("name: \x00\n", "is not YAML: character 7: "),
        ("name: 2001-99-99\n", "is not YAML: month must be in 1..12"),
        (
            f"seed: {5000 * '1'}\n",
            r"is not YAML: Exceeds the limit \(4300 digits\) .*: value has 5000 digits\.$",
        ),
        (
            f"name: {5000 * '['}",
            r"x\.yaml: is not YAML of an experiment: its lists or keys are nested too deeply\.$",
        ),
        ("name: x\n--- y\n", "line 2, column 1: expected a single document in the stream, but found another"),
    ],
)
def test_what_is_wrong_with_yaml_is_told_by_line_and_column(tmp_path, text, words):
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=words) as caught:
        read_experiment(path)
    assert "\n" not in str(caught.value)
    assert "unicode string" not in str(caught.value)


def test_keys_that_are_merged_in_may_be_said_again(tmp_path):
    path = tmp_path / "x.yaml"
    files = "data: {<<: &common {kind: files, train: [a.csv]}, train: [c.csv], test: [b.csv]}\n"
    path.write_text("name: x\n" + files)
    assert read_experiment(path).data.train == ("c.csv",)


def test_paths_start_from_the_experiments_folder(tmp_path):
    config = parse_experiment(CONTENT, base=tmp_path / "experiments")
    assert config.path("cells/a.json") == tmp_path / "experiments" / "cells" / "a.json"
    assert config.path("/data/a.json") == Path("/data/a.json")


def test_who_computes_and_where_it_is_tracked_is_no_part_of_the_identity():
    one = parse_experiment(CONTENT)
    other = parse_experiment(
        {
            **CONTENT,
            "tracking": {"uri": "http://a"},
            "runner": {"kind": "dask"},
            "search": {"workers": 2},
            "note": "n",
        }
    )
    assert one.digest == other.digest
    assert parse_experiment({**CONTENT, "seed": 1}).digest != one.digest
    assert parse_experiment({**CONTENT, "seed": 1}).setting == one.setting


def test_a_stated_temperature_needed_quotes():
    data = {**CONTENT["data"], "columns": {"temperature_degc": 40}}
    config = parse_experiment({**CONTENT, "data": data})
    assert config.data.reading("a.csv").columns == {"temperature_degc": "40"}


def test_a_config_survives_json():
    config = parse_experiment(CONTENT)
    assert ExperimentConfig.model_validate_json(config.model_dump_json()).digest == config.digest


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=20),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
        max_leaves=20,
    )
)
def test_any_content_gives_a_config_or_a_config_error(content):
    mapping = content if isinstance(content, dict) else {"name": content, "data": content}
    try:
        parse_experiment({**CONTENT, **mapping})
    except ConfigError:
        return


def test_an_experiment_that_only_closes_the_loop_needs_no_roles():
    content = {
        "name": "cold",
        "data": {"kind": "files"},
        "cell": {"bpx": "cell.json"},
        "discover": {"fit": ["a.csv"]},
    }
    config = parse_experiment(content)
    with pytest.raises(ConfigError, match="for `aesi discover` alone"):
        load(config)


def test_a_file_that_is_not_there_is_named_with_the_nearest(tmp_path):
    (tmp_path / "train.csv").write_text("")
    (tmp_path / "cell.bpx.json").write_text("")
    data = {"kind": "files", "train": ["trian.csv"], "test": ["train.csv"]}
    content = {"name": "own", "data": data, "cell": {"bpx": "cell.bpx.json"}}
    path = tmp_path / "own.yaml"
    for changes, words in (
        ({}, "own: data: trian.csv: there is no file .*trian.csv; did you mean 'train.csv'"),
        ({"cell": {"bpx": "sell.bpx.json"}}, "own: cell: there is no file .*did you mean 'cell.bpx.json'"),
    ):
        path.write_text(json.dumps(content | changes))
        with pytest.raises(ConfigError, match=words):
            check_there(read_experiment(path, []))
    path.write_text(json.dumps(content | {"data": data | {"train": ["cell.bpx.json"]}}))
    check_there(read_experiment(path, []))
