"""The quick margin against full dynamics: what it calls INTACT never yields."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.constants import GM_EARTH, R_EARTH, G
from flybystab.core.passage import passage
from flybystab.core.statics import demand, rigid_stress
from flybystab.sky.encounter import Encounter
from flybystab.survey.attitude import attitude_matrix, isotropic_direction
from flybystab.survey.quick import INTACT, NOT_IN_EQUILIBRIUM, UNDECIDED, quick_margins, tide_size


def judge(axes, rho, omega, phi, cohesion, code, size):
    n = len(rho)
    friction, verdict = np.empty((n, 2)), np.empty(n, dtype=np.int64)
    quick_margins(axes, rho, omega, phi, cohesion, code, *size, friction, verdict)
    return friction, verdict


def bodies(n, rng):
    a = 10 ** rng.uniform(1.5, 3.5, n)
    ratios = np.sort(rng.uniform(0.35, 1.0, (n, 2)), axis=1)[:, ::-1]
    ratios[::3, 1] = ratios[::3, 0] * rng.choice([1.0, 0.999], len(ratios[::3]))  # prolate, or nearly
    axes = a[:, None] * np.column_stack([np.ones(n), ratios])
    rho = rng.uniform(1200, 3000, n)
    rate = np.sqrt(np.pi * G * rho) * rng.uniform(0.0, 0.9, n)
    wobble = rng.normal(size=(n, 3)) * rng.choice([0.0, 0.1, 1.0], size=(n, 1)) + [0, 0, 1]
    omega = rate[:, None] * wobble / np.linalg.norm(wobble, axis=1)[:, None]
    phi = np.radians(rng.uniform(15, 50, n))
    cohesion = rng.choice([0.0, 30.0], n)
    return axes, rho, omega, phi, cohesion


def test_tide_size_of_a_hyperbola_in_closed_form():
    q, v = 3 * R_EARTH, 6000.0
    enc = Encounter.hyperbolic("earth", periapsis=q * u.m, v_inf=v * u.m / u.s, start_distance=40 * q * u.m)
    peak, impulse, start = tide_size(enc.tide, enc.t_start, -enc.t_start)
    norm = np.sqrt(6) * GM_EARTH
    assert peak == pytest.approx(norm / q**3, rel=0.01)
    assert start == pytest.approx(norm / (40 * q) ** 3, rel=0.01)
    # int dt/R^3 = 2 (nu + e sin nu)/(h p), nu the true anomaly at the ends
    e = 1 + q * v**2 / GM_EARTH
    p = q * (1 + e)
    nu = np.arccos((p / (40 * q) - 1) / e)
    exact = norm * 2 * (nu + e * np.sin(nu)) / (np.sqrt(GM_EARTH * p) * p)
    assert 1.0 < impulse / exact < 1.01
    assert impulse >= exact


@pytest.mark.parametrize("code", range(4))
def test_intact_by_the_bound_never_yields(code):
    rng = np.random.default_rng(code)
    checked = 0
    for q in (2.5, 4.0, 8.0, 30.0):
        start = max(10, 3 * q) * R_EARTH * u.m
        enc = Encounter.hyperbolic(
            "earth", periapsis=q * R_EARTH * u.m, v_inf=6 * u.km / u.s, start_distance=start
        )
        sample = bodies(60, rng)
        friction, verdict = judge(*sample, code, tide_size(enc.tide, enc.t_start, enc.t_stop))
        for i in np.flatnonzero(verdict != UNDECIDED)[:25]:
            axes, rho, omega, phi, cohesion = (x[i] for x in sample)
            turn = attitude_matrix(rng.normal(size=3), isotropic_direction(rng.uniform(size=2)), 1.0)
            span = enc.t_start, enc.t_stop, enc.tide
            material = {"phi": phi, "cohesion": cohesion, "surface": code}
            run = passage(axes, rho, omega, turn, *span, **material)
            yielded = any(name == "onset" for name, _, _ in run.events)
            assert yielded == (verdict[i] == NOT_IN_EQUILIBRIUM)
            if verdict[i] == INTACT and cohesion == 0.0:
                rigid = passage(axes, rho, omega, turn, *span, unyielding=True, **material)
                assert rigid.max_friction <= friction[i, 1] + 1e-9
                assert friction[i, 1] <= phi + 1e-6
            checked += 1
    assert checked > 30


def test_the_bound_is_sharp_without_a_tide():
    rng = np.random.default_rng(3)
    axes, rho, omega, phi, cohesion = bodies(200, rng)
    omega = np.linalg.norm(omega, axis=1)[:, None] * np.array([0.0, 0.0, 1.0])
    friction, verdict = judge(axes, rho, omega, phi, cohesion, 1, (0.0, 0.0, 0.0))
    stress = np.empty(6)
    for i in range(len(rho)):
        rigid_stress(*axes[i] ** 2, rho[i], np.pi * G * rho[i], omega[i], np.zeros(6), stress)
        need = demand(1, phi[i], cohesion[i], stress)[0]
        assert friction[i, 0] == pytest.approx(need, abs=1e-12) or need == np.inf
        if np.isfinite(need):  # the extension cone is its own least slope
            assert friction[i, 1] == pytest.approx(need, abs=1e-6)
        assert verdict[i] == (INTACT if need <= phi[i] else NOT_IN_EQUILIBRIUM)


def test_prolate_bodies_are_decided_too():
    """Where two moments of inertia agree the axis is free to turn, but the stress turns with it."""
    for c in (500.0, 499.0):
        axes = np.array([[1000.0, 500.0, c]])
        sample = axes, np.array([2000.0]), np.array([[0, 0, 2.5e-4]]), np.array([0.6]), np.array([0.0])
        friction, verdict = judge(*sample, 0, (1e-10, 1e-5, 1e-10))
        assert verdict[0] == INTACT
        assert friction[0, 1] - friction[0, 0] < 0.02


def test_far_passages_are_decided_and_close_ones_are_not():
    axes = np.array([[1400.0, 850.0, 750.0]])
    sample = axes, np.array([2000.0]), np.array([[0, 0, 2.9e-4]]), np.array([0.6]), np.array([0.0])
    far = judge(*sample, 0, (1e-10, 1e-5, 1e-10))
    near = judge(*sample, 0, (3e-6, 1e-3, 1e-8))
    assert far[1][0] == INTACT
    assert near[1][0] == UNDECIDED
    assert near[0][0, 1] > far[0][0, 1]
