"""Types of arrays that the whole package uses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: An array of SI floats.
Array = NDArray[np.float64]
