"""State of rotation of a free rigid body: the axis of its spin, and the stability of that motion.

Steady spin about the axis of the intermediate moment of inertia is an equilibrium of the stress and an unstable motion
(Euler's equations; Landau & Lifshitz, Mechanics, section 37): a small tilt grows as ``exp(rate t)`` with ``rate = omega
sqrt((J2 - J1)(J3 - J2)/(J1 J3))``. A body that does not spin about a principal axis tumbles: its angular velocity moves
along a polhode and its stress changes with it, so that an equilibrium holds only at one instant of a cycle.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import Body, check_body
from flybystab.constants import G
from flybystab.core.ellipsoid.rigid_stress import demand, rigid_stress
from flybystab.tabular import Record
from flybystab.units import brief

#: Points of a polhode at which the stress is evaluated.
POLHODE_POINTS = 201
#: Moments of inertia that differ by less than this fraction of the greatest count as equal.
EQUAL_MOMENTS = 1e-9


@dataclass(frozen=True, repr=False)
class SpinState(Record):
    """State of rotation of a free rigid body.

    Attributes
    ----------
    mode : str
        "no spin", "short axis", "middle axis", "long axis" (steady spin about that principal axis), "short-axis mode",
        "long-axis mode" or "separatrix" (tumbling, with the axis about which the spin vector circulates).
    steady : bool
        Whether the angular velocity is constant in the body.
    growth_rate : Quantity
        Rate at which a small tilt grows, 1/s; zero for every motion but spin about the middle axis.
    required_friction_angle : Quantity
        Largest over the polhode with the body's own cohesion, deg; that of the equilibrium for steady spin.
    """

    mode: str
    steady: bool
    growth_rate: Quantity
    required_friction_angle: Quantity

    @property
    def unstable(self) -> bool:
        """Whether a small tilt of the spin vector grows exponentially."""
        return bool(self.growth_rate.value > 0.0)

    @property
    def description(self) -> str:
        """The state of rotation and its consequence, for printed output."""
        if self.unstable:
            time = (1.0 / self.growth_rate).to(u.h)
            return f"spin about the middle axis: unstable, a tilt grows e-fold in {brief(time)}"
        if self.mode == "no spin":
            return "no spin"
        if self.steady:
            return f"steady spin about the {self.mode}"
        return (
            f"tumbling ({self.mode}): the results hold at this instant; over a cycle the body needs up to "
            f"{brief(self.required_friction_angle)} of friction"
        )


def spin_state(body: Body) -> SpinState:
    """State of rotation of a body without external torque.

    Parameters
    ----------
    body : Body
        With any spin vector.

    Returns
    -------
    SpinState
    """
    check_body(body)
    squares = body.axes**2
    moments = squares.sum() - squares  # J1 <= J2 <= J3, in m/5
    omega = body.omega
    size = float(np.linalg.norm(omega))
    rate = 0.0
    path = omega[None, :]
    aligned = _principal_axis(moments, omega)
    if size == 0.0:
        mode = "no spin"
    elif aligned is not None:
        mode = ("long axis", "middle axis", "short axis")[aligned]
        if aligned == 1:
            j1, j2, j3 = moments
            rate = size * float(np.sqrt((j2 - j1) * (j3 - j2) / (j1 * j3)))
    else:
        # 2 E J2 - H^2: positive where the spin vector circulates about the long axis
        sides = moments[1] * (moments @ omega**2) - (moments**2) @ omega**2
        small = EQUAL_MOMENTS * (moments**2) @ omega**2
        mode = (
            "separatrix" if abs(sides) <= small else ("long-axis mode" if sides > 0.0 else "short-axis mode")
        )
        path = polhode(moments, omega)
    return SpinState(
        mode=mode,
        steady=len(path) == 1,
        growth_rate=rate / u.s,
        required_friction_angle=np.rad2deg(_friction(body, path)) * u.deg,
    )


def polhode(moments: NDArray[np.float64], omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angular velocities (n, 3) of one octant of the polhode through `omega`.

    With energy and angular momentum held, the squares ``omega_i^2`` lie on a line segment in the positive octant;
    the other octants give the same stress up to reflections.
    """
    squares = omega**2
    along = np.cross(moments, moments**2)
    along = along / np.linalg.norm(along)
    low, high = -np.inf, np.inf
    for w, d in zip(squares, along, strict=True):
        if abs(d) > 1e-12:
            low, high = (max(low, -w / d), min(high, np.inf)) if d > 0.0 else (low, min(high, -w / d))
    # dense at the ends, where omega_i ~ sqrt(distance)
    fraction = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, POLHODE_POINTS)))
    points = squares + (low + fraction[:, None] * (high - low)) * along
    return np.asarray(np.sqrt(np.maximum(points, 0.0)))


def _principal_axis(moments: NDArray[np.float64], omega: NDArray[np.float64]) -> int | None:
    """Index of the principal axis of steady spin (2 where two moments are equal to the greatest), or None."""
    moving = [i for i in range(3) if omega[i] != 0.0]
    if not moving:
        return None
    spread = moments[moving].max() - moments[moving].min()
    if spread > EQUAL_MOMENTS * moments[2]:
        return None
    axis = moving[-1]
    if axis == 1:  # the middle axis of an oblate or prolate body is not distinct
        if moments[2] - moments[1] <= EQUAL_MOMENTS * moments[2]:
            return 2
        if moments[1] - moments[0] <= EQUAL_MOMENTS * moments[2]:
            return 0
    return axis


def _friction(body: Body, path: NDArray[np.float64]) -> float:
    s = body.axes**2
    stress = np.empty(6)
    most = 0.0
    for omega in path:
        rigid_stress(
            s[0], s[1], s[2], body.rho, np.pi * G * body.rho, np.ascontiguousarray(omega), np.zeros(6), stress
        )
        most = max(most, demand(body.material.surface_code, body.material.phi, body.material.c_pa, stress)[0])
    return float(most)
