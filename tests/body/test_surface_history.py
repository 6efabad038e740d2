"""Slopes, effective accelerations and Roche lobes of shapes over time."""

import astropy.units as u
import numpy as np
import pytest
from scenes import earth

import flybystab as fs
from flybystab.body.roche_lobe import roche_lobe
from flybystab.body.surface_history import shape_history
from flybystab.constants import G
from flybystab.errors import InvalidInput
from flybystab.flybys.surface_history import lobe_history

SHAPE = fs.Shape.perturbed([1400.0, 850.0, 750.0] * u.m, amplitude=0.04, seed=3, facets=600)
PILE = fs.Body.from_shape(SHAPE, density=2 * u.g / u.cm**3, spin_period=6 * u.h)
BALL = fs.Shape.from_ellipsoid([500.0, 500.0, 500.0] * u.m, facets=1000)


def ball(spin, density=2000.0):
    return fs.Body.from_shape(BALL, density=density * u.kg / u.m**3, spin=[0.0, 0.0, spin] * u.rad / u.s)


@pytest.fixture(scope="module")
def history():
    return fs.surface_history(PILE, earth(2.5), shape=SHAPE)


def test_extremes_are_those_of_the_slope_change(history):
    change = fs.surface_change(PILE, earth(2.5), shape=SHAPE)
    assert history.slope[0].value == pytest.approx(change.before.value, abs=1e-9)
    assert history.extremes.greatest.value == pytest.approx(change.greatest.value, abs=0.04)
    assert history.extremes.least.value == pytest.approx(change.least.value, abs=0.3)
    limit = np.percentile(change.before.value, 90) * u.deg
    assert history.share_refreshed(repose=limit) == pytest.approx(change.share_passing(limit), abs=0.01)
    assert history.share_refreshed(repose=limit) > 0.0


def test_normal_and_tangential_parts_are_the_effective_acceleration(history):
    slope = history.slope.to_value(u.rad)
    assert -history.outward.value == pytest.approx(history.acceleration.value * np.cos(slope), rel=1e-9)
    # the first row from its terms: gravity of the polyhedron, centrifugal acceleration and a small tide
    gravity = SHAPE.gravity(SHAPE.centroids, PILE.density)[1].value
    w = PILE.omega
    centrifugal = -np.cross(w, np.cross(w, SHAPE.centroids.value))
    size = np.linalg.norm(gravity + centrifugal, axis=1)
    assert history.acceleration[0].value == pytest.approx(size, rel=0.01)


def test_refreshed_area_grows_with_smaller_limits_and_unites_conditions(history):
    shares = [history.share_refreshed(rise=x * u.deg) for x in (0.0, 0.5, 2.0, 180.0)]
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] == 0.0
    both = history.refreshed(repose=20 * u.deg, rise=1 * u.deg)
    either = history.refreshed(repose=20 * u.deg) | history.refreshed(rise=1 * u.deg)
    assert np.array_equal(both, either)
    with pytest.raises(InvalidInput, match="repose"):
        history.refreshed()


def test_the_tide_lifts_the_ends_that_point_to_the_planet():
    """A sphere: g = -(4/3) pi G rho a + 2 GM a/R^3 on the axis to the planet."""
    body = ball(0.0)
    critical = 4.0 / 3.0 * np.pi * G * body.rho / 2.0
    for factor, lifted in ((0.97, False), (1.03, True)):
        k = factor * critical * np.diag([2.0, -1.0, -1.0])[None] / u.s**2
        found = shape_history(BALL, body, [0.0] * u.s, np.zeros((1, 3)) * u.rad / u.s, k)
        assert (found.share_lifted[0] > 0.0) == lifted
        x = BALL.centroids[np.argmax(found.outward[0].value)].value
        assert abs(x[0]) / np.linalg.norm(x) > 0.95


def test_wrong_times_are_refused():
    with pytest.raises(InvalidInput, match="time"):
        shape_history(
            BALL, ball(0.0), [0, 1] * u.s, np.zeros((1, 3)) * u.rad / u.s, np.zeros((1, 6)) / u.s**2
        )
    other = fs.Shape.from_ellipsoid([1000.0, 900.0, 800.0] * u.m, facets=200)
    with pytest.raises(InvalidInput, match="equivalent ellipsoid"):
        fs.surface_history(PILE, earth(3.0), shape=other)


def test_roche_lobe_of_a_spinning_sphere_ends_at_the_synchronous_orbit():
    spin = 2.0 * np.pi / (8 * 3600.0)
    body = ball(spin)
    found = roche_lobe(BALL, body)
    gm = G * body.rho * BALL.volume.value
    r = np.cbrt(gm / spin**2)
    assert np.linalg.norm(found.saddle.value) == pytest.approx(r, rel=1e-4)
    assert abs(found.saddle.value[2]) < 1e-3 * r
    assert found.level.value == pytest.approx(-1.5 * gm / r, rel=1e-4)
    assert found.share_outside == 0.0


def test_roche_lobe_of_a_sphere_in_a_tide_ends_at_the_hill_radius():
    """Without spin: r^3 = GM/(2 GM_p/R^3); with synchronous rotation r^3 = GM/(3 GM_p/R^3), the Hill radius."""
    body = ball(0.0)
    gm = G * body.rho * BALL.volume.value
    n2 = 0.1 * np.pi * G * body.rho
    tide = n2 * np.diag([2.0, -1.0, -1.0]) / u.s**2
    found = roche_lobe(BALL, body, tide)
    assert np.abs(found.saddle.value) == pytest.approx([np.cbrt(gm / (2 * n2)), 0, 0], abs=0.5)
    hill = roche_lobe(BALL, ball(np.sqrt(n2)), tide)
    assert np.abs(hill.saddle.value) == pytest.approx([np.cbrt(gm / (3 * n2)), 0, 0], abs=0.5)


def test_no_lobe_without_spin_and_tide_and_material_outside_it_near_the_spin_limit():
    assert roche_lobe(BALL, ball(0.0)).saddle is None
    assert roche_lobe(BALL, ball(0.0)).share_outside == 0.0
    # synchronous radius r = 1.1 a: V(latitude) = -(GM/a)(1 + cos^2/(2 r^3)) exceeds -3GM/(2 r) beyond a latitude
    r = 1.1
    rate = np.sqrt(4.0 / 3.0 * np.pi * G * ball(0.0).rho / r**3)
    sine = np.sqrt(1.0 - 2.0 * r**3 * (1.5 / r - 1.0))
    assert roche_lobe(BALL, ball(rate)).share_outside == pytest.approx(1.0 - sine, abs=0.02)


def test_the_lobe_shrinks_at_closest_approach():
    found = lobe_history(PILE, earth(2.5), shape=SHAPE)
    reach = [np.linalg.norm(x.saddle.value) for x in (found.before, found.closest, found.after)]
    assert reach[1] < reach[0]
    assert abs(found.time[1].value) < 200.0
