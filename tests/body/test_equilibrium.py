"""Equilibrium stress, spin limits and static tides against closed forms and tabulated values."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import YIELD_SURFACES, Body, Material
from flybystab.body.equilibrium import (
    equilibrium,
    failure_distance,
    point_tide,
    spin_limits,
    stress_components,
    synchronous,
)
from flybystab.body.fluids import jacobi, maclaurin, roche
from flybystab.constants import G
from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.errors import InvalidInput, UnitMismatch

RHO = 2000 * u.kg / u.m**3
ANGLES = [10, 20, 30, 40] * u.deg
UNIT_PLANET = 4 / 3 * np.pi * G * 2000 * 1000**3 * u.m**3 / u.s**2  # radius 1 km, same density


def body(axes, w2=0.0, **material):
    omega = np.sqrt(w2 * np.pi * G * RHO.value)
    return Body(
        semi_axes=np.array(axes) * u.km,
        density=RHO,
        spin=[0, 0, omega] * u.rad / u.s,
        material=Material(**material),
    )


def w2(rate):
    return rate.to_value(u.rad / u.s) ** 2 / (np.pi * G * RHO.value)


UPPER = {
    (1, 1, 0.8): (0.50015, 0.71604, 0.87453, 0.99155),
    (1, 0.8, 0.7): (0.49418, 0.69274, 0.83867, 0.94728),
    (1, 0.6, 0.6): (0.44625, 0.60797, 0.72642, 0.81650),
    (1, 0.5, 0.5): (0.41656, 0.53433, 0.62317, 0.69214),
}
LOWER_AT_10 = {(1, 1, 0.8): 0.0, (1, 0.8, 0.7): 0.0, (1, 0.6, 0.6): 0.04353, (1, 0.5, 0.5): 0.13409}


@pytest.mark.parametrize("axes", UPPER)
def test_spin_limits_of_ellipsoids(axes):
    limits = w2(spin_limits(body(axes, yield_surface="drucker-prager"), ANGLES))
    assert limits[:, 1] == pytest.approx(UPPER[axes], abs=6e-6)  # the table is cut, not rounded
    assert limits[0, 0] == pytest.approx(LOWER_AT_10[axes], abs=6e-6)


@pytest.mark.parametrize("surface", ["drucker-prager", "mohr-coulomb"])
def test_spin_limit_of_a_sphere(surface):
    limits = w2(spin_limits(body((1, 1, 1), yield_surface=surface), ANGLES))
    sin = np.sin(ANGLES.to_value(u.rad))
    assert limits[:, 1] == pytest.approx(8 / 3 * sin / (1 + sin), rel=1e-8)


def test_spin_at_its_limit_mobilises_the_friction_angle():
    for surface in YIELD_SURFACES:
        b = body((1, 0.8, 0.6), friction_angle=33 * u.deg, yield_surface=surface)
        fastest = spin_limits(b)[1]
        e = equilibrium(b.with_(spin=u.Quantity([0 * fastest, 0 * fastest, fastest])))
        assert e.required_friction_angle.to_value(u.deg) == pytest.approx(33, abs=1e-9)
        assert e.margin.to_value(u.deg) == pytest.approx(0, abs=1e-9)


def test_static_tide_on_a_sphere():
    angles = [10, 20, 30, 40, 89.99999] * u.deg
    sphere = body((1, 1, 1), yield_surface="drucker-prager")
    got = failure_distance(sphere, UNIT_PLANET, angles).to_value(u.km)
    assert got == pytest.approx((2.0114, 1.5721, 1.3572, 1.2240, 1.0), abs=6e-5)
    sin = np.sin(angles.to_value(u.rad))
    assert got == pytest.approx(np.cbrt((3 - sin) / (2 * sin)), rel=1e-9)
    for surface in ("mohr-coulomb", "drucker-prager-extension"):
        got = failure_distance(body((1, 1, 1), yield_surface=surface), UNIT_PLANET, angles[:-1]).to_value(
            u.km
        )
        assert got == pytest.approx(np.cbrt((3 + sin[:-1]) / (2 * sin[:-1])), rel=1e-9)


def test_failure_distance_is_where_the_required_friction_passes_the_angle():
    b = body((1, 0.7, 0.6), w2=0.3, friction_angle=32 * u.deg)
    d = failure_distance(b, UNIT_PLANET)
    for factor, inside in ((0.999, False), (1.001, True)):
        assert equilibrium(b, point_tide(UNIT_PLANET, factor * d)).admissible is inside
    d = failure_distance(b, UNIT_PLANET, synchronous=True)
    for factor, inside in ((0.999, False), (1.001, True)):
        e = equilibrium(synchronous(b, UNIT_PLANET, factor * d), point_tide(UNIT_PLANET, factor * d))
        assert e.admissible is inside


def test_fluid_ellipsoids_need_no_friction():
    free = [maclaurin(0.7), jacobi(0.6)]
    for f in free:
        e = equilibrium(body((1, f.a2_a1, f.a3_a1), w2=f.load))
        assert e.required_friction_angle.to_value(u.deg) == pytest.approx(0, abs=1e-6)
        assert e.mean_pressure.value > 0
    f = roche(0.6)
    b = body((1, f.a2_a1, f.a3_a1))
    gm = 1e6 * u.m**3 / u.s**2
    d = np.cbrt(gm.value / (f.load * np.pi * G * RHO.value)) * u.m
    e = equilibrium(synchronous(b, gm, d), point_tide(gm, d))
    assert e.required_friction_angle.to_value(u.deg) == pytest.approx(0, abs=1e-6)


def test_principal_stresses_of_steady_spin():
    b = body((1.4, 0.85, 0.75), w2=0.3)
    s = b.axes**2
    a = np.array(gravity_coefficients(*s))
    w = np.array([1, 1, 0]) * b.omega[2] ** 2
    expected = b.rho * s / 5 * (w - 2 * np.pi * G * b.rho * a)
    e = equilibrium(b)
    assert np.diag(e.stress.to_value(u.Pa)) == pytest.approx(expected, rel=1e-13)
    assert e.mean_pressure.to_value(u.Pa) == pytest.approx(-expected.mean(), rel=1e-12)


def test_tumbling_stress_satisfies_the_tensor_equation_of_motion():
    """(K - Omegadot - Omega^2) S must be the symmetric stress, with Omegadot from Euler's equations."""
    b = body((1.4, 0.85, 0.75)).with_(spin=[1e-4, -2e-4, 3e-4] * u.rad / u.s)
    rng = np.random.default_rng(0)
    k = rng.standard_normal((3, 3)) * 1e-7
    k = 0.5 * (k + k.T)
    s = b.axes**2
    total = k - 2 * np.pi * G * b.rho * np.diag(gravity_coefficients(*s))
    w = b.omega
    j = s.sum() - s
    # torque_i = eps_ijk int x_j (K x)_k: (K_32 S_2 - K_23 S_3) and cyclic
    torque = np.array([k[2, 1] * (s[1] - s[2]), k[0, 2] * (s[2] - s[0]), k[1, 0] * (s[0] - s[1])])
    wdot = (torque - np.cross(w, j * w)) / j

    def cross_matrix(v):
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    om = cross_matrix(w)
    expected = b.rho / 5 * (total - cross_matrix(wdot) - om @ om) @ np.diag(s)
    assert np.allclose(expected, expected.T, rtol=1e-12, atol=1e-14 * np.abs(expected).max())
    assert equilibrium(b, k / u.s**2).stress.to_value(u.Pa) == pytest.approx(expected, rel=1e-10, abs=1e-10)


def test_required_cohesion_just_holds_the_body():
    b = Body([730, 695, 535] * u.m, 1700 * u.kg / u.m**3, 2.1216 * u.h)
    e = equilibrium(b)
    assert e.in_tension
    assert not e.admissible
    assert np.isinf(e.required_friction_angle)
    assert e.margin.value == -np.inf
    for factor, holds in ((0.999, False), (1.001, True)):
        m = b.material.with_(cohesion=factor * e.required_cohesion)
        assert equilibrium(b.with_(material=m)).admissible is holds


def test_lode_angle_of_a_spinning_sphere_is_compression():
    # stretched alike along x and y, most compressed along z
    assert equilibrium(body((1, 1, 1), w2=0.3)).lode_angle.to_value(u.deg) == pytest.approx(30, abs=1e-5)
    assert np.isnan(equilibrium(body((1, 1, 1))).lode_angle)


def test_tide_of_a_point_mass_is_traceless_and_pulls_along_the_line():
    k = point_tide(4e14 * u.m**3 / u.s**2, 1e7 * u.m, direction=[0, 2, 0]).value
    assert np.diag(k) == pytest.approx(4e14 / 1e21 * np.array([-1, 2, -1]))
    with pytest.raises(InvalidInput, match="direction"):
        point_tide(4e14 * u.m**3 / u.s**2, 1e7 * u.m, direction=[0, 0, 0])


def test_bad_input_is_named():
    b = body((1, 0.8, 0.7))
    with pytest.raises(UnitMismatch, match="friction_angle"):
        spin_limits(b, 0.5)
    with pytest.raises(InvalidInput, match="friction_angle"):
        spin_limits(b, [30, 95] * u.deg)
    with pytest.raises(InvalidInput, match="symmetric"):
        equilibrium(b, np.arange(9).reshape(3, 3) / u.s**2)
    with pytest.raises(InvalidInput, match="body"):
        equilibrium("Apophis")


def test_long_cohesionless_body_without_friction_bears_no_spin():
    assert np.isnan(spin_limits(body((1, 0.3, 0.3)), 0.5 * u.deg)).all()


def test_stress_scales_as_density_squared_and_size_squared():
    b = body((1, 0.8, 0.7), w2=0.2)
    big = Body(3 * b.semi_axes, 2 * b.density, spin=np.sqrt(2) * b.spin)
    assert stress_components(big) == pytest.approx(36 * stress_components(b), rel=1e-12)


def test_required_friction_is_given_on_the_default_surface_and_the_compression_cone():

    prolate = Body(
        [1400, 850, 750] * u.m,
        2000 * u.kg / u.m**3,
        spin_period=4 * u.h,
        material=Material(yield_surface="mohr-coulomb"),
    )
    e = equilibrium(prolate)
    cone = equilibrium(prolate.with_(material=Material(yield_surface="drucker-prager")))
    assert e.required_by_surface["mohr-coulomb"] == e.required_friction_angle
    assert e.required_by_surface["drucker-prager"] == cone.required_friction_angle
    assert cone.required_friction_angle < e.required_friction_angle - 0.1 * u.deg
    assert "drucker-prager" in e.other_surfaces()
    assert "drucker-prager" in repr(e)
    assert "mohr-coulomb" in cone.other_surfaces()
    sphere = prolate.with_(semi_axes=[1000, 1000, 1000] * u.m)  # triaxial compression
    assert equilibrium(sphere).other_surfaces() == ""


@pytest.mark.parametrize("offset", [1e-3, 1e-7, 1e-10])
def test_lode_angle_keeps_its_digits_at_the_corners(offset):
    """Near a sphere with spin the angle departs from 30 deg linearly with the difference of two axes."""
    spin = 1e-3 * u.rad / u.s

    def angle(stretch):
        axes = [1000.0 * (1.0 + stretch), 1000.0, 1000.0 / (1.0 + stretch)]
        spun = Body(axes * u.m, RHO, spin=[0, 0, 1] * spin)
        return equilibrium(spun).lode_angle.value

    found, slope = angle(offset), (angle(2e-5) - angle(1e-5)) / 1e-5
    assert abs(slope) > 1.0
    assert found == pytest.approx(angle(0.0) + slope * offset, abs=1e-3 * abs(slope) * offset + 1e-10)
