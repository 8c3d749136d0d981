"""The experiment that would tell look-alikes apart, from the declarations of the effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, combinations

from aesi.physics.effect import Effect

SENSOR = "a second sensor of the same quantity: an instrument's fault does not show there"
OTHERWISE = "data at other rates, temperatures and states of charge"


def telling_experiment(names: Sequence[str], effects: Mapping[str, Effect]) -> str:
    """A sentence for a group of look-alikes.

    names : ids of the group.  effects : id -> effect, all that was tried.
    """
    group = [effects[name] for name in names]
    by_pair = [
        [text for text in (a.told_apart.get(b.id), b.told_apart.get(a.id)) if text is not None]
        for a, b in combinations(group, 2)
    ]
    pairs = list(chain.from_iterable(by_pair))
    if sum(map(bool, by_pair)) >= len(group) - 1:
        return "; ".join(dict.fromkeys(pairs))
    named = [f"for {effect.id}: {effect.experiment}" for effect in group if effect.experiment]
    if any(effect.kind == "instrument" for effect in group):
        named.append(SENSOR)
    return "; ".join(dict.fromkeys([*pairs, *named])) or OTHERWISE
