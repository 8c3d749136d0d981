"""Run benchmarks and add them to the history in docs/benchmarks.json.

    python docs/hooks/record.py [NAME ...]                 run the named ones, or all
    python docs/hooks/record.py --lines FILE [FILE ...]    take what `aesi bench --json` has printed to files
    python docs/hooks/record.py --label TEXT ...           head the column of blind or measured cases with it

Says what got worse since it was last recorded, and then exits with 1; the entry is added all the same. Without a line
there is no entry.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flows.benchmarks.history import Entry, read_history, regressions, worth_keeping, write_history

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "docs" / "benchmarks.json"


def main(arguments: list[str]) -> int:
    """Add an entry; the number of regressions."""
    parser = argparse.ArgumentParser(description="Add benchmarks to the history in docs/benchmarks.json.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="benchmark to run; all without a name")
    parser.add_argument(
        "--lines", nargs="+", type=Path, metavar="FILE", help="what runs printed, in their place"
    )
    parser.add_argument("--label", help="head of the column of blind or measured cases")
    asked = parser.parse_args(arguments)
    if asked.lines and asked.names:
        parser.error("give names to run, or --lines of what was run.")
    load: float | None = None
    if asked.lines:
        lines = [line for path in asked.lines for line in parsed(path.read_text(encoding="utf-8"))]
    else:
        load = round(os.getloadavg()[0], 2)
        lines = [line for name in asked.names or [""] for line in run(name)]
    kept = tuple(line | {"label": asked.label} if asked.label else line for line in worth_keeping(lines))
    if not kept:
        parser.error("there is no line of a benchmark to add.")
    entries = read_history(TARGET)
    worse = regressions(entries, kept)
    entry = Entry(datetime.now(UTC).date().isoformat(), commit(), machine(), load, kept)
    write_history(TARGET, [*entries, entry])
    print(f"{TARGET}: {len(kept)} lines added")
    for text in worse:
        print(f"worse: {text}")
    return len(worse)


def run(name: str) -> list[dict[str, Any]]:
    """The lines that `aesi bench NAME --json` prints."""
    aesi = Path(sys.executable).with_name("aesi")
    command = [str(aesi), "bench", *([name] if name else []), "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return parsed(done.stdout)


def parsed(text: str) -> list[dict[str, Any]]:
    """The JSON lines of a text."""
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


def commit() -> str:
    """The commit that is checked out."""
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


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


if __name__ == "__main__":
    raise SystemExit(1 if main(sys.argv[1:]) else 0)
