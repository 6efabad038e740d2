"""The four yield surfaces against principal-stress forms written independently of them."""

import numpy as np
import pytest

from flybystab.core.ellipsoid.rigid_stress import demand, invariants, load_interval, overload
from flybystab.core.material import yield_surface as rheology
from flybystab.core.material.surfaces import code_of

DRUCKER_PRAGER, EXTENSION_CONE, MOHR_COULOMB, MATSUOKA_NAKAI = map(
    code_of, ("drucker-prager", "drucker-prager-extension", "mohr-coulomb", "matsuoka-nakai")
)

CODES = [
    DRUCKER_PRAGER,
    EXTENSION_CONE,
    MOHR_COULOMB,
    MATSUOKA_NAKAI,
]


def rotated(principal, rng):
    q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    m = q @ np.diag(principal) @ q.T
    return np.array([m[0, 0], m[1, 1], m[2, 2], m[0, 1], m[0, 2], m[1, 2]])


def compressive_states(n=200, seed=3):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        principal = -rng.uniform(0.2, 1.0, 3)
        yield np.sort(principal)[::-1], rotated(principal, rng)


def test_slope_of_the_compression_cone():
    for phi, k in zip((30, 35, 40, 50), (0.97979590, 1.15805799, 1.33590139, 1.67990630), strict=True):
        assert rheology.slope(DRUCKER_PRAGER, np.sin(np.deg2rad(phi)), 0.0) == pytest.approx(k, abs=5e-9)


def test_mohr_coulomb_friction_is_that_of_the_extreme_principal_stresses():
    for (s1, _, s3), c in compressive_states():
        expected = np.arcsin((s1 - s3) / -(s1 + s3))
        assert demand(MOHR_COULOMB, 0.5, 0.0, c)[0] == pytest.approx(expected, rel=1e-10)


def test_mohr_coulomb_cohesion_is_that_of_the_extreme_principal_stresses():
    rng = np.random.default_rng(4)
    phi = np.deg2rad(35)
    for _ in range(100):
        principal = rng.uniform(-1, 1, 3)
        s1, s3 = principal.max(), principal.min()
        expected = max(0.0, ((s1 - s3) + (s1 + s3) * np.sin(phi)) / (2 * np.cos(phi)))
        got = demand(MOHR_COULOMB, phi, 0.0, rotated(principal, rng))[1]
        assert got == pytest.approx(expected, rel=1e-10, abs=1e-14)


def test_matsuoka_nakai_friction_from_the_three_invariants():
    for principal, c in compressive_states():
        i1, i2, i3 = -principal.sum(), np.prod(principal) * np.sum(1 / principal), -principal.prod()
        eta = i1 * i2 / i3
        expected = np.arctan(np.sqrt((eta - 9) / 8))
        assert demand(MATSUOKA_NAKAI, 0.5, 0.0, c)[0] == pytest.approx(expected, rel=1e-9)


def test_surfaces_meet_mohr_coulomb_at_the_ends_of_the_lode_angle():
    compression, extension = (-2 / 6**1.5, 2 / 6**1.5)  # det of (1,1,-2)/sqrt6 and (2,-1,-1)/sqrt6
    for sin in (0.1, 0.5, 0.8):
        mc = [rheology.slope(MOHR_COULOMB, sin, d) for d in (compression, extension)]
        mn = [rheology.slope(MATSUOKA_NAKAI, sin, d) for d in (compression, extension)]
        cones = [rheology.slope(code, sin, 0.0) for code in (DRUCKER_PRAGER, EXTENSION_CONE)]
        assert mc == pytest.approx(cones, rel=1e-7)
        assert mn == pytest.approx(cones, rel=1e-7)
    assert rheology.lode_angle(compression) == pytest.approx(np.pi / 6, abs=1e-7)
    assert rheology.lode_angle(extension) == pytest.approx(-np.pi / 6, abs=1e-7)


@pytest.mark.parametrize("code", CODES)
def test_least_slope_bounds_the_slope(code):
    dets = np.linspace(-2, 2, 2001) / 6**1.5
    for sin in (0.05, 0.4, 0.7):
        slopes = [rheology.slope(code, sin, d) for d in dets]
        assert min(slopes) == pytest.approx(rheology.least_slope(code, sin), rel=1e-6)


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("cohesion", [0.0, 0.15])
def test_required_friction_and_cohesion_put_the_stress_on_the_surface(code, cohesion):
    for _, c in compressive_states(50, seed=5):
        phi, _ = demand(code, 0.3, cohesion, c)
        if 0.0 < phi < np.inf:
            assert overload(code, phi, cohesion, c) == pytest.approx(0.0, abs=1e-9)
            assert overload(code, phi * 0.99, cohesion, c) > 0.0
        _, y = demand(code, 0.3, 0.0, c)
        if y > 0.0:
            assert overload(code, 0.3, y, c) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("code", CODES)
def test_overload_is_convex_in_the_stress(code):
    rng = np.random.default_rng(6)
    for _ in range(300):
        a, b = rng.standard_normal((2, 6))
        x = rng.uniform()
        between = overload(code, 0.6, 0.1, x * a + (1 - x) * b)
        assert between <= x * overload(code, 0.6, 0.1, a) + (1 - x) * overload(code, 0.6, 0.1, b) + 1e-12


def test_no_friction_bears_tension_and_any_bears_pressure():
    tension = np.array([1.0, 0.5, 0.2, 0.0, 0.0, 0.0])
    assert demand(DRUCKER_PRAGER, 0.6, 0.0, tension)[0] == np.inf
    pressure = np.array([-1.0, -1.0, -1.0, 0.0, 0.0, 0.0])
    assert demand(DRUCKER_PRAGER, 0.0, 0.0, pressure) == (0.0, 0.0)
    assert invariants(pressure) == (1.0, 0.0, 0.0)


@pytest.mark.parametrize("code", CODES)
def test_load_interval_agrees_with_a_scan(code):
    rng = np.random.default_rng(7)
    found = 0
    for _ in range(40):
        base = np.append(-rng.uniform(0.1, 1.0, 3), np.zeros(3))
        load = np.append(rng.uniform(-0.5, 1.0, 3), 0.2 * rng.standard_normal(3))
        low, high = load_interval(base, load, code, 0.4, 0.05)
        x = np.linspace(0.0, 3.0, 3001)
        borne = np.array([overload(code, 0.4, 0.05, base + xi * load) <= 0 for xi in x])
        if np.isnan(low):
            assert not borne.any()
        else:
            found += 1
            assert np.array_equal(borne, (x >= low) & (x <= high))
    assert found > 10


LODE = [MOHR_COULOMB, MATSUOKA_NAKAI]
SINES = [0.05, 0.4, 0.5736, 0.8]


def unit_deviator(theta):
    """Unit deviator, sorted, at a Lode angle."""
    return np.sqrt(2.0 / 3.0) * np.cos(theta + np.pi / 6.0 - np.array([0.0, 2.0, 4.0]) * np.pi / 3.0)


def isotropic(a, b, u):
    return a * u + b * (u @ u - np.eye(3) / 3.0)


def random_deviators(n, seed):
    rng = np.random.default_rng(seed)
    m = rng.standard_normal((n, 3, 3))
    m = m + np.swapaxes(m, 1, 2)
    m -= np.trace(m, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    return m / np.linalg.norm(m, axis=(1, 2))[:, None, None]


def admissible_stresses(code, sin, n, seed):
    """Stresses inside and on the yield surface without cohesion, at any pressure."""
    rng = np.random.default_rng(seed)
    for u in random_deviators(n, seed):
        p = rng.exponential()
        k = rheology.slope(code, sin, np.linalg.det(u))
        yield -p * np.eye(3) + rng.choice([1.0, rng.uniform()]) * k * p * u


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("sin", SINES)
def test_maximum_dissipation(code, sin):
    """The true normal dissipates nothing without cohesion, and no admissible stress does more work on it."""
    stresses = np.array(list(admissible_stresses(code, sin, 400, 1)))
    for u in random_deviators(200, 2):
        det = np.linalg.det(u)
        a, b, support, g, stress_det = rheology.normal(code, sin, det)
        n = isotropic(a, b, u)
        assert np.linalg.norm(n) == pytest.approx(g, rel=1e-9)
        assert np.linalg.det(n / g) == pytest.approx(stress_det, abs=1e-9)
        assert g == pytest.approx(rheology.slope_over_sine(code, sin, stress_det), rel=1e-7)
        d = u + sin * support / 3.0 * np.eye(3)
        flowing = -np.eye(3) + sin * n
        assert np.sum(flowing * d) == pytest.approx(0.0, abs=1e-12)
        assert np.einsum("nij,ij->n", stresses, d).max() < 1e-9


@pytest.mark.parametrize("code", LODE)
def test_radial_flow_breaks_maximum_dissipation(code):
    """Flow along the stress deviator with the least k: other admissible stresses would do up to a quarter more."""
    sin = np.sin(np.deg2rad(35.0))
    beta = rheology.least_slope(code, sin)
    stresses = np.array(list(admissible_stresses(code, sin, 2000, 3)))
    worst = 0.0
    for u in random_deviators(200, 4):
        k = rheology.slope(code, sin, np.linalg.det(u))
        d = u + beta / 3.0 * np.eye(3)
        work = np.einsum("nij,ij->n", stresses, d) / -np.trace(stresses, axis1=1, axis2=2) * 3.0
        worst = max(worst, (work.max() - (k - beta)) / k)
    assert 0.02 < worst < 0.25


@pytest.mark.parametrize("sin", SINES)
def test_stress_and_normal_are_inverse_on_a_smooth_surface(sin):
    for theta in np.linspace(-np.pi / 6, np.pi / 6, 61):
        u = np.diag(unit_deviator(theta))
        a, b, support = rheology.flow_direction(MATSUOKA_NAKAI, sin, np.linalg.det(u))
        d = isotropic(a, b, u)
        assert np.linalg.norm(d) == pytest.approx(1.0, rel=1e-9)
        a, b, back, g, _ = rheology.normal(MATSUOKA_NAKAI, sin, np.linalg.det(d))
        np.testing.assert_allclose(isotropic(a, b, d) / g, u, atol=3e-7)
        assert back == pytest.approx(support, rel=1e-9)


@pytest.mark.parametrize("sin", SINES)
def test_every_stress_on_a_face_of_mohr_coulomb_has_the_same_normal(sin):
    """The intermediate principal rate vanishes and tr D = sin(phi) (d1 - d3); both corners share the normal."""
    for theta in np.linspace(-0.5, 0.5, 11):
        u = np.diag(unit_deviator(theta))
        a, b, support = rheology.flow_direction(MOHR_COULOMB, sin, np.linalg.det(u))
        d = isotropic(a, b, u) + sin * support / 3.0 * np.eye(3)
        np.testing.assert_allclose(np.diag(d)[1], 0.0, atol=1e-12)
        assert np.trace(d) == pytest.approx(sin * (d[0, 0] - d[2, 2]), rel=1e-12)
        det = np.linalg.det(isotropic(a, b, u))
        assert rheology.beyond_face(sin, det) == pytest.approx(0.0, abs=1e-9)
        supports = [rheology.corner(sin, det, extension)[2] for extension in (True, False)]
        assert supports == pytest.approx([support, support], rel=1e-9)


@pytest.mark.parametrize("code", LODE)
def test_gauge_and_its_derivatives(code):
    h = 1e-4
    for sin in SINES:
        for theta in np.linspace(-0.5, 0.5, 21):
            value, first, bend = rheology.gauge(code, sin, theta)
            left, right = (rheology.gauge(code, sin, theta + x)[0] for x in (-h, h))
            det = np.prod(unit_deviator(theta))
            assert value == pytest.approx(1.0 / rheology.slope_over_sine(code, sin, det), rel=1e-9)
            assert first == pytest.approx((right - left) / (2.0 * h), abs=1e-6)
            assert bend - value == pytest.approx((right - 2.0 * value + left) / h**2, abs=1e-5)
            assert bend >= 0.0
