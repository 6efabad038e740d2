"""Types that the whole package uses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: An array of SI floats.
Array = NDArray[np.float64]
#: A JSON or TOML object, or a row of a table: values of any type by name.
Document = dict[str, Any]
