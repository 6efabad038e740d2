"""Surface slopes against equipotentials, finite differences and the rigid equations of motion."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Body
from flybystab.body.equilibrium import point_tide
from flybystab.body.fluids import jacobi, maclaurin, roche
from flybystab.body.surface_slope import slope_change, surface_points, surface_slopes
from flybystab.constants import GM_EARTH, G
from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.ellipsoid.surface_slope import effective_field
from flybystab.errors import InvalidInput

RHO = 1900.0


def body(axes, w2=0.0, scale=1.0):
    omega = np.sqrt(w2 * np.pi * G * RHO)
    return Body(np.array(axes) * scale * u.km, RHO * u.kg / u.m**3, spin=[0, 0, omega] * u.rad / u.s)


def test_area_of_the_ellipsoid():
    a, c = 1000.0, 600.0
    e = np.sqrt(1 - c * c / a / a)
    exact = 2 * np.pi * a * a + np.pi * c * c / e * np.log((1 + e) / (1 - e))
    _, area = surface_points(body((1, 1, 0.6)), 20_000)
    assert area.sum() == pytest.approx(exact, rel=1e-4)
    points, _ = surface_points(body((1, 0.8, 0.6)), 500)
    assert np.sum((points / [1000, 800, 600]) ** 2, axis=1) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("figure", [maclaurin(0.7), jacobi(0.6)])
def test_the_surface_of_a_fluid_is_level(figure):
    b = body((1, figure.a2_a1, figure.a3_a1), figure.load)
    assert surface_slopes(b).slope.max().value < 1e-5


def test_the_surface_of_a_synchronous_fluid_is_level():
    f = roche(0.6)
    k = f.load * np.pi * G * RHO * np.diag([2.0, -1.0, -1.0])
    assert surface_slopes(body((1, f.a2_a1, f.a3_a1), f.load), k / u.s**2).slope.max().value < 1e-5


def test_sphere_at_rest_is_level_and_a_spinning_one_slopes_to_the_equator():
    assert surface_slopes(body((1, 1, 1))).slope.max().value < 1e-6
    w2 = 0.3
    s = surface_slopes(body((1, 1, 1), w2))
    z = s.points[:, 2].to_value(u.km)
    latitude = np.arcsin(z)
    # g = -(4/3 - w2 cos^2) radially, w2 sin cos tangentially, in pi G rho a
    expected = np.arctan2(w2 * np.sin(abs(latitude)) * np.cos(latitude), 4 / 3 - w2 * np.cos(latitude) ** 2)
    assert s.slope.to_value(u.rad) == pytest.approx(expected, abs=1e-12)


def test_equator_is_lifted_off_beyond_the_weightless_spin():
    assert surface_slopes(body((1, 1, 1), 1.5)).share_above(90 * u.deg) > 0.1
    assert surface_slopes(body((1, 1, 1), 1.2)).share_above(90 * u.deg) == 0.0


def test_effective_field_is_that_of_a_tumbling_rigid_body():
    """g = (K - Omega^2 - Omegadot) x, with Omegadot from J omegadot + omega x J omega = torque."""
    s = np.array([1.0, 0.6, 0.4]) * 1e6
    w = np.array([1e-4, -2e-4, 3e-4])
    k = np.array([[2.0, 0.3, -0.4], [0.3, -1.5, 0.2], [-0.4, 0.2, -0.5]]) * 1e-7
    six = np.array([k[0, 0], k[1, 1], k[2, 2], k[0, 1], k[0, 2], k[1, 2]])
    field = np.empty((3, 3))
    effective_field(s, np.pi * G * RHO, w, six, field)
    rng = np.random.default_rng(0)
    # torque on the body: mean over the volume of x cross (K x), by its second moments S/5
    second = np.diag(s)
    torque = np.array(
        [
            (k @ second)[2, 1] - (k @ second)[1, 2],
            (k @ second)[0, 2] - (k @ second)[2, 0],
            (k @ second)[1, 0] - (k @ second)[0, 1],
        ]
    )
    j = s.sum() - s
    wdot = (torque - np.cross(w, j * w)) / j
    a = np.array(gravity_coefficients(*s))
    for x in rng.standard_normal((5, 3)) * 500:
        g = -2 * np.pi * G * RHO * a * x + k @ x - np.cross(w, np.cross(w, x)) - np.cross(wdot, x)
        assert field @ x == pytest.approx(g, rel=1e-12)


def test_change_through_an_encounter_starts_from_the_slope_before():
    b = body((0.22, 0.18, 0.17), 0.01)
    k0 = np.zeros((3, 3))
    near = point_tide(GM_EARTH * u.m**3 / u.s**2, 38_012 * u.km).to_value(u.s**-2)
    tides = np.array([k0, 0.5 * near, near, 0.5 * near, k0]) / u.s**2
    spin = np.tile(b.omega, (5, 1)) * u.rad / u.s
    c = slope_change(b, spin, tides, count=2000)
    assert c.before.value == pytest.approx(surface_slopes(b, count=2000).slope.value)
    at_peak = surface_slopes(b, near / u.s**2, count=2000).slope
    assert np.all(c.change.value >= np.abs(at_peak - c.before).value - 1e-12)
    assert c.largest_change.value == pytest.approx(np.abs(at_peak - c.before).max().value)
    assert 0.05 < c.largest_change.to_value(u.deg) < 10
    # six components are the same tensor
    six = np.stack([tides.value[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))], -1)
    assert np.array_equal(slope_change(b, spin, six / u.s**2, count=2000).greatest, c.greatest)
    # share of area: none passes an angle above all slopes, and the share falls with the angle
    assert c.share_passing(80 * u.deg) == 0.0
    # size does not matter: slopes are angles of a field that is linear in x
    large = slope_change(body((0.22, 0.18, 0.17), 0.01, scale=10), spin, tides, count=2000)
    assert large.greatest.value == pytest.approx(c.greatest.value)


def test_slope_change_falls_with_density():
    near = point_tide(GM_EARTH * u.m**3 / u.s**2, 38_012 * u.km).to_value(u.s**-2)
    tides = np.array([np.zeros((3, 3)), near]) / u.s**2

    def change(rho):
        b = Body([220, 180, 170] * u.m, rho * u.kg / u.m**3)
        return slope_change(b, np.zeros((2, 3)) * u.rad / u.s, tides, count=1000).largest_change

    assert change(1290) > change(2200) > 0


def test_bad_input_is_named():
    b = body((1, 0.8, 0.7))
    with pytest.raises(InvalidInput, match="spin"):
        slope_change(b, [0, 0, 1e-4] * u.rad / u.s, np.zeros((1, 6)) / u.s**2)
    with pytest.raises(InvalidInput, match="tide"):
        slope_change(b, np.zeros((2, 3)) * u.rad / u.s, np.zeros((1, 6)) / u.s**2)
    with pytest.raises(InvalidInput, match="count"):
        surface_slopes(b, count=3)
