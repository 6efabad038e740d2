"""The bound on yield against the full dynamics: a body that the bound calls INTACT never yields."""

import runpy
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import YIELD_SURFACES, Material
from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import GM_EARTH, R_EARTH, G
from flybystab.core.ellipsoid.rigid_stress import demand, invariants, overload, rigid_stress
from flybystab.core.ellipsoid.tide import components
from flybystab.core.ellipsoid.yield_bound import (
    INTACT,
    NOT_IN_EQUILIBRIUM,
    UNDECIDED,
    _holds,
    quick_margins,
    tide_size,
)
from flybystab.core.material.yield_surface import slope
from flybystab.encounter.encounter import Encounter
from flybystab.screening.draws import Attitudes, draws
from flybystab.screening.encounters import close_approaches
from flybystab.screening.sample_verdicts import sample_verdicts as judged
from flybystab.screening.settings import settings

honesty = runpy.run_path(str(Path(__file__).resolve().parents[3] / "benchmarks" / "honesty.py"))


def judge(axes, rho, omega, phi, cohesion, code, size):
    n = len(rho)
    friction, verdict = np.empty((n, 2)), np.empty(n, dtype=np.int64)
    quick_margins(axes, rho, omega, phi, cohesion, code, *size, friction, verdict)
    return friction, verdict


def test_tide_size_of_a_hyperbola_in_closed_form():
    q, v = 3 * R_EARTH, 6000.0
    enc = Encounter.hyperbolic("earth", periapsis=q * u.m, v_inf=v * u.m / u.s, start_distance=40 * q * u.m)
    peak, impulse = tide_size(enc.tide, enc.t_start, -enc.t_start)
    norm = np.sqrt(6) * GM_EARTH
    assert peak == pytest.approx(norm / q**3, rel=0.01)
    # int dt/R^3 = 2 (nu + e sin nu)/(h p), nu the true anomaly at the ends
    e = 1 + q * v**2 / GM_EARTH
    p = q * (1 + e)
    nu = np.arccos((p / (40 * q) - 1) / e)
    exact = norm * 2 * (nu + e * np.sin(nu)) / (np.sqrt(GM_EARTH * p) * p)
    assert 1.0 < impulse / exact < 1.01
    assert impulse >= exact


@pytest.mark.parametrize("seed", range(3))
def test_intact_by_the_bound_never_yields(seed):
    """The same attack as `python benchmarks/honesty.py scripted`, shorter."""
    found = honesty["campaign"](seed, 12, 40)
    assert found.false == 0
    assert found.intact > 80
    assert found.used.max() <= 1.0
    assert found.used.max() > 0.9  # some bodies come as near as the bound allows


def test_samples_on_real_orbits_by_the_bound_and_by_the_dynamics():
    """Passages among all planets: Earth and Moon in 2029 and 2013, Venus, Mars; tumblers and fast rotators."""
    for name, start, stop in (
        ("Apophis", "2029-04-01", "2029-05-01"),
        ("Duende", "2013-02-01", "2013-03-01"),
        ("1998 WT24", "2040-06-01", "2044-01-01"),
    ):
        a = Asteroid.from_catalogue(name)
        wanted = settings(start, stop, ["earth", "moon", "venus", "mars"], within=0.1 * u.au)
        d = draws(a, 8, 3)
        found = close_approaches(a, wanted)
        assert found
        for p in found:
            where = Attitudes.at(a, d, 3, p.planet, p.time.jd)
            fast = judged(p, d, where, Material())
            full = judged(p, d, where, Material(), quick=False)
            assert fast.verdict == full.verdict
            size = p.close_bounds()
            assert all(b >= x for b, x in zip(p.bounds(), size, strict=True))


@pytest.mark.parametrize("code", range(len(YIELD_SURFACES)))
def test_the_bound_is_sharp_without_a_tide(code):
    """Without a tide the bound on the friction angle is the one that the body needs, on every yield surface."""
    rng = np.random.default_rng(3)
    axes, rho, omega, phi, cohesion = honesty["bodies"](200, rng)
    omega = np.linalg.norm(omega, axis=1)[:, None] * np.array([0.0, 0.0, 1.0])
    friction, verdict = judge(axes, rho, omega, phi, cohesion, code, (0.0, 0.0))
    stress = np.empty(6)
    for i in range(len(rho)):
        rigid_stress(*axes[i] ** 2, rho[i], np.pi * G * rho[i], omega[i], np.zeros(6), stress)
        need = demand(code, phi[i], cohesion[i], stress)[0]
        assert friction[i, 0] == pytest.approx(need, abs=1e-12) or need == np.inf
        if verdict[i] == INTACT:
            assert friction[i, 1] == pytest.approx(need, abs=1e-6)
        assert verdict[i] == (INTACT if need <= phi[i] else NOT_IN_EQUILIBRIUM)


@pytest.mark.parametrize("code", range(len(YIELD_SURFACES)))
def test_the_distance_of_a_stress_from_yield(code):
    """No stress within the distance that the bound allows is beyond the yield surface; just outside one is.

    The second holds where the yield function is as steep as anywhere: on cones and on Mohr-Coulomb at every stress.
    """
    rng = np.random.default_rng(code)
    phi, cohesion = np.radians(35.0), 0.1
    for _ in range(50):
        stress = rng.normal(size=(3, 3))
        stress = 0.1 * (stress + stress.T) - np.eye(3)
        p, s, det = invariants(components(stress))
        if not _holds(code, phi, cohesion, s, p, det, 0.0):
            continue
        low, high = 0.0, 10.0
        for _ in range(60):
            mid = 0.5 * (low + high)
            low, high = (mid, high) if _holds(code, phi, cohesion, s, p, det, mid) else (low, mid)
        for change in rng.normal(size=(500, 3, 3)):
            change = change + change.T
            moved = stress + low * change / np.linalg.norm(change)
            assert overload(code, phi, cohesion, components(moved)) <= 1e-12
        axes = np.linalg.eigh(stress)[1]
        if YIELD_SURFACES[code] == "mohr-coulomb":
            steepest = axes @ np.diag([np.sin(phi) - 1.0, 0.0, np.sin(phi) + 1.0]) @ axes.T
        else:
            unit = (stress + p * np.eye(3)) / s
            steepest = unit + slope(code, np.sin(phi), det) / 3.0 * np.eye(3)
        moved = stress + 1.001 * low * steepest / np.linalg.norm(steepest)
        if YIELD_SURFACES[code] != "matsuoka-nakai":
            assert overload(code, phi, cohesion, components(moved)) > 0.0


def test_prolate_bodies_are_decided_too():
    """Where two moments of inertia agree the axis is free to turn, but the stress turns with it."""
    for c in (500.0, 499.0):
        axes = np.array([[1000.0, 500.0, c]])
        sample = axes, np.array([2000.0]), np.array([[0, 0, 2.5e-4]]), np.array([0.6]), np.array([0.0])
        friction, verdict = judge(*sample, 0, (1e-10, 1e-5))
        assert verdict[0] == INTACT
        assert friction[0, 1] - friction[0, 0] < 0.02


def test_far_passages_are_decided_and_close_ones_are_not():
    axes = np.array([[1400.0, 850.0, 750.0]])
    sample = axes, np.array([2000.0]), np.array([[0, 0, 2.9e-4]]), np.array([0.6]), np.array([0.0])
    far = judge(*sample, 0, (1e-10, 1e-5))
    near = judge(*sample, 0, (3e-6, 1e-3))
    assert far[1][0] == INTACT
    assert near[1][0] == UNDECIDED
    assert near[0][0, 1] > far[0][0, 1]
