"""Array types for annotations; docstrings state shapes and units."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Float32Array = NDArray[np.float32]
IntArray = NDArray[np.int64]
Int32Array = NDArray[np.int32]
BoolArray = NDArray[np.bool_]
UInt64Array = NDArray[np.uint64]
IndexArray = NDArray[np.intp]
