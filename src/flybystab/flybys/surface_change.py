"""Surface slopes of an asteroid through an encounter, on its ellipsoid or on a polyhedral shape."""

from __future__ import annotations

import astropy.units as u
import numpy as np

from flybystab.body.body import Body, check_body
from flybystab.body.shape import Shape
from flybystab.body.shape_slope import shape_slope_change
from flybystab.body.surface_slope import SlopeChange, slope_change
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.inputs import FlybyInputs
from flybystab.flybys.rigid_course import rigid_course


def surface_change(
    body: Body,
    encounter: Encounter,
    attitude: object = None,
    *,
    count: int = 4000,
    shape: Shape | None = None,
) -> SlopeChange:
    """Slopes over the surface of a body that stays rigid, from before an encounter to after it.

    Parameters
    ----------
    body, encounter, attitude
        As in :func:`flybystab.flybys.flyby.flyby`.
    count : int
        Points on the surface of the ellipsoid.
    shape : Shape, optional
        The true shape, of which `body` is the equivalent ellipsoid (:meth:`Body.from_shape`): slopes are then those of
        its facets. The rotation is the same, since the ellipsoid has the inertia ratios of the shape; torques beyond
        the quadrupole are left out.

    Returns
    -------
    SlopeChange
        "Before" is the start of the encounter; `least` and `greatest` are over all instants of the rigid course, so
        that a lasting change of spin counts, too.
    """
    if shape is not None:
        check_shape(shape, body)
    course = rigid_course(body, encounter, attitude, tolerance=1e-12)
    tide = np.asarray(course.tide.value) / u.s**2
    if shape is not None:
        return shape_slope_change(shape, body, course.spin, tide)
    return slope_change(body, course.spin, tide, count=count)


def check_shape(shape: Shape, body: Body) -> None:
    """Raise InvalidInput for anything but a shape whose equivalent ellipsoid is the body."""
    check_body(body)
    if not (isinstance(shape, Shape) and np.allclose(shape.ellipsoid().value, body.axes, rtol=1e-6)):
        raise InvalidInput("shape", shape, "a Shape whose equivalent ellipsoid is the body (Body.from_shape)")


def slopes_of(inputs: FlybyInputs) -> SlopeChange:
    """`surface_change` of the encounter of a flyby."""
    attitude = inputs.encounter.periapsis_axes @ inputs.rotation
    return surface_change(inputs.body, inputs.encounter, attitude)
