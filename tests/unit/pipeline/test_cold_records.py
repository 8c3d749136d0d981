"""A record without its temperature that a cold cell could have given is searched, and another cell's refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import aesi
from aesi.errors import DataError
from aesi.physics.effects import CATALOGUE
from aesi.physics.record_checks import check_measured
from aesi.pipeline.calibrate import start_at_size
from aesi.pipeline.discovery import cold
from aesi.pipeline.discovery.cases import case_of_files
from aesi.pipeline.discovery.cold import with_cold_admitted
from aesi.pipeline.discovery.discover import Case
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
HG2 = CELLS / "lg_18650hg2_25degc.bpx.json"


@pytest.fixture(scope="module")
def hg2():
    return aesi.Cell.from_bpx(HG2)


def discharged(cell, shift_k):
    """A rest, a 1C discharge with pulses from full to the lower cut-off, at `shift_k` from the declared temperature."""
    time_s = np.arange(0.0, 4000.0, 2.0)
    pulses = 1.0 + 0.5 * np.sign(np.sin(time_s / 60.0))
    current_a = np.where(time_s > 60.0, pulses, 0.0) * cell.nominal_capacity_ah
    cold = [CATALOGUE["ambient_temperature"].activate(shift_k=shift_k)]
    run = aesi.simulate(cell, time_s, current_a, soc0=1.0, effects=cold, hold="backward", on_depletion="clip")
    rows = slice(0, int(np.argmax(run.voltage_v < cell.lower_voltage_v)))
    noise_v = 1e-3 * np.random.default_rng(0).standard_normal(len(time_s))
    return Measurement(time_s[rows], current_a[rows], (run.voltage_v + noise_v)[rows], name="cold")


def test_a_discovery_refused_the_cold_records_whose_temperature_it_is_to_find(hg2, tmp_path):
    record = discharged(hg2, -40.0)
    with pytest.raises(DataError, match="Or it was far colder than the 25 degC"):
        check_measured(hg2, [record])
    columns = {"time_s": record.time_s, "current_a": record.current_a, "voltage_v": record.voltage_v}
    pd.DataFrame(columns).to_csv(tmp_path / "cold.csv", index=False)
    (note,) = case_of_files(HG2, [tmp_path / "cold.csv"]).measurements[0].notes
    assert "not those of" in note
    assert "at some -15 degC" in note
    with pytest.raises(DataError, match="Ah leave the cell"):  # nothing would find that it was cold
        case_of_files(HG2, [tmp_path / "cold.csv"], without=["ambient_temperature"])


def test_a_calibration_refused_a_cold_record_whose_temperature_was_given(hg2):
    record = discharged(hg2, -40.0)
    with pytest.raises(DataError, match="Or it was far colder"):
        start_at_size(hg2, [record], None)
    assert start_at_size(hg2, [record], {"cold": -15.0}).capacity_ah == pytest.approx(
        record.charge_ah, rel=0.01
    )


def refused(cell, record):
    with pytest.raises(DataError) as caught:
        with_cold_admitted(Case(HybridModel(cell), (record,)))
    return str(caught.value)


def test_the_cold_does_not_make_up_for_another_cells_capacity(hg2):
    """A warm record of a smaller cell, a cold one of a smaller cell, and one that charges more than fits."""
    m50 = aesi.Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    warm, cold = discharged(hg2, 0.0), discharged(hg2, -40.0)
    assert "Ah leave the cell" in refused(hg2, replace(warm, current_a=0.4 * warm.current_a))
    assert "Ah leave the cell" in refused(m50, cold)
    filling = Measurement(cold.time_s, -3.0 * warm.current_a[: len(cold)], warm.voltage_v[: len(cold)][::-1])
    assert "Ah enter the cell" in refused(hg2, filling)


def test_a_cell_that_does_not_answer_to_temperature_and_a_record_that_tells_its_own_are_as_declared(hg2):
    cold = discharged(hg2, -40.0)
    warm = replace(cold, temperature_degc=np.full(len(cold), 25.0))
    assert "colder" not in refused(hg2, warm)
    still = hg2.with_negative(diffusivity_ea_j_mol=0.0, rate_ea_j_mol=0.0, film_ea_j_mol=0.0)
    still = still.with_positive(diffusivity_ea_j_mol=0.0, rate_ea_j_mol=0.0, film_ea_j_mol=0.0)
    still = still.with_electrolyte(conductivity_ea_j_mol=0.0, diffusivity_ea_j_mol=0.0)
    assert "Ah leave the cell" in refused(still, cold)


@pytest.mark.parametrize(("asked", "model"), [("dfn", "dfn"), (None, "espm")])
def test_a_discovery_by_the_porous_electrode_asked_the_single_particle_for_the_cold(
    hg2, monkeypatch, asked, model
):
    used = set()

    def noted(*args, **options):
        used.add(options["model"])
        return aesi.simulate(*args, **{**options, "model": "espm"})

    monkeypatch.setattr(cold, "simulate", noted)
    (record,) = with_cold_admitted(Case(HG2, (discharged(hg2, -40.0),), model=asked)).measurements
    assert any("at some -15 degC" in note for note in record.notes)
    assert used == {model}
