"""Over a cell's envelope a simulation ends at its cut-off voltage, or with a sentence that names the true cause."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from aesi.constants import FARADAY_C_MOL
from aesi.errors import InputError, SimulationError
from aesi.physics import Cell, simulate
from aesi.physics.depletion import limiting_current_a
from aesi.physics.effects import CATALOGUE
from aesi.physics.model import EspmModel

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
RATED_C = {
    "lg_18650hg2": 20.0 / 3.0,
    "lg_18650hg2_25degc": 20.0 / 3.0,
    "panasonic_ncr18650pf": 10.0 / 2.9,
    "panasonic_ncr18650pf_25degc": 10.0 / 2.9,
    "lg_m50_chen2020": 3.0,
    "nmc_30ah": 3.0,
}
"""Continuous discharge in the data sheets (the pouch cell has none: what its drive cycles ask for)."""
CAUSES = ("more charge than the cell", "solid diffusion cannot follow", "the electrolyte ran out of salt")

NO_REACTION = "no reaction was found"
REFUSED = {("dfn", "reaction_nonuniformity")}
"""What a model has of itself."""


@cache
def cell_of(name: str) -> Cell:
    return Cell.from_bpx(CELLS / f"{name}.bpx.json")


@pytest.mark.parametrize("model", ["espm", "dfn"])
@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(sorted(RATED_C)),
    degc=st.floats(-20.0, 40.0),
    share=st.floats(-1.0, 1.0).filter(lambda s: abs(s) > 0.01),
    soc0=st.floats(0.0, 1.0),
)
@example(name="lg_18650hg2", degc=0.0, share=0.5625, soc0=0.875)  # its winding warms until it is empty
def test_over_the_envelope_a_simulation_ends_at_its_cut_off_or_says_why_not(model, name, degc, share, soc0):
    cell = cell_of(name)
    rate = share * RATED_C[name] if share > 0 else share
    current = rate * cell.nominal_capacity_ah
    room_ah = cell.capacity_ah * (soc0 if current > 0 else 1.0 - soc0)
    time = np.linspace(0.0, max(1.15 * room_ah / abs(current) * 3600.0, 5.0), 400)
    run = simulate(cell, time, np.full(400, current), soc0, (), degc, on_depletion="clip", model=model)
    assert np.isfinite(run.voltage_v).all()
    passed = (run.voltage_v < cell.lower_voltage_v) | (run.voltage_v > cell.upper_voltage_v)
    depleted = run.series["depleted"] > 0
    ends = int(np.argmax(passed)) if passed.any() else len(time)
    fails = int(np.argmax(depleted)) if depleted.any() else len(time)
    if fails < len(time):
        with pytest.raises(SimulationError) as caught:
            simulate(cell, time, np.full(400, current), soc0, (), degc, model=model)
        said = str(caught.value)
        beyond = (
            (NO_REACTION,) if ends <= fails else ()
        )  # places full and places empty, past what a cell is used for
        assert any(cause in said for cause in (*CAUSES, *beyond))
        soc = float(run.series["soc"][fails])
        if NO_REACTION not in said:
            assert ("more charge than the cell" in said) == (not 0.0 <= soc <= 1.0 and "salt" not in said)
        assert ("cut-off" in said) == (ends <= fails)
    if current > 0 and ends == len(time) and fails == len(time):
        assert run.series["soc"][-1] < 0.02  # a rest voltage below the cut-off is beyond what is asked


@pytest.mark.parametrize("model", ["espm", "dfn"])
@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=CATALOGUE)
@settings(max_examples=4, deadline=None)
@given(
    name=st.sampled_from(sorted(RATED_C)),
    degc=st.floats(-10.0, 40.0),
    share=st.sampled_from([-1.0, -0.3, 0.3, 1.0]),
    soc0=st.floats(0.05, 0.95),
)
# Of particles of several sizes the small ones are full long before the large ones.
@example(name="panasonic_ncr18650pf", degc=0.0, share=-1.0, soc0=0.0625)
def test_with_any_effect_a_cell_is_followed_until_it_runs_out_or_one_sentence_says_why_not(
    model, effect, name, degc, share, soc0
):
    cell = cell_of(name)
    current = (share * RATED_C[name] if share > 0 else share) * cell.nominal_capacity_ah
    room_ah = cell.capacity_ah * (soc0 if current > 0 else 1.0 - soc0)
    time = np.linspace(0.0, max(1.15 * room_ah / abs(current) * 3600.0, 5.0), 200)

    def run(**options):
        return simulate(
            cell, time, np.full(200, current), soc0, [effect.activate()], degc, model=model, **options
        )

    if (model, effect.id) in REFUSED:
        with pytest.raises(InputError, match="of itself"):
            run()
        return
    followed = run(on_depletion="clip")
    assert np.isfinite(followed.voltage_v).all()
    if not (followed.series["depleted"] > 0).any():
        assert run().voltage_v == pytest.approx(followed.voltage_v)
        return
    with pytest.raises(SimulationError) as caught:
        run()
    assert any(cause in str(caught.value) for cause in (*CAUSES, NO_REACTION))
    assert "\n" not in str(caught.value)


def test_where_a_porous_electrode_runs_dry_its_solution_goes_on_to_the_cut_off():
    cell = cell_of("lg_18650hg2")
    time = np.arange(0.0, 100.0, 0.25)
    current = np.full(len(time), 4.0 * cell.nominal_capacity_ah)
    run = simulate(cell, time, current, 0.85, (), -10.0, on_depletion="clip", model="dfn")
    ends = int(np.argmax(run.voltage_v < cell.lower_voltage_v))
    dry = np.abs(run.series["c_eL"]) < 0.01 * cell.electrolyte.c0_mol_m3
    assert ends > 0
    assert dry[:ends].sum() > 20  # for seconds the reaction has left the collector and goes on elsewhere
    assert run.series["depleted"][ends] == 0.0


def test_an_electrolyte_that_is_too_cold_is_named_and_not_the_charge():
    cell = cell_of("nmc_30ah")
    time = np.arange(200.0)
    with pytest.raises(SimulationError, match="too cold for this current") as caught:
        simulate(cell, time, np.full(200, 8.0 * cell.nominal_capacity_ah), 1.0, (), -20.0)
    assert "soc0" not in str(caught.value)
    assert "-20 degC" in str(caught.value)


def test_a_single_particle_stopped_where_a_porous_electrode_goes_on():
    """At the collector the salt is used up after a minute, and the reaction goes on nearer to the separator: the single
    particle ended there, and is within 27 mV of a porous electrode for five."""
    cell = cell_of("nmc_30ah")
    time = np.arange(0.0, 300.0)
    current = np.full(len(time), 3.0 * cell.nominal_capacity_ah)
    single, porous = (simulate(cell, time, current, 0.9, (), -10.0, model=model) for model in ("espm", "dfn"))
    assert (single.series["c_eL"] < 0.0).mean() > 0.5
    assert single.voltage_v == pytest.approx(porous.voltage_v, abs=0.05)


def test_a_current_asked_of_an_empty_cell_is_named_as_charge():
    cell = cell_of("lg_m50_chen2020")
    time = np.arange(0.0, 8000.0, 10.0)
    with pytest.raises(SimulationError, match="asks for more charge than the cell has") as caught:
        simulate(cell, time, np.full(len(time), 5.0), 0.9)
    assert "passed the lower cut-off (2.5 V)" in str(caught.value)
    assert "soc0" in str(caught.value)
    missing = (
        5.0 * time[-1] / 3600.0 / cell.capacity_ah - 0.9
    )  # of all that is asked for, not up to the fault
    assert f"than the cell has, by {100 * missing:.1f} % of its capacity in all. Check soc0" in str(
        caught.value
    )
    with pytest.raises(SimulationError, match="brings more charge than the cell can hold") as caught:
        simulate(cell, time, np.full(len(time), -5.0), 0.9)
    assert "passed the upper cut-off (4.2 V)" in str(caught.value)


def test_a_pulse_of_charge_above_the_upper_cut_off_was_told_of_a_cell_that_ran_empty():
    cell = cell_of("lg_m50_chen2020")
    time = np.arange(0.0, 8000.0, 10.0)
    current = np.where(time < 20.0, -10.0, 5.0)
    assert simulate(cell, time[:3], current[:3], 0.99).voltage_v.max() > cell.upper_voltage_v
    with pytest.raises(SimulationError, match="asks for more charge than the cell has") as caught:
        simulate(cell, time, current, 0.99)
    assert "passed the lower cut-off (2.5 V)" in str(caught.value)
    cold = np.full(len(time), -20.0)
    with pytest.raises(SimulationError, match=r"too cold|solid diffusion cannot") as caught:
        simulate(cell, time, np.where(time < 20.0, -10.0, 10.0), 0.99, (), cold)
    assert "upper cut-off" not in str(caught.value)


def test_the_salt_of_a_drive_in_the_cold_stays_near_that_of_a_porous_electrode():
    """A wall that a uniform reaction would dry is one from which the reaction withdraws."""
    cell = cell_of("nmc_30ah")
    time = np.arange(0.0, 120.0)
    current = np.where(time % 60 < 40, 3.0, 0.3) * cell.nominal_capacity_ah
    single, porous = (
        simulate(cell, time, current, 0.8, (), -20.0, on_depletion="clip", model=name)
        for name in ("espm", "dfn")
    )
    assert single.series["c_eL"].min() < 0.0 < porous.series["c_eL"].min()
    assert np.abs(single.voltage_v - porous.voltage_v).max() < 0.12


def steady_salt(cell: Cell) -> tuple[float, float]:
    """Mean salt in the negative and the positive electrode over rest, mol/m3, under a steady discharge of 1 A that
    reacts evenly, by quadrature of the flux (1 - t) I/F = -D B dc/dx."""
    layers, e = (cell.negative, cell.separator, cell.positive), cell.electrolyte
    thickness = np.array([layer.thickness_m for layer in layers])
    cells = 2000
    dx = np.repeat(thickness / cells, cells)
    across = (np.arange(cells) + 0.5) / cells
    ionic_a = np.concatenate([across, np.ones(cells), 1.0 - across]) / cell.total_area_m2
    efficiency = np.repeat([layer.transport_efficiency for layer in layers], cells)
    diffusivity = float(e.diffusivity(np.array([e.c0_mol_m3]))[0])
    slope = -(1.0 - e.transference) * ionic_a / (FARADAY_C_MOL * diffusivity * efficiency)
    salt = np.cumsum(slope * dx) - 0.5 * slope * dx
    porosity = np.repeat([layer.porosity for layer in layers], cells)
    salt -= (salt * porosity * dx).sum() / (porosity * dx).sum()
    return float(salt[:cells].mean()), float(salt[-cells:].mean())


@pytest.mark.parametrize("name", ["lg_m50_chen2020", "lfp_prada2013", "nmc_30ah"])
def test_the_salt_of_a_discharge_was_told_to_last_for_the_current_of_a_charge(name):
    """Of an LFP cell, whose thinner positive electrode loses less: 42 A, which it carries on charge, for 86."""
    cell = cell_of(name)
    of_negative, of_positive = steady_salt(cell)
    rest = cell.electrolyte.c0_mol_m3
    for charging, lost in ((False, -of_positive), (True, of_negative)):
        told = limiting_current_a(EspmModel(cell), cell.reference_temperature_k, charging)
        assert told == pytest.approx(rest / lost, rel=1e-4)
