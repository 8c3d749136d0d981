"""Ten million rows: read within 4 GiB, decimated to a stated number of rows, the charge kept."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

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
    assert any("Decimated from 10000000" in note for note in answer["notes"])
    # The rows after the last whole run of five are left out: at most 0.4 s.
    assert answer["charge"] == pytest.approx(charge, abs=0.5 * 3.0)
    assert answer["peak"] < MEMORY_BYTES
