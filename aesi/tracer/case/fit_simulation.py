"""The simulations that fits are made of, with coarser numerics than those of a simulation that is looked at.

The nonlinear part takes longer steps where rows are far apart, so that slow tests cost as little as short ones, and a
porous electrode has fewer points across it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from aesi.data.thinning import Averaged
from aesi.numerics.typing import Array
from aesi.parameters import Parameter
from aesi.physics import simulate
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Effect
from aesi.physics.model import DEFAULT_SUBSTEP_S, EspmModel
from aesi.physics.simulation import ModelName
from aesi.records import Hold, Measurement, Run
from aesi.tracer.case.instruments import instruments_undone

LONGEST_STEP_S = 60.0
"""A minute is short beside diffusion at C/20."""
STEPS_A_SAMPLE = 4
"""Most steps of the model between two rows."""

PARAMETERS = {
    "substep_s": Parameter(
        DEFAULT_SUBSTEP_S,
        "s",
        bounds=(0.1, LONGEST_STEP_S),
        source="a minute is short beside diffusion at C/20",
    )
}


def longer_steps(model: EspmModel, *, substep_s: float) -> EspmModel:
    """The model with another longest step, s, and at most `STEPS_A_SAMPLE` steps between two rows: thinned records have
    rows wherever much happens."""
    return replace(model, substep_s=substep_s, most_substeps=STEPS_A_SAMPLE)


EFFECT = Effect("longer_steps", "instrument", __doc__ or "", PARAMETERS, on_model=longer_steps)

POINTS = 4
"""Points across each electrode. Against 14, on discharges of the shipped cells to 1C at 25 degC, the voltage is off
by at most 0.14 mV RMS (NCA cell; 0.05 for the others), at 0.6 of the cost of the 6 that `simulate` takes. Where they
move the voltage notably, finer numerics double them."""


def fewer_points(model: EspmModel) -> EspmModel:
    """The model with few points across an electrode."""
    return replace(model, electrode_points=POINTS)


FEWER_POINTS = Effect("fewer_points", "instrument", __doc__ or "", on_model=fewer_points).activate()


@lru_cache(maxsize=64)
def stepping(data: Measurement) -> tuple[ActiveEffect, ...]:
    """The numerics for one record: an effect with longer steps where rows are far apart, else an empty tuple."""
    gaps = np.diff(data.time_s)
    if float(gaps.max(initial=0.0)) <= STEPS_A_SAMPLE * DEFAULT_SUBSTEP_S:
        return ()
    typical = float(np.median(gaps)) / STEPS_A_SAMPLE
    return (EFFECT.activate(substep_s=min(max(typical, DEFAULT_SUBSTEP_S), LONGEST_STEP_S)),)


@lru_cache(maxsize=64)
def unresolved_heat_w(data: Measurement, hold: Hold) -> Array | None:
    """(n,) W, see `Averaged.unresolved_heat_w`; None for rows as measured."""
    return data.unresolved_heat_w(hold) if isinstance(data, Averaged) else None


def fit_simulation(
    cell: Cell,
    data: Measurement,
    soc0: float | None,
    effects: Sequence[ActiveEffect],
    hold: Hold,
    model: ModelName = "espm",
    rest_voltage_v: float | None = None,
) -> Run:
    """One simulation, at the measured temperature where there is one, in longer steps where rows are far apart.

    soc0 : state of charge at the first row; None takes that at which the cell rests at `rest_voltage_v` (V).
    effects : active ones; those that infer a quantity that was measured are skipped, unless they hold constants of the
    cell, as self_heating does its heat capacity.
    Stoichiometries are clipped at the ends of their range, so that a search goes on. Raises AesiError where the
    simulation fails.
    """
    needed = tuple(
        a
        for a in effects
        if a.effect.infers is None or a.effect.of_every_record or data.temperature_degc is None
    )
    data, needed = instruments_undone(data, needed)
    spared = (FEWER_POINTS,) if model == "dfn" else ()
    return simulate(
        cell,
        data.time_s,
        data.current_a,
        soc0,
        (*spared, *needed, *stepping(data)),
        data.temperature_degc,
        hold,
        rest_voltage_v=rest_voltage_v,
        on_depletion="clip",
        model=model,
        unresolved_heat_w=unresolved_heat_w(data, hold),
    )
