"""Binaries in encounters: two-body motion without a tide, the impulse limit, and three bodies by rebound."""

import astropy.units as u
import numpy as np
import pytest
import rebound

import flybystab as fs
from flybystab.constants import G
from flybystab.errors import InvalidInput, UnitMismatch
from flybystab.flybys import binary as module

PRIMARY = fs.Body([500, 500, 500] * u.m, 2000 * u.kg / u.m**3, 3 * u.h)
MASS = PRIMARY.mass.to_value(u.kg)


def test_far_from_the_planet_nothing_changes():
    far = fs.Encounter.hyperbolic("earth", periapsis=2000 * fs.R_earth, v_inf=10 * u.km / u.s)
    out = fs.binary_flyby(PRIMARY, far, 1.6 * u.km, eccentricity=0.1, samples=8)
    assert np.all(out.fate == "bound")
    assert out.semi_major_axis.to_value(u.km) == pytest.approx(1.6, rel=1e-4)
    assert out.eccentricity == pytest.approx(0.1, abs=1e-3)
    assert np.all(out.closest.to_value(u.km) >= 1.6 * 0.9 * (1 - 1e-3))


def test_fast_passages_give_the_impulse_of_a_straight_line():
    """``dv = 2 GM/(b^2 V) (x, 0, -z)``: x on the line to the planet, y along the motion, z normal to both."""
    speed, q, a = 400e3, 3e7, 5000.0
    passage = fs.Encounter.hyperbolic("earth", periapsis=q * u.m, v_inf=speed * u.m / u.s)
    n = 32
    out = fs.binary_flyby(PRIMARY, passage, a * u.m, mass_ratio=0.0, samples=n, seed=5)
    rng = np.random.default_rng(5)
    frames = module._frames(None, n, rng)
    state = module._states(0.0, 2 * np.pi * rng.random(n), frames)
    unit = np.sqrt(a**3 / (G * MASS))
    x, v = state[:, :3] * a, state[:, 3:] * a / unit
    # the phase at closest approach: the orbit turned by the time from the start
    angle = -passage.t_start / unit
    perpendicular = v * unit
    x, v = (
        np.cos(angle) * x + np.sin(angle) * perpendicular,
        (np.cos(angle) * perpendicular - np.sin(angle) * x) / unit,
    )
    size = 2 * passage.planet.gm / (q**2 * speed)
    dv = size * x * np.array([1.0, 0.0, -1.0])  # periapsis frame: x to the planet, y along the motion
    energy = 0.5 * np.sum((v + dv) ** 2, axis=1) - G * MASS / a
    expected = -0.5 * G * MASS / energy
    change, predicted = out.semi_major_axis.to_value(u.m) / a - 1, expected / a - 1
    assert np.abs(predicted).max() > 0.01
    assert change == pytest.approx(predicted, abs=0.03 * np.abs(predicted).max())


def test_three_bodies_by_rebound_agree():
    """Planet, primary and companion as point masses: the difference is the tide of the next order, d/q ~ 1e-4."""
    passage = fs.Encounter.hyperbolic("earth", periapsis=12 * fs.R_earth, v_inf=8 * u.km / u.s, j2=False)
    n, a, e = 12, 1700.0, 0.05
    out = fs.binary_flyby(PRIMARY, passage, a * u.m, mass_ratio=0.02, eccentricity=e, samples=n, seed=2)
    rng = np.random.default_rng(2)
    frames = module._frames(None, n, rng)
    state = module._states(e, 2 * np.pi * rng.random(n), frames)
    mass, unit = MASS * 1.02, np.sqrt(a**3 / (G * MASS * 1.02))
    start = passage.track.states(np.array([passage.t_start]))[0]
    for k in range(n):
        d, w = state[k, :3] * a, state[k, 3:] * a / unit
        sim = rebound.Simulation()
        sim.G = G
        sim.add(m=passage.planet.gm / G)
        for share, m in ((-0.02 / 1.02, MASS), (1 / 1.02, 0.02 * MASS)):
            x, v = start[:3] + share * d, start[3:] + share * w
            sim.add(m=m, x=x[0], y=x[1], z=x[2], vx=v[0], vy=v[1], vz=v[2])
        sim.integrator = "ias15"
        sim.integrate(passage.t_stop - passage.t_start)
        p, s = sim.particles[1], sim.particles[2]
        d = np.array([s.x - p.x, s.y - p.y, s.z - p.z])
        w = np.array([s.vx - p.vx, s.vy - p.vy, s.vz - p.vz])
        energy = 0.5 * w @ w - G * mass / np.linalg.norm(d)
        assert -0.5 * G * mass / energy == pytest.approx(out.semi_major_axis[k].to_value(u.m), rel=5e-3)
        h = np.cross(d, w)
        vector = np.cross(w, h) / (G * mass) - d / np.linalg.norm(d)
        assert np.linalg.norm(vector) == pytest.approx(out.eccentricity[k], abs=5e-3)


def test_deep_passages_take_companions_away_and_distant_ones_do_not():
    odds = []
    for q in (1.6, 3.0, 8.0, 30.0):
        passage = fs.Encounter.hyperbolic("earth", periapsis=q * fs.R_earth, v_inf=10 * u.km / u.s)
        out = fs.binary_flyby(PRIMARY, passage, 1.7 * u.km, samples=64, seed=1)
        assert out.probability("bound") + out.probability("escape") + out.probability("collision") == 1.0
        odds.append(1.0 - out.probability("bound"))
        if q == 30.0:
            excited = float(np.median(out.eccentricity))
    assert odds[0] > 0.3
    assert odds == sorted(odds, reverse=True)
    assert odds[-1] == 0.0
    assert 1e-4 < excited < 0.05


def test_companions_that_touch_collide_and_stay_out_of_the_orbits():
    passage = fs.Encounter.hyperbolic("earth", periapsis=2.0 * fs.R_earth, v_inf=5 * u.km / u.s)
    out = fs.binary_flyby(PRIMARY, passage, 1.3 * u.km, samples=64, seed=3)
    hit = out.fate == "collision"
    assert hit.any()
    assert np.isnan(out.semi_major_axis[hit]).all()
    contact = 500.0 * (1 + np.cbrt(0.01))
    assert np.all(out.closest[hit].to_value(u.m) <= contact)
    assert np.all(out.closest[~hit].to_value(u.m) > contact)


def test_results_repeat_and_are_tables():
    passage = fs.Encounter.hyperbolic("earth", periapsis=20 * fs.R_earth, v_inf=10 * u.km / u.s)
    one, two = (
        fs.binary_flyby(PRIMARY, passage, 1.7 * u.km, normal=[0, 0, 1], samples=5, seed=9) for _ in "ab"
    )
    assert np.array_equal(one.eccentricity, two.eccentricity, equal_nan=True)
    assert one.to_table()["semi_major_axis"].unit == u.m
    assert one.plane_change.to_value(u.deg) == pytest.approx(0.0, abs=1e-5)  # coplanar stays coplanar


@pytest.mark.parametrize(
    ("change", "error", "expected"),
    [
        ({"semi_major_axis": 1.0}, UnitMismatch, "semi_major_axis"),
        ({"semi_major_axis": 550 * u.m}, InvalidInput, "contact"),
        ({"mass_ratio": 2.0}, InvalidInput, "mass_ratio"),
        ({"eccentricity": 1.0}, InvalidInput, "eccentricity"),
        ({"normal": [0, 0, 0]}, InvalidInput, "normal"),
        ({"normal": "up"}, InvalidInput, "normal"),
        ({"samples": 0}, InvalidInput, "samples"),
    ],
)
def test_bad_input_is_named(change, error, expected):
    passage = fs.Encounter.hyperbolic("earth", periapsis=5 * fs.R_earth, v_inf=10 * u.km / u.s)
    options = {"semi_major_axis": 1.7 * u.km} | change
    with pytest.raises(error, match=expected):
        fs.binary_flyby(PRIMARY, passage, options.pop("semi_major_axis"), **options)
