"""Encounter rates against Opik's formula, sampled positions, and passages counted by CNEOS."""

import csv
import gzip

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable
from scipy.integrate import quad

import flybystab as fs
from flybystab.constants import AU
from flybystab.errors import InvalidInput, UnitMismatch, UnknownName
from flybystab.orbit.elements import GM_SUN, state_from_elements
from flybystab.orbit.planets import Planet
from flybystab.population.rates import elements_of, smoothing

ORBIT = QTable({"a": [1.3] * u.au, "e": [0.4], "i": [10.0] * u.deg})
CIRCLE = (1.0 * u.au, 0.0, 0.0 * u.deg)
YEAR = 365.25 * 86400.0


def test_circular_planet_is_opiks_formula():
    """Opik (1951): ``p = tau^2 U/(pi sin i |U_x|)`` a revolution, lengths and speeds over those of the planet."""
    a, e, i = 1.3, 0.4, np.radians(10.0)
    p = a * (1 - e * e)
    ux2 = 2 - 1 / a - p
    u2 = 3 - 1 / a - 2 * np.sqrt(p) * np.cos(i)
    speed = np.sqrt(u2 * GM_SUN / AU)
    q = 3e7
    gm = fs.encounter_rates(ORBIT, "earth").planet.gm
    tau2 = q * (q + 2 * gm / speed**2) / AU**2
    period = 2 * np.pi * np.sqrt((a * AU) ** 3 / GM_SUN)
    expected = tau2 * np.sqrt(u2 / ux2) / (np.pi * np.sin(i)) / period * YEAR
    got = fs.encounter_rates(ORBIT, "earth", q * u.m, planet_orbit=CIRCLE)
    assert got.rate[0].to_value(1 / u.yr) == pytest.approx(expected, rel=1e-12)
    assert got.v_inf[0].to_value(u.m / u.s) == pytest.approx(speed, rel=1e-12)
    assert got.v_inf_dispersion[0].value == pytest.approx(0.0, abs=1e-3)


def sampled(rng, n, a, e, i):
    """Distance, sine of the latitude, and velocity (radial, east, north) of an orbit with uniform angles."""
    m, node, peri = rng.random((3, n)) * 2 * np.pi
    anomaly = m.copy()
    for _ in range(9):  # Newton: converged to rounding for e <= 0.5
        anomaly -= (anomaly - e * np.sin(anomaly) - m) / (1 - e * np.cos(anomaly))
    b = np.sqrt(1 - e * e)
    rate = np.sqrt(GM_SUN / a**3) / (1 - e * np.cos(anomaly))
    x, y = a * (np.cos(anomaly) - e), a * b * np.sin(anomaly)
    vx, vy = -a * np.sin(anomaly) * rate, a * b * np.cos(anomaly) * rate
    cn, sn, cw, sw, ci, si = np.cos(node), np.sin(node), np.cos(peri), np.sin(peri), np.cos(i), np.sin(i)
    p = np.array([cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si])
    w = np.array([-cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si])
    position, velocity = (x * p + y * w).T, (vx * p + vy * w).T
    r = np.linalg.norm(position, axis=1)
    up = position / r[:, None]
    east = np.column_stack([-up[:, 1], up[:, 0], np.zeros(n)])
    east /= np.linalg.norm(east, axis=1)[:, None]
    frame = np.stack([up, east, np.cross(up, east)], axis=1)
    return r, up[:, 2], np.einsum("nij,nj->ni", frame, velocity)


def test_eccentric_inclined_planet_is_what_sampled_orbits_give():
    """Longitudes are uniform: where distance and latitude agree, the density is that in both over ``2 pi r^2``."""
    rng = np.random.default_rng(4)
    planet, asteroid = (AU, 0.3, np.radians(30.0)), (1.3 * AU, 0.5, np.radians(60.0))
    dr, ds, n, parts = 0.04 * AU, 0.04, 400_000, 8
    total, squares = 0.0, 0.0
    for _ in range(parts):
        r, s, v = sampled(rng, n, *asteroid)
        r1, s1, w = sampled(rng, n, *planet)
        near = (np.abs(r - r1) < dr) & (np.abs(s - s1) < ds)
        value = np.linalg.norm(v - w, axis=1)[near] / (2 * np.pi * r[near] ** 2 * 4 * dr * ds)
        total += value.sum()
        squares += (value**2).sum()
    b = 0.01 * AU  # Mercury's focusing adds less than 1e-5 there
    expected, sigma = np.pi * b**2 * total / (parts * n), np.pi * b**2 * np.sqrt(squares) / (parts * n)
    assert sigma < 0.025 * expected
    table = QTable({"a": [1.3] * u.au, "e": [0.5], "i": [60.0] * u.deg})
    rates = fs.encounter_rates(table, "mercury", b * u.m, planet_orbit=(1 * u.au, 0.3, 30 * u.deg))
    assert rates.rate[0].to_value(1 / u.s) == pytest.approx(expected, abs=3.5 * sigma)


def test_orbits_out_of_reach_have_no_encounters():
    table = QTable({"a": [3.0, 0.5] * u.au, "e": [0.1, 0.1], "i": [5.0, 5.0] * u.deg})
    rates = fs.encounter_rates(table, "earth", 0.01 * u.au)
    assert np.all(rates.rate.value == 0.0)
    assert np.all(np.isnan(rates.v_inf.value))
    with pytest.raises(InvalidInput, match="none does"):
        rates.sample(5, seed=1)


def test_rates_grow_with_the_focused_cross_section():
    near, far = (fs.encounter_rates(ORBIT, "earth", q, planet_orbit=CIRCLE) for q in (1e7 * u.m, 1e8 * u.m))
    f = near.planet.gm / near.v_inf[0].to_value(u.m / u.s) ** 2
    expected = 1e8 * (1e8 + 2 * f) / (1e7 * (1e7 + 2 * f))
    sine = np.sin(np.radians([10.0]))  # 2e-6: mean density over discs of different size
    expected *= (smoothing(sine, 1e8 / AU) / smoothing(sine, 1e7 / AU))[0]
    assert (far.rate / near.rate)[0].value == pytest.approx(expected, rel=1e-10)


def test_sampled_encounters_follow_rate_and_cross_section():
    table = QTable({"a": [1.3, 2.0] * u.au, "e": [0.4, 0.6], "i": [10.0, 3.0] * u.deg})
    rates = fs.encounter_rates(table, "earth", 10 * fs.R_earth)
    drawn = rates.sample(20_000, seed=3)
    share = rates.rate[0] / rates.total
    assert np.mean(drawn["orbit"] == 0) == pytest.approx(share.value, abs=4 * np.sqrt(0.25 / 20_000))
    first = drawn["orbit"] == 1
    n = int(first.sum())
    error = 4 * rates.v_inf_dispersion[1].value / np.sqrt(n)
    assert drawn["v_inf"][first].value.mean() == pytest.approx(rates.v_inf[1].value, abs=error)
    # impacts among encounters: the ratio of the rates at the two distances
    surface = fs.encounter_rates(table, "earth")
    hits = np.mean(drawn["periapsis"] < (surface.periapsis))
    expected = (surface.total / rates.total).value
    assert hits == pytest.approx(expected, abs=4 * np.sqrt(expected / 20_000))
    again = rates.sample(20_000, seed=3)
    assert np.array_equal(drawn["periapsis"].value, again["periapsis"].value)


def test_orbits_and_asteroids_are_taken_too():
    apophis = fs.Asteroid.from_catalogue("Apophis")
    rates = fs.encounter_rates([apophis, apophis.orbit], "earth", 0.05 * u.au)
    assert rates.rate[0] == rates.rate[1]
    state = state_from_elements(0.7 * AU, 0.3, 0.2, 1.0, 2.0, 1e6)
    assert elements_of(state[:3], state[3:]) == pytest.approx((AU, 0.3, 0.2), rel=1e-12)


def test_any_number_of_workers_gives_the_same():
    rng = np.random.default_rng(0)
    table = QTable(
        {
            "a": rng.uniform(0.8, 3, 50_000),
            "e": rng.uniform(0.1, 0.8, 50_000),
            "i": rng.uniform(1, 30, 50_000),
        }
    )
    one, two = (fs.encounter_rates(table, "venus", workers=n) for n in (1, 2))
    assert np.array_equal(one.rate, two.rate)


def test_bad_input_is_named():
    with pytest.raises(InvalidInput, match=r"orbits\[1\].*elliptic"):
        fs.encounter_rates(QTable({"a": [1.0, 1.0], "e": [0.1, 1.2], "i": [5.0, 5.0]}), "earth")
    with pytest.raises(InvalidInput, match="columns a, e and i"):
        fs.encounter_rates(QTable({"a": [1.0]}), "earth")
    with pytest.raises(UnknownName):
        fs.encounter_rates(ORBIT, "erth")
    with pytest.raises(UnitMismatch):
        fs.encounter_rates(ORBIT, "earth", 1e7)
    with pytest.raises(InvalidInput, match="an Orbit"):
        fs.encounter_rates([1], "earth")


def read(path):
    with gzip.open(path, "rt") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def catalogue(shared):
    rows = read(shared / "nea_mpc_2026-02.csv.gz")
    column = {k: np.array([float(r[k] or "nan") for r in rows]) for k in ("a_au", "e", "i_deg", "H")}
    return QTable({"a": column["a_au"], "e": column["e"], "i": column["i_deg"]}), column["H"]


def test_passages_of_large_asteroids_are_as_many_as_cneos_counts(catalogue, shared):
    """93 passages of H < 17.75 within 0.05 au from 1950 to 2040; 94.2 from the rates of the same asteroids."""
    table, h = catalogue
    rows = read(shared / "cneos_earth_1950_2040_lt0.05au.csv.gz")
    jd = np.array([float(r["jd_tdb_rounded_min"]) for r in rows])
    size = np.array([float(r["H"]) if r["H"] not in ("", "n/a") else np.nan for r in rows])
    counted = int(np.sum(size < 17.75))
    years = np.ptp(jd) / 365.25
    expected = fs.encounter_rates(table[h < 17.75], "earth", 0.05 * u.au).total.value * years
    assert counted == pytest.approx(expected, abs=3 * np.sqrt(expected))


def test_impacts_of_kilometre_sized_asteroids(catalogue):
    """Published: one in 0.5 to 0.7 Myr for all of them; the known ones (H < 17.75) give one in 0.79 Myr."""
    table, h = catalogue
    interval = 1e-6 / fs.encounter_rates(table[h < 17.75], "earth").total.value
    assert 0.5 < interval < 1.0


def test_collisions_in_the_main_belt_have_the_published_probability():
    """Bottke et al. (1994): 2.86e-18/km2/yr, ``pi`` included, 5.3 km/s; here six large asteroids (a, e, i)."""
    belt = np.array(
        [
            [2.767, 0.078, 10.59],  # Ceres
            [2.644, 0.187, 11.75],  # Eunomia
            [2.386, 0.230, 5.52],  # Iris
            [2.922, 0.137, 3.09],  # Psyche
            [2.768, 0.164, 5.22],  # Thisbe
            [2.669, 0.257, 12.98],  # Juno
        ]
    )
    table = QTable({"a": belt[:, 0] * u.au, "e": belt[:, 1], "i": belt[:, 2] * u.deg})
    chance = np.zeros((6, 6))
    for k, (a, e, i) in enumerate(belt):
        target = Planet("asteroid", 1e-9, 1e3, 0.0, (0.0, 0.0, 1.0), 0.0, 0, a * AU)
        rates = fs.encounter_rates(table, target, 1 * u.km, planet_orbit=(a * u.au, e, i * u.deg))
        chance[k] = rates.rate.to_value(1 / u.yr)
    # each of the two may be the target: two ways through the quadrature
    assert chance == pytest.approx(chance.T, rel=0.05)
    pairs = chance[np.triu_indices(6, 1)]
    assert np.mean(pairs[pairs > 0.0]) == pytest.approx(2.86e-18, rel=0.5)  # a factor pi would be 3.1


#: A planet without attraction.
BALL = Planet("ball", gm=1.0, radius=1e7, j2=0.0, pole=(0, 0, 1), atmosphere=0.0, target=0, orbit_radius=AU)


def sampled_rate(a, e, i, reach, count):
    """Rate (1/yr) and its error by positions at random angles near a planet on a circular orbit, on the x axis.

    A position within `reach` contributes the inverse of the time in which its straight path crosses the sphere.
    """
    rng = np.random.default_rng(5)
    mean, node, peri = rng.uniform(0.0, 2.0 * np.pi, (3, count))
    anomaly = mean.copy()
    for _ in range(6):
        anomaly -= (anomaly - e * np.sin(anomaly) - mean) / (1.0 - e * np.cos(anomaly))
    x, y = a * (np.cos(anomaly) - e), a * np.sqrt(1.0 - e * e) * np.sin(anomaly)
    speed = np.sqrt(GM_SUN / a) / (1.0 - e * np.cos(anomaly))
    vx, vy = -speed * np.sin(anomaly), speed * np.sqrt(1.0 - e * e) * np.cos(anomaly)
    cw, sw, cn, sn = np.cos(peri), np.sin(peri), np.cos(node), np.sin(node)

    def turned(p, q):
        along, across = cw * p - sw * q, sw * p + cw * q
        return np.stack(
            [cn * along - sn * np.cos(i) * across, sn * along + cn * np.cos(i) * across, np.sin(i) * across]
        )

    place, velocity = turned(x, y), turned(vx, vy)
    place[0] -= AU
    velocity[1] -= np.sqrt(GM_SUN / AU)
    near = np.sum(place**2, axis=0) < reach**2
    place, velocity = place[:, near], velocity[:, near]
    u2 = np.sum(velocity**2, axis=0)
    miss2 = np.sum(place**2, axis=0) - np.sum(place * velocity, axis=0) ** 2 / u2
    weight = np.sqrt(u2) / (2.0 * np.sqrt(reach**2 - miss2)) * YEAR
    return weight.sum() / count, np.sqrt((weight**2).sum()) / count


@pytest.mark.parametrize("degrees", [0.3, 1.0, 3.0, 179.0])
def test_orbits_of_low_inclination_agree_with_sampled_positions(degrees):
    orbits = QTable({"a": [1.5] * u.au, "e": [0.45], "i": [degrees] * u.deg})
    reach = 0.05 * AU
    expected, error = sampled_rate(
        1.5 * AU, 0.45, np.radians(degrees), reach, 4_000_000 if degrees == 3.0 else 1_000_000
    )
    found = fs.encounter_rates(orbits, BALL, reach * u.m, planet_orbit=CIRCLE).total.value
    assert error < 0.05 * expected
    assert (
        abs(found - expected) < 4.0 * error + 0.03 * expected
    )  # 3 %: curvature of the orbits within 0.05 au


def test_coplanar_orbits_have_the_rate_of_the_plane():
    """In the plane: density r-dependent over 2 pi r, times the speed and the diameter of the disc."""
    a, e, reach = 1.5 * AU, 0.45, 1e9
    inside = (AU - a * (1 - e)) * (a * (1 + e) - AU)
    density = 1.0 / (np.pi * a * np.sqrt(inside)) / (2.0 * np.pi)
    h = np.sqrt(GM_SUN * a * (1.0 - e * e)) / AU
    radial2 = GM_SUN * (2.0 / AU - 1.0 / a) - h * h
    for i, sign in ((0.0, 1.0), (180.0, -1.0), (1e-4, 1.0)):
        speed = np.sqrt(radial2 + (sign * h - np.sqrt(GM_SUN / AU)) ** 2)
        orbits = QTable({"a": [a] * u.m, "e": [e], "i": [i] * u.deg})
        found = fs.encounter_rates(orbits, BALL, reach * u.m, planet_orbit=CIRCLE)
        assert found.total.value == pytest.approx(density * 2.0 * reach * speed * YEAR, rel=1e-6)
        half = found.within(0.5 * reach * u.m).total.value
        assert half == pytest.approx(0.5 * found.total.value, rel=1e-6)


def test_the_mean_density_over_a_disc_is_its_integral():
    for sin_i, width in ((0.5, 0.05), (0.06, 0.05), (0.05, 0.05), (0.04, 0.05), (1e-7, 0.05), (5.0, 0.01)):
        m = min(sin_i, width)

        def inner(angle, m=m, sin_i=sin_i, width=width):
            s = m * np.sin(angle)
            root = np.sqrt(max(sin_i**2 - s * s, 1e-300))
            return np.sqrt(max(width**2 - s * s, 0.0)) / root * m * np.cos(angle)

        mean = quad(inner, -np.pi / 2, np.pi / 2, epsabs=0.0)[0] * 2.0 / (np.pi * width) ** 2
        assert smoothing(np.array([sin_i]), width)[0] == pytest.approx(mean * np.pi * sin_i, rel=1e-6)
