"""Refreshing distance against the tilt of gravity on a sphere and its scaling with density."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.constants import GM_EARTH, G
from flybystab.errors import InvalidInput
from flybystab.flybys.refresh_distance import refresh_distance
from flybystab.orbit.planets import planet

BALL = fs.Shape.from_ellipsoid([500.0, 500.0, 500.0] * u.m, facets=300)


def ball(density):
    return fs.Body.from_shape(BALL, density=density * u.kg / u.m**3)


def found(density, **options):
    return refresh_distance(ball(density), BALL, v_inf=0 * u.km / u.s, attitudes=1, **options)


def test_a_small_area_is_refreshed_where_the_largest_tilt_on_a_sphere_is_the_rise():
    """The tide tilts gravity by atan[(3/2) k/(1 - k/2 ...)] at most, k = (GM/q^3)/(4/3 pi G rho), near 45 deg."""
    rise = 2.0
    angle = np.linspace(0.0, np.pi / 2, 2000)
    k = np.geomspace(1e-3, 1.0, 4000)[:, None]
    tilt = np.arctan2(1.5 * k * np.sin(2 * angle), 1.0 - k * (3 * np.cos(angle) ** 2 - 1)).max(axis=1)
    needed = np.interp(np.deg2rad(rise), tilt, k[:, 0])
    limit = np.cbrt(GM_EARTH / (needed * 4 / 3 * np.pi * G * 1000.0))
    small = found(1000.0, area=0.01, rise=rise * u.deg)
    assert 0.93 * limit < small.distance.to_value(u.m) < 1.01 * limit
    assert found(1000.0, area=0.3, rise=rise * u.deg).distance < small.distance


def test_it_goes_as_the_cube_root_of_the_density():
    """On a parabola all that matters is the mean density of the planet over that of the body."""
    light, heavy = (found(rho, area=0.1, rise=1 * u.deg).distance.value for rho in (800.0, 2700.0))
    assert light / heavy == pytest.approx(np.cbrt(2700.0 / 800.0), rel=0.02)


def test_other_planets():
    """Distances in radii go as the cube root of the mean density; Venus' atmosphere ends above 1.02 radii."""
    radii = {
        name: refresh_distance(
            ball(1000.0), BALL, name, v_inf=0 * u.km / u.s, attitudes=1, rise=1 * u.deg
        ).radii
        for name in ("earth", "venus", "mars")
    }
    density = {}
    for name in radii:
        home = planet(name)
        density[name] = home.gm / home.radius**3
    for name in ("venus", "mars"):
        expected = np.cbrt(density[name] / density["earth"])
        assert radii[name] / radii["earth"] == pytest.approx(expected, rel=0.02)


def test_no_distance_is_enough_for_a_rise_that_no_encounter_makes():
    none = found(20_000.0, area=0.5, rise=60 * u.deg)
    assert np.isnan(none.distance.value)


def test_distances_of_the_literature():
    """Binzel 2010, Nesvorny 2010, DeMeo 2014: 5 to 16 Earth radii; a rise of 0.2 to 1 deg gives them."""
    shape = fs.Shape.perturbed([225.0, 165.0, 155.0] * u.m, amplitude=0.06, seed=2, facets=300)
    body = fs.Body.from_shape(shape, density=2 * u.g / u.cm**3, spin_period=8 * u.h)
    radii = [refresh_distance(body, shape, rise=x * u.deg, area=0.1, attitudes=2).radii for x in (0.2, 1.0)]
    assert 5.0 < radii[1] < radii[0] < 16.0


def test_bad_input_is_named():
    with pytest.raises(InvalidInput, match="area"):
        found(1000.0, area=1.5)
    with pytest.raises(InvalidInput, match="attitudes"):
        refresh_distance(ball(1000.0), BALL, attitudes=0)
