"""Run benchmarks and record them for the documentation: `python docs/hooks/record.py [NAME ...]`.

Writes docs/benchmarks.json: the machine, the date, the command and the lines it printed. Benchmarks that are not
named keep the lines they had.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

TARGET = Path(__file__).resolve().parents[1] / "benchmarks.json"


def main(names: list[str]) -> None:
    """Run the named benchmarks, or all of them."""
    lines = [line for name in names or [""] for line in run(name)]
    fresh = {line["bench"] for line in lines}
    kept = [line for line in _before() if line["bench"] not in fresh]
    record = {
        "machine": machine(),
        "date": datetime.now(UTC).date().isoformat(),
        "command": "aesi bench --json",
        "lines": kept + lines,
    }
    TARGET.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"{TARGET}: {len(lines)} lines recorded, {len(kept)} kept")


def run(name: str) -> list[dict[str, Any]]:
    """The lines that `aesi bench NAME --json` prints."""
    aesi = Path(sys.executable).with_name("aesi")
    command = [str(aesi), "bench", *([name] if name else []), "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def machine() -> str:
    """Processor, cores and memory, as far as the system tells."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{_processor()}, {os.cpu_count()} cores, {memory:.0f} GiB, Python {platform.python_version()}"


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _before() -> list[dict[str, Any]]:
    if not TARGET.exists():
        return []
    lines: list[dict[str, Any]] = json.loads(TARGET.read_text(encoding="utf-8"))["lines"]
    return lines


if __name__ == "__main__":
    main(sys.argv[1:])
