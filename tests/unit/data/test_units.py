"""Factors of units, against a library of them."""

import numpy as np
import pint
import pytest

from aesi.data import units

REGISTRY = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("quantity", "unit"), [(quantity, unit) for quantity, known in units.FACTORS.items() for unit in known]
)
def test_every_unit_is_converted_as_a_library_of_units_does(quantity, unit):
    known = REGISTRY.Quantity(np.array([-3.0, 0.0, 21.5]), unit).to(units.SI[quantity]).magnitude
    np.testing.assert_allclose(units.to_si(quantity, np.array([-3.0, 0.0, 21.5]), unit), known, atol=1e-9)
