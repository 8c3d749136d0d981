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
"""What a caller may give where rows of numbers are asked for: arrays of any number, lists, columns of a table."""

SavedState = dict[str, Any]
"""Plain values and numpy arrays under string keys, as a model folder keeps them; nothing in it needs pickle."""
