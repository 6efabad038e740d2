"""Torque of the tide on a polyhedron by its moments, against its gravity on the planet and against point masses."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.constants import GM_EARTH, G
from flybystab.core.ellipsoid.tide import COMPONENTS, tide_point
from flybystab.core.polyhedron.moments import octupole_torque, quadrupole_torque, third_moments, tide_gradient

SHAPE = fs.Shape.perturbed([225.0, 165.0, 155.0] * u.m, amplitude=0.1, seed=2, facets=500)
SECOND = np.diag(SHAPE.second_moments)
DIRECTION = np.array([0.6, -0.48, 0.64])


def tide(gm, position):
    six, out = np.zeros(6), np.empty((3, 3))
    tide_point(gm, *position, six)
    for value, (i, j) in zip(six, COMPONENTS, strict=True):
        out[i, j] = out[j, i] = value
    return out


def test_third_moments_of_a_tetrahedron():
    """With corners 0, x, y, z: int x^3 = 1/120, int x^2 y = 1/360, int x y z = 1/720."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    facets = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    t = third_moments(corners, facets)
    assert t[0, 0, 0] == pytest.approx(1 / 120)
    assert t[0, 0, 1] == t[0, 1, 0] == t[1, 0, 0] == pytest.approx(1 / 360)
    assert t[0, 1, 2] == pytest.approx(1 / 720)


def test_a_point_symmetric_body_has_none():
    ellipsoid = fs.Shape.from_ellipsoid([3.0, 2.0, 1.0] * u.m, facets=400)
    # the lattice of vertices is not quite symmetric
    assert np.abs(ellipsoid.third_moments).max() < 1e-3 * 3.0**3
    assert np.abs(SHAPE.third_moments).max() > 3e-3 * 225.0**3


def test_gradient_of_the_tide_by_differences():
    """The tide grows towards the planet: moving by dx changes the position of the planet by -dx."""
    r, h = 2.0e7 * DIRECTION, 1e3
    exact = tide_gradient(GM_EARTH, r)
    for k in range(3):
        step = h * np.eye(3)[k]
        difference = (tide(GM_EARTH, r - step) - tide(GM_EARTH, r + step)) / (2 * h)
        assert exact[:, :, k] == pytest.approx(difference, rel=1e-6, abs=1e-6 * np.abs(exact).max())


def test_torque_is_the_reaction_to_the_gravity_of_the_polyhedron():
    """The planet is attracted with grad U(R), so that the body feels ``-R x grad U(R)`` about its centre."""
    residual = []
    for distance in (2.5e3, 5e3, 1e4):  # beyond, the torque cancels to the rounding errors of the gravity
        r = distance * DIRECTION
        pull = SHAPE.gravity(r[None] * u.m, 2000 * u.kg / u.m**3)[1].value[0]
        exact = -np.cross(r, pull) / (G * 2000 * SHAPE.volume.value)
        two = quadrupole_torque(SECOND, tide(1.0, r))
        three = octupole_torque(SHAPE.third_moments, 1.0, r)
        size = np.linalg.norm(two)
        residual.append((np.linalg.norm(exact - two) / size, np.linalg.norm(exact - two - three) / size))
    one, both = np.array(residual).T
    # terms of relative order a/R, then (a/R)^2 are left
    assert one[:-1] / one[1:] == pytest.approx([2.0, 2.0], rel=0.05)
    assert both[:-1] / both[1:] == pytest.approx([4.0, 4.0], rel=0.1)
    assert both[-1] < 0.1 * one[-1]


def test_torque_at_the_distance_of_a_planet_is_that_of_point_masses():
    """Point masses at the nodes of a cubature of degree 3 in the tetrahedra of the shape, in long double."""
    r = (38.0e6 * DIRECTION).astype(np.longdouble)
    corners = SHAPE.vertices.value[SHAPE.facets]
    volumes = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    four = np.concatenate([np.zeros((len(corners), 1, 3)), corners], axis=1)
    centre = four.mean(axis=1, keepdims=True)
    nodes = np.concatenate([centre, 0.5 * centre * 4 / 3 + (0.5 - 1 / 6) * four], axis=1)
    weights = volumes[:, None] * np.array([-0.8, 0.45, 0.45, 0.45, 0.45])
    x = nodes.reshape(-1, 3).astype(np.longdouble)
    mass = weights.ravel().astype(np.longdouble) / np.longdouble(SHAPE.volume.value)
    apart = r - x
    pull = apart / np.sqrt((apart * apart).sum(axis=1))[:, None] ** 3 - r / np.sqrt((r * r).sum()) ** 3
    exact = np.float64(GM_EARTH) * (mass[:, None] * np.cross(x, pull)).sum(axis=0).astype(float)
    two = quadrupole_torque(SECOND, tide(GM_EARTH, r.astype(float)))
    three = octupole_torque(SHAPE.third_moments, GM_EARTH, r.astype(float))
    share = np.linalg.norm(three) / np.linalg.norm(two)
    assert 1e-7 < share < 1e-5
    assert np.linalg.norm(exact - two) / np.linalg.norm(two) == pytest.approx(share, rel=1e-3)
    assert np.linalg.norm(exact - two - three) < 1e-3 * np.linalg.norm(three)
