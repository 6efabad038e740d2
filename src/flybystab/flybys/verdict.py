"""What became of the body: verdicts and the gravitationally bound share (theory, section 7)."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from flybystab.core.dynamics import verdict_row as judgement
from flybystab.core.ellipsoid.bound_mass import bound_share

Array = NDArray[np.float64]


class Verdict(StrEnum):
    """Fate of a body in an encounter. Members compare equal to their text."""

    #: Never yielded.
    INTACT = "INTACT"
    #: Flowed; all of it stays bound.
    RESHAPED = "RESHAPED"
    #: Lost less than half of its mass: class M below 10 %, class B from 10 % (Richardson et al. 1998).
    MASS_LOSS = "MASS LOSS"
    #: Lost half of its mass or more: class S.
    DISRUPTED = "DISRUPTED"
    #: Reached the surface or the atmosphere with any part of it.
    IMPACT = "IMPACT"
    #: Passed the axis ratio beyond which a homogeneous ellipsoid says nothing.
    BEYOND_MODEL = "BEYOND MODEL"
    #: The given body cannot exist with the given material, even far from any planet.
    NOT_IN_EQUILIBRIUM = "NOT IN EQUILIBRIUM"


#: Verdicts by their codes in :mod:`flybystab.core.dynamics.verdict_row`; what could not be computed is none of them.
VERDICTS = {
    judgement.INTACT: Verdict.INTACT,
    judgement.RESHAPED: Verdict.RESHAPED,
    judgement.MASS_LOSS: Verdict.MASS_LOSS,
    judgement.DISRUPTED: Verdict.DISRUPTED,
    judgement.IMPACT: Verdict.IMPACT,
    judgement.BEYOND_MODEL: Verdict.BEYOND_MODEL,
    judgement.NOT_IN_EQUILIBRIUM: Verdict.NOT_IN_EQUILIBRIUM,
}


def bound_fraction(shape: Array, velocity_gradient: Array, density: float) -> float:
    """Share of the mass that is gravitationally bound to a homogeneous ellipsoid with velocity ``L x``.

    A point is bound if ``|L x|^2/2 < pi G rho (A_0 - sum A_i x_i^2)``. With ``x = F xi``, ``F F^T = S``, that
    is ``xi^T [(L F)^T (L F)/2 + pi G rho diag(A_i a_i^2)] xi < pi G rho A_0`` on the unit ball, and the share
    is the mean over directions of ``min(1, r^3)``, ``r`` the radius at which the form reaches the bound.
    It is an upper bound: the potential counts the material that is leaving.

    Parameters
    ----------
    shape : ndarray (3, 3)
        ``S = 5 I/m``, m2.
    velocity_gradient : ndarray (3, 3)
        ``L``, 1/s, in the same (non-rotating) frame.
    density : float
        kg/m3.
    """
    return float(
        bound_share(
            np.array(shape, dtype=float, order="C"),
            np.array(velocity_gradient, dtype=float, order="C"),
            float(density),
        )
    )


def classed(bound: float) -> tuple[Verdict, str | None]:
    """Verdict and Richardson class of a body that has flowed; class edges belong to the heavier class."""
    verdict = VERDICTS[judgement.class_of(bound)]
    return verdict, letter_of(verdict, bound)


def letter_of(verdict: Verdict, bound: float) -> str | None:
    """Class of Richardson et al. (1998) of a verdict: M, B or S; None for bodies that lost nothing."""
    if verdict == Verdict.MASS_LOSS:
        return "M" if bound > 0.9 else "B"
    return "S" if verdict == Verdict.DISRUPTED else None
