"""The file of a user's own effect: the ohmic drop of a lead."""

OWN = '''"""Ohmic drop of a lead.

    V = V_cell - I R      I > 0 on discharge

Leaves out its inductance. Holds at any current.

Source: Ohm's law.
"""

from aesi.parameters import Parameter
from aesi.physics import Contribution, Effect

PARAMETERS = {"lead_ohm": Parameter(1e-3, "ohm", (0.0, 0.01), "a lead", neutral=0.0, description="R")}


def drop(trace, *, lead_ohm):
    return Contribution(-lead_ohm * trace.current_a, {"lead_v": lead_ohm * trace.current_a})


EFFECT = Effect("lead", "physics", __doc__, PARAMETERS, on_voltage=drop)
'''
