"""The array types of the simulator: their shapes and units stand in each docstring."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
