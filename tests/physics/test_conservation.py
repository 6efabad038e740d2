"""Conservation laws and budgets of the dynamics."""

import astropy.units as u
import numpy as np
import pytest
from scenes import (
    PILE,
    axes_of,
    carried,
    earth,
    kinetic,
    material,
    momentum,
    potential,
    simpson,
    stepped,
    tides,
)
from scipy.spatial.transform import Rotation

from flybystab.body.body import Body

DENSITY = 2000 * u.kg / u.m**3


def initial(body, attitude=None):
    """Shape and velocity gradient at the start."""
    r = np.eye(3) if attitude is None else attitude
    w = r @ body.omega
    return r @ np.diag(body.axes**2) @ r.T, np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


@pytest.mark.parametrize("axes", [(1400, 850, 750), (1000, 1000, 1000), (900, 900, 700), (1400, 800, 800)])
def test_body_in_equilibrium_stays_put(axes):
    body = Body(semi_axes=axes * u.m, density=DENSITY, spin_period=6 * u.h)
    end = 20 * 6 * 3600.0
    p = carried(body, 0.0, end)
    assert p.events == []
    assert p.regime == "rigid"
    shape, gradient = initial(body)
    np.testing.assert_allclose(axes_of(p.shape), axes, rtol=1e-14)
    np.testing.assert_allclose(p.velocity_gradient, gradient, atol=1e-9 * 2.9e-4)
    # 20 whole turns
    np.testing.assert_allclose(p.shape, shape, atol=1e-6 * axes[0] ** 2)


def test_free_tumbler_keeps_momentum_and_energy():
    body = Body(semi_axes=[1400, 850, 750] * u.m, density=DENSITY, spin=[2e-4, 1e-4, 1.5e-4] * u.rad / u.s)
    p = carried(body, 0.0, 20 * 6 * 3600.0, unyielding=True, tolerance=1e-11)
    shape, gradient = initial(body)
    np.testing.assert_allclose(
        momentum(p.shape, p.velocity_gradient), momentum(shape, gradient), rtol=0, atol=1e-9 * 300.0
    )
    assert kinetic(p.shape, p.velocity_gradient) == pytest.approx(kinetic(shape, gradient), rel=1e-9)


@pytest.mark.parametrize("dilatancy", [0.0, 1.0])
@pytest.mark.parametrize("surface", ["drucker-prager", "mohr-coulomb", "matsuoka-nakai"])
def test_collapsing_body_keeps_angular_momentum_and_mass(surface, dilatancy):
    """A body too long for its friction flows on its own: no torque, no source of mass."""
    body = Body(
        semi_axes=[1400, 850, 750] * u.m,
        density=DENSITY,
        spin=[1e-4, 0.5e-4, 3.5e-4] * u.rad / u.s,
        material=material(3.0, dilatancy=dilatancy, yield_surface=surface),
    )
    p = carried(body, 0.0, 40000.0, tolerance=1e-10, keep=20000)
    assert p.events[0][:2] == ("onset", 0.0)
    shape, gradient = initial(body)
    before = momentum(shape, gradient)
    after = momentum(p.history["shape"], p.history["velocity_gradient"])
    assert np.abs(after - before).max() < 1e-9 * np.linalg.norm(before)
    volume = np.sqrt(np.linalg.det(p.history["shape"])) / np.prod(body.axes)
    if dilatancy == 0.0:
        assert np.abs(volume - 1.0).max() < 1e-9
    else:
        assert np.all(np.diff(volume) > -1e-12)
    d = 0.5 * (gradient := p.history["velocity_gradient"]) + 0.5 * np.swapaxes(gradient, 1, 2)
    flowing = p.history["regime"] == 1
    trace = np.trace(d[flowing], axis1=1, axis2=2)
    deviator = d[flowing] - trace[:, None, None] / 3.0 * np.eye(3)
    if dilatancy == 0.0:
        assert np.abs(trace).max() < 1e-9 / body.dynamical_time
    else:
        size = np.sqrt(np.einsum("nij,nij->n", deviator, deviator))
        assert np.all(trace > 0.5 * size * np.sin(np.deg2rad(3.0)))


def lode(det):
    """Lode angle from the determinant of a unit deviator."""
    return np.arcsin(np.clip(-3.0 * np.sqrt(6.0) * det, -1.0, 1.0)) / 3.0


@pytest.mark.parametrize(
    ("surface", "dilatancy", "q"),
    [
        ("drucker-prager", 0.0, 2.0),
        ("drucker-prager", 1.0, 2.0),
        ("mohr-coulomb", 0.0, 2.1),
        ("mohr-coulomb", 0.5, 2.1),
        ("mohr-coulomb", 1.0, 2.1),
        ("matsuoka-nakai", 0.0, 2.1),
        ("matsuoka-nakai", 1.0, 2.1),
    ],
)
def test_energy_and_momentum_budget_of_a_flyby(surface, dilatancy, q):
    """Change of energy = tidal work - plastic dissipation, change of momentum = tidal torque, each regime."""
    body = PILE.with_(material=material(35, dilatancy=dilatancy, yield_surface=surface))
    e = earth(q)
    r = Rotation.from_euler("zxz", [20, 50, 10], degrees=True).as_matrix()
    p = carried(body, e.t_start, e.t_stop, e.tide, r, tolerance=1e-10, keep=50000)
    # Associative Mohr-Coulomb: the stress reaches the end of a face, and a solver that takes the face again stalls.
    assert p.reason == "done"
    h = p.history
    k = tides(e.tide, h["time"])
    flow = h["velocity_gradient"] @ h["shape"]
    power = np.einsum("nij,nij->n", k, flow)
    product = k @ h["shape"]
    torque = np.stack(
        [
            product[:, 2, 1] - product[:, 1, 2],
            product[:, 0, 2] - product[:, 2, 0],
            product[:, 1, 0] - product[:, 0, 1],
        ],
        axis=-1,
    )
    d = 0.5 * (h["velocity_gradient"] + np.swapaxes(h["velocity_gradient"], 1, 2))
    trace = np.trace(d, axis1=1, axis2=2)
    deviator = d - trace[:, None, None] / 3.0 * np.eye(3)
    size = np.sqrt(np.einsum("nij,nij->n", deviator, deviator))
    volume = 4.0 / 3.0 * np.pi * np.sqrt(np.linalg.det(h["shape"]))
    # sigma:D V over m/5; stress and rate of strain have common axes, but not the same Lode angle
    unit = deviator / np.where(size > 0.0, size, 1.0)[:, None, None]
    turn = np.where(size > 0.0, lode(np.linalg.det(unit)) - lode(h["determinant"]), 0.0)
    loss = 5.0 * volume / body.mass.value * (h["deviator"] * size * np.cos(turn) - h["pressure"] * trace)
    energy = kinetic(h["shape"], h["velocity_gradient"]) + potential(body, h["shape"])
    spin = momentum(h["shape"], h["velocity_gradient"])
    seen = set()
    edges = np.flatnonzero(np.diff(h["regime"])) + 1
    scale = np.abs(np.diff(energy)).max() + kinetic(h["shape"][0], h["velocity_gradient"][0])
    for a, b in zip([0, *edges], [*edges, len(h["time"])], strict=True):
        regime = h["regime"][a]
        samples = 4
        end = a + (b - a - 1) // samples * samples
        if end > a and np.ptp(last := np.diff(h["time"][end - samples : end + 1])) > 1e-6 * last.max():
            end -= samples  # a step cut short by the end of the regime
        if end == a:
            continue
        part, rows = {"time": h["time"][a : end + 1]}, slice(a, end + 1)
        work = simpson(part, (power - (loss if regime == 1 else 0.0))[rows], samples)
        assert energy[end] - energy[a] == pytest.approx(work, abs=2e-7 * scale), regime
        np.testing.assert_allclose(
            spin[end] - spin[a],
            simpson(part, torque[rows], samples),
            atol=2e-7 * np.linalg.norm(spin[0]),
        )
        seen.add(int(regime))
    assert {0, 1} <= seen
    if dilatancy < 1.0:
        assert np.all(loss[h["regime"] == 1] >= 0.0)
    else:  # associative and cohesionless: nothing is dissipated
        assert np.abs(loss).max() < 1e-8 * np.abs(power).max()


def test_rotating_everything_together_changes_nothing():
    e = earth(2.0)
    body = PILE
    turn = Rotation.from_rotvec([0.3, -0.7, 0.5]).as_matrix()
    from flybystab.core.ellipsoid.tide import components, tensor

    tilted = e.tide._replace(
        coefficients=np.ascontiguousarray(components(turn @ tensor(e.tide.coefficients) @ turn.T))
    )
    a = carried(body, e.t_start, e.t_stop, e.tide, tolerance=1e-10)
    b = carried(body, e.t_start, e.t_stop, tilted, turn, tolerance=1e-10)
    np.testing.assert_allclose(turn @ a.shape @ turn.T, b.shape, atol=3e-8 * 1400**2)
    np.testing.assert_allclose(turn @ a.velocity_gradient @ turn.T, b.velocity_gradient, atol=3e-8 * 3e-4)


def test_rigid_motion_runs_backwards():
    """Rigid motion is symmetric in time: the end state, reversed in a reversed tide, returns to the start."""
    e = earth(3.0)
    p = carried(PILE, e.t_start, -e.t_start, e.tide, unyielding=True, tolerance=1e-12)
    vectors = np.linalg.eigh(p.shape)[1]
    vectors = vectors[:, ::-1]
    vectors[:, 2] *= np.linalg.det(vectors)
    g = p.velocity_gradient
    spin = 0.5 * np.array([g[2, 1] - g[1, 2], g[0, 2] - g[2, 0], g[1, 0] - g[0, 1]])
    # K(t) of the hyperbola has K(-t) = M K(t) M with M a reflection of y.
    mirror = np.diag([1.0, -1.0, 1.0])
    back_vectors = mirror @ vectors @ np.diag([1.0, -1.0, 1.0])
    spin_back = -(-mirror @ spin)  # time reversal, and the reflection of an axial vector
    body = PILE.with_(spin=(back_vectors.T @ spin_back) * u.rad / u.s)
    q = carried(body, e.t_start, -e.t_start, e.tide, back_vectors, unyielding=True, tolerance=1e-12)
    shape, gradient = initial(PILE)
    np.testing.assert_allclose(mirror @ q.shape @ mirror, shape, atol=1e-8 * 1400**2)
    np.testing.assert_allclose(np.abs(q.velocity_gradient[1, 0]), gradient[1, 0], rtol=1e-8)


def test_same_dimensionless_problem_at_two_sizes():
    e = earth(2.2)
    small = PILE.with_(semi_axes=[1.4, 0.85, 0.75] * u.m)
    large = PILE.with_(semi_axes=[1400, 850, 750] * u.km)
    a = carried(small, e.t_start, e.t_stop, e.tide)
    b = carried(large, e.t_start, e.t_stop, e.tide)
    np.testing.assert_allclose(axes_of(a.shape) * 1e6, axes_of(b.shape), rtol=1e-12)
    assert a.events[1][1] == pytest.approx(b.events[1][1], abs=1e-6)


def test_stepping_keeps_angular_momentum_exactly():
    body = PILE.with_(material=material(3.0))
    shape, gradient = stepped(body, 0.0, 20000.0, 4000)
    before = momentum(*initial(body))
    np.testing.assert_allclose(momentum(shape, gradient), before, atol=1e-12 * np.linalg.norm(before))
