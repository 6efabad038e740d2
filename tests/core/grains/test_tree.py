"""Gravity by a tree against the direct sum."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flybystab.body.packing import settled_pile
from flybystab.core.grains.gravity import direct_sum, potential_at
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.tree import LEAF, opening, tree_sum


def places(kind, n, seed=1):
    """Positions (3, n) and masses: an ellipsoid, a string of clumps, or a few far grains beside one."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(3, n))
    x *= rng.uniform(size=n) ** (1 / 3) / np.linalg.norm(x, axis=0)
    if kind == "ellipsoid":
        x *= np.array([[1.3], [0.9], [0.8]])
    elif kind == "string":
        x = 0.3 * x + np.array([[2.0], [0.3], [0.0]]) * rng.integers(-4, 5, n)
    else:
        x[:, :: n // 10] *= 300.0
    turn = Rotation.from_euler("ZXZ", [0.3, 1.1, 2.0]).as_matrix()
    return np.ascontiguousarray(turn @ x), rng.uniform(0.2, 2.7, n) / n


def error(p, m, theta):
    a, b = np.empty_like(p), np.empty_like(p)
    direct_sum(p, m, a)
    tree_sum(p, m, theta, b)
    return np.sqrt(((a - b) ** 2).sum(axis=0).mean() / (a**2).sum(axis=0).mean()), b


@pytest.mark.parametrize("kind", ["ellipsoid", "string", "debris"])
@pytest.mark.parametrize("n", [1000, 4000])
@pytest.mark.parametrize("asked", [1e-5, 1e-4, 1e-3, 1e-2])
def test_the_error_is_below_the_one_asked_for(kind, n, asked):
    found, _ = error(*places(kind, n), opening(asked))
    assert found < asked
    if kind != "debris":  # whose mean is that of a few close pairs
        assert found > 1e-2 * asked  # a tree, not the direct sum


@pytest.mark.parametrize("n", [2, 3, LEAF, LEAF + 1, 100])
def test_a_closed_tree_is_the_direct_sum(n):
    found, _ = error(*places("ellipsoid", n), 1e-6)
    assert found < 1e-13


def test_the_field_of_a_distant_clump_has_its_quadrupole():
    # two equal clumps far apart: each is a leaf of the other's walk
    p, m = places("ellipsoid", 192)
    q, w = np.column_stack([p, 0.3 * p + [[20.0], [1.0], [2.0]]]), np.append(m, m)
    a, b = np.empty_like(q), np.empty_like(q)
    direct_sum(q, w, a)
    tree_sum(q, w, 0.5, b)
    true, found = a[:, 192:] @ m / m.sum(), b[:, 192:] @ m / m.sum()
    d = q[:, 192:] @ m / m.sum() - p @ m / m.sum()
    monopole = -m.sum() * d / np.linalg.norm(d) ** 3
    scale = np.linalg.norm(true)
    assert np.linalg.norm(monopole - true) > 4e-4 * scale
    assert np.linalg.norm(found - true) < 0.1 * np.linalg.norm(monopole - true)


def test_no_force_and_no_torque_is_left_over():
    p, m = places("string", 3000)
    _, a = error(p, m, 0.8)
    scale = (m * np.linalg.norm(a, axis=0)).sum()
    assert np.abs(a @ m).max() < 1e-14 * scale
    torque = (m * np.cross(p.T, a.T).T).sum(axis=1)
    assert np.abs(torque).max() < 1e-12 * scale * np.abs(p).max()


def test_lost_grains_take_no_part():
    p, m = places("ellipsoid", 500)
    _, whole = error(p, m, 0.5)
    q = np.column_stack([p[:, :200], [[1e6], [1e6], [1e6]], p[:, 200:]])
    _, more = error(q, np.insert(m, 200, 0.0), 0.5)
    np.testing.assert_array_equal(more[:, 200], 0.0)
    np.testing.assert_array_equal(np.delete(more, 200, axis=1), whole)
    single = np.ones((3, 1))
    tree_sum(single, np.ones(1), 0.5, single)
    np.testing.assert_array_equal(single, 0.0)


def test_the_potential_is_that_of_the_pairs():
    p, m = places("ellipsoid", 60)
    found = potential_at(np.array([[5.0, 1.0, 0.0], [0.0, 9.0, 2.0]]), p.T, m)
    for at, value in zip([[5.0, 1.0, 0.0], [0.0, 9.0, 2.0]], found, strict=True):
        assert value == pytest.approx(-(m / np.linalg.norm(p.T - at, axis=1)).sum(), rel=1e-13)


def test_a_pile_under_the_tree_keeps_shape_and_spin():
    from flybystab.core.grains.clumps import moments, semi_axes, spin_of

    def state(sim):
        mass, _, _, inertia, momentum = moments(sim.grains, sim.grains.mass > 0)
        return semi_axes(mass, inertia)[0], np.linalg.norm(spin_of(inertia, momentum))

    sim = settled_pile(np.array([1.5, 0.9, 1 / 1.35]), 300, 5, 0.6, 0.3)
    assert sim.tree_from > 300
    sim = Simulation(sim.grains, sim.contact, sim.pairs, tree_from=0)
    sim.add_spin(np.array([0.0, 0.0, 0.39]))
    sim.advance(2.2)
    axes, spin = state(sim)
    sim.advance(10.0)
    after, later = state(sim)
    np.testing.assert_allclose(after, axes, rtol=1e-3)
    assert later == pytest.approx(spin, rel=1e-3)
