"""Tension cut-off: closed forms, limits and what is refused."""

import astropy.units as u
import numpy as np
import pytest
from scenes import earth

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium, failure_distance, spin_limits
from flybystab.body.recovery import pushed
from flybystab.body.stability import stability
from flybystab.constants import G
from flybystab.errors import InvalidInput, NotModelled, UnitMismatch
from flybystab.flybys.flyby import flyby
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.margin import flyby_margin
from flybystab.flybys.rigid_course import rigid_course

RHO = 2000.0


def sphere(period, tensile_strength=None, cohesion=20.0, radius=25.0):
    material = Material(
        friction_angle=35 * u.deg, cohesion=cohesion * u.Pa, tensile_strength=tensile_strength
    )
    return Body(np.full(3, radius) * u.m, RHO * u.kg / u.m**3, period, material=material)


def tension(radius, omega):
    """Sphere: ``(rho a^2/5)(omega^2 - (4/3) pi G rho)``."""
    return RHO * radius**2 / 5 * (omega**2 - 4.0 / 3.0 * np.pi * G * RHO)


def test_the_largest_tension_of_a_sphere_decides():
    body = sphere(28 * u.min)
    exact = tension(25.0, 2 * np.pi / (28 * 60))
    assert equilibrium(body).largest_tension.value == pytest.approx(exact, rel=1e-9)
    assert equilibrium(body).admissible
    for factor, holds in ((1.001, True), (0.999, False)):
        e = equilibrium(sphere(28 * u.min, factor * exact * u.Pa))
        assert e.admissible == holds
        assert np.isfinite(e.required_friction_angle) == holds
        assert np.isfinite(e.required_cohesion) == holds


def test_a_strength_that_is_a_share_of_the_cohesion_asks_for_cohesion():
    exact = tension(25.0, 2 * np.pi / (28 * 60))
    for share in (0.3, 0.5):
        need = equilibrium(sphere(28 * u.min, share)).required_cohesion
        assert need.value == pytest.approx(exact / share, rel=1e-9)
        for factor, holds in ((1.001, True), (0.999, False)):
            assert equilibrium(sphere(28 * u.min, share, factor * need.value)).admissible == holds
    # a share beyond the apex of the surface has no effect
    plain, apex = equilibrium(sphere(28 * u.min)), equilibrium(sphere(28 * u.min, 1 / np.tan(np.deg2rad(35))))
    assert apex.required_cohesion == plain.required_cohesion
    assert apex.required_friction_angle == plain.required_friction_angle


def test_spin_limits_end_where_the_tension_is_the_strength():
    limit = spin_limits(sphere(1 * u.h, 2.0 * u.Pa))[1].value
    assert tension(25.0, limit) == pytest.approx(2.0, rel=1e-9)
    assert limit < spin_limits(sphere(1 * u.h))[1].value
    angles = spin_limits(sphere(1 * u.h, 2.0 * u.Pa), [20.0, 40.0] * u.deg)
    assert angles.shape == (2, 2)
    assert np.all(angles[:, 1].value <= limit * (1 + 1e-12))


def test_stability_is_inadmissible_beyond_the_strength():
    assert stability(sphere(28 * u.min, 1.0 * u.Pa)).level == 0
    assert stability(sphere(28 * u.min, 1.0 * u.Pa)).critical_energy.barrier == 0 * u.J
    assert stability(sphere(28 * u.min, 10.0 * u.Pa)).level == stability(sphere(28 * u.min)).level >= 1


def test_onset_of_yield_in_an_encounter():
    body = Body(
        [1400, 850, 750] * u.m,
        RHO * u.kg / u.m**3,
        6 * u.h,
        material=Material(friction_angle=35 * u.deg, cohesion=2000 * u.Pa),
    )
    free = rigid_course(body, earth(1.5))
    assert free.onset_time is None
    most = free.largest_tension.max()
    assert most > 0 * u.Pa
    cut = body.with_(material=body.material.with_(tensile_strength=0.5 * most))
    course = rigid_course(cut, earth(1.5))
    at = np.interp(course.onset_time.value, course.time.value, course.largest_tension.value)
    assert at == pytest.approx(0.5 * most.value, rel=1e-6)
    with pytest.raises(NotModelled, match="tensile strength"):
        flyby(cut, earth(1.5))
    table = flyby_many([cut, body], [earth(1.5)] * 2)
    assert (table.verdict[0], table.verdict[1]) == ("FAILED", "INTACT")
    assert "tension cut-off" in table.failure[0]
    strong = body.with_(material=body.material.with_(tensile_strength=1.01 * most))
    assert flyby(strong, earth(1.5)).verdict == "INTACT"


def test_what_is_not_modelled_is_refused():
    body = sphere(3 * u.h, 5.0 * u.Pa)
    with pytest.raises(NotModelled, match="flyby_margin"):
        flyby_margin(body, earth(2.0))
    with pytest.raises(NotModelled, match="recovery"):
        pushed(body, np.diag([1.0, -1.0, 0.0]), 1 * u.J)
    with pytest.raises(NotModelled, match="failure_distance"):
        failure_distance(body, 4e14 * u.m**3 / u.s**2)
    with pytest.raises(UnitMismatch):
        Material(tensile_strength=3 * u.m)
    with pytest.raises(InvalidInput):
        Material(tensile_strength=-1 * u.Pa)
    assert "tensile strength 5 Pa" in repr(body.material)
