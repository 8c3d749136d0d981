"""The calibrated cell files come from the command that `experiments/cells/calibrate.sh` names."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from aesi.bench.physics.archive import ARCHIVE
from aesi.data.catalogue import locate
from aesi.errors import DataError
from aesi.physics import Cell, simulate

CELLS = Path(__file__).resolve().parents[2] / "experiments" / "cells"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "file", "data"),
    [
        ("hg2", "lg_18650hg2", "lg_18650hg2"),
        ("hg2_25degc", "lg_18650hg2_25degc", "lg_18650hg2"),
        ("hg2_mixed2", "lg_18650hg2_mixed2", "lg_18650hg2"),
        ("panasonic", "panasonic_ncr18650pf", "panasonic_ncr18650pf"),
        ("panasonic_25degc", "panasonic_ncr18650pf_25degc", "panasonic_ncr18650pf"),
        ("hg2_cold", "lg_18650hg2_cold", "lg_18650hg2"),
    ],
)
def test_the_command_gives_the_file_again(name, file, data, tmp_path):
    try:
        records = locate(data, "25degC_c20_ocv").parent.parent.parent
    except DataError as error:
        pytest.skip(str(error))
    shipped = Cell.from_bpx(CELLS / f"{file}.bpx.json")
    folder = records / "measured" / data
    beyond = [fitted for fitted, _ in shipped.fitted_at_k if fitted in ARCHIVE[data]]
    try:
        for fitted in beyond:
            locate(data, fitted)
    except DataError:
        pytest.skip(f"{name} needs {', '.join(beyond)} of the published archive in {folder}")
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = os.environ | {"AESI_DATA": str(records), "PATH": path}
    subprocess.run(["sh", CELLS / "calibrate.sh", name, tmp_path], check=True, env=environment, timeout=7200)
    again = Cell.from_bpx(tmp_path / f"{file}.bpx.json")
    assert again.tested_on == shipped.tested_on
    assert again.fitted_at_k == shipped.fitted_at_k
    time = np.arange(0.0, 2400.0)
    # At 5 degC the electrolyte of the Panasonic carries 1.3C for long.
    current = shipped.nominal_capacity_ah * (0.4 + 0.5 * np.sign(np.sin(time / 60.0)))
    voltages = [
        simulate(cell, time, current, 0.95, (), degc).voltage_v
        for cell in (shipped, again)
        for degc in (25.0, 5.0)
    ]
    # Other processors and libraries end a descent elsewhere along what the data leave open: lg_18650hg2 from an AMD
    # and from an Intel processor differ by 1.2 mV at 25 degC and 5.6 mV at 5 degC.
    assert np.abs(voltages[0] - voltages[2]).max() < 2e-3
    assert np.abs(voltages[1] - voltages[3]).max() < 8e-3
