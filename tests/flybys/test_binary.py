"""Binaries in encounters: two-body motion without a tide, the impulse limit, and three bodies by rebound."""

import astropy.units as u
import numpy as np
import pytest
import rebound
from scipy.integrate import solve_ivp

import flybystab as fs
from flybystab.constants import G
from flybystab.errors import InvalidInput, UnitMismatch
from flybystab.flybys import binary as module
from flybystab.flybys import binary_figures as figures

PRIMARY = fs.Body([500, 500, 500] * u.m, 2000 * u.kg / u.m**3, 3 * u.h)
MASS = PRIMARY.mass.to_value(u.kg)


def test_far_from_the_planet_nothing_changes():
    far = fs.Encounter.hyperbolic("earth", periapsis=2000 * fs.R_earth, v_inf=10 * u.km / u.s)
    out = fs.binary_flyby(PRIMARY, far, 1.6 * u.km, eccentricity=0.1, samples=8)
    assert np.all(out.fate == "bound")
    assert out.semi_major_axis.to_value(u.km) == pytest.approx(1.6, rel=1e-4)
    assert out.eccentricity == pytest.approx(0.1, abs=1e-3)
    assert np.all(out.closest.to_value(u.km) >= 1.6 * 0.9 * (1 - 1e-3))


@pytest.mark.parametrize("e", [0.0, 1e-9, 0.3, 0.95])
def test_the_states_before_the_encounter_obey_the_equation_of_kepler(e):
    rng = np.random.default_rng(3)
    mean_anomaly = 2.0 * np.pi * rng.random(200)
    frames = module._frames(None, 200, rng)
    state = module._states(e, mean_anomaly, frames)
    x, v = (np.einsum("nji,nj->ni", frames, part) for part in (state[:, :3], state[:, 3:]))
    anomaly = np.arctan2(x[:, 1] / np.sqrt(1.0 - e * e), x[:, 0] + e)  # eccentric
    turn = anomaly - e * np.sin(anomaly) - mean_anomaly
    assert np.abs(np.angle(np.exp(1j * turn))).max() < 1e-13
    assert 0.5 * np.sum(v * v, axis=1) - 1.0 / np.linalg.norm(x, axis=1) == pytest.approx(-0.5, abs=1e-12)
    momentum = np.cross(x, v)
    assert momentum[:, 2] == pytest.approx(np.sqrt(1.0 - e * e), rel=1e-12)
    assert np.abs(x[:, 2]).max() < 1e-14


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
        ({"companion": 5}, InvalidInput, "companion"),
        ({"companion": PRIMARY, "mass_ratio": 0.1}, InvalidInput, "mass_ratio"),
    ],
)
def test_bad_input_is_named(change, error, expected):
    passage = fs.Encounter.hyperbolic("earth", periapsis=5 * fs.R_earth, v_inf=10 * u.km / u.s)
    options = {"semi_major_axis": 1.7 * u.km} | change
    with pytest.raises(error, match=expected):
        fs.binary_flyby(PRIMARY, passage, options.pop("semi_major_axis"), **options)


COMPANION = fs.Body([150, 110, 90] * u.m, 2000 * u.kg / u.m**3, 20 * u.h)
OBLATE = fs.Body([540, 520, 450] * u.m, 2000 * u.kg / u.m**3, 3 * u.h)
NO_TIDE = np.zeros((3, 3))


def start(eccentricity=0.05, n=3, seed=4):
    """States with the figures of the two bodies, ``a = G m = 1``, and the figures."""
    rng = np.random.default_rng(seed)
    frames = module._frames(None, n, rng)
    state = module._states(eccentricity, 2 * np.pi * rng.random(n), frames)
    second = COMPANION.axes**2 / 5.0 / 1700.0**2
    made = figures.Figures(figures.averaged(OBLATE.axes / 1700.0, frames[:, :, 2]), second, 0.97)
    y = np.concatenate([state, *figures.synchronous(frames, state, 1.0)], axis=1)
    return y, made, frames


def followed(y, made, time, tide=NO_TIDE):
    found = solve_ivp(
        lambda _, z: figures.rates(z.reshape(y.shape), tide, made).ravel(),
        (0.0, time),
        y.ravel(),
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
    )
    return found.y[:, -1].reshape(y.shape)


def test_energy_and_angular_momentum_of_two_figures_are_kept():
    """A tilted, tumbling companion and an oblate primary, without a planet; over the reduced mass."""
    y, made, _ = start()
    y[:, 10:] = [0.3, -0.4, 1.1]
    turned = figures.rotation_matrices(y[:, 6:10])
    moments = made.companion.sum() - made.companion

    def energy(z):
        x, v = z[:, :3], z[:, 3:6]
        own = figures.rotation_matrices(z[:, 6:10])
        both = made.primary + np.einsum("nij,j,nkj->nik", own, made.companion, own)
        r = np.linalg.norm(x, axis=1)
        q = 3 * np.einsum("ni,nij,nj->n", x, both, x) - r**2 * np.trace(both, axis1=1, axis2=2)
        spin = 0.5 * np.sum(moments * z[:, 10:] ** 2, axis=1) / made.mass_fraction  # m2/mu = 1/mass_fraction
        return 0.5 * np.sum(v * v, axis=1) - 1 / r - q / (2 * r**5) + spin

    def momentum(z):
        own = figures.rotation_matrices(z[:, 6:10])
        spin = np.einsum("nij,nj->ni", own, moments * z[:, 10:]) / made.mass_fraction
        return np.cross(z[:, :3], z[:, 3:6]) + spin

    last = followed(y, made, 60.0)
    assert energy(last) == pytest.approx(energy(y), rel=1e-10)
    assert np.abs(last[:, 3:6] - y[:, 3:6]).max() > 0.1
    # the pole of the primary is held: with a point mass as primary the total is kept, too
    point = made._replace(primary=np.zeros_like(made.primary))
    last = followed(y, point, 60.0)
    assert momentum(last) == pytest.approx(momentum(y), abs=1e-10)
    assert np.abs(figures.rotation_matrices(last[:, 6:10]) - turned).max() > 0.1


def test_the_pericentre_of_an_oblate_primary_precesses():
    """In its equator by ``3 J2 (R/p)^2 n/2`` to first order, with ``J2 R^2 = S_equator - S_pole``."""
    y, made, frames = start(eccentricity=0.1, n=1)
    round_body = made._replace(companion=np.full(3, 1e-3), primary=1e-2 * made.primary)
    j2 = 1e-2 * (OBLATE.axes[0] ** 2 + OBLATE.axes[1] ** 2 - 2 * OBLATE.axes[2] ** 2) / 10 / 1700.0**2
    time = 2 * np.pi * 50
    last = followed(y, round_body, time)

    def longitude(z):
        x, v = z[0, :3], z[0, 3:6]
        vector = np.cross(v, np.cross(x, v)) - x / np.linalg.norm(x)
        return np.arctan2(vector @ frames[0, :, 1], vector @ frames[0, :, 0])

    expected = 1.5 * j2 / (1 - 0.1**2) ** 2 * time
    assert longitude(last) - longitude(y) == pytest.approx(expected, rel=0.02)


def test_a_synchronous_companion_librates_at_the_known_frequency():
    """``n sqrt(3 (B - A)/C)`` on a circular orbit (Murray & Dermott 1999, 5.60) for a light companion."""
    y, made, _ = start(eccentricity=0.0, n=1)
    small = made._replace(
        companion=1e-6 * made.companion, primary=np.zeros_like(made.primary), mass_fraction=1.0
    )
    moments = small.companion.sum() - small.companion
    frequency = np.sqrt(3 * (moments[1] - moments[0]) / moments[2])
    y[:, 12] += 1e-4  # set in motion from its equilibrium
    quarter = followed(y, small, 0.5 * np.pi / frequency)
    assert quarter[0, 12] == pytest.approx(1.0, abs=2e-6)  # the angle is greatest, the rate that of the orbit
    half = followed(y, small, np.pi / frequency)
    assert half[0, 12] - 1.0 == pytest.approx(-1e-4, rel=1e-3)


def test_a_sphere_as_companion_is_a_point_mass():
    passage = fs.Encounter.hyperbolic("earth", periapsis=6 * fs.R_earth, v_inf=10 * u.km / u.s)
    ball = fs.Body([100, 100, 100] * u.m, 2000 * u.kg / u.m**3, 20 * u.h)
    options = {"samples": 6, "seed": 2}
    plain = fs.binary_flyby(PRIMARY, passage, 1.7 * u.km, mass_ratio=0.2**3, **options)
    figured = fs.binary_flyby(PRIMARY, passage, 1.7 * u.km, companion=ball, oblate=True, **options)
    assert figured.semi_major_axis.value == pytest.approx(plain.semi_major_axis.value, rel=1e-6)
    # nothing turns a sphere
    assert figured.spin_ratio == pytest.approx(1.0, abs=1e-9)
    assert figured.obliquity.to_value(u.deg) == pytest.approx(figured.plane_change.to_value(u.deg), abs=1e-5)
    assert np.isnan(plain.spin_ratio).all()


def test_encounters_excite_the_spin_of_the_companion():
    wobble, change = [], []
    for q in (5.0, 10.0, 40.0):
        passage = fs.Encounter.hyperbolic("earth", periapsis=q * fs.R_earth, v_inf=10 * u.km / u.s)
        out = fs.binary_flyby(
            OBLATE, passage, 1.9 * u.km, companion=COMPANION, oblate=True, samples=12, seed=1
        )
        whole = out.fate == "bound"
        wobble.append(float(np.median(out.wobble[whole].to_value(u.deg))))
        change.append(float(np.median(np.abs(out.spin_ratio[whole] - 1))))
    assert wobble[0] > wobble[1] > wobble[2]
    assert change[0] > change[2]
    assert wobble[0] > 5.0
    assert wobble[2] < 1.0
