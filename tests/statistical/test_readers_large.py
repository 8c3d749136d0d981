"""Ten million rows: read and discovered on within 4 GiB, decimated to a stated number of rows, the charge kept."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import aesi
from aesi.physics.effects import CATALOGUE

CELL = Path(__file__).resolve().parents[2] / "experiments" / "cells" / "nmc_30ah.bpx.json"
ROWS = 10_000_000
CHUNK = 500_000
MEMORY_BYTES = 4 * 1024**3

READ = """
import json, resource, sys
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]), int(sys.argv[2])))
from aesi.data import read_measurement
m = read_measurement(sys.argv[1])
charge = float((m.current_a[1:] * (m.time_s[1:] - m.time_s[:-1])).sum())
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
print(json.dumps({"rows": len(m), "charge": charge, "last": float(m.time_s[-1]), "peak": peak, "notes": m.notes}))
"""


def write_rows(path: Path) -> float:
    """Rows every 0.1 s of a current that alternates each ten seconds about 1 A; returns the charge held, A s."""
    charge = 0.0
    with path.open("w") as stream:
        stream.write("time_s,current_a,voltage_v\n")
        for start in range(0, ROWS, CHUNK):
            k = np.arange(start, start + CHUNK)
            current = np.where((k // 100) % 2 == 0, 3.0, -2.9)
            voltage = 3.7 - 0.01 * current
            charge += 0.1 * float(np.sum(current[1:] if start == 0 else current))
            stream.write(
                "\n".join(
                    f"{t / 10:.1f},{i:.1f},{v:.4f}" for t, i, v in zip(k, current, voltage, strict=True)
                )
            )
            stream.write("\n")
    return charge


@pytest.mark.slow
def test_ten_million_rows_within_four_gibibytes(tmp_path):
    path = tmp_path / "long.csv"
    charge = write_rows(path)
    done = subprocess.run(
        [sys.executable, "-c", READ, str(path), str(MEMORY_BYTES)],
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    answer = json.loads(done.stdout)
    assert answer["rows"] <= 2_000_000
    assert any("Decimated from 10,000,000" in note for note in answer["notes"])
    # The rows after the last whole run of five are left out: at most 0.4 s.
    assert answer["charge"] == pytest.approx(charge, abs=0.5 * 3.0)
    assert answer["peak"] < MEMORY_BYTES


def write_drive(path: Path, rows: int) -> None:
    """Rows at 100 Hz of a 30 Ah cell under pulses of 20 s: 1 mohm that its file does not declare, 1 mV of noise."""
    import pyarrow as pa
    import pyarrow.csv as pacsv

    rng = np.random.default_rng(1)
    seconds = np.arange(rows // 100 + 1.0)
    pulses = rng.normal(0.0, 12.0, len(seconds) // 20 + 1)
    for start in range(0, len(pulses), 360):  # two hours that discharge, two that charge
        block = pulses[start : start + 360]
        block += (7.5 if start % 720 == 0 else -7.5) - block.mean()
    current = np.repeat(pulses, 20)[: len(seconds)]
    current[:120] = 0.0
    missing = CATALOGUE["series_resistance"].activate(resistance_ohm=1e-3)
    run = aesi.simulate(aesi.Cell.from_bpx(CELL), seconds, current, soc0=0.75, effects=[missing])
    time = np.arange(rows) / 100
    columns = {
        "time_s": time,
        "current_a": np.interp(time, seconds, current).round(3),
        "voltage_v": (np.interp(time, seconds, run.voltage_v) + 1e-3 * rng.standard_normal(rows)).round(5),
    }
    pacsv.write_csv(pa.table(columns), path)


def discover_within(path: Path, out: Path) -> tuple[dict, int]:
    """The content of discovery.json, and the most memory that the command held, in bytes."""
    command = [sys.executable, "-m", "flows.cli", "discover", "--cell", str(CELL), "--data", str(path)]
    with subprocess.Popen(
        [*command, "--out", str(out)], env={**os.environ, "AESI_HOME": str(out)}
    ) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return json.loads((out / "discovery.json").read_text()), used.ru_maxrss * 1024


@pytest.mark.slow
def test_ten_million_rows_are_discovered_on_within_four_gibibytes(tmp_path):
    path = tmp_path / "long.csv"
    write_drive(path, ROWS)
    found, peak = discover_within(path, tmp_path)
    assert any("Decimated from 10,000,000" in note for note in found["notes"])
    assert peak < MEMORY_BYTES
    # Averages over 1.3 s keep the ohmic drop: what is left is a twentieth of it, whatever the verdict is called.
    assert found["after"]["test"]["rmse_mv"] < 0.1 * found["before"]["test"]["rmse_mv"]
