"""Sums over the rows of each block, whitened at many sizes of the model error.

With s the part that lasts and r the part within seconds, a whitened row is s/delta + r/phi, and at every size

    J'J = S'S/delta^2 + (S'R + R'S)/(delta phi) + R'R/phi^2     (1)

so that 30 sizes take three products of columns. Where the error has a single part, rows are whitened at each size.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aesi.numerics.typing import Array
from aesi.tracer.likelihood.gaussian import BlockSums, block_sums, sums_of_products
from aesi.tracer.likelihood.model_error import Size, SplitTable


@dataclass(frozen=True, eq=False)
class SizeSums:
    """table : (n, 1 + m) V, the residual and the sensitivities of a linear form."""

    table: SplitTable

    def at(self, size: Size) -> BlockSums:
        """The sums at a size of the model error."""
        table = self.table
        if table.blocks.windows is None:
            return block_sums(table.blocks, *table.whitened(size))
        lasting, mixed, gone = self._products
        over = lasting / size.delta_v**2 + mixed / (size.delta_v * size.fast_v) + gone / size.fast_v**2
        return sums_of_products(table.blocks, over, table.log_det(size))

    @cached_property
    def _products(self) -> tuple[Array, Array, Array]:
        """(b, 1 + m, 1 + m) each: the three of (1)."""
        slow, rest = self.table.at_one_volt
        shape = (len(self.table.blocks), slow.shape[1], slow.shape[1])
        lasting, mixed, gone = np.empty(shape), np.empty(shape), np.empty(shape)
        for k, rows in enumerate(self.table.blocks.rows):
            crossed = slow[rows].T @ rest[rows]
            lasting[k], mixed[k], gone[k] = (
                slow[rows].T @ slow[rows],
                crossed + crossed.T,
                rest[rows].T @ rest[rows],
            )
        return lasting, mixed, gone
