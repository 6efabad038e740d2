"""What became of the body: verdicts and the gravitationally bound share (theory, section 7)."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import G
from flybystab.core.ellipsoid import gravity_coefficients, potential_coefficient

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
    #: Reached the surface or the atmosphere.
    IMPACT = "IMPACT"
    #: Passed the axis ratio beyond which a homogeneous ellipsoid says nothing.
    BEYOND_MODEL = "BEYOND MODEL"
    #: The given body cannot exist with the given material, even far from any planet.
    NOT_IN_EQUILIBRIUM = "NOT IN EQUILIBRIUM"


#: Mass that a RESHAPED body may lose: the rounding of the quadrature below.
ALL_BOUND = 1.0 - 1e-6


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
    values, vectors = np.linalg.eigh(shape)
    a = np.sqrt(values)
    potential = np.pi * G * density
    coefficients = np.array(gravity_coefficients(*values))
    bound = potential * potential_coefficient(*values)
    flow = vectors.T @ velocity_gradient @ vectors @ np.diag(a)
    form = 0.5 * flow.T @ flow + potential * np.diag(coefficients * values)
    if np.linalg.eigvalsh(form)[-1] < bound:
        return 1.0
    # Gauss-Legendre in the polar cosine (measured from the axis that escapes most), trapezoid in longitude.
    _, axes = np.linalg.eigh(form)
    diagonal = np.diag(axes.T @ form @ axes)
    mu, weight = np.polynomial.legendre.leggauss(128)
    longitude = (np.arange(256) + 0.5) * np.pi / 256
    sine2 = 1.0 - mu**2
    across = diagonal[0] * np.cos(longitude) ** 2 + diagonal[1] * np.sin(longitude) ** 2
    value = diagonal[2] * mu[:, None] ** 2 + sine2[:, None] * across[None, :]
    radius3 = np.minimum(1.0, (bound / value) ** 1.5)
    return float(0.5 * weight @ radius3.mean(axis=1))


def classed(bound: float) -> tuple[Verdict, str | None]:
    """Verdict and Richardson class of a body that has flowed; class edges belong to the heavier class."""
    if bound >= ALL_BOUND:
        return Verdict.RESHAPED, None
    if bound > 0.9:
        return Verdict.MASS_LOSS, "M"
    if bound > 0.5:
        return Verdict.MASS_LOSS, "B"
    return Verdict.DISRUPTED, "S"
