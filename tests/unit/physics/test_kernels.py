"""Compiled functions of the models: the same numbers in the process that compiled them and in the next."""

import math

import numpy as np
import pytest

from aesi.numerics.compiled import SETTINGS
from aesi.physics.espm.kernels import compiled


def test_a_discovery_differed_between_the_process_that_compiled_it_and_the_next(monkeypatch, tmp_path):
    """A part that is called is another function where it was compiled by itself as well."""
    monkeypatch.setattr(SETTINGS, "CACHE_DIR", str(tmp_path))

    @compiled
    def part_of_it(row):
        total = 0.0
        for value in row:
            total += math.exp(value) * math.log(1.0 + value) + math.sqrt(value)
        return total

    @compiled
    def whole(row):
        return part_of_it(row) + part_of_it(row[1:]) + part_of_it(row[2:])

    assert whole(np.ones(4)) == pytest.approx(9.0 * (math.e * math.log(2.0) + 1.0))
    code = whole.inspect_llvm(whole.signatures[0]).splitlines()
    calls = [line for line in code if "call" in line]
    assert [line for line in calls if "exp" in line]
    assert not [line for line in calls if "part_of_it" in line]
