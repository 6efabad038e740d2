"""The tidal tensor against the field it comes from."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flybystab.constants import GM_EARTH, R_EARTH
from flybystab.core.ellipsoid.tide import tensor, tide_j2, tide_point
from flybystab.orbit.planets import planet

EARTH = planet("earth")


def point(r):
    out = np.zeros(6)
    tide_point(GM_EARTH, *r, out)
    return tensor(out)


def oblate(r, pole=EARTH.pole):
    out = np.zeros(6)
    tide_j2(GM_EARTH, EARTH.j2, EARTH.radius, *pole, *r, out)
    return tensor(out)


def j2_acceleration(r, pole):
    """Acceleration at `r` from an oblate planet: the textbook form, not the one of the kernel."""
    d = np.linalg.norm(r)
    s = r @ pole / d
    c = 1.5 * GM_EARTH * EARTH.j2 * EARTH.radius**2 / d**4
    return c * ((5 * s * s - 1) * r / d - 2 * s * pole)


def random_place(seed, distance=1.3 * R_EARTH):
    v = np.random.default_rng(seed).normal(size=3)
    return distance * v / np.linalg.norm(v)


@pytest.mark.parametrize("seed", range(5))
def test_j2_tide_is_the_gradient_of_the_j2_acceleration(seed):
    r, pole = random_place(seed), random_place(seed + 50, 1.0)
    h = 2e3
    gradient = np.empty((3, 3))
    for j in range(3):
        e = np.eye(3)[j]
        # fourth-order central difference
        gradient[:, j] = (
            8 * (j2_acceleration(r + h * e, pole) - j2_acceleration(r - h * e, pole))
            - (j2_acceleration(r + 2 * h * e, pole) - j2_acceleration(r - 2 * h * e, pole))
        ) / (12 * h)
    k = oblate(-r, pole)  # the planet is at -r from the body
    assert np.abs(k - gradient).max() < 1e-9 * np.abs(k).max()


@pytest.mark.parametrize("tide", [point, oblate])
def test_tide_is_trace_free_symmetric_and_even(tide):
    r = random_place(3)
    k = tide(r)
    assert abs(np.trace(k)) < 1e-14 * np.abs(k).max()
    np.testing.assert_array_equal(k, k.T)
    np.testing.assert_allclose(tide(-r), k, rtol=1e-13)


def test_tide_turns_with_the_frame():
    q = Rotation.random(random_state=4).as_matrix()
    r, pole = random_place(5), random_place(6, 1.0)
    np.testing.assert_allclose(point(q @ r), q @ point(r) @ q.T, atol=1e-20)
    np.testing.assert_allclose(oblate(q @ r, q @ pole), q @ oblate(r, pole) @ q.T, atol=1e-22)


def test_tide_stretches_along_the_line_to_the_planet():
    k = point([0.0, 2 * R_EARTH, 0.0])
    c = GM_EARTH / (2 * R_EARTH) ** 3
    np.testing.assert_allclose(np.diag(k), [-c, 2 * c, -c], rtol=1e-15)


def moment(axes, big, order=24):
    """Mean of x (b(x) - b(0)) over the ellipsoid, b the exact field of a point mass at `big`."""
    x, w = np.polynomial.legendre.leggauss(order)
    r, wr = 0.5 * (x + 1), 0.5 * w
    phi = 2 * np.pi * np.arange(2 * order) / (2 * order)
    rho, mu, ph = np.meshgrid(r, x, phi, indexing="ij")
    weight = wr[:, None, None] * rho**2 * w[None, :, None] / (2 * order) * 1.5
    s = np.sqrt(1 - mu * mu)
    p = np.stack([axes[0] * rho * s * np.cos(ph), axes[1] * rho * s * np.sin(ph), axes[2] * rho * mu], -1)
    away = big - p
    # (big - p)/|big - p|^3 - big/|big|^3 by a form that does not cancel
    d2, b2 = np.sum(away**2, -1), big @ big
    ratio = np.expm1(-1.5 * np.log1p((d2 - b2) / b2))
    field = GM_EARTH / b2**1.5 * (big * ratio[..., None] - p * (1 + ratio[..., None]))
    return np.einsum("abc,abci,abcj->ij", weight, p, field)


def test_point_mass_moment_against_quadrature_of_the_exact_field():
    """M^T = K I up to (a/R)^2: halving the body quarters the difference; the octupole adds nothing."""
    big = random_place(8, 2.0 * R_EARTH)
    shape = np.array([1.0, 0.7, 0.5])
    k = point(big)
    gaps = []
    for size in (4e5, 2e5, 1e5):
        axes = size * shape
        linear = k @ np.diag(axes**2 / 5)
        gaps.append(np.abs(moment(axes, big).T - linear).max() / np.abs(linear).max())
    assert gaps[0] < 6 * (4e5 / np.linalg.norm(big)) ** 2
    assert gaps[0] / gaps[1] == pytest.approx(4, rel=0.02)
    assert gaps[1] / gaps[2] == pytest.approx(4, rel=0.005)  # a first-order (octupole) part would give 2
