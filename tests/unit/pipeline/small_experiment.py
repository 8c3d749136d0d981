"""A small experiment with a known answer: a cell whose contacts are worse than its file says."""

from functools import cache
from pathlib import Path

import numpy as np

from aesi.pipeline.experiment.config import ExperimentConfig, parse_experiment
from aesi.pipeline.experiment.fit import build_problem, final_models
from aesi.pipeline.experiment.intervals.conformalise import conformalise
from aesi.pipeline.experiment.load import Loaded, load
from aesi.sparse import Candidate, Genome, evaluate

ROOT = Path(__file__).resolve().parents[3]
BPX = ROOT / "experiments" / "cells" / "nmc_30ah.bpx.json"
SOC0 = 0.8
NOISE_V = 1e-3
PERIOD_S = 600


def write_record(
    folder: Path, name: str = "drive.csv", seed: int = 0, every_s: float = 1.0, noise_v: float = NOISE_V
) -> Path:
    """Five repeats of a random drive, after a minute of rest; 1.5 mohm more than declared."""
    import pandas as pd

    import aesi
    from aesi.physics.effects import CATALOGUE

    rng = np.random.default_rng(seed)
    schedule = np.repeat(rng.normal(12.0, 30.0, PERIOD_S // 20), 20).clip(-60.0, 90.0)
    schedule[:60] = 0.0
    seconds_a = np.tile(schedule, 5)
    time_s = np.round(every_s * np.arange(int((len(seconds_a) - 1) / every_s) + 1), 6)
    current_a = seconds_a[np.ceil(time_s).astype(int)]
    truth = aesi.simulate(
        aesi.Cell.from_bpx(BPX),
        time_s,
        current_a,
        soc0=SOC0,
        effects=[CATALOGUE["series_resistance"].activate(resistance_ohm=1.5e-3)],
        hold="backward",
    )
    voltage_v = truth.voltage_v + noise_v * rng.standard_normal(len(time_s))
    path = folder / name
    pd.DataFrame({"time_s": time_s, "current_a": current_a, "voltage_v": voltage_v}).to_csv(path, index=False)
    return path


def experiment(record: Path, dt_s: float = 1.0, **changes: object) -> ExperimentConfig:
    """Train on repeats 1, 3 and 5 of the record, test on 2 and 4."""
    content = {
        "name": "small",
        "data": {
            "kind": "files",
            "record": str(record),
            "dt_s": dt_s,
            "repeats": {"period_s": PERIOD_S, "train": [1, 3, 5], "test": [2, 4]},
        },
        "cell": {"bpx": str(BPX), "soc0": SOC0, "start": "declared"},
        "library": {
            "inputs": ["I", "I_next", "c_sp", "c_sn", "c_e0", "c_eL"],
            "p_c": [0, 1],
            "d": [1, 1],
            "special": True,
            "fade": False,
        },
        "search": {"resamples": 10, "block": 60},
        "conformal": {"window": 20},
        "models": ["ESPM", "AESI I", "AESI II"],
    }
    return parse_experiment(content | changes)


@cache
def fitted(record: Path, dt_s: float = 1.0) -> tuple[Loaded, Candidate, tuple]:
    """The experiment loaded, one candidate without feedback, and the models with their intervals."""
    config = experiment(record, dt_s)
    loaded = load(config)
    problem = build_problem(loaded, config)
    chosen = evaluate(problem, Genome.whole(problem.library, 1.0, 1e-3, 0.5, 1, 1, feedback=False))
    assert isinstance(chosen, Candidate)
    models = conformalise(final_models(problem, chosen, config).fitted, problem, chosen, config)
    return loaded, chosen, models
