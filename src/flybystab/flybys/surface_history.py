"""The surface of a shape through an encounter: slopes and effective accelerations of all facets over time."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import Body
from flybystab.body.roche_lobe import RocheLobe, roche_lobe
from flybystab.body.shape import Shape
from flybystab.body.surface_history import SurfaceHistory, shape_history
from flybystab.core.ellipsoid.tide import tensor
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.inputs import FlybyInputs
from flybystab.flybys.rigid_course import Course, rigid_course
from flybystab.flybys.surface_change import check_shape
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import whole

#: Default number of instants: the error of the greatest slopes is then 0.002 deg at the distance of Apophis, and
#: 0.03 deg at 2.5 Earth radii.
INSTANTS = 200


def surface_history(
    body: Body, encounter: Encounter, attitude: object = None, *, shape: Shape, instants: int = INSTANTS
) -> SurfaceHistory:
    """Slope and effective acceleration of every facet of a rigid shape through an encounter.

    Parameters
    ----------
    body, encounter, attitude
        As in :func:`flybystab.flybys.flyby.flyby`.
    shape : Shape
        The true shape, of which `body` is the equivalent ellipsoid (:meth:`Body.from_shape`).
    instants : int
        Rows of the result: the first, the last and the closest approach, the others equally spaced in
        ``asinh(t/tau)``, ``tau`` the time scale of the encounter.

    Returns
    -------
    SurfaceHistory
        Times from closest approach. The rotation is that of the rigid body in the quadrupole of the tide.
    """
    check_shape(shape, body)
    course = rigid_course(body, encounter, attitude, tolerance=1e-12)
    rows = _spaced(course.time.value, encounter.tide.tau, whole(instants, "instants", 3))
    tide = np.asarray(course.tide.value)[rows] / u.s**2
    closest = int(np.argmin(course.distance.value[rows]))
    return shape_history(shape, body, course.time[rows], course.spin[rows], tide, closest=closest)


def history_of(inputs: FlybyInputs, shape: Shape) -> SurfaceHistory:
    """`surface_history` of the encounter of a flyby."""
    attitude = inputs.encounter.periapsis_axes @ inputs.rotation
    return surface_history(inputs.body, inputs.encounter, attitude, shape=shape)


@dataclass(frozen=True, eq=False, repr=False)
class LobeHistory(Record):
    """Roche lobes before an encounter, at closest approach and after it.

    Attributes
    ----------
    before, closest, after : RocheLobe
    time : Quantity, shape (3,)
        From closest approach, s.
    """

    before: RocheLobe
    closest: RocheLobe
    after: RocheLobe
    time: Quantity


def lobe_history(body: Body, encounter: Encounter, attitude: object = None, *, shape: Shape) -> LobeHistory:
    """Roche lobes of a shape before an encounter, at closest approach and after it (arguments: `surface_history`)."""
    check_shape(shape, body)
    course = rigid_course(body, encounter, attitude)
    rows = (0, int(np.argmin(course.distance.value)), len(course) - 1)
    before, closest, after = (_lobe(shape, course, row) for row in rows)
    return LobeHistory(before, closest, after, course.time[list(rows)])


def _lobe(shape: Shape, course: Course, row: int) -> RocheLobe:
    tide = tensor(course.tide.value[row]) / u.s**2
    return roche_lobe(shape, course.body.with_(spin=course.spin[row]), tide)


def _spaced(time: Array, tau: float, count: int) -> Array:
    """Rows nearest to `count` times equally spaced in ``asinh(t/tau)``, with both ends and the row next to zero."""
    v = np.arcsinh(time / tau)
    wanted = np.append(np.linspace(v[0], v[-1], count - 1), 0.0)
    right = np.clip(np.searchsorted(v, wanted), 1, len(v) - 1)
    nearest = np.where(wanted - v[right - 1] < v[right] - wanted, right - 1, right)
    return np.unique(nearest)
