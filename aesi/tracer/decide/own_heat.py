"""Records without a temperature, of a cell that warms itself under load as its file says."""

from __future__ import annotations

from dataclasses import replace

from aesi.physics.effect import ActiveEffect
from aesi.physics.effects import self_heating
from aesi.tracer.decide.evidence import Evidence
from aesi.tracer.search.plausible import ALIKE_NATS


def heat_of_file(evidence: Evidence) -> ActiveEffect | None:
    """Self-heating with the thermal data of the cell's file, for a second search; None where the first search explains
    the data, beside known-good records, where a temperature was measured, where self-heating is in the model or is not
    to be tried, and where the file lacks a heat capacity or a conductance to the surroundings.

    The first search holds the temperature constant, although losses warm every cell. It adds one effect at a time and
    so misses a wrong temperature with heat: in the cold a constant temperature explains too little, and heat alone
    nothing.
    """
    problem = evidence.path.problem
    asked = evidence.verdict.word == "unknown" and not problem.has_good
    measured = any(record.data.temperature_degc is not None for record in problem.records)
    cell = problem.cell
    declared = cell.heat_capacity_j_k is not None and cell.conductance_w_k is not None
    if not asked or measured or not declared or self_heating.EFFECT.id not in problem.competing():
        return None
    return self_heating.of_file(cell)


def with_heat_told(warm: Evidence, evidence: Evidence) -> Evidence | None:
    """The evidence of the search with the file's heat, with a sentence on it; None where a constant temperature
    predicts unseen data better by more than `ALIKE_NATS`."""
    cold = evidence.paths.get(warm.path.problem.trust, evidence.path)
    ahead = warm.path.chosen.score.total - cold.chosen.score.total
    if ahead < -ALIKE_NATS:
        return None
    heat = next(active for active in warm.path.problem.fixed if active.id == self_heating.EFFECT.id)
    cooling = f"{heat.parameters['heat_transfer_w_k']:.3g} W/K to the surroundings"
    note = (
        "no temperature was measured: every model, the declared one, too, warms itself by the thermal data of the "
        f"cell's file ({cooling}); that says {abs(ahead):.1f} nats {'more' if ahead >= 0.0 else 'less'} of unseen "
        "data than a constant temperature does."
    )
    return replace(warm, limits=(note, *warm.limits))
