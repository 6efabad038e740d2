"""The fluid limit: ellipsoids whose stress is a pressure only (Maclaurin, Jacobi, Roche).

Equal principal stresses ``a_i^2 (mu_i + omega_i^2 - 2 A_i)``, in units of ``pi G rho``, are two conditions on
two axis ratios and one load (Chandrasekhar 1969, chapters 5 and 8). They are the limit ``phi = 0`` of
:mod:`flybystab.body.equilibrium`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.errors import InvalidInput


class FluidEllipsoid(NamedTuple):
    """A fluid ellipsoid in equilibrium.

    Attributes
    ----------
    a2_a1, a3_a1 : float
        Axis ratios.
    load : float
        ``omega^2/(pi G rho)`` of a free body, ``GM/(d^3 pi G rho)`` of a synchronous satellite of small mass.
    """

    a2_a1: float
    a3_a1: float
    load: float


def maclaurin(a3_a1: float) -> FluidEllipsoid:
    """Maclaurin spheroid ``a1 = a2``: ``w2 = 2 (A_1 - A_3 a3^2/a1^2)``."""
    if not 0.0 < a3_a1 <= 1.0:
        raise InvalidInput("a3_a1", a3_a1, "an axis ratio in (0, 1]")
    a, _, c = gravity_coefficients(1.0, 1.0, a3_a1**2)
    return FluidEllipsoid(1.0, float(a3_a1), float(2.0 * (a - c * a3_a1**2)))


def jacobi(a2_a1: float) -> FluidEllipsoid:
    """Jacobi ellipsoid of a given ``a2/a1 < 1``; as ``a2/a1 -> 1`` it ends on the Maclaurin sequence."""
    if not 0.0 < a2_a1 < 1.0:
        raise InvalidInput("a2_a1", a2_a1, "an axis ratio in (0, 1)")
    s2 = a2_a1**2

    def condition(s3: float) -> float:
        # w2 from axes 1 and 3 equals w2 from axes 2 and 3; divided by 1 - s2, which is a trivial root
        a, b, c = gravity_coefficients(1.0, s2, s3)
        return float((a - b) / (1.0 - s2) + c * s3 / s2)

    s3 = brentq(condition, 1e-3 * s2, s2, xtol=1e-16, rtol=1e-15)
    a, _, c = gravity_coefficients(1.0, s2, s3)
    return FluidEllipsoid(float(a2_a1), float(np.sqrt(s3)), float(2.0 * (a - c * s3)))


def roche(a2_a1: float) -> FluidEllipsoid:
    """Roche ellipsoid of a given ``a2/a1``: a small synchronous satellite, long axis to the planet."""
    if not 0.0 < a2_a1 < 1.0:
        raise InvalidInput("a2_a1", a2_a1, "an axis ratio in (0, 1)")
    s2 = a2_a1**2

    def load(s3: float) -> float:  # from axes 2 and 3: s2 (-2 A_2) = s3 (-mu - 2 A_3)
        _, b, c = gravity_coefficients(1.0, s2, s3)
        return float(2.0 * (b * s2 / s3 - c))

    def condition(s3: float) -> float:  # axes 1 and 2: 3 mu - 2 A_1 = -2 A_2 s2
        a, b, _ = gravity_coefficients(1.0, s2, s3)
        return float(3.0 * load(s3) - 2.0 * (a - b * s2))

    s3 = brentq(condition, 1e-2 * s2, s2 * (1.0 - 1e-12), xtol=1e-16, rtol=1e-15)
    return FluidEllipsoid(float(a2_a1), float(np.sqrt(s3)), load(s3))


def roche_limit() -> FluidEllipsoid:
    """The Roche ellipsoid in the strongest tide: no synchronous fluid satellite exists at a smaller distance.

    ``d = R_p (4 rho_p/(3 load rho))^(1/3)``, 2.455 R_p at equal densities.
    """
    # The maximum is flat: the root of the derivative gives two more digits of the argument than sqrt(eps).
    top = minimize_scalar(
        lambda x: -roche(x).load, bounds=(0.3, 0.8), method="bounded", options={"xatol": 1e-6}
    )
    h = 1e-4

    def derivative(x: float) -> float:
        return (
            8.0 * (roche(x + h).load - roche(x - h).load) - roche(x + 2 * h).load + roche(x - 2 * h).load
        ) / h

    return roche(float(brentq(derivative, top.x - 1e-3, top.x + 1e-3, xtol=1e-14)))
