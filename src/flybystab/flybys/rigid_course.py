"""Motion of a rigid body through an encounter: its attitude, spin and tide at every instant.

Surface slopes and the stability margin of a flyby are computed from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import Body, check_settled
from flybystab.constants import G
from flybystab.core.dynamics.regimes import Span
from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.core.dynamics.state import rotated_to_body, rotation_matrix
from flybystab.core.ellipsoid.rigid_stress import overload, rigid_stress
from flybystab.core.ellipsoid.tide import TidePanels, tensor, tide_at
from flybystab.core.numerics.jit import kernel
from flybystab.encounter.attitude import attitude_matrix, periapsis_axes
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NotConverged, NotModelled
from flybystab.flybys.batch import ground_near, span_of
from flybystab.typing import Array
from flybystab.units import brief

#: Rows kept at most.
ROWS = 20_000


@dataclass(frozen=True, eq=False)
class Course:
    """Motion of a body that stays rigid at any stress; every array has the same first dimension.

    Attributes
    ----------
    body : Body
    encounter : Encounter
    time : Quantity (n,)
        From closest approach.
    distance : Quantity (n,)
        Between the centres.
    attitude : ndarray (n, 3, 3)
        Body axes -> frame of the encounter.
    spin : Quantity (n, 3)
        Angular velocity along the body axes.
    tide : Quantity (n, 6)
        Tidal tensor along the body axes, ``xx, yy, zz, xy, xz, yz``.
    max_required_friction_angle : Quantity
        Largest friction angle that the body mobilises, deg; inf if no angle suffices.
    """

    body: Body
    encounter: Encounter
    time: Quantity
    distance: Quantity
    attitude: Array
    spin: Quantity
    tide: Quantity
    max_required_friction_angle: Quantity

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def largest_tension(self) -> Quantity:
        """Largest principal stress at each instant, shape (n,), Pa; negative in compression."""
        return self._stresses[0] * u.Pa

    @cached_property
    def onset_time(self) -> Quantity | None:
        """First instant at which the stress passes the yield surface or the tension cut-off, s; None if it never does.

        From closest approach, linear between the rows.
        """
        tension, overload = self._stresses
        beyond = np.maximum(overload, tension - self.body.material.t_pa)
        passed = np.flatnonzero(beyond > 0.0)
        if not len(passed):
            return None
        i = int(passed[0])
        if i == 0:
            return self.time[0]
        part = -beyond[i - 1] / (beyond[i] - beyond[i - 1])
        return self.time[i - 1] + part * (self.time[i] - self.time[i - 1])

    @cached_property
    def _stresses(self) -> tuple[Array, Array]:
        """Largest principal stress and overload of the yield surface at each instant, Pa."""
        body, m = self.body, self.body.material
        tension, beyond = np.empty(len(self)), np.empty(len(self))
        s, stress = body.axes**2, np.empty(6)
        for i, (w, k) in enumerate(zip(self.spin.value, self.tide.value, strict=True)):
            spin, tide = np.ascontiguousarray(w), np.ascontiguousarray(k)
            rigid_stress(s[0], s[1], s[2], body.rho, np.pi * G * body.rho, spin, tide, stress)
            tension[i] = np.linalg.eigvalsh(tensor(stress))[-1]
            beyond[i] = overload(m.surface_code, m.phi, m.c_pa, stress)
        return tension, beyond

    def __repr__(self) -> str:
        return f"<Course {len(self)} rows: mobilises {brief(self.max_required_friction_angle)} at most>"


def rigid_course(
    body: Body, encounter: Encounter, attitude: object = None, *, tolerance: float = 1e-10
) -> Course:
    """Course of a body that stays rigid.

    Parameters
    ----------
    body, encounter, attitude
        As in :func:`flybystab.flybys.flyby.flyby`.
    tolerance : float
        Relative error allowed in each integration step. The rows are a quarter of a step apart: a smaller one
        gives more of them (1e-10: about 12 per dynamical time near the planet).
    """
    check_settled(body)
    if not isinstance(encounter, Encounter):
        raise InvalidInput("encounter", encounter, "a flybystab.Encounter")
    rotation = periapsis_axes(encounter).T @ attitude_matrix(attitude)
    start, stop, limit = span_of(encounter)
    material = body.material
    run = integrate(
        body_state(
            body.axes,
            body.rho,
            body.omega,
            rotation,
            material.phi,
            material.c_pa,
            surface=material.surface_code,
        ),
        Span(start, stop, limit),
        encounter.tide,
        limits=LIMITS._replace(tolerance=tolerance, axis_ratio=np.inf),
        unyielding=True,
        keep=ROWS,
        ground=ground_near(encounter, float(body.axes[0])),
    )
    if run.reason == "stuck" or run.history is None:
        raise NotConverged(f"the rigid course stopped {run.time - start:.1f} s after the start")
    time = run.history["time"]
    turned = np.empty((len(time), 3, 3))
    spin, tide = np.empty((len(time), 3)), np.empty((len(time), 6))
    w = np.ascontiguousarray(_spin_of(run.history["velocity_gradient"]))
    _along_body_axes(time, run.history["quaternion"], w, encounter.tide, turned, spin, tide)
    return Course(
        body=body,
        encounter=encounter,
        time=time * u.s,
        distance=(encounter.distances(time) * u.m).to(u.km),
        attitude=turned,
        spin=spin * u.rad / u.s,
        tide=tide / u.s**2,
        max_required_friction_angle=np.rad2deg(run.max_friction) * u.deg,
    )


def check_tension(body: Body, encounter: Encounter, attitude: object = None) -> None:
    """Raise NotModelled for a body with a tension cut-off that yields in an encounter: its flow is not modelled."""
    if not body.material.cut_off:
        return
    course = rigid_course(body, encounter, attitude)
    if course.onset_time is None:
        return
    first = (course.onset_time - course.time[0]).to_value(u.h)
    raise NotModelled(
        f"flow with a tension cut-off is not modelled, and this body yields {first:.3g} h after the start of the "
        f"encounter (largest tension {course.largest_tension.max().value:.3g} Pa, tensile strength "
        f"{body.material.t_pa:.3g} Pa); without tensile_strength it is followed on its yield surface alone"
    )


def _spin_of(gradient: Array) -> Array:
    """Angular velocity of ``W x = w x x``."""
    return np.stack([gradient[:, 2, 1], gradient[:, 0, 2], gradient[:, 1, 0]], axis=-1)


@kernel
def _along_body_axes(
    time: Array, quaternion: Array, w: Array, panels: TidePanels, turned: Array, spin: Array, tide: Array
) -> None:
    """Rotation matrices of the quaternions; spin and tide along the body axes."""
    k = np.empty(6)
    m = np.empty((3, 3))
    for i in range(time.size):
        rotation_matrix(quaternion[i], turned[i])
        tide_at(panels.tau, panels.start, panels.width, panels.coefficients, time[i], k)
        rotated_to_body(quaternion[i], k, m, tide[i])
        for j in range(3):
            spin[i, j] = turned[i, 0, j] * w[i, 0] + turned[i, 1, j] * w[i, 1] + turned[i, 2, j] * w[i, 2]
