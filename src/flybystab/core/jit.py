"""The one way in which the package compiles a kernel.

``kernel`` is ``numba.njit`` with the on-disk cache, without the GIL and with IEEE division (a zero
divisor gives inf or nan, which the callers test for, instead of an exception inside a kernel).
``fastmath`` stays off: compensated sums and sign tests rely on the order of operations.
"""

from __future__ import annotations

import numpy as np
from numba import njit

kernel = njit(cache=True, nogil=True, error_model="numpy")


def code(n: int) -> int:
    """An integer constant for kernels: numba compiles anew for each literal int, but not for numpy's."""
    return np.int64(n)  # type: ignore[return-value]
