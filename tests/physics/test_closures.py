"""Fluid closures against closed forms: the limits of the same equations that classics solved."""

import astropy.units as u
import numpy as np
import pytest
from scenes import axes_of, carried, deforming, kinetic, material, momentum, potential

from flybystab.body.body import Body
from flybystab.constants import G
from flybystab.core.dynamics.state import DISPERSED, FLOWING, FLUID
from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.ellipsoid.tide import components, tide_panels

DENSITY = 2000 * u.kg / u.m**3
RHO = 2000.0
RATE = np.sqrt(np.pi * G * RHO)
SPHERE = Body(semi_axes=[500, 500, 500] * u.m, density=DENSITY, material=material(0.0))


@pytest.mark.parametrize("pattern", [np.diag([1.0, -1.0, 0.0]), np.diag([-1.0, -1.0, 2.0])])
def test_kelvin_mode_of_an_inviscid_sphere(pattern):
    """sigma^2 = 8 l (l-1)/(3 (2 l + 1)) pi G rho = 16/15 for l = 2."""
    e = 1e-5
    *_, rows = deforming(SPHERE, e * RATE * pattern, 20.0 / RATE, regime=FLUID)
    t, signal = rows[:, 0], rows[:, 1:4] @ np.diag(pattern)
    sigma = np.sqrt(16.0 / 15.0) * RATE
    exact = 2.0 * 500.0**2 * np.sum(pattern**2) * e * RATE / sigma * np.sin(sigma * t)
    # e is the size of the terms that the linear theory leaves out
    assert np.abs(signal - exact).max() < 10 * e * np.abs(exact).max()


def test_viscous_decay_of_a_sphere():
    """The homogeneous mode decays at 5 nu/R^2, and its frequency falls to sqrt(sigma^2 - gamma^2)."""
    gamma = 0.05 * RATE
    mu = RHO * gamma * 500.0**2 / 5.0
    e = 1e-5
    *_, rows = deforming(
        SPHERE, e * RATE * np.diag([1.0, -1.0, 0.0]), 30.0 / RATE, regime=FLUID, viscosity=mu
    )
    t, x = rows[:, 0], rows[:, 1] - rows[:, 2]
    sigma = np.sqrt(16.0 / 15.0 * RATE**2 - gamma**2)
    exact = 4.0 * 500.0**2 * e * RATE / sigma * np.exp(-gamma * t) * np.sin(sigma * t)
    assert np.abs(x - exact).max() < 2e-4 * np.abs(exact).max()


def maclaurin(e):
    """Axes and w^2 = Omega^2/(pi G rho) of a Maclaurin spheroid."""
    a = np.array([1.0, 1.0, np.sqrt(1.0 - e * e)])
    a_i = np.array(gravity_coefficients(*(a * a)))
    return 500.0 * a, 2.0 * (a_i[0] - a_i[2] * a[2] ** 2)


def test_maclaurin_toroidal_frequencies():
    """Frequencies of the m = 2 modes: sigma = Omega +- sqrt(4 B_11 - Omega^2) (Chandrasekhar 1969, 33).

    They are the roots of sigma^2 - 2 Omega sigma - 2 (2 B_11 - Omega^2) = 0.
    """
    axes, w2 = maclaurin(0.5)
    omega = np.sqrt(w2) * RATE
    body = Body(
        semi_axes=axes * u.m, density=DENSITY, spin=[0, 0, omega] * u.rad / u.s, material=material(0.0)
    )
    # B_12 = (a_1^2 A_1 - a_2^2 A_2)/(a_1^2 - a_2^2), which is B_11 for a_1 = a_2
    h = 1e-3
    s1, s2 = (1.0 + h) ** 2, (1.0 - h) ** 2
    a = gravity_coefficients(s1, s2, (axes[2] / axes[0]) ** 2)
    b12 = (s1 * a[0] - s2 * a[1]) / (s1 - s2)
    roots = np.roots([1.0, -2.0 * np.sqrt(w2), -2.0 * (2.0 * b12 - w2)])
    e = 1e-6
    *_, rows = deforming(body, e * RATE * np.diag([1.0, -1.0, 0.0]), 400.0 / RATE, regime=FLUID)
    t = rows[:, 0] * RATE
    # S_11 - S_22 + 2 i S_12 in the frame that turns with the body
    z = ((rows[:, 1] - rows[:, 2]) + 2j * rows[:, 4]) * np.exp(-2j * np.sqrt(w2) * t)
    # two exponentials exp(-i sigma t): fit amplitudes at the predicted frequencies, residual must vanish
    basis = np.exp(-1j * np.outer(t, roots))
    amplitude, *_ = np.linalg.lstsq(basis, z, rcond=None)
    residual = np.abs(basis @ amplitude - z).max() / np.abs(z).max()
    assert residual < 3e-3
    wrong = np.exp(-1j * np.outer(t, roots * 1.01))
    amplitude, *_ = np.linalg.lstsq(wrong, z, rcond=None)
    assert np.abs(wrong @ amplitude - z).max() / np.abs(z).max() > 0.3


def test_inviscid_energy_and_momentum():
    body = Body(
        semi_axes=[700, 500, 400] * u.m,
        density=DENSITY,
        spin=[1e-4, 2e-4, 4e-4] * u.rad / u.s,
        material=material(0.0),
    )
    rate = 0.2 * RATE * np.array([[1.0, 0.3, 0.0], [0.3, -0.6, 0.1], [0.0, 0.1, -0.4]])
    start = np.diag(body.axes**2)
    w = body.omega
    l0 = rate + np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    shape, gradient, *_ = deforming(body, rate, 30.0 / RATE, regime=FLUID)
    before = kinetic(start, l0) + potential(body, start)
    after = kinetic(shape, gradient) + potential(body, shape)
    assert after == pytest.approx(before, rel=1e-9)
    np.testing.assert_allclose(
        momentum(shape, gradient), momentum(start, l0), atol=1e-9 * np.linalg.norm(momentum(start, l0))
    )
    assert np.prod(axes_of(shape)) == pytest.approx(np.prod(body.axes), rel=1e-9)

    # Kelvin: the circulation, the angular momentum of Dedekind's adjoint ellipsoid, is kept in size.
    def circulation(s, g):
        values, vectors = np.linalg.eigh(s)
        root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
        return np.linalg.norm(root @ (g - g.T) @ root)

    assert circulation(shape, gradient) == pytest.approx(circulation(start, l0), rel=1e-9)


def test_no_friction_is_the_fluid_limit():
    """FLOWING with phi -> 0 tends to the inviscid fluid, in proportion to phi."""
    axes = [700, 500, 400] * u.m
    rate = 0.2 * RATE * np.array([[1.0, 0.3, 0.0], [0.3, -0.6, 0.1], [0.0, 0.1, -0.4]])
    spin = [1e-4, 2e-4, 4e-4] * u.rad / u.s
    fluid = deforming(
        Body(semi_axes=axes, density=DENSITY, spin=spin, material=material(0.0)),
        rate, 3.0 / RATE, regime=FLUID,
    )[0]  # fmt: skip
    errors = []
    for phi in (1e-2, 1e-3):
        body = Body(semi_axes=axes, density=DENSITY, spin=spin, material=material(phi))
        errors.append(np.abs(deforming(body, rate, 3.0 / RATE, regime=FLOWING)[0] - fluid).max())
    assert errors[1] < 1e-4 * 700**2
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.05)


def rotating_tide(strength, rate, span):
    """Tide of a planet on a circular orbit, GM/R^3 = strength, starting on +x."""

    def k(t):
        n = np.stack([np.cos(rate * t), np.sin(rate * t), np.zeros_like(t)], axis=-1)
        return components(strength * (3.0 * n[:, :, None] * n[:, None, :] - np.eye(3)))

    return tide_panels(k, 0.0, span, span, width=0.02)[0]


def test_roche_ellipsoid_is_a_fixed_point():
    """The last synchronous Roche ellipsoid keeps its shape; 3 % nearer no equilibrium is left."""
    axes = 500.0 * np.array([1.0, 0.511342804, 0.482573598])
    strength = 0.0900929971 * RATE**2
    rate = np.sqrt(strength)
    span = 2.0 * np.pi / rate
    body = Body(
        semi_axes=axes * u.m, density=DENSITY, spin=[0, 0, rate] * u.rad / u.s, material=material(0.0)
    )
    shape, *_ = deforming(
        body, np.zeros((3, 3)), 0.3 * span, regime=FLUID, tide=rotating_tide(strength, rate, span)
    )
    np.testing.assert_allclose(axes_of(shape), axes, rtol=2e-6)
    # R = [4/3 / (GM/R^3 pi G rho)]^(1/3) Rp (rho_p/rho)^(1/3)
    assert pytest.approx(2.455175645, rel=1e-9) == (4.0 / 3.0 / 0.0900929971) ** (1.0 / 3.0)
    nearer = 1.1 * strength
    rate = np.sqrt(nearer)
    body = body.with_(spin=[0, 0, rate] * u.rad / u.s)
    mu = 0.3 * RHO * RATE * 500.0**2 / 5.0
    shape, *_ = deforming(
        body, np.zeros((3, 3)), 6.0 * span, regime=FLUID, viscosity=mu, limit=8.0,
        tide=rotating_tide(nearer, rate, 7.0 * span),
    )  # fmt: skip
    assert axes_of(shape)[0] / axes_of(shape)[2] > 7.9


@pytest.mark.parametrize("phi", [10.0, 20.0, 30.0, 40.0])
@pytest.mark.parametrize("surface", ["drucker-prager", "mohr-coulomb"])
def test_static_failure_distance_of_a_sphere(phi, surface):
    """A slow, radial approach fails where the static theory says (Holsapple & Michel 2006)."""
    body = Body(
        semi_axes=[500, 500, 500] * u.m,
        density=DENSITY,
        material=material(phi, yield_surface=surface),
    )
    sine = np.sin(np.deg2rad(phi))
    sign = -1.0 if surface == "drucker-prager" else 1.0
    distance = ((3.0 + sign * sine) / (2.0 * sine)) ** (1.0 / 3.0)
    # GM/R^3 = (4/3) pi G rho / distance^3 at failure; a ramp that passes it
    span = 2000.0 / RATE
    failure = 4.0 / 3.0 / distance**3 * RATE**2

    def k(t):
        x = 2.0 * failure * t / span
        return np.stack([2 * x, -x, -x, 0 * x, 0 * x, 0 * x], axis=-1)

    tide, _ = tide_panels(k, 0.0, span, span, width=0.2)
    p = carried(body, 0.0, span, tide, tolerance=1e-10)
    assert p.events[0][0] == "onset"
    reached = (4.0 / 3.0 * RATE**2 / (2.0 * failure * p.events[0][1] / span)) ** (1.0 / 3.0)
    # The Lode angle comes from the invariants of the stress. At a corner of the surface their rounding errors of 1e-16
    # are errors of some 1e-8 rad in the angle, and thus in the Mohr-Coulomb strength; on the cone it does not enter.
    assert reached == pytest.approx(distance, rel=1e-12 if surface == "drucker-prager" else 1e-8)
    assert p.events[0][2] == pytest.approx(-np.pi / 6.0, abs=5e-8)


def test_dispersed_grains_keep_momentum_and_energy():
    """Ballistic grains in their own gravity: momentum and energy kept while the volume grows."""
    body = Body(semi_axes=[700, 500, 400] * u.m, density=DENSITY, spin=[0, 0, 9e-4] * u.rad / u.s)
    rate = RATE * np.diag([1.5, 1.2, 1.0])
    shape, gradient, events, _ = deforming(body, rate, 2.0 / RATE, regime=DISPERSED)
    assert events == []
    w = body.omega
    l0 = rate + np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    start = np.diag(body.axes**2)
    assert np.prod(axes_of(shape)) > 3.0 * np.prod(body.axes)
    assert kinetic(shape, gradient) + potential(body, shape) == pytest.approx(
        kinetic(start, l0) + potential(body, start), rel=1e-9
    )
    np.testing.assert_allclose(momentum(shape, gradient), momentum(start, l0), rtol=0, atol=1e-8)
