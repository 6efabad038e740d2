"""Error of an outcome from the finite number of grains.

Estimated from means over piles of 250 to 2,000 grains (Earth, 5 km/s, 6 h prograde, 35 deg), extrapolated as
``y = y_inf + b n^(-1/2)`` (``python benchmarks/grains_resolution.py``). The runs do not determine the exponent: with 1
the differences are half as large, with 1/3 half as large again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: Number of grains of the measured differences, and the exponent with which they decrease.
REFERENCE, EXPONENT = 500, 0.5
#: Relative differences between piles of 500 grains and the limit: of the largest clump where it has at most half of the
#: mass (0.39 +- 0.13) and where it has more (0.22 +- 0.11); of the mass lost by a body that stays whole (0.34 +- 0.50),
#: and of its ``stretch - 1`` (0.32 +- 0.20).
SMALL, LARGE, LOST, ELONGATION = 0.39, 0.22, 0.34, 0.32


class ResolutionErrors(NamedTuple):
    """Errors from the finite number of grains."""

    #: Of the mass of the largest clump over that of the body.
    largest_fraction: float
    #: Of the ratio of the long axis of the largest clump to the initial one; nan after a disruption.
    stretch: float


def resolution_errors(grains: int, largest: float, stretch: float, *, whole: bool) -> ResolutionErrors:
    """Errors of an outcome with piles of a number of grains.

    Parameters
    ----------
    grains : int
    largest, stretch : float
        Mass of the largest clump over that of the body, and its long axis over the initial one.
    whole : bool
        Whether the body has stayed in one piece, apart from loose grains.
    """
    scale = (REFERENCE / grains) ** EXPONENT
    if whole:
        return ResolutionErrors(LOST * scale * (1.0 - largest), ELONGATION * scale * abs(stretch - 1.0))
    relative = (SMALL if largest <= 0.5 else LARGE) * scale
    return ResolutionErrors(min(relative, 1.0) * largest, np.nan)
