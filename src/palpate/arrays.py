"""Kinds of array that pass between functions; each docstring states shapes and units."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]
Mask = NDArray[np.bool_]
Counts = NDArray[np.int64]
Indices = NDArray[np.intp]
AnyArray = NDArray[Any]
