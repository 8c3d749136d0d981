"""The simulations that fits are made of."""

from __future__ import annotations

from collections.abc import Sequence

from aesi.physics import simulate
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.simulation import ModelName
from aesi.records import Hold, Measurement, Run
from aesi.tracer.case.instruments import instruments_undone
from aesi.tracer.case.stepping import FEWER_POINTS, stepping


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
    )
