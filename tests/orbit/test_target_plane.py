"""Target plane against two-body motion far from the planet, and the same in tables and encounters."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.errors import InvalidInput
from flybystab.orbit.planets import planet
from flybystab.orbit.target_plane import capture_radius, target_plane

EARTH = planet("earth")


def test_scripted_encounter():
    v = 8.0 * u.km / u.s
    encounter = fs.Encounter.hyperbolic("earth", 2 * fs.R_earth, v)
    gm, q = encounter.planet.gm, (2 * fs.R_earth).to_value(u.m)
    b = encounter.b_plane()
    # T = S x N is along S x h, where B is: the asteroid passes on the side of +T, as long as its impact parameter
    impact = capture_radius(gm, q, 8000.0) / 1e3
    assert b.to_value(u.km) == pytest.approx([impact, 0.0], rel=1e-9, abs=1e-6)
    # seen far out on the inbound leg, the asteroid is off the line through the planet by B
    state = encounter.track.states(np.array([-3.0e6]))[0]
    r, w = state[:3], state[3:]
    s = w / np.linalg.norm(w)
    off = r - (r @ s) * s
    t = np.cross(s, [0.0, 0.0, 1.0])
    assert off @ t / np.linalg.norm(t) / 1e3 == pytest.approx(b[0].to_value(u.km), rel=0.01)
    with pytest.raises(InvalidInput, match="v_inf"):
        fs.Encounter.hyperbolic("earth", 2 * fs.R_earth, 0 * u.km / u.s).b_plane()
    c = 1.0 / (1.0 + q * 8000.0**2 / gm)
    with pytest.raises(InvalidInput, match="north"):
        encounter.b_plane(north=(c, np.sqrt(1 - c * c), 0.0))
    plunge = fs.Encounter.hyperbolic("earth", 0.5 * fs.R_earth, v)
    assert plunge.b_plane()[0].to_value(u.m) == pytest.approx(capture_radius(gm, 0.25 * q, 8000.0), rel=1e-9)


def test_every_point_of_a_hyperbola_has_the_same_b():
    """Turned into a general attitude: B and v_inf are constants of the motion, and turn with the frame."""
    encounter = fs.Encounter.hyperbolic("earth", 3 * fs.R_earth, 5 * u.km / u.s)
    t = np.array([-1e5, -3e3, 0.0, 500.0, 2e5])
    turn = Rotation.random(random_state=3).as_matrix()
    states = encounter.track.states(t)
    turned = np.hstack([states[:, :3] @ turn.T, states[:, 3:] @ turn.T])
    north = (0.3, -0.5, 0.8)
    here, v = target_plane(states, EARTH.gm, north)
    there, _ = target_plane(turned, EARTH.gm, tuple(turn @ np.array(north)))
    np.testing.assert_allclose(v, 5000.0, rtol=1e-9)
    np.testing.assert_allclose(here, np.tile(here[2], (5, 1)), rtol=1e-8, atol=1e-2)
    np.testing.assert_allclose(there, here, rtol=1e-8, atol=1e-2)
    assert np.linalg.norm(here[0]) == pytest.approx(
        capture_radius(EARTH.gm, 3 * EARTH.radius, 5000.0), rel=1e-8
    )


def test_signs_on_a_straight_line():
    """A fast body moves along +x; ICRF north is +z: T = x cross z = -y, R = x cross T = -z."""
    b, _ = target_plane(np.array([[-1e12, 2e9, 3e9, 1e6, 0, 0]]), EARTH.gm)
    np.testing.assert_allclose(b[0], [-2e9, -3e9], rtol=1e-4)


def test_bound_and_radial_motion():
    b, v = target_plane(np.array([[1e8, 0, 0, 0, 1e3, 0], [1e9, 0, 0, -1e4, 0, 0]]), EARTH.gm)
    assert np.isnan(b[0]).all()
    assert np.isnan(v[0])
    np.testing.assert_array_equal(b[1], [0.0, 0.0])


def test_table_and_encounter_agree_on_apophis():
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    span = Time("2029-04-06", scale="tdb"), Time("2029-04-20", scale="tdb")
    row = fs.find_encounters(orbit, *span, within=0.01 * u.au, error=10 * u.m)[0]
    b = fs.Encounter.from_orbit(orbit, "earth", row["time"], error=10 * u.m).b_plane()
    assert row["b_t"].to_value(u.km) == pytest.approx(b[0].to_value(u.km), abs=0.1)
    assert row["b_r"].to_value(u.km) == pytest.approx(b[1].to_value(u.km), abs=0.1)
    size = np.hypot(row["b_t"], row["b_r"])
    assert size.to_value(u.m) == pytest.approx(
        capture_radius(EARTH.gm, row["distance"].to_value(u.m), row["v_inf"].to_value(u.m / u.s)), rel=1e-8
    )
