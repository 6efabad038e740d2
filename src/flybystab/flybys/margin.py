"""Stability margin of a flyby: the energy that the encounter gives the body against its energy barrier.

An estimate from the rigid course: where the stress that rigidity needs passes the yield surface, the body
deforms along one direction of strain (:mod:`flybystab.core.energy.newmark`), and tide and torque do work on it. A
body whose barrier is above that work comes to rest inside the model; ``python benchmarks/margin.py`` counts how
often this prediction is wrong, and in which direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import Body, check_body, refuse_cut_off
from flybystab.body.perturbation import body_units, flow_cohesion
from flybystab.body.stability_regions import stability_many
from flybystab.core.ellipsoid.tide import tensor
from flybystab.core.energy.newmark import driving_stress, slide
from flybystab.core.energy.perturbation import ellipsoid, rate_of_strain, slope_of_flow
from flybystab.core.energy.potential import MASS
from flybystab.core.energy.stability_row import first_to_flow
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.rigid_course import Course, rigid_course
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import brief, to_si

#: Predicted outcomes.
HOLDS, RECOVERS, RUNS_AWAY = "holds", "recovers", "runs away"


@dataclass(frozen=True, eq=False)
class FlybyMargin(Record):
    """Energy given by an encounter, and the energy barrier of the body.

    Attributes
    ----------
    expected : str
        "holds": the body never yields; "recovers": it yields, and comes to rest inside the model without loss of mass;
        "runs away": it passes the barrier, to an axis ratio beyond 6:1 or to the loss of mass.
    margin : float
        ``1 - energy/barrier``: 1 without an energy input, 0 at the barrier, negative beyond; minus infinity for a body
        that is not in equilibrium at its spin after the encounter.
    energy : Quantity
        Work of the tide and the changed spin on the deformation, J; zero for a body that does not yield.
    kinetic_energy : Quantity
        Largest kinetic energy of deformation, J.
    strain : float
        Accumulated strain of the deformation (integral of ``|D'|``); it ends at 3.
    duration : Quantity
        Duration of the deformation, s.
    direction : ndarray (3, 3)
        Rate of strain in body axes, ``|D'| = 1``, at the largest overload; nan for a body that does not yield.
    barrier : Quantity
        The smaller of `barrier_before` and `barrier_after`, J.
    barrier_before, barrier_after : Quantity
        Barrier of the energy criterion (:func:`flybystab.body.stability.stability`), J, at the spin before the
        encounter and at that of a rigid body after it. Zero for a body that is not in equilibrium.
    momentum, momentum_change : Quantity (3,)
        Angular momentum before the encounter and its change, kg m2/s, frame of the encounter.
    stands_after : bool
        Whether the body in its initial shape is in equilibrium at its spin after the encounter.
    required_friction_angle : Quantity
        Largest mobilised friction angle on the rigid course, deg.
    course : Course
    """

    expected: str
    margin: float
    energy: Quantity
    kinetic_energy: Quantity
    strain: float
    duration: Quantity
    direction: Array
    barrier: Quantity
    barrier_before: Quantity
    barrier_after: Quantity
    momentum: Quantity
    momentum_change: Quantity
    stands_after: bool
    required_friction_angle: Quantity
    course: Course

    _left_out: ClassVar[tuple[str, ...]] = ("course",)

    def __repr__(self) -> str:
        return (
            f"<FlybyMargin {self.expected}: margin {self.margin:.3g}, energy {brief(self.energy)} of "
            f"{brief(self.barrier)}>"
        )


def flyby_margin(
    body: Body, encounter: Encounter, attitude: object = None, *, dilatancy: float | None = None
) -> FlybyMargin:
    """The stability margin of an encounter, without the dynamics of the flow.

    Parameters
    ----------
    body, encounter, attitude
        As in :func:`flybystab.flybys.flyby.flyby`.
    dilatancy : float, optional
        ``beta/min k``; the material's own by default, as in the dynamics.

    Returns
    -------
    FlybyMargin
    """
    check_body(body)
    refuse_cut_off(body.material, "flyby_margin")
    course = rigid_course(body, encounter, attitude)
    m, units = body.material, body_units(body)
    beta = m.dilatancy if dilatancy is None else dilatancy
    beta = to_si(beta, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0)
    s = (body.axes / units.length) ** 2
    spin, tide = course.spin.value * units.time, course.tide.value * units.time**2
    cohesion = m.c_pa / units.stress
    n = len(course)
    deviator, pressure, excess = np.empty((n, 5)), np.empty(n), np.empty(n)
    driving_stress(s, spin, tide, m.surface_code, m.phi, cohesion, deviator, pressure, excess)
    worst = int(np.argmax(excess))

    energy = kinetic = strain = duration = 0.0
    way = np.full((3, 3), np.nan)
    yields = bool(excess[worst] > 0.0)
    if yields:
        scene = ellipsoid(
            s[0], s[1], s[2], spin[0], m.surface_code, m.phi, flow_cohesion(body) / units.stress, beta, 0.0
        )
        x = np.empty(5)
        first_to_flow(scene._replace(stress=deviator[worst].copy(), pressure=float(pressure[worst])), x)
        _, trace = slope_of_flow(scene, x)
        d = np.empty(6)
        rate_of_strain(x, trace, d)
        momenta = MASS / 5.0 * (np.sum(scene.s) - scene.s) * spin
        energy, kinetic, strain, duration = slide(scene, x, course.time.value / units.time, momenta, tide)
        way = tensor(d)

    after = body.with_(spin=course.spin[-1])
    table = stability_many([body, after], dilatancy=beta, depth="barrier", workers=1)
    before_after = table.energy_barrier.to_value(u.J)
    barrier = float(before_after.min())
    given = energy * units.energy
    margin = 1.0 if given == 0.0 else 1.0 - given / barrier if barrier > 0.0 else -np.inf
    inertia = body.inertia.to_value(u.kg * u.m**2)
    momentum = [course.attitude[i] @ (inertia * course.spin[i].value) for i in (0, -1)]
    unit = u.kg * u.m**2 / u.s
    return FlybyMargin(
        expected=HOLDS if not yields else RECOVERS if margin > 0.0 else RUNS_AWAY,
        margin=float(margin),
        energy=given * u.J,
        kinetic_energy=kinetic * units.energy * u.J,
        strain=float(strain),
        duration=duration * units.time * u.s,
        direction=way,
        barrier=barrier * u.J,
        barrier_before=before_after[0] * u.J,
        barrier_after=before_after[1] * u.J,
        momentum=momentum[0] * unit,
        momentum_change=(momentum[1] - momentum[0]) * unit,
        stands_after=bool(table.level[1] >= 1),
        required_friction_angle=course.max_required_friction_angle,
        course=course,
    )
