"""Puts virtual records that experiments simulate, or fall back to, into the package:
`python docs/hooks/ship.py EXPERIMENT ...`.

Run it after a change of the laboratory, of the cell file or of the profiles: entries are found by their content, so
old ones are not wrong, only never met.
"""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
from pathlib import Path


def main() -> None:
    """Simulate the records of the experiments in an empty cache and move them beside the laboratory, in place of those
    that are there."""
    parser = argparse.ArgumentParser(
        description="Put virtual records into the package, in place of those there."
    )
    parser.add_argument("experiments", nargs="+", metavar="EXPERIMENT")
    experiments = parser.parse_args().experiments
    with tempfile.TemporaryDirectory() as folder:
        os.environ["AESI_CACHE"] = folder
        from aesi.data.laboratory import cache
        from aesi.pipeline.experiment.config import read_experiment
        from aesi.pipeline.experiment.sources import cell_path, virtual_experiment

        for config in map(read_experiment, experiments):
            simulated = config.on_fallback()
            virtual_experiment(simulated, cell_path(simulated))
        shutil.rmtree(cache.SHIPPED, ignore_errors=True)
        cache.SHIPPED.mkdir()
        for path in sorted((Path(folder) / "laboratory").glob("*.npz")):
            shutil.move(path, cache.SHIPPED / path.name)
            print(cache.SHIPPED / path.name)


if __name__ == "__main__":
    main()
