"""Grains and contact parameters, as passed to the kernels.

Units are scaled: the gravitational constant, the mass of the pile and its volume-equivalent radius ``R = (a1 a2
a3)^(1/3)`` are one, so that the unit of time is ``sqrt(R^3/(G M)) = (4/3 pi G rho)^(-1/2)``. A pile without cohesion
then has no further scale (size or density). Velocities are those of the leapfrog, half a step behind the positions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.typing import Array

#: Ratio of tangential to normal stiffness (Schwartz et al. 2012).
SHEAR_STIFFNESS = 2.0 / 7.0
#: Pressure in the middle of a homogeneous sphere, ``2/3 pi G rho^2 R^2``, in scaled units.
CENTRAL_PRESSURE = 3.0 / (8.0 * np.pi)
#: Mean overlap of grains, relative to their radius, that sets the stiffness.
OVERLAP = 0.002
#: Steps in half a period of the stiffest contact.
STEPS_PER_CONTACT = 15.0


class Grains(NamedTuple):
    """Positions, velocities and constants of spheres, scaled units.

    Attributes
    ----------
    x, v, w : ndarray (n, 3)
        Positions, and velocities and angular velocities half a step earlier.
    radius, mass : ndarray (n,)
        A grain of mass zero has been removed: it has no contacts, no gravity and no motion.
    """

    x: Array
    v: Array
    w: Array
    radius: Array
    mass: Array

    def copy(self) -> Grains:
        """Independent copies of the arrays."""
        return Grains(*(a.copy() for a in self))


class Contact(NamedTuple):
    """Parameters of the contact law (:mod:`flybystab.core.grains.contact`), scaled units.

    Attributes
    ----------
    k_n, k_s : float
        Normal and tangential stiffness.
    damping_n, damping_s : float
        Damping coefficients over the square root of the reduced mass of the pair.
    mu_s, mu_r, mu_t : float
        Coefficients of sliding, rolling and twisting friction.
    beta : float
        Radius of the contact patch over the reduced radius of the pair; 0 for ideal spheres.
    cohesion : float
        Attraction per area ``(2 beta R)^2`` of a contact.
    """

    k_n: float
    k_s: float
    damping_n: float
    damping_s: float
    mu_s: float
    mu_r: float
    mu_t: float
    beta: float
    cohesion: float


def damping(restitution: float, stiffness: float) -> float:
    """Damping coefficient over ``sqrt(reduced mass)`` of a linear contact with a coefficient of restitution.

    A contact that ends with zero overlap separates at ``exp(-pi zeta/sqrt(1 - zeta^2))`` of the speed of approach,
    ``zeta`` the damping ratio (Cundall & Strack 1979). A linear spring cannot have zero restitution.
    """
    logarithm = np.log(restitution)
    return float(-2.0 * logarithm * np.sqrt(stiffness) / np.hypot(np.pi, logarithm))


def contact_parameters(
    mean_radius: float,
    *,
    mu_s: float,
    beta: float,
    mu_r: float = 1.05,
    mu_t: float = 1.3,
    restitution: float = 0.3,
    cohesion: float = 0.0,
    overlap: float = OVERLAP,
    pressure: float = CENTRAL_PRESSURE,
) -> Contact:
    """Contact parameters of a pile of grains of a mean radius, scaled units.

    The stiffness ``k_n = p pi <r>/eps`` gives a mean overlap ``eps <r>`` at the pressure `pressure`.
    """
    k_n = pressure * np.pi * mean_radius / overlap
    k_s = SHEAR_STIFFNESS * k_n
    return Contact(
        k_n, k_s, damping(restitution, k_n), damping(restitution, k_s), mu_s, mu_r, mu_t, beta, cohesion
    )


def time_step(grains: Grains, contact: Contact, steps: float = STEPS_PER_CONTACT) -> float:
    """Time step: half a period of the contact of two of the lightest grains in `steps` parts."""
    lightest = float(grains.mass[grains.mass > 0.0].min())
    return float(np.pi * np.sqrt(0.5 * lightest / contact.k_n) / steps)
