"""Discretisation error of the declared model: the same equations on a finer basis and with shorter steps.

    orders of projection times n, steps (a row, or the longest explicit step within it) divided by n

Leaves out the error of interpolating the current between samples, which is the caller's choice (`hold`). Holds always:
a change under refinement is numerical, not physical, and has to be known before physical effects are sought.

Source: the effect of the orders is measured in the reference tests.
"""

from dataclasses import replace

from aesi.parameters import Parameter
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

PARAMETERS = {
    "refinement": Parameter(
        2.0,
        "dimensionless",
        bounds=(1.0, 4.0),
        neutral=1.0,
        source="a fourfold refinement leaves microvolts",
        description="n, rounded to halves",
    )
}


def refine(model: EspmModel, *, refinement: float) -> EspmModel:
    """The model with finer numerics."""
    factor = round(2.0 * refinement) / 2.0
    return replace(
        model,
        solid_order=round(model.solid_order * factor),
        electrolyte_order=round(model.electrolyte_order * factor),
        electrode_points=round(model.electrode_points * factor),
        step_refinement=model.step_refinement * factor,
    )


EFFECT = Effect(
    "numerical_error", "instrument", __doc__, PARAMETERS, on_model=refine, refines="discretisation"
)
