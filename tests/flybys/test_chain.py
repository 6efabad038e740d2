"""The body after an encounter: its attitude, its state, and the next encounter."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from scenes import PILE, earth, material
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.core.ellipsoid.tide import tide_panels
from flybystab.encounter.reach import TAIL
from flybystab.encounter.tide_sources import planet_tide
from flybystab.errors import InvalidInput, UnsettledBody
from flybystab.flybys.flyby import flyby
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.margin import flyby_margin
from flybystab.flybys.remnant import final_attitude
from flybystab.flybys.rigid_course import rigid_course

TURNED = Rotation.from_euler("zyx", [0.7, 0.3, -0.2]).as_matrix()
GAP = 60_000.0  # s between the two passages


def double(q, v=5.0):
    """One encounter whose tide is that of two passages, GAP apart, and its two halves."""
    one = earth(q, v)
    gm, radius, pole = one.planet.gm, one.planet.radius, np.array([0.0, 0.0, 1.0])

    def tide(t):
        out = np.zeros((t.size, 6))
        for shift in (0.0, GAP):
            planet_tide(gm, 0.0, radius, pole, one.positions(t - shift), out)
        return out

    stop = one.t_stop + GAP
    tau = q * radius / one.v_periapsis.to_value(u.m / u.s)
    panels, miss = tide_panels(tide, one.t_start, stop + TAIL, tau, width=0.01)
    assert miss < 1e-8
    whole = replace(one, tide=panels, t_stop=stop)
    middle = one.t_stop
    return whole, replace(whole, t_stop=middle), replace(whole, t_start=middle)


@pytest.mark.parametrize("q", [2.2, 3.0])
@pytest.mark.parametrize("period", [6.0, -6.0])
@pytest.mark.parametrize("turn", [np.eye(3), TURNED])
def test_two_encounters_are_one_run_through_both(q, period, turn):
    body = PILE.with_(spin_period=period * u.h)
    whole, first, second = double(q)
    both = flyby(body, whole, turn, error=False, tolerance=1e-11)
    one = flyby(body, first, turn, error=False, tolerance=1e-11)
    assert one.end_time.to_value(u.s) == pytest.approx(first.t_stop - first.t_start, abs=1e-6)
    two = flyby(one.body, second, second.periapsis_axes @ one.attitude, error=False, tolerance=1e-11)
    np.testing.assert_allclose(two.semi_axes.value, both.semi_axes.value, rtol=1e-6)
    np.testing.assert_allclose(two.spin_vector.value, both.spin_vector.value, atol=1e-6 * both.spin.value)
    # half turns apart, the same directions
    same = np.abs(np.diag(two.attitude.T @ both.attitude))
    np.testing.assert_allclose(same, 1.0, atol=1e-6)
    assert two.spin_ratio * one.spin_ratio == pytest.approx(both.spin_ratio, rel=1e-6)


@pytest.mark.parametrize("q", np.linspace(2.1, 4.5, 9))
@pytest.mark.parametrize("sign", [1, -1])
def test_the_spin_keeps_its_sign_along_the_short_axis(q, sign):
    body = PILE.with_(spin_period=sign * 6 * u.h)
    r = flyby(body, earth(float(q)), error=False, history=False)
    assert r.body.omega[2] * sign > 0.0
    np.testing.assert_allclose(r.attitude.T @ r.attitude, np.eye(3), atol=1e-12)
    assert np.linalg.det(r.attitude) == pytest.approx(1.0)
    np.testing.assert_allclose(r.attitude @ r.body.omega, r.spin_vector.value, atol=1e-18)


def test_the_attitude_is_that_of_the_last_row_of_the_history():
    r = flyby(PILE, earth(2.2), TURNED, error=False)
    shape = r.attitude @ np.diag(r.semi_axes.value**2) @ r.attitude.T
    np.testing.assert_allclose(shape, r.history.shape[-1].value, rtol=1e-9, atol=1e-3)
    # rigid: the attitude of the rigid course, up to half turns
    r = flyby(PILE, earth(3.0), TURNED, error=False)
    course = rigid_course(PILE, earth(3.0), TURNED)
    np.testing.assert_allclose(np.abs(r.attitude.T @ course.attitude[-1]), np.eye(3), atol=1e-6)


def test_attitude_of_equal_axes_and_no_spin_is_a_rotation():
    for shape in (np.eye(3), np.diag([4.0, 4.0, 1.0]), np.diag([1.0, 9.0, 4.0])):
        for spin in (np.zeros(3), np.array([0.0, 0.0, -1.0])):
            a = final_attitude(shape, spin, 0.0)
            np.testing.assert_allclose(a @ a.T, np.eye(3), atol=1e-14)
            assert np.linalg.det(a) == pytest.approx(1.0)
            assert spin @ a[:, 2] >= 0.0


def test_the_attitude_of_a_real_encounter_is_in_icrf():
    apophis = fs.Asteroid.from_catalogue("Apophis")
    from astropy.time import Time

    e = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    start = apophis.attitude(0 * u.deg)
    r = flyby(apophis.body, e, e.periapsis_axes @ start, error=False)
    momentum = r.attitude @ (r.body.inertia.value * r.body.omega)
    before = start @ (apophis.body.inertia.value * apophis.body.omega)
    angle = np.arccos(momentum @ before / np.linalg.norm(momentum) / np.linalg.norm(before))
    assert np.rad2deg(angle) == pytest.approx(r.pole_change.value, abs=1e-6)


def test_an_unsettled_body_is_refused():
    flowing = flyby(PILE, earth(1.5), error=False)
    assert flowing.verdict == "BEYOND MODEL"
    assert flowing.body.state == "flowing"
    hit = flyby(PILE, earth(0.9), error=False)
    assert hit.body.state == "on the ground"
    for body in (flowing.body, hit.body):
        for call in (flyby, flyby_margin, rigid_course, fs.surface_change):
            with pytest.raises(UnsettledBody, match=body.state):
                call(body, earth(3.0))
    table = flyby_many([PILE, flowing.body], [earth(3.0)] * 2)
    assert table.verdict.tolist() == ["INTACT", "FAILED"]
    assert "flowing" in table.failure[1]
    settled = flowing.body.with_(state="rigid", material=material(60, cohesion=1 * u.MPa))
    assert flyby(settled, earth(5.0), error=False).verdict == "INTACT"
    assert flyby(PILE, earth(2.2)).body.state == "rigid"
    with pytest.raises(InvalidInput, match="state"):
        PILE.with_(state="tired")
