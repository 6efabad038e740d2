"""Change of the elastic stress inside a body by the tide of an encounter."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import Body
from flybystab.body.elastic_stress import ElasticStress, elastic_stress, stress_change
from flybystab.core.ellipsoid.tide import COMPONENTS
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.rigid_course import Course, rigid_course
from flybystab.tabular import Record
from flybystab.units import brief


@dataclass(frozen=True, eq=False)
class ElasticChange(Record):
    """Elastic stress at the start of an encounter and at closest approach.

    Attributes
    ----------
    before, closest : ElasticStress
    largest : Quantity
        Largest von Mises stress of the difference over the volume, Pa.
    """

    before: ElasticStress
    closest: ElasticStress
    largest: Quantity

    def __repr__(self) -> str:
        return f"<ElasticChange {brief(self.largest)} at most, Poisson {self.before.poisson:g}>"


def elastic_change(
    body: Body, encounter: Encounter, attitude: object = None, *, poisson: float = 0.25
) -> ElasticChange:
    """Elastic stress of a body at the start of an encounter and at closest approach.

    Parameters
    ----------
    body, encounter, attitude
        As in :func:`flybystab.flybys.flyby.flyby`.
    poisson : float
        Poisson's ratio.

    Returns
    -------
    ElasticChange
        For the spin and attitude of the rigid body. Elastic waves are neglected: their periods are seconds.
    """
    course = rigid_course(body, encounter, attitude)
    rows = 0, int(np.argmin(course.distance.value))
    before, closest = (_state(course, row, poisson) for row in rows)
    return ElasticChange(before, closest, stress_change(before, closest))


def _state(course: Course, row: int, poisson: float) -> ElasticStress:
    tide = np.empty((3, 3))
    for value, (i, j) in zip(course.tide.value[row], COMPONENTS, strict=True):
        tide[i, j] = tide[j, i] = value
    body = course.body.with_(spin=course.spin[row])
    return elastic_stress(body, tide / u.s**2, poisson=poisson)
