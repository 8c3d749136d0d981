"""Forward selection over hypotheses, several abreast, every fit kept so that an interrupted search
resumes."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from aesi.numerics.typing import Array
from aesi.records import digest
from aesi.tracer.fit import Fit, as_dict, fit_hypothesis, from_dict
from aesi.tracer.knobs import SOC0, placed_in, starts
from aesi.tracer.problem import Hypothesis, Problem
from aesi.tracer.score import held_out_rmse_v, placebo_gain, refitted_rmse_v, structured_v

EVIDENCE_NATS = 10.0
"""What an effect has to bring beyond its own complexity: the price of having tried some twenty others."""
MATERIAL_SHARE = 0.35
"""An effect that moves the voltage by less than this share of the noise is not worth a name."""
POLARISATION_SHARE = 0.012
"""No two solvers of the same equations agree better than to this share of the polarisation, and what moves the voltage
by less is not told from them."""
PLACEBO_FACTOR = 2.0
"""An effect brings this many times what a placebo brings, or leaves at most its inverse of what a placebo
leaves."""
PLACEBO_MARGIN_SHARE = 0.25
RICHER = 3
"""Parameters more, from which on a hypothesis is a flexible curve beside a plain one."""
FAR = 1.5
"""Times more left on unseen data, from which on evidence does not count: its noise model forgives what is slow."""
AT_REST = (SOC0, "voltage_sensor_offset")
"""Owners of what a cell's voltage at rest is known to."""
RELIEF_NATS = 5.0
"""An effect that sets these right by so much need not move the voltage: without it, they hide it."""


@dataclass(frozen=True)
class Breadth:
    """How widely a search looks.

    singles : effects that are fitted alone, the most promising by a linear estimate (None: all).  abreast : hypotheses
    of a size that are grown further, since the best single effect need not be half of the best pair.  grown : effects
    that are fitted in full on top of each of them.  lost : abreast and grown where not one effect was admitted.
    least_share : of the structured variance that the best effect so far has to explain for the search to go on, where
    it is not 0: half of a pair may leave more by itself than nothing does.
    most_left_v : what it may leave for that, V.
    """

    singles: int | None = None
    abreast: int = 3
    grown: int = 6
    lost: tuple[int, int] = (2, 4)
    least_share: float = 0.0
    most_left_v: float = np.inf


@dataclass(frozen=True, eq=False)
class Scored:
    """A fitted hypothesis and what it explains of data it has not seen (V)."""

    fit: Fit
    held_out_rmse_v: float
    structured_v: float

    @property
    def hypothesis(self) -> Hypothesis:
        """Ids of the effects."""
        return self.fit.hypothesis

    @property
    def evidence(self) -> float:
        """Nats."""
        return self.fit.log_evidence


def only_by_freedom(plain: Scored, richer: Scored, material_v: float) -> bool:
    """True where `richer` does better than `plain` by so little that its many parameters may follow the model's error.

    Thousands of samples make nats of tenths of a millivolt, and no two models agree to that.
    """
    more = len(richer.fit.knobs) - len(plain.fit.knobs)
    better = plain.held_out_rmse_v**2 - richer.held_out_rmse_v**2
    return more >= RICHER and better <= material_v**2


def strain_at_rest(fit: Fit) -> float:
    """Nats that it costs the fit to set the voltage at rest right within its tolerances."""
    owned = [x for k, x in zip(fit.knobs, fit.x, strict=True) if k.owner in AT_REST and k.sd is not None]
    return 0.5 * float(np.sum(np.square(owned)))


@dataclass(frozen=True)
class Admission:
    """Whether an effect may be added, and why not.

    gain_v, placebo_v : what it and the best placebo take off the held-out residual, V.  over_placebo : how many times
    better it is, in what it brings or in what it leaves, whichever says more.
    """

    admitted: bool
    reason: str
    evidence_nats: float
    gain_v: float
    placebo_v: float
    over_placebo: float


class Archive:
    """Fits by content, one line each in a file; lines that cannot be read are ignored and fitted again."""

    def __init__(self, path: Path | None, context: str) -> None:
        self.path, self.context = path, context
        self.stored: dict[str, dict[str, object]] = {}
        if path is not None and path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                try:
                    entry = json.loads(line)
                    if entry["context"] == context:
                        self.stored["+".join(entry["fit"]["hypothesis"])] = entry["fit"]
                except (ValueError, KeyError, TypeError):
                    continue

    def get(self, problem: Problem, hypothesis: Hypothesis) -> Fit | None:
        """The stored fit, evaluated again, or None."""
        entry = self.stored.get("+".join(hypothesis))
        try:
            return None if entry is None else from_dict(problem, entry)
        except (KeyError, TypeError, ValueError):
            return None

    def put(self, fit: Fit) -> None:
        """Append a fit that is not there yet."""
        if self.path is None or "+".join(fit.hypothesis) in self.stored:
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"context": self.context, "fit": as_dict(fit)}) + "\n")


def context_of(problem: Problem) -> str:
    """Changes whenever a stored fit would no longer be the same fit."""
    pieces = [
        repr(problem.cell),
        repr(sorted(problem.effects)),
        repr(sorted(problem.tolerances.items(), key=str)),
        f"{problem.model_error_v} {problem.outlier_v} {problem.zero_sd_a} {problem.steps}",
    ]
    pieces += [f"{r.data.digest}{r.n_fit}{r.soc0}{r.soc0_sd}{r.noise_v}" for r in problem.records]
    return digest(np.frombuffer("".join(pieces).encode(), dtype=np.uint8).astype(float))


@dataclass
class Search:
    """One case's hypotheses, fitted on demand.

    polarisation_v : root mean square distance of the declared model's voltage from equilibrium, V.
    report : called with every newly scored hypothesis and its parent (progress, tracking).
    """

    problem: Problem
    rng: np.random.Generator
    archive: Archive
    polarisation_v: float = 0.0
    report: Callable[[Scored, Admission | None], None] = lambda scored, admission: None
    scored: dict[frozenset[str], Scored | None] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    refitted: dict[frozenset[str], float] = field(default_factory=dict)
    admissions: dict[tuple[frozenset[str], frozenset[str]], Admission] = field(default_factory=dict)

    @property
    def noise_v(self) -> float:
        """Mean white noise of the records, V."""
        return float(np.mean([r.noise_v for r in self.problem.records]))

    @property
    def material_v(self) -> float:
        """What an effect has to take off the error on unseen data to be worth a name, V."""
        return float(np.hypot(MATERIAL_SHARE * self.noise_v, POLARISATION_SHARE * self.polarisation_v))

    def unseen_rmse_v(self, scored: Scored, bound_v: float) -> float:
        """What a hypothesis leaves on unseen data, V: the linear estimate, or where that is above `bound_v` although
        the fit itself is below, what refits leave."""
        if scored.held_out_rmse_v <= bound_v or scored.fit.rmse_v > bound_v:
            return scored.held_out_rmse_v
        key = frozenset(scored.hypothesis)
        if key not in self.refitted:
            self.refitted[key] = refitted_rmse_v(self.problem, scored.fit)
        return min(scored.held_out_rmse_v, self.refitted[key])

    def far_behind(self, one: Scored, other: Scored) -> bool:
        """Does `one` leave so much more on unseen data than `other` that its evidence does not count?"""
        left = [max(s.held_out_rmse_v**2 - self.noise_v**2, self.material_v**2) for s in (one, other)]
        return left[0] > FAR**2 * left[1]

    def fit(self, hypothesis: Hypothesis, warm: Iterable[Array] = ()) -> Scored | None:
        """Fit once; the order in which effects were added does not matter to the fit."""
        if frozenset(hypothesis) not in self.scored:
            self._keep(hypothesis, self._found(hypothesis, list(warm)))
        return self.scored[frozenset(hypothesis)]

    def _found(self, hypothesis: Hypothesis, warm: list[Array]) -> Fit | None:
        stored = self.archive.get(self.problem, hypothesis)
        return fit_hypothesis(self.problem, hypothesis, warm) if stored is None else stored

    def _keep(self, hypothesis: Hypothesis, found: Fit | None) -> None:
        if found is None:
            self.notes.append(f"{' + '.join(hypothesis)}: not tried; {self.problem.why_not(hypothesis)}")
            self.scored[frozenset(hypothesis)] = None
            return
        self.archive.put(found)
        self.scored[frozenset(hypothesis)] = self._score(found)

    def _score(self, fit: Fit) -> Scored:
        return Scored(fit, held_out_rmse_v(self.problem, fit), structured_v(self.problem, fit.residual_v))

    def grow(self, parent: Scored, limit: int | None = None) -> list[Scored]:
        """Full fits of `parent` plus one effect, for the `limit` most promising effects (None: all)."""
        names = [n for n in self.problem.competing if n not in parent.hypothesis]
        if limit is not None:
            names = self._promising(parent, names)[:limit]
        children = []
        for child in self._side_by_side({(*parent.hypothesis, n): self._warm(parent, n) for n in names}):
            if child is not None:
                children.append(child)
                self.report(child, self.admit(parent, child))
        return children

    def _side_by_side(self, wanted: Mapping[Hypothesis, list[Array]]) -> Iterator[Scored | None]:
        """Fits in threads, since simulations do not hold the interpreter's lock; in the order in which they were asked
        for, so that the outcome does not depend on how many threads there are."""
        pool = ThreadPoolExecutor(os.cpu_count())
        try:
            new = [h for h in wanted if frozenset(h) not in self.scored]
            fits = {h: pool.submit(self._found, h, wanted[h]) for h in new}
            for hypothesis in wanted:
                if hypothesis in fits:
                    self._keep(hypothesis, fits[hypothesis].result())
                yield self.scored[frozenset(hypothesis)]
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def _warm(self, parent: Scored, name: str) -> list[Array]:
        """Where parent and the effect alone ended, joined: a start beside the standard ones."""
        alone = self.scored.get(frozenset((name,)))
        knobs = self.problem.knobs((*parent.hypothesis, name))
        known = parent.fit.placed
        single = {} if alone is None else alone.fit.placed
        vectors = []
        if parent.hypothesis and single:
            vectors.append(placed_in(knobs, single | known, np.zeros(len(knobs))))
        return [*vectors, *(placed_in(knobs, known, start) for start in starts(knobs))]

    def _promising(self, parent: Scored, names: list[str]) -> list[str]:
        """Effects by how much of the parent's residual they can take up: with their sensitivities where they ended
        alone, and with what they do to the parent where their fit would start.

        By turns the best in nats, under the parent's noise model, and the best in volts: that model has taken what is
        slow in the residual for noise, and an effect that is missing may be slow.
        """
        does = {}
        for name in names:
            alone = self.scored.get(frozenset((name,)))
            columns = self._responses(parent, name)
            if alone is not None:
                columns += [
                    alone.fit.jacobian[:, j] for j, k in enumerate(alone.fit.knobs) if k.owner == name
                ]
            if columns:
                does[name] = np.column_stack(columns)
        residual = np.column_stack([parent.fit.residual_v, parent.fit.jacobian])

        def whitened(table: Array) -> Array:
            return self.problem.whiten(table, parent.fit.noise)[0]

        in_nats = _by_gain(whitened(residual), {name: whitened(table) for name, table in does.items()})
        in_volts = _by_gain(residual, does)
        return list(dict.fromkeys(name for pair in zip(in_nats, in_volts, strict=True) for name in pair))

    def _responses(self, parent: Scored, name: str) -> list[Array]:
        """(n,) V each: what the effect does to the parent's voltage at each start that can be simulated."""
        hypothesis = (*parent.hypothesis, name)
        knobs = self.problem.knobs(hypothesis)
        bounds = np.array([k.working_bounds for k in knobs])
        modelled = self.problem.measured - parent.fit.residual_v
        responses = []
        for start in self._warm(parent, name):
            predicted = self.problem.predict(knobs, np.clip(start, bounds[:, 0], bounds[:, 1]))
            if predicted is not None:
                responses.append(np.concatenate(predicted) - modelled)
        return responses

    def without(self, child: Scored, name: str) -> Scored | None:
        """`child` less one effect, refitted from where the others were."""
        rest = tuple(n for n in child.hypothesis if n != name)
        knobs = self.problem.knobs(rest)
        return self.fit(rest, [placed_in(knobs, child.fit.placed, np.zeros(len(knobs)))])

    def admit(self, parent: Scored, child: Scored) -> Admission:
        """May the effect that `child` adds to `parent` be named?"""
        key = (frozenset(parent.hypothesis), frozenset(child.hypothesis))
        if key not in self.admissions:
            self.admissions[key] = self._admission(parent, child)
        return self.admissions[key]

    def _admission(self, parent: Scored, child: Scored) -> Admission:
        nats = child.evidence - parent.evidence
        gain = parent.held_out_rmse_v**2 - child.held_out_rmse_v**2
        placebo = placebo_gain(self.problem, parent.fit, child.fit, self.rng)
        noise = self.noise_v
        left = max(child.held_out_rmse_v**2 - noise**2, (MATERIAL_SHARE * noise) ** 2)
        left_by_placebo = parent.held_out_rmse_v**2 - placebo - noise**2
        over = max(gain / max(placebo, 1e-4 * noise**2), left_by_placebo / left)
        beaten = gain - placebo >= (PLACEBO_MARGIN_SHARE * noise) ** 2 and over >= PLACEBO_FACTOR
        hidden = strain_at_rest(parent.fit) - strain_at_rest(child.fit) >= RELIEF_NATS
        immaterial = gain < self.material_v**2
        verdict = [
            (nats < EVIDENCE_NATS, f"brings {nats:.1f} nats, {EVIDENCE_NATS:g} are asked for"),
            (immaterial and not hidden, "moves the voltage by less than noise and solvers hide"),
            (not (beaten or hidden), "does not clearly beat a placebo"),
            (bool(child.fit.at_bounds), f"ends on a bound: {', '.join(child.fit.at_bounds)}"),
        ]
        reasons = [reason for failed, reason in verdict if failed]
        root = float(np.sqrt(max(gain, 0.0)))
        return Admission(not reasons, "; ".join(reasons), nats, root, float(np.sqrt(placebo)), over)


def select(
    search: Search,
    max_effects: int,
    grade: Callable[[Scored, Scored], int],
    breadth: Breadth | None = None,
) -> list[Scored] | None:
    """Add effects one at a time while that is admitted and the rest is not explained well enough.

    grade : (empty hypothesis, another one) -> 0 where it leaves more than a model may miss, 2 where it does not, with a
    margin and on unseen data, and 1 between.  A higher grade goes before more evidence; effects are added until it is
    2, and none where the empty hypothesis has 1.

    Returns the chosen hypothesis after each addition, the empty one first; None where not even that one can
    be
    simulated. Two effects may come in one step, where neither shows without the other.
    """
    breadth = breadth or Breadth()
    base = search.fit(())
    if base is None:
        return None
    steps, front = [base], search.grow(base, breadth.singles)
    for size in range(1, max_effects + 1):
        needed = [s for s in front if _all_needed(search, s)]
        grades = {id(s): grade(base, s) for s in needed}
        top = max(grades.values(), default=0)
        wanted = [s for s in needed if grades[id(s)] == top]
        near = [s for s in wanted if not any(search.far_behind(s, other) for other in wanted)]
        best = max(near, key=lambda s: s.evidence, default=None)
        plainer = [s for s in wanted if top and best and only_by_freedom(s, best, search.material_v)]
        best = max(plainer, key=lambda s: s.evidence, default=best)
        if best is not None and best.evidence - steps[-1].evidence >= EVIDENCE_NATS:
            steps.append(best)
        left_v = steps[-1].structured_v
        little = left_v**2 > (1.0 - breadth.least_share) * base.structured_v**2 and breadth.least_share > 0
        hopeless = (size > 1 and len(steps[-1].hypothesis) < size) or little or left_v > breadth.most_left_v
        done = grade(base, steps[-1]) >= (2 if steps[-1].hypothesis else 1)
        if size == max_effects or hopeless or done:
            break
        abreast, grown = breadth.lost if len(steps) == 1 else (breadth.abreast, breadth.grown)
        front = _grown(search, _abreast(front, steps[-1], abreast), grown)
    return steps


def _by_gain(residual: Array, does: Mapping[str, Array]) -> list[str]:
    """Names by what their columns take off a residual beside the columns that it has, most first.

    residual : (n, 1 + m), the residual and the sensitivities that may move with it.  does : name -> (n, k).
    """
    gains = {}
    for name, extra in does.items():
        columns = np.column_stack([residual[:, 1:], extra])
        columns /= np.linalg.norm(columns, axis=0) + 1e-300
        step = np.linalg.lstsq(columns, residual[:, 0], rcond=1e-8)[0]
        gains[name] = -float(np.sum((residual[:, 0] - columns @ step) ** 2))
    return sorted(gains, key=lambda name: -gains[name])


def _grown(search: Search, parents: list[Scored], limit: int) -> list[Scored]:
    children = [c for p in parents for c in search.grow(p, limit)]
    return list({frozenset(c.hypothesis): c for c in children}.values())


def _abreast(front: list[Scored], current: Scored, count: int) -> list[Scored]:
    ranked = sorted(front, key=lambda s: -s.evidence)[:count]
    if current in front and current not in ranked:
        ranked = [current, *ranked[:-1]]
    return ranked


def _all_needed(search: Search, child: Scored) -> bool:
    """Every effect of `child` has to earn its place on top of the others."""
    for name in child.hypothesis:
        parent = search.without(child, name)
        if parent is None or not search.admit(parent, child).admitted:
            return False
    return True
