"""Surface slopes of an asteroid through an encounter: body and encounter in, slopes out."""

from __future__ import annotations

from typing import Any

import astropy.units as u
import numpy as np

from flybystab.body.body import Body
from flybystab.body.surface_slope import SlopeChange, slope_change
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.rigid_course import rigid_course


def surface_change(
    body: Body, encounter: Encounter, attitude: Any = None, *, count: int = 4000
) -> SlopeChange:
    """Slopes over the surface of a body that stays rigid, from before an encounter to after it.

    Parameters
    ----------
    body, encounter, attitude
        As in :func:`flybystab.flybys.flyby.flyby`.
    count : int
        Points on the surface.

    Returns
    -------
    SlopeChange
        "Before" is the start of the encounter; `least` and `greatest` are over all instants of the rigid course, so
        that a spin which the encounter has changed for good counts, too.
    """
    course = rigid_course(body, encounter, attitude, tolerance=1e-12)
    return slope_change(body, course.spin, np.asarray(course.tide.value) / u.s**2, count=count)
