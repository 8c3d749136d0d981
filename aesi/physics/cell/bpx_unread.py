"""What a BPX file declares and no simulation here takes, in sentences for who gave the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aesi.physics.cell.parts import (
    CAPACITY_SHARES,
    CONTACT_RESISTANCE,
    DOUBLE_LAYERS,
    FILM_ENERGIES,
    FILM_RESISTANCES,
    FITTED_WITH,
    RATE_FACTORS,
    THERMAL_CONDUCTIVITY,
)

OWN_FIELDS = {
    CONTACT_RESISTANCE,
    CAPACITY_SHARES,
    THERMAL_CONDUCTIVITY,
    *(
        field
        for fields in (DOUBLE_LAYERS, FILM_ENERGIES, FILM_RESISTANCES, FITTED_WITH, RATE_FACTORS)
        for field in fields.values()
    ),
}
"""Of the section `User-defined` that are read."""
BRANCHES = ("OCP (lithiation) [V]", "OCP (delithiation) [V]")


def unread(v1: Mapping[str, Any]) -> tuple[str, ...]:
    """Sentences on the fields of a BPX 1.x mapping that are passed over and would change a simulation."""
    parts, said = v1["Parameterisation"], []
    branched = [
        side
        for side in ("Negative electrode", "Positive electrode")
        if any(parts[side].get(name) is not None for name in BRANCHES)
    ]
    if branched:
        said.append(
            f"the cell's file declares a hysteresis ({', '.join(branched)}: OCP by direction), which is not simulated: "
            "'OCP [V]' holds both ways; the effect ocv_hysteresis adds one."
        )
    ageing = (v1.get("State") or {}).get("Degradation") or {}
    lost = [f"{name} {value}" for name, value in ageing.items() if value]
    if lost:
        said.append(
            f"the cell's file declares an aged state ({', '.join(lost)}), which is not simulated: the cell is taken as "
            "new; --soh or the effects of ageing take it as aged."
        )
    own = [name for name in parts.get("User-defined") or {} if name not in OWN_FIELDS]
    if own:
        said.append(f"fields of the cell's file that are not read (User-defined): {', '.join(own)}.")
    return tuple(said)
