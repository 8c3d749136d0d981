"""The catalogue of effects: one file per effect, registered in `catalogue.py`, looked up by name in `by_name.py`."""

from aesi.physics.effect import ActiveEffect, Effect
from aesi.physics.effects.by_name import (
    activated,
    active_effect,
    describe,
    find_effect,
    known_effects,
    listing,
    load_effect,
    named_effect,
    saved_effect,
    selected,
)
from aesi.physics.effects.catalogue import CATALOGUE

__all__ = [
    "CATALOGUE",
    "ActiveEffect",
    "Effect",
    "activated",
    "active_effect",
    "describe",
    "find_effect",
    "known_effects",
    "listing",
    "load_effect",
    "named_effect",
    "saved_effect",
    "selected",
]
