"""Array types used in annotations; shapes are stated in the docstrings."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]
AnyArray = NDArray[Any]
Numbers = ArrayLike
"""Rows of numbers that a caller may give: arrays of any numeric type, lists, columns of a table."""

SavedState = dict[str, Any]
"""Plain values and numpy arrays by string key, as stored in a model folder without pickle."""
