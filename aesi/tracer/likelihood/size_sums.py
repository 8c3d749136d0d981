"""Sums over the rows of each block, whitened at many sizes of the model error.

With L the part of the columns that lasts and F the part within seconds, whitened at 1 V, the columns whitened at a size
(delta, phi) are L/delta + F/phi, and at every size

    J'J = L'L/delta^2 + (L'F + F'L)/(delta phi) + F'F/phi^2     (1)

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
        lasting, mixed, fast = self._products
        products = lasting / size.delta_v**2 + mixed / (size.delta_v * size.fast_v) + fast / size.fast_v**2
        return sums_of_products(table.blocks, products, table.log_det(size))

    @cached_property
    def _products(self) -> tuple[Array, Array, Array]:
        """(L'L, L'F + F'L, F'F) of (1), (b, 1 + m, 1 + m) each."""
        lasting, fast = self.table.at_one_volt
        shape = (len(self.table.blocks), lasting.shape[1], lasting.shape[1])
        of_lasting, mixed, of_fast = np.empty(shape), np.empty(shape), np.empty(shape)
        for k, rows in enumerate(self.table.blocks.rows):
            crossed = lasting[rows].T @ fast[rows]
            of_lasting[k] = lasting[rows].T @ lasting[rows]
            mixed[k] = crossed + crossed.T
            of_fast[k] = fast[rows].T @ fast[rows]
        return of_lasting, mixed, of_fast
