"""A second look, where the declared parameters are off in many ways at once.

The file of a real cell is rarely off in one thing. Where single effects leave a structured residual, and the data hold
what a calibration needs (a slow, nearly full discharge), the model's own parameters and its open-circuit potential are
freed for every hypothesis, the empty one included. That empty hypothesis is the recalibrated model, and what is
missing from the physics competes on top of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.numerics.typing import Array, BoolArray
from aesi.physics.balance import same_rest
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.effects import CATALOGUE
from aesi.tracer.calibrate import MODEL_ERROR_V, OUTLIER_V, RESISTANCE, with_model_error
from aesi.tracer.calibrate import settled as settled_cell
from aesi.tracer.cycler_zero import is_slow
from aesi.tracer.fit import Fit, fit_hypothesis
from aesi.tracer.knobs import SOC0, placed_in
from aesi.tracer.ocp_correction import EFFECT as OCP_CORRECTION
from aesi.tracer.problem import TOLERANCES, Problem
from aesi.tracer.records import Record
from aesi.tracer.rough_look import FAR_OFF
from aesi.tracer.score import refitted_without, structured_v
from aesi.tracer.search import EVIDENCE_NATS, Admission, Breadth, Scored, Search
from aesi.tracer.verdict import Verdict, Word

OCP = "ocp_shape"
OWN: Mapping[str, float] = {
    OCP: 0.05,
    "active_material_loss_negative": 0.1,
    "active_material_loss_positive": 0.1,
    "lithium_inventory_loss": 0.05,
    "solid_diffusivity": 1.0,
    "charge_transfer_kinetics": 1.0,
    "electrolyte_transport": 0.7,
}
"""What a published parametrisation may be off by: V for the potential, shares for the balance, e-folds for the rest."""
RESISTANCE_OHM_AH = 0.02
"""Of contacts that were not declared, for a cell of one ampere-hour."""
STEPS = 14
"""Of a descent: many parameters at once, far from where they were declared."""
SPAN = 0.8
FIRST = Breadth(least_share=0.5, most_left_v=FAR_OFF * MODEL_ERROR_V)
"""Of the search before: it goes on from single effects only where one explains most of what there is, and leaves no
more than a model that needs calibrating would."""
BREADTH = Breadth(singles=5, abreast=1, grown=3, lost=(1, 3))
LIKELY = (
    "reaction_nonuniformity",
    "self_heating",
    "ocv_hysteresis",
    "concentration_dependent_diffusivity",
    "film_growth",
    "double_layer",
)
"""What a real cell has under load, more or less of it, in the order in which it is tried."""
BLOCKS = 12
BETWEEN, BEYOND = range(1, BLOCKS, 3), range(9, BLOCKS)
"""Of the blocks of each quick record, those that a hypothesis has to predict unseen: every third, between others that
it sees, and in a second refit the last quarter, beyond them."""
BETWEEN_SHARE, BEYOND_SHARE = 0.97, 1.2
"""And with errors of at most these shares of those without the effect: better between, and no worse beyond, where the
potential at charges that no other record has seen decides more than any effect."""
CONTRADICTION = (
    "the model's own parameters, refitted to all of these records, do worse on parts that the fit has not seen than "
    "the declared ones: the records contradict one another, by the zero of their currents or by more than one effect, "
    "and nothing is adopted"
)


def is_possible(problem: Problem) -> bool:
    """True where a slow discharge over most of the range is among the data."""
    return any(_is_slow_and_wide(problem.cell, r) for r in problem.records)


def _is_slow_and_wide(cell: Cell, record: Record) -> bool:
    seen = record.thin.take(slice(0, record.n_fit))
    moved_ah = (
        np.concatenate([[0.0], np.cumsum(seen.current_a[1:] * np.diff(seen.time_s))]) / SECONDS_PER_HOUR
    )
    return is_slow(cell, record) and float(np.ptp(moved_ah)) >= SPAN * cell.capacity_ah


def freed(problem: Problem) -> Problem:
    """The same case with the model's own parameters open in every hypothesis."""
    resistance = RESISTANCE_OHM_AH / problem.cell.nominal_capacity_ah
    own = {**TOLERANCES, **OWN, RESISTANCE: resistance}
    effects = {name: CATALOGUE[name] for name in own if name != OCP} | {OCP: OCP_CORRECTION}
    return replace(
        problem,
        records=tuple(with_model_error(r) for r in problem.records),
        effects=dict(problem.effects) | effects,
        tolerances=own,
        nuisances=frozenset(own),
        model_error_v=MODEL_ERROR_V,
        outlier_v=OUTLIER_V,
        steps=STEPS,
    )


def nats_of_potential(problem: Problem, fit: Fit) -> float:
    """Evidence that the recalibrated model loses where its open-circuit potential stays as declared."""
    tolerances = {name: sd for name, sd in problem.tolerances.items() if name != OCP}
    without = replace(problem, tolerances=tolerances)
    knobs = without.knobs(())
    other = fit_hypothesis(without, (), [placed_in(knobs, fit.placed, np.zeros(len(knobs)))])
    return np.inf if other is None else fit.log_evidence - other.log_evidence


def reworded(
    verdict: Verdict, added: tuple[str, ...], moved: Mapping[str, float], left_v: Sequence[float]
) -> Verdict:
    """The verdict of the second search, with what recalibration did and which of its parameters mattered.

    added : effects on top.  moved : own parameter -> nats that it brings.
    left_v : beyond noise as declared, recalibrated, and with the effects added, V.
    """
    before, recalibrated, after = (1e3 * v for v in left_v)
    reason = (
        f"{before:.2f} mV beyond the noise as declared, {recalibrated:.2f} mV after the model's own parameters were "
        f"recalibrated, {after:.2f} mV with {' + '.join(added) or 'nothing'} on top; "
        f"{1e3 * verdict.tolerance_v:.2f} mV would be within what a model may miss"
    )
    effects = (*moved, *added)
    groups = tuple(g for g in verdict.groups if g[0] in effects)
    word: Word = "found" if verdict.word == "found" else "unknown"
    return replace(verdict, word=word, effects=effects, groups=groups, reason=reason)


def contradicted(verdict: Verdict) -> Verdict:
    """The verdict where a recalibration does not carry to data that it has not seen: nothing is named."""
    return replace(
        verdict, word="unknown", effects=(), groups=(), reason=f"{verdict.reason}; {CONTRADICTION}"
    )


@dataclass
class SecondSearch(Search):
    """A search on top of a recalibrated model.

    With so many parameters free a linear estimate says little, so that a short list of what real cells have under load
    is fitted in full, and unseen data are parts of the quick records that refits leave out.
    """

    unseen: dict[frozenset[str], tuple[float, float]] = field(default_factory=dict)

    def _promising(self, parent: Scored, names: list[str]) -> list[str]:
        return [name for name in LIKELY if name in names]

    def _score(self, fit: Fit) -> Scored:
        counted = self.problem.saturated(fit.residual_v)
        return Scored(fit, float(np.sqrt(np.mean(counted**2))), structured_v(self.problem, counted))

    def _admission(self, parent: Scored, child: Scored) -> Admission:
        nats = child.evidence - parent.evidence
        reasons = []
        if nats < EVIDENCE_NATS:
            reasons.append(f"brings {nats:.1f} nats, {EVIDENCE_NATS:g} are asked for")
        if child.fit.at_bounds:
            reasons.append(f"ends on a bound: {', '.join(child.fit.at_bounds)}")
        gain = 0.0
        if not reasons:
            before, after = self._unseen_rmse_v(parent), self._unseen_rmse_v(child)
            gain = float(np.sqrt(max(before[0] ** 2 - after[0] ** 2, 0.0)))
            for where, share, was, left in zip(
                ("between", "beyond"), (BETWEEN_SHARE, BEYOND_SHARE), before, after, strict=True
            ):
                if left > share * was:
                    reasons.append(
                        f"leaves {1e3 * left:.2f} mV {where} what it has seen, {1e3 * was:.2f} mV without it"
                    )
        return Admission(not reasons, "; ".join(reasons), nats, gain, 0.0, np.inf)

    def improves(self, scored: Scored, declared: Fit) -> bool:
        """Does it leave less on parts that it has not seen than the declared model does, which has been fitted to none?

        Where records contradict one another, a recalibration to all of them may be worse than none.
        """
        counted = np.clip(declared.residual_v, -OUTLIER_V, OUTLIER_V)
        known = [np.mean(counted[self._rows_of(blocks)] ** 2) for blocks in (BETWEEN, BEYOND)]
        return bool(sum(e**2 for e in self._unseen_rmse_v(scored)) < sum(known))

    def _unseen_rmse_v(self, scored: Scored) -> tuple[float, float]:
        """RMSE on parts of the quick records by fits that have not seen them, between and beyond, V. Errors count up
        to what saturates a calibration: a model that runs empty says no more by how far."""
        key = frozenset(scored.hypothesis)
        if key not in self.unseen:
            between, beyond = (
                float(np.sqrt(np.mean(self._predicted(scored, blocks) ** 2))) for blocks in (BETWEEN, BEYOND)
            )
            self.unseen[key] = between, beyond
        return self.unseen[key]

    def _predicted(self, scored: Scored, blocks: range) -> Array:
        """V: errors on these blocks of a fit without them, at most OUTLIER_V."""
        out = self._rows_of(blocks)
        e = refitted_without(self.problem, scored.fit, out)
        return np.full(np.count_nonzero(out), OUTLIER_V) if e is None else np.clip(e, -OUTLIER_V, OUTLIER_V)

    def _rows_of(self, blocks: range) -> BoolArray:
        """(n,) True on the rows of the quick records that lie in these blocks of their time."""
        records = self.problem.records
        quick = [i for i, r in enumerate(records) if not _is_slow_and_wide(self.problem.cell, r)]
        out = np.zeros(len(self.problem.measured), dtype=bool)
        for i in quick or range(len(records)):
            time = records[i].thin.time_s[: records[i].n_fit]
            block = np.minimum((BLOCKS * (time - time[0]) / (time[-1] - time[0])).astype(int), BLOCKS - 1)
            out[self.problem.slices[i]] = np.isin(block, blocks)
        return out


def settled(problem: Problem, fit: Fit) -> tuple[Cell, tuple[ActiveEffect, ...], float]:
    """The recalibrated cell, the effects on top of it, and its state of charge at the first sample.

    The cell says by itself what its own parameters said, so that a BPX file holds it.
    """
    values = {owner: given for owner, given in fit.values.items() if owner != SOC0}
    folded = {
        o: v for o, v in values.items() if o in problem.nuisances and problem.effects[o].on_model is not None
    }
    beside = {owner: given for owner, given in values.items() if owner not in folded}
    cell = settled_cell(problem, folded)
    return cell, problem.active(beside), same_rest(problem.cell, cell, fit.values[SOC0]["0"])
