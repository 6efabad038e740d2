"""Power of the stress of a flow: against the integrator, the dilation and numerical integrals."""

import inspect

import numpy as np
import pytest

from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.core.ellipsoid.tide import no_tide
from flybystab.core.energy.flow_work import LARGEST_VOLUME, gauss, gauss_up_to, growth_at, volume_at
from flybystab.core.energy.perturbation import (
    barrier,
    ellipsoid,
    loss_at,
    powers,
    rate_of_strain,
    slope_of_flow,
)
from flybystab.core.energy.potential import MASS, velocity_gradient

SLOW = np.bool_(True)
PILE = np.array([1400.0, 850.0, 750.0]) / np.cbrt(1400.0 * 850.0 * 750.0)
DIRECTIONS = {
    "extends a1": [1.0, -0.5, -0.5, 0, 0, 0],
    "compresses a1": [-1.0, 0.5, 0.5, 0, 0, 0],
    "flattens": [0.5, 0.5, -1.0, 0, 0, 0],
    "shears": [0.6, -0.1, -0.5, 0.3, -0.2, 0.4],
}


def components_of(d):
    x = np.array([(d[0] - d[1]) / 2**0.5, (d[0] + d[1] - 2 * d[2]) / 6**0.5, *(2**0.5 * np.array(d[3:]))])
    return x / np.linalg.norm(x)


def kinetic_energy(shape, gradient):
    """Of the motion without angular momentum about the centre, with the mass of the energy kernels."""
    s, l = np.asarray(shape), np.asarray(gradient)
    h = l @ s - s @ l.T
    axial = np.array([h[2, 1], h[0, 2], h[1, 0]])
    w = np.linalg.solve(np.trace(s) * np.eye(3) - s, axial)
    l = l - np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return MASS / 10.0 * np.trace(l @ s @ l.T)


DENSITY = 1.0 / (np.pi * 6.6743e-11)  # of the integrator: pi G rho is one


def initial_powers(axes, spin, phi, cohesion, dilatancy, code, x, share, longest=np.inf):
    """``P1`` of a direction, and the initial rate at which the integrator loses kinetic energy, per rate of strain.

    The perturbation is followed for a `share` of the time to rest, `longest` at most.
    """
    squares = np.square(axes)
    b = ellipsoid(*squares, spin, code, phi, cohesion, dilatancy, 0.0)
    _, trace = slope_of_flow(b, x)
    d, gradient = np.empty(6), np.empty((3, 3))
    rate_of_strain(x, trace, d)
    velocity_gradient(*squares, d, gradient)
    size = 1e-4
    start = kinetic_energy(np.diag(squares), size * gradient)
    p1 = powers(b, x)[0]
    time = min(share * 2.0 * start / (size * abs(p1)), longest)
    losses = []
    for t in (time, time / 2):
        run = integrate(
            body_state(axes, DENSITY, spin, np.eye(3), phi, cohesion * DENSITY, dilatancy, code),
            (0.0, t),
            no_tide(),
            limits=LIMITS._replace(tolerance=1e-11),
            deformation=size * gradient,
        )
        losses.append((kinetic_energy(run.shape, run.velocity_gradient) - start) / (size * t))
    # the rate falls linearly with |D|: extrapolated to the start
    return p1, 2 * losses[1] - losses[0]


@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS.keys())
@pytest.mark.parametrize("dilatancy", [0.0, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("code", range(4))
def test_first_power_is_that_of_the_dynamics_of_a_small_perturbation(code, dilatancy, direction):
    """The pile of the README at 35 deg: initial loss of kinetic energy in the full integrator, to 1e-3."""
    rate = np.sqrt(np.pi * 6.6743e-11 * 2000.0)
    spin = np.array([0.0, 0.0, 2 * np.pi / (6 * 3600.0) / rate])
    x = components_of(direction)
    p1, found = initial_powers(PILE, spin, np.deg2rad(35.0), 0.0, dilatancy, code, x, 0.02)
    assert p1 < 0.0
    assert found == pytest.approx(p1, rel=1e-3)


@pytest.mark.parametrize("dilatancy", [0.0, 0.3, 0.6, 0.9, 1.0])
@pytest.mark.parametrize("code", range(4))
def test_first_power_of_random_bodies(code, dilatancy):
    """Random shapes, friction angles and directions; spinning or tumbling, with and without cohesion."""
    rng = np.random.default_rng(0)
    for case in range(6):
        axes = -np.sort(-rng.uniform(0.3, 1.0, 3))
        spin = rng.normal(size=3) * 0.3 if case % 2 else np.array([0.0, 0.0, rng.uniform(0.0, 0.8)])
        phi, cohesion = np.deg2rad(rng.uniform(15, 45)), 0.05 * (case % 3)
        x = rng.standard_normal(5)
        p1, found = initial_powers(
            axes / np.cbrt(np.prod(axes)),
            spin,
            phi,
            cohesion,
            dilatancy,
            code,
            x / np.linalg.norm(x),
            5e-3,
            2.5e-4,
        )
        assert found == pytest.approx(p1, rel=1e-3)


def test_the_dilation_is_that_of_the_dynamics():
    assert inspect.signature(body_state).parameters["expansion"].default == LARGEST_VOLUME
    for trace in (0.2, 1.1):
        t = np.linspace(0.0, 4.0, 40_001)
        volume = np.array([volume_at(trace, q) for q in t])
        growth = np.array([growth_at(trace, v) for v in volume])
        assert np.gradient(np.log(volume), t)[1:-1] == pytest.approx(growth[1:-1], abs=5e-5)
        assert volume.max() < LARGEST_VOLUME
    assert volume[-1] == pytest.approx(LARGEST_VOLUME, rel=2e-3)
    assert volume_at(0.0, 2.0) == 1.0


def test_gauss_rule_and_its_partial_integrals():
    nodes = [gauss(i)[0] for i in range(3)]
    weights = [gauss(i)[1] for i in range(3)]
    assert np.dot(weights, np.power(nodes, 5)) == pytest.approx(1 / 6, rel=1e-14)
    values = 1.0 - 3.0 * np.array(nodes) + 5.0 * np.square(nodes)
    for i, t in enumerate(nodes):
        assert gauss_up_to(i, values) == pytest.approx(t - 1.5 * t**2 + 5 / 3 * t**3, rel=1e-13)


@pytest.mark.parametrize("code", range(4))
@pytest.mark.parametrize(("dilatancy", "cohesion"), [(0.0, 0.02), (0.4, 0.0), (1.0, 0.02)])
def test_powers_with_the_reaction_pressure_are_the_derivatives_along_the_path(code, dilatancy, cohesion):
    b = ellipsoid(1.0, 0.49, 0.25, np.array([0.1, 0.2, 0.6]), code, 0.6, cohesion, dilatancy, 0.0)
    rng = np.random.default_rng(4)
    h = 0.02
    for x in rng.standard_normal((6, 5)):
        x /= np.linalg.norm(x)
        v = np.array([loss_at(b, x, k * h, SLOW) for k in range(-4, 5)])
        first = v @ [1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280] / h
        second = v @ [-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560] / h**2
        third = v @ [-7 / 240, 3 / 10, -169 / 120, 61 / 30, 0, -61 / 30, 169 / 120, -3 / 10, 7 / 240] / h**3
        assert -np.array(powers(b, x)) == pytest.approx([first, second, third], abs=1e-4)


def test_inertia_raises_the_energy_of_a_fast_path_and_not_of_a_slow_one():
    b = ellipsoid(1.0, 0.64, 0.49, np.array([0.0, 0.0, 0.6]), 0, 0.5, 0.0, 0.0, 0.0)
    x = components_of(DIRECTIONS["extends a1"])
    for t, share in ((1e-3, 1e-3), (0.5, 0.5)):
        slow, whole = loss_at(b, x, t, SLOW), loss_at(b, x, t, np.bool_(False))
        assert 0.0 < whole / slow - 1.0 < share
    top, strain = barrier(b, x, 3.0, np.inf)
    assert top == pytest.approx(loss_at(b, x, strain, np.bool_(False)), rel=1e-6)


def test_a_jammed_flow_loses_its_energy_at_once():
    """A flat body under the compression cone, beyond phi = 36.87 deg: the pressure has no finite value."""
    b = ellipsoid(36.0, 36.0, 1.0, np.zeros(3), 0, np.deg2rad(45.0), 0.0, 0.0, 0.0)
    x = components_of([-0.5, -0.5, 1.0, 0, 0, 0])
    assert powers(b, x)[0] == -np.inf
    assert barrier(b, x, 3.0, np.inf) == (np.inf, np.inf)
