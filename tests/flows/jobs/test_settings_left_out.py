"""An experiment runs to its end with any optional key left out."""

import pytest
import yaml
from pydantic import BaseModel

from aesi.pipeline.experiment.config import ExperimentConfig

VIRTUAL = {
    "model": "SPMe",
    "effects": ["series_resistance"],
    "magnitude": 1.0,
    "values": {},
    "pulse_c": 2.0,
    "other_load": 2.0,
    "thermocouple": None,
    "seed": 0,
}
FULL = {
    "name": "whole",
    "note": "Every key of every section.",
    "seed": 0,
    "data": {
        "kind": "virtual",
        "set": None,
        "record": None,
        "repeats": None,
        "train": [],
        "valid": [],
        "test": [],
        "dt_s": 4.0,
        "hold": "linear",
        "columns": {},
        "units": {},
        "sign": None,
        "state_words": {},
        "duplicates": None,
        "from_s": {},
        "to_s": {},
        "virtual": VIRTUAL,
    },
    "cell": {
        "bpx": "",
        "soc0": None,
        "soc0_of": {},
        "soh": 0.98,
        "effects": {},
        "effect_files": [],
        "start": "declared",
        "model": "espm",
    },
    "fallback": None,
    "library": {
        "p_c": [0, 1],
        "d": [1, 1],
        "factors": 1,
        "special": False,
        "mixed": False,
        "inputs": None,
        "feedback": True,
        "fade": False,
    },
    "search": {
        "candidates": 4,
        "population": 2,
        "resamples": 5,
        "block": 40,
        "horizon": 40,
        "fold": 400,
        "regime": "free_run",
        "top_share": 0.4,
        "lambda1": [0.01, 10.0],
        "lambda2": [0.001, 0.1],
        "tau": [0.3, 0.7],
        "pearson_train": -0.9,
        "pearson_valid": -0.9,
        "weights": [0.45, 0.45, 0.1],
        "warm_start": True,
        "timeout_s": 60,
        "memory_mb": 4000,
        "workers": 1,
    },
    "conformal": {"method": "split", "alpha": 0.1, "window": 20, "horizons_s": [60.0], "compare": []},
    "models": ["ESPM", "AESI I"],
    "tracking": {"uri": None, "log_model": False, "register_model": False, "system_metrics": False},
    "runner": {"kind": "local", "address": None, "storage": None, "stage_timeout_s": 300},
    "discover": None,
}
NEEDED = {"name", "data", "data.kind", "cell", "cell.bpx"}
"""`cell.bpx` has a default for data sets that bring their cell; a virtual cell needs one."""
SLOW_WITHOUT = {"search.candidates", "data.dt_s", "data.virtual", "data.virtual.model"}
"""What is left to its default takes minutes: another key is made small for it below."""


def keys(model=ExperimentConfig, content=FULL, prefix=""):
    for name, field in model.model_fields.items():
        if name == "base":
            continue
        assert name in content, f"{prefix}{name} is a new key: give it a value above"
        yield f"{prefix}{name}"
        inner = field.annotation
        if isinstance(content[name], dict) and isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from keys(inner, content[name], f"{prefix}{name}.")


OPTIONAL = [key for key in keys() if key not in NEEDED]


SECTIONS = ["data", "data.virtual", "cell", "library", "search", "conformal", "tracking", "runner"]


def section_of(content, path):
    for part in path:
        content = content[part]
    return content


def without(keys, cell):
    content = yaml.safe_load(yaml.safe_dump(FULL))
    content["cell"]["bpx"] = str(cell)
    if SLOW_WITHOUT & set(keys):
        content["search"]["resamples"] = 2
    for key in keys:
        *path, last = key.split(".")
        del section_of(content, path)[last]
    return content


def runs_to_its_end(content, tracked):
    from flows.jobs.start import start

    path = tracked / "whole.yaml"
    path.write_text(yaml.safe_dump(content))
    folder = start(path, use_prefect=False)
    assert (folder / "report.html").stat().st_size > 1000
    assert (folder / "summary.json").is_file()


def test_a_run_without_search_block_ended_in_a_division_by_zero(tracked, cell):
    runs_to_its_end(without(["search.block"], cell), tracked)


@pytest.mark.parametrize("section", SECTIONS)
def test_a_section_may_hold_no_more_than_what_it_needs(section, tracked, cell):
    """The keys of a section at once, which is what a short file leaves out; those that take minutes are kept."""
    here = [key for key in OPTIONAL if key.rpartition(".")[0] == section]
    quick = [key for key in here if key not in SLOW_WITHOUT and key != "search.population"]
    runs_to_its_end(without(quick, cell), tracked)


@pytest.mark.slow
@pytest.mark.parametrize("key", [key for key in OPTIONAL if key != "search.block"])
def test_any_optional_key_may_be_left_out(key, tracked, cell):
    runs_to_its_end(without([key], cell), tracked)
