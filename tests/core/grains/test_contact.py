"""Two spheres: restitution, sliding, rolling, twisting and cohesion against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.state import Grains, contact_parameters


def pair(distance=2.0, v=(0.0, 0.0, 0.0), w=(0.0, 0.0, 0.0), mass=(1.0, 1.0), radius=(1.0, 1.0), **law):
    """Sphere 0 at the origin, sphere 1 at `distance` radii along x with velocity and spin."""
    x = np.array([[0.0, 0.0, 0.0], [distance, 0.0, 0.0]])
    g = Grains(
        x, np.array([[0.0] * 3, v], float), np.array([[0.0] * 3, w], float), np.array(radius), np.array(mass)
    )
    options = {"mu_s": 0.5, "beta": 0.0, "pressure": 1.0, "overlap": 1e-3, **law}
    return Simulation.of(g, contact_parameters(1.0, **options))


@pytest.mark.parametrize("e", [0.1, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("masses", [(1.0, 1.0), (1.0, 20.0)])
def test_restitution_is_as_asked(e, masses):
    # a contact begins and ends between two steps: 15 steps leave a few per cent, which fall with the step
    for steps, error in ((15.0, 0.05), (150.0, 0.005)):
        sim = pair(2.001, (-0.01, 0.0, 0.0), mass=masses, restitution=e)
        sim = replace(sim, steps_per_contact=steps)
        sim.advance(0.4, gravity=False)
        after = sim.grains.v[1, 0] - sim.grains.v[0, 0]
        assert after / 0.01 == pytest.approx(e, abs=error)
        assert masses @ sim.grains.v[:, 0] == pytest.approx(-0.01 * masses[1], rel=1e-12)


@pytest.mark.parametrize("spin", [0.02, 0.05])
def test_a_sliding_sphere_comes_to_roll(spin):
    # A sphere held by a load N on one of nearly infinite mass slides at first: r w falls at 5/2 mu N/m and the speed
    # of the centre rises at mu N/m until they are equal, at w = 2/7 of the initial spin.
    mu, load = 0.1, 0.05
    sim = pair(2.0, w=(0.0, 0.0, spin), mass=(1e9, 1.0), mu_s=mu)
    sim.grains.x[1, 0] -= load / sim.contact.k_n
    field = np.array([load, 1.0, 1.0, 1.0])
    until = spin / (3.5 * mu * load)
    sim.advance(0.5 * until, gravity=False, pull=field)
    assert sim.grains.w[1, 2] == pytest.approx(spin * (1.0 - 2.5 / 7.0), rel=0.01)
    sim.advance(until, gravity=False, pull=field)
    assert sim.grains.w[1, 2] == pytest.approx(2.0 / 7.0 * spin, rel=0.01)
    assert abs(sim.grains.v[1, 1]) == pytest.approx(2.0 / 7.0 * spin, rel=0.01)


@pytest.mark.parametrize("beta", [0.2, 0.5])
def test_rolling_friction_stops_a_roll(beta):
    # Two equal spheres pressed together turn against each other like gears, without slip: only the rolling moment
    # mu_r beta R N brakes them, and they stop after w I/(mu_r beta R N).
    load, w, mu_r = 0.05, 0.05, 0.4
    sim = pair(2.0, beta=beta, mu_r=mu_r)
    sim.grains.x[:, 0] += np.array([-1.0, -1.0]) + load / sim.contact.k_n * np.array([0.5, -0.5])
    sim.grains.w[:, 2] = w, -w
    sim.s[:] = sim.grains.w
    field = np.array([load, 1.0, 0.0, 0.0])
    stop = w * 0.4 / (mu_r * beta * 0.5 * load)
    sim.advance(0.5 * stop, gravity=False, pull=field)
    np.testing.assert_allclose(sim.grains.w[:, 2], [0.5 * w, -0.5 * w], rtol=0.01)
    sim.advance(0.6 * stop, gravity=False, pull=field)
    assert np.abs(sim.grains.w).max() < 0.01 * w
    assert np.abs(sim.grains.v).max() < 1e-6


@pytest.mark.parametrize(("share", "stays"), [(0.9, True), (1.1, False)])
def test_cohesion_holds_up_to_its_force(share, stays):
    # attraction c (2 beta R)^2: two spheres part when pulled harder than that
    sim = pair(2.0, beta=0.5, cohesion=1.0)
    area = (2.0 * 0.5 * 0.5) ** 2
    sim.grains.x[:, 0] += np.array([-1.0, -1.0]) + area / sim.contact.k_n * np.array([0.5, -0.5])
    # opposite pulls by a tide along x, m K_xx at x = 1, that grows slowly enough not to shake
    end, ramp = 20.0, np.zeros((1, 2, 6))
    ramp[0, :, 0] = 0.5 * share * area
    sim.tide = TidePanels(1e9, 0.0, end / 1e9, ramp)
    sim.advance(0.999 * end, gravity=False)
    assert (sim.grains.x[1, 0] - sim.grains.x[0, 0] < 2.0) == stays


def test_a_twist_is_resisted():
    sim = pair(2.0, beta=0.5, mu_s=0.5, mass=(1e9, 1.0), w=(1e-3, 0, 0), restitution=0.3)
    sim.grains.x[1, 0] -= 1e-4
    sim.advance(40.0, gravity=False, pull=np.array([sim.contact.k_n * 1e-4, 1.0, 0, 0]))
    assert abs(sim.grains.w[1, 0]) < 2e-6
    ideal = pair(2.0, beta=0.0, mu_s=0.5, mass=(1e9, 1.0), w=(1e-3, 0, 0), restitution=0.3)
    ideal.grains.x[1, 0] -= 1e-4
    ideal.advance(40.0, gravity=False, pull=np.array([ideal.contact.k_n * 1e-4, 1.0, 0, 0]))
    assert ideal.grains.w[1, 0] == pytest.approx(1e-3, rel=1e-9)
