"""Does a finding hold where the state of charge is read from the record itself?

Virtual records of an hour, of steps with pauses and 1 mV of noise, begin at rest at 55 and at 92 % of the charge of
each of five cells; each has one effect. The finder is not told the state of charge. Some effects shift the voltage that
it is read from, others the potentials that it is read by, and on a flat potential a few millivolts are worth much of
the charge.

    python -m aesi.bench.read_start

prints one line per record and, last, the counts.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer import discover

CELLS = ("lg_m50_chen2020", "nmc_30ah", "lfp_prada2013", "nca_kim2011", "panasonic_ncr18650pf")
STARTS = (0.55, 0.92)
"""States of charge at the first row: a flat and a steep part of most potentials. A convention."""
HYSTERESIS = {"rate": 20.0, "start": 1.0}
SHIFTING: tuple[tuple[str, Mapping[str, float]], ...] = (
    ("voltage_sensor_offset", {"offset_v": 8e-3}),
    ("voltage_sensor_offset", {"offset_v": -12e-3}),
    ("voltage_sensor_offset", {"offset_v": 16e-3}),
    ("ocv_hysteresis", {"magnitude_v": 10e-3, **HYSTERESIS}),
    ("ocv_hysteresis", {"magnitude_v": 20e-3, **HYSTERESIS}),
)
"""Effects that add to the voltage which the state of charge is read from."""
OTHERS: tuple[tuple[str, Mapping[str, float]], ...] = (
    ("ocp_shape", {"a1_v": 12e-3, "a2_v": -6e-3, "a3_v": 6e-3}),
    ("ocp_shape", {"a1_v": -20e-3, "a2_v": 10e-3, "a3_v": -10e-3}),
    ("lithium_inventory_loss", {"loss": 0.05}),
    ("solid_diffusivity", {"negative_factor": 1.5}),
)
COMPETING = (
    "series_resistance",
    "current_sensor_gain",
    "voltage_sensor_offset",
    "solid_diffusivity",
    "ocv_hysteresis",
    "ocp_shape",
    "lithium_inventory_loss",
    "charge_transfer_kinetics",
)
"""The effects that the finder may name."""
DURATION_S, STEP_S, NOISE_V = 3600, 20, 1e-3
"""Length of a record and of a step of its current, s, and standard deviation of its noise, V. A convention."""


def record_at_rest(cell: Cell, soc0: float, effect: str, values: Mapping[str, float]) -> Measurement:
    """A record at 1 Hz with one effect, at rest in its first row."""
    rng = np.random.default_rng(int(abs(next(iter(values.values()))) * 1e4 + 100 * soc0))
    time_s = np.arange(float(DURATION_S))
    rates = rng.normal(0.3, 0.7, DURATION_S // STEP_S)  # discharging on average
    current_a = np.repeat(rates, STEP_S) * cell.nominal_capacity_ah
    current_a[(time_s // 240.0) % 5.0 == 0.0] = 0.0
    active = CATALOGUE[effect].activate(**values)
    voltage_v = simulate(cell, time_s, current_a, soc0, [active], hold="backward").voltage_v
    noise_v = NOISE_V * rng.standard_normal(DURATION_S)
    return Measurement(time_s, current_a, voltage_v + noise_v, name="record", hold="backward")


def rows(cells: Path) -> Iterator[dict[str, Any]]:
    """One row per record: what is in it, and the answer."""
    competing = {name: CATALOGUE[name] for name in COMPETING}
    for name in CELLS:
        cell = Cell.from_bpx(cells / f"{name}.bpx.json")
        for soc0 in STARTS:
            for effect, values in (*SHIFTING, *OTHERS):
                found = discover(cell, [record_at_rest(cell, soc0, effect, values)], effects=competing)
                yield {
                    "cell": name,
                    "soc0": soc0,
                    "effect": effect,
                    **values,
                    "shifting": (effect, values) in SHIFTING,
                    "verdict": found.verdict.word,
                    "effects": list(found.verdict.effects),
                    "right": found.verdict.effects == (effect,),
                }


def main() -> None:
    """Print one line per record and, last, the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--cells", default="experiments/cells")
    told = []
    for one in rows(Path(parser.parse_args().cells)):
        print(json.dumps(one), flush=True)
        told.append(one)
    shifting = [one for one in told if one["shifting"]]
    counts = {
        "summary": True,
        "records": len(told),
        "right": sum(one["right"] for one in told),
        "wrong_found": sum(one["verdict"] == "found" and not one["right"] for one in told),
        "shifting": len(shifting),
        "shifting_right": sum(one["right"] for one in shifting),
    }
    print(json.dumps(counts))


if __name__ == "__main__":
    main()
