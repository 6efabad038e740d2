"""Rotation of a rigid polyhedron through an encounter: true inertia, quadrupole and octupole of the tide.

Euler's equations are integrated with the torque of the second moments of the shape in the tidal tensor of the
encounter and, where its relative size exceeds the allowed error, that of the third moments in the gradient of the
planet's tide (:mod:`flybystab.core.polyhedron.moments`). An ellipsoid has no third moments: that relative size is the
error of the equivalent ellipsoid. It is of the order of the radius over the distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from flybystab.body.body import Body, check_settled
from flybystab.body.shape import Shape
from flybystab.catalogues.tumbling import free_spin, precession_period
from flybystab.core.polyhedron.moments import octupole_torque, quadrupole_torque
from flybystab.encounter.attitude import attitude_matrix, periapsis_axes, rotation_rates
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NotConverged
from flybystab.flybys.surface_change import check_shape
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import brief, to_si

#: Tolerance of the integration over the allowed error.
STEP = 1e-2
#: Relative distance of ``L^2/(2E)`` from a moment of inertia below which the spin counts as steady about that axis.
STEADY = 1e-12


@dataclass(frozen=True, repr=False)
class RotationState(Record):
    """Free rotation of a rigid body.

    Attributes
    ----------
    mode : str
        "SAM" or "LAM" (short-axis, long-axis mode).
    momentum : Quantity, shape (3,)
        Angular momentum over the mass in the frame of the encounter, m2/s.
    precession_period : Quantity
        Mean period of the axis of the mode about the angular momentum, h.
    rotation_period : Quantity
        Period of the angular velocity in the body, h; infinite without rotation about a second axis.
    effective_period : Quantity
        ``2 pi L/(2E)``, h.
    """

    mode: str
    momentum: Quantity
    precession_period: Quantity
    rotation_period: Quantity
    effective_period: Quantity


@dataclass(frozen=True, eq=False)
class ShapeSpin(Record):
    """Rotation of a shape through an encounter.

    Attributes
    ----------
    before, after : RotationState
        At the start and at the end of the encounter.
    attitude : ndarray (3, 3)
        At the end, principal axes -> frame of the encounter.
    spin : Quantity, shape (3,)
        At the end, principal axes, rad/s.
    octupole_share : float
        Largest torque of the third moments over the largest torque of the second moments.
    octupole_included : bool
        Whether the torque of the third moments is part of the motion.
    octupole_effect : float
        Magnitude of its effect on the final angular momentum, over the change of the angular momentum in the encounter;
        nan where it is not included.
    """

    before: RotationState
    after: RotationState
    attitude: Array
    spin: Quantity
    octupole_share: float
    octupole_included: bool
    octupole_effect: float

    @property
    def spin_ratio(self) -> float:
        """Effective spin rate ``2E/L`` after over before."""
        return float(self.before.effective_period / self.after.effective_period)

    @property
    def pole_change(self) -> Quantity:
        """Angle between the angular momenta before and after, deg."""
        a, b = self.before.momentum.value, self.after.momentum.value
        return np.rad2deg(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)) * u.deg

    def __repr__(self) -> str:
        return (
            f"<ShapeSpin rate x {self.spin_ratio:.4g}, pole moves {brief(self.pole_change)}, "
            f"octupole ratio {self.octupole_share:.1e}>"
        )


def shape_spin(
    body: Body, encounter: Encounter, attitude: object = None, *, shape: Shape, error: float = 1e-6
) -> ShapeSpin:
    """Rotation of a rigid shape through an encounter.

    Parameters
    ----------
    body, encounter, attitude
        As in :func:`flybystab.flybys.flyby.flyby`. The body may tumble.
    shape : Shape
        The true shape, of which `body` is the equivalent ellipsoid.
    error : float
        Relative error allowed for the torque, 1e-10 to 1e-2: the octupole is included where its relative size is
        larger, and the tolerance of the integration is a hundred times smaller.

    Returns
    -------
    ShapeSpin

    Raises
    ------
    InvalidInput, NotConverged
    """
    check_settled(body)
    check_shape(shape, body)
    if not isinstance(encounter, Encounter):
        raise InvalidInput("encounter", encounter, "a flybystab.Encounter")
    if encounter.impact:
        raise InvalidInput("encounter", encounter, "an encounter without an impact")
    allowed = to_si(error, u.dimensionless_unscaled, "error", low=1e-10, high=1e-2)
    start = periapsis_axes(encounter).T @ attitude_matrix(attitude)
    motion = _Motion(shape, encounter)
    q0 = np.roll(Rotation.from_matrix(start).as_quat(), 1)  # scipy's scalar is the last component
    first = np.concatenate([q0, body.omega])
    plain, torques = motion.followed(first, octupole=False, tolerance=STEP * allowed)
    ratio = torques[1] / torques[0] if torques[0] > 0.0 else 0.0
    included, effect, last = ratio > allowed, np.nan, plain
    if included:
        last, _ = motion.followed(first, octupole=True, tolerance=STEP * allowed)
        change = motion.momentum(last) - motion.momentum(first)
        size = float(np.linalg.norm(change))
        effect = float(np.linalg.norm(motion.momentum(last) - motion.momentum(plain)) / size) if size else 0.0
    return ShapeSpin(
        motion.state(first),
        motion.state(last),
        _matrix(last),
        last[4:] * u.rad / u.s,
        float(ratio),
        bool(included),
        effect,
    )


def free_rotation(moments: Array, omega: Array, attitude: Array) -> RotationState:
    """State of free rotation.

    Parameters
    ----------
    moments : ndarray (3,)
        Principal moments of inertia over the mass, m2, in ascending order.
    omega : ndarray (3,)
        Angular velocity, principal axes, rad/s.
    attitude : ndarray (3, 3)
        Principal axes -> outer frame.
    """
    momentum = moments * omega
    size, energy = float(np.linalg.norm(momentum)), 0.5 * float(momentum @ omega)
    if size == 0.0:
        raise InvalidInput("spin", omega, "a body that rotates")
    j1, j2, j3 = moments
    j = size**2 / (2.0 * energy)
    short = j > j2
    hour = 3600.0
    if min(abs(j - j3), abs(j - j1)) < STEADY * j3:
        precession, rotation = 2.0 * np.pi * (j3 if short else j1) / size, np.inf
    elif j2 - j1 < STEADY * j3 or j3 - j2 < STEADY * j3:  # a body of revolution: steady precession
        axial, other = (j3, j1) if j2 - j1 < STEADY * j3 else (j1, j3)
        spin = omega[2] if axial is j3 else omega[0]
        precession, rotation = 2.0 * np.pi * other / size, 2.0 * np.pi * other / abs((axial - other) * spin)
    else:
        precession = precession_period(moments, size, j)
        rotation = free_spin(moments, size, j, np.zeros(1))[1]
    return RotationState(
        "SAM" if short else "LAM",
        attitude @ momentum * u.m**2 / u.s,
        precession / hour * u.h,
        rotation / hour * u.h,
        2.0 * np.pi * j / size / hour * u.h,
    )


class _Motion:
    """Euler's equations of a shape in an encounter: quaternion (scalar first) and spin along the principal axes."""

    def __init__(self, shape: Shape, encounter: Encounter) -> None:
        self.moments = np.asarray(shape.inertia.value)
        self.second = np.diag(shape.second_moments)
        self.third = shape.third_moments
        self.encounter = encounter

    def torques(self, t: float, turned: Array) -> tuple[Array, Array]:
        """Torques of second and third moments over the mass, principal axes, m2/s2."""
        k = self.encounter.tidal_tensor(t)
        planet = -turned.T @ self.encounter.positions(np.array([t]))[0]
        return (
            quadrupole_torque(self.second, turned.T @ k @ turned),
            octupole_torque(self.third, self.encounter.planet.gm, planet),
        )

    def followed(
        self, first: Array, *, octupole: bool, tolerance: float
    ) -> tuple[Array, tuple[float, float]]:
        """State at the end of the encounter, and the largest torques of second and third moments during it."""
        largest = [0.0, 0.0]

        def rate(t: float, y: Array) -> Array:
            two, three = self.torques(t, _matrix(y))
            largest[0] = max(largest[0], float(np.linalg.norm(two)))
            largest[1] = max(largest[1], float(np.linalg.norm(three)))
            return rotation_rates(y, self.moments, two + three if octupole else two)

        e = self.encounter
        scale = float(np.linalg.norm(first[4:])) or 1.0 / e.tide.tau
        found = solve_ivp(
            rate,
            (e.t_start, e.t_stop),
            first,
            method="DOP853",
            rtol=max(tolerance, 1e-13),
            atol=np.array([tolerance] * 4 + [tolerance * scale] * 3),
            first_step=0.01 * e.tide.tau,
            max_step=abs(e.t_start) / 8.0,
        )
        if not found.success:
            raise NotConverged(f"the rotation of the shape: {found.message}")
        return found.y[:, -1], (largest[0], largest[1])

    def momentum(self, y: Array) -> Array:
        """Angular momentum over the mass, frame of the encounter, m2/s."""
        return np.asarray(_matrix(y) @ (self.moments * y[4:]))

    def state(self, y: Array) -> RotationState:
        return free_rotation(self.moments, y[4:], _matrix(y))


def _matrix(y: Array) -> Array:
    return np.asarray(Rotation.from_quat(np.roll(y[:4], -1)).as_matrix())
