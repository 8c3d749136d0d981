"""Ohmic drop in contacts, tabs, leads or a constant film, in series with the whole cell.

    V = V_cell - I R        I > 0 on discharge

Leaves out its dependence on temperature. Holds where the drop follows the current without delay.

Source: Ohm's law; the size from Taheri et al., J. Power Sources 196 (2011) 6525,
doi:10.1016/j.jpowsour.2011.03.056.
"""

from aesi.parameters import Parameter, Spread
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

PARAMETERS = {
    "resistance_ohm": Parameter(
        1e-3,
        "ohm",
        bounds=(0.0, 1e3),
        neutral=0.0,
        source="0.1 mohm (large pouch, welded tabs), 100 mohm (small cylindrical cell in a clamp), 1 kohm (some 1 mAh)",
        description="resistance added to what the cell file declares",
        counted="added",
        expected=0.02,
        capacity_power=-1,
        spread=Spread(None, 0.02, "tabs, welds and clamps of small cells, Taheri et al. 2011"),
    )
}


def add_resistance(model: EspmModel, *, resistance_ohm: float) -> EspmModel:
    """The model with a larger contact resistance (ohm)."""
    return model.with_cell(contact_resistance_ohm=model.cell.contact_resistance_ohm + resistance_ohm)


EFFECT = Effect(
    "series_resistance",
    "physics",
    __doc__,
    PARAMETERS,
    on_model=add_resistance,
    ohmic=True,
    experiment="impedance at 1 kHz",
    told_apart={
        "electrolyte_transport": (
            "impedance at 1 kHz at two temperatures: contacts hardly change, the electrolyte by 2 % a "
            "kelvin; or pulses after a long discharge at high rate, where the electrolyte has been "
            "depleted"
        ),
        "charge_transfer_kinetics": (
            "pulses from C/10 to 5C with 10 ms sampling: an ohmic drop is linear and instant, a kinetic "
            "one bends and takes milliseconds"
        ),
        "film_growth": "the same pulse at the same state of charge before and after some hundred hours or cycles",
    },
)
