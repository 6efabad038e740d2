"""Many grains: conservation, budgets, repeatability, neighbour lists."""

import numpy as np
import pytest

from flybystab.body.packing import settled_pile
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.grains.gravity import direct_sum
from flybystab.core.grains.neighbours import empty_pairs, find_pairs
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.state import Grains, contact_parameters


def cloud(n=60, seed=3, speed=0.6, **law):
    """Spheres without contact that fall and collide, with random velocities and spins; no net momentum."""
    rng = np.random.default_rng(seed)
    radius = rng.uniform(0.08, 0.16, n)
    x = []
    for r in radius:
        while True:
            p = rng.uniform(-1.0, 1.0, 3)
            if p @ p < 1 and all(np.linalg.norm(p - q) > r + s for q, s in zip(x, radius, strict=False)):
                x.append(p)
                break
    mass = radius**3 / (radius**3).sum()
    v, w = speed * rng.normal(size=(n, 3)), speed * rng.normal(size=(n, 3))
    g = Grains(np.array(x), v, w, radius, mass)
    options = {"mu_s": 0.5, "beta": 0.3, **law}
    sim = Simulation.of(g, contact_parameters(0.12, **options), gravity_interval=0.0)
    sim.centre()
    return sim


def angular_momentum(g):
    spin = 0.4 * g.mass * g.radius**2
    # positions and velocities are half a step apart; x x v does not change in a drift
    return g.mass @ np.cross(g.x, g.v) + spin @ g.w


def test_momentum_and_angular_momentum_keep():
    sim = cloud()
    before = angular_momentum(sim.grains)
    sim.advance(3.0)
    assert sim.pairs.touching.sum() > 60  # they did meet
    assert np.abs(sim.grains.mass @ sim.grains.v).max() < 1e-14
    assert np.abs(angular_momentum(sim.grains) - before).max() < 1e-12 * np.abs(before).max() + 1e-13


def test_gravity_of_intervals_keeps_angular_momentum():
    sim = cloud()
    sim.gravity_interval = Simulation.gravity_interval
    before = angular_momentum(sim.grains)
    sim.advance(3.0)
    assert np.abs(angular_momentum(sim.grains) - before).max() < 1e-4 * np.abs(before).max()


@pytest.mark.parametrize("law", [{}, {"restitution": 1.0, "mu_s": 1e9, "mu_r": 1e9}])
def test_energy_and_what_is_dissipated_add_up(law):
    errors = []
    for steps in (30.0, 60.0):
        sim = cloud(**law)
        sim = Simulation.of(
            sim.grains, sim.contact, gravity_interval=0.0, steps_per_contact=steps, ledger=np.zeros(2)
        )
        before = sim.kinetic_energy() + sim.potential_energy()
        sim.advance(2.0)
        after = sim.kinetic_energy() + sim.potential_energy() + sim.ledger[0]
        lost = sim.ledger[1]
        errors.append(abs(after + lost - before))
        assert errors[-1] < 0.01 * (sim.kinetic_energy() + lost)
        if not law:
            assert lost > 0.3 * (before - sim.potential_energy())
    assert errors[1] < 0.75 * errors[0] or errors[1] < 1e-3


def test_a_repeated_run_is_the_same_to_the_last_bit():
    runs = []
    for _ in range(2):
        sim = cloud()
        sim.advance(1.0)
        runs.append(np.concatenate([sim.grains.x.ravel(), sim.grains.w.ravel(), sim.pairs.spring.ravel()]))
    np.testing.assert_array_equal(*runs)


def test_the_neighbour_list_has_every_near_pair():
    rng = np.random.default_rng(0)
    x = rng.uniform(-50, 50, (400, 3)) * np.array([1.0, 0.02, 0.02])
    g = Grains(x, 0 * x, 0 * x, rng.uniform(0.2, 0.6, 400), np.ones(400))
    g.mass[7] = 0.0
    pairs = empty_pairs(400)
    assert find_pairs(g, 0.3, 0.1, pairs)
    found = {(i, int(j)) for i in range(400) for j in pairs.other[pairs.first[i] : pairs.first[i + 1]]}
    gap = np.linalg.norm(x[:, None] - x, axis=2) - g.radius[:, None] - g.radius
    expected = {(i, j) for i, j in np.argwhere(gap < 0.1) if i < j and 7 not in (i, j)}
    assert found == expected
    assert len(found) > 400
    assert not find_pairs(g, 0.3, 0.1, empty_pairs(400, per_grain=1))


def test_results_do_not_depend_on_the_skin():
    # the list is only an index of contacts: with a larger skin the order of sums changes, nothing else
    ends = []
    for skin in (0.15, 0.6):
        sim = cloud()
        sim = Simulation.of(sim.grains, sim.contact, gravity_interval=0.0, skin=skin)
        sim.advance(0.4)
        ends.append(sim.grains.x)
    np.testing.assert_allclose(*ends, atol=1e-9)


def test_gravity_is_the_sum_over_pairs():
    rng = np.random.default_rng(1)
    x, m = rng.normal(size=(3, 50)), rng.uniform(0.5, 2.0, 50)
    out = np.empty((3, 50))
    direct_sum(x, m, out)
    for i in (0, 17, 49):
        d = np.delete(x - x[:, [i]], i, axis=1)
        expected = (np.delete(m, i) * d / np.linalg.norm(d, axis=0) ** 3).sum(axis=1)
        np.testing.assert_allclose(out[:, i], expected, rtol=1e-13)


def test_free_grains_follow_the_tide():
    # x'' = K x with constant K: cosh along x, cos along y and z
    x = np.array([[1.0, 2.0, 3.0], [-5.0, 1.0, 0.5]])
    g = Grains(x.copy(), 0 * x, 0 * x, np.full(2, 0.1), np.full(2, 0.5))
    sim = Simulation.of(g, contact_parameters(0.1, mu_s=0.5, beta=0.3))
    k = np.array([2.0, -1.0, -1.0, 0.0, 0.0, 0.0])
    coefficients = np.zeros((1, 2, 6))
    coefficients[0, 0] = k
    sim.tide = TidePanels(1e3, 0.0, 1.0, coefficients)
    sim.advance(1.0, gravity=False)
    t = sim.time
    # velocities start at the time of the positions, not half a step before: an error of first order in the step
    factor = [np.cosh(np.sqrt(2) * t), np.cos(t), np.cos(t)]
    np.testing.assert_allclose(sim.grains.x, x * factor, rtol=3 * sim.dt)


@pytest.fixture(scope="module")
def pile():
    return settled_pile(np.array([1.5, 0.9, 1 / 1.35]), 200, 5, 0.6, 0.3)


def test_a_pile_left_alone_keeps_shape_and_spin(pile):
    from flybystab.core.grains.clumps import moments, semi_axes, spin_of

    w = np.array([0.0, 0.0, 0.39])
    pile.add_spin(w)
    pile.advance(2.2)
    states = []
    for _ in range(2):
        mass, _, _, inertia, momentum = moments(pile.grains, pile.grains.mass > 0)
        states.append((semi_axes(mass, inertia)[0], spin_of(inertia, momentum)))
        if len(states) == 1:
            pile.advance(32.3)  # 12 h at 2000 kg/m3
    (axes, spin), (axes_after, spin_after) = states
    np.testing.assert_allclose(axes_after, axes, rtol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(spin_after), np.linalg.norm(spin), rtol=1e-3)
