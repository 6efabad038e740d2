"""Non-gravitational laws and zonal harmonics against closed forms; comet 67P at Jupiter against JPL."""

import json
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from numpy.polynomial import legendre
from reference import need_ephemeris

import flybystab as fs
from flybystab.constants import AU, DAY
from flybystab.errors import FlybystabError, InvalidInput, UnknownName
from flybystab.orbit.covariance import Covariance
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.forces import FORCES, NonGravitational, acceleration, model, zonal
from flybystab.orbit.kepler import two_body
from flybystab.orbit.nongravitational import RADIATION_PRESSURE
from flybystab.orbit.planets import PLANETS
from flybystab.orbit.predictability import deviations_of
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.neighbours import spread

EPOCH = Time("2020-01-01", scale="tdb")
CASE = Path(__file__).parents[1] / "cases" / "files" / "67P.json"
EARTH = PLANETS["earth"]


def push_at(law, r, v):
    """The non-gravitational acceleration (m/s2) alone, from the compiled sum of forces."""
    window = ephemeris("de421").window(EPOCH, -10.0, 10.0)
    sun = window.states(0, np.zeros(1))[0]
    one, two = np.empty(3), np.empty(3)
    acceleration(
        model(window, ["sun point mass", "non-gravitational"], law), 0.0, sun[:3] + r, sun[3:] + v, one
    )
    acceleration(model(window, ["sun point mass"]), 0.0, sun[:3] + r, sun[3:] + v, two)
    return one - two


R, V = np.array([1.3 * AU, 0.4 * AU, -0.2 * AU]), np.array([-9e3, 2.4e4, 3e3])


@pytest.mark.parametrize("n", [2, 3, 4])
def test_zonal_accelerations_are_gradients_of_their_potentials(n):
    strength = 1e-3 * EARTH.gm * EARTH.radius**n
    pole = np.array([0.36, -0.48, 0.8])

    def potential(x):
        d = np.linalg.norm(x)
        return -strength / d ** (n + 1) * legendre.legval(x @ pole / d, np.eye(n + 1)[n])

    x = np.array([5e6, 6e6, -4e6])
    steps = 10.0 * np.eye(3)
    gradient = np.array([(potential(x + h) - potential(x - h)) / 20.0 for h in steps])
    out = np.zeros(3)
    t, rate = 3e8, np.array([2e-11, 1e-11, -3e-12])
    zonal(*(strength * (n == k) for k in (2, 3, 4)), np.concatenate([pole - t * rate, rate]), t, x, out)
    np.testing.assert_allclose(out, gradient, rtol=1e-8, atol=1e-9 * np.linalg.norm(gradient))


def test_five_constants_are_the_law_of_that_name():
    words = "0.1112620426 2.808 2.15 5.093 4.6142"
    a = (1e-9, -2e-9, 3e-9)
    np.testing.assert_allclose(
        push_at(NonGravitational(a, words), R, V), push_at(NonGravitational(a, "comet"), R, V), rtol=1e-14
    )
    one = fs.Orbit.from_state(
        EPOCH, R * u.m, V * u.m / u.s, A1=1e-9 * u.m / u.s**2, law=(1.0, 1.0, 3.0, 0.0, 0.0)
    )
    r = np.linalg.norm(R)
    # alone, and the radial part of a law that falls as 1/r^3
    np.testing.assert_allclose(push_at(one.nongrav, R, V), 1e-9 * (AU / r) ** 3 * R / r, rtol=1e-6)


def test_radiation_pressure_is_a_radial_push_that_falls_with_the_square():
    found = push_at(NonGravitational(area_to_mass=1e-3), R, V)
    r = np.linalg.norm(R)
    np.testing.assert_allclose(found, RADIATION_PRESSURE * 1e-3 * (AU / r) ** 2 * R / r, rtol=1e-6)
    # Perfect absorption at 1 au: 4.54 uPa (1361 W/m2 over c).
    assert pytest.approx(4.5398e-6, rel=1e-4) == RADIATION_PRESSURE


@pytest.mark.parametrize("days", [35.0, -35.0])
def test_a_delay_takes_the_distance_of_an_earlier_time(days):
    a = (1e-6, 0.0, 0.0)
    before = two_body(PLANETS["sun"].gm, np.concatenate([R, V]), -days * DAY)[:3]
    found = push_at(NonGravitational(a, "comet", delay=days * DAY), R, V)
    size = np.linalg.norm(push_at(NonGravitational(a, "comet"), before, V))
    np.testing.assert_allclose(found, size * R / np.linalg.norm(R), rtol=1e-6)
    later = np.linalg.norm(push_at(NonGravitational(a, "comet"), R, V))
    assert abs(size / later - 1.0) > 0.05


def comet(delay=True):
    orbit = json.loads(CASE.read_text())["orbit"]
    e = {item["name"]: float(item["value"]) for item in orbit["elements"]}
    p = {item["name"]: float(item["value"]) for item in orbit["model_pars"]}
    push = {k: p[k] * u.au / u.d**2 for k in ("A1", "A2", "A3")}
    return fs.Orbit.from_elements(
        Time(float(orbit["epoch"]), format="jd", scale="tdb"),
        e["a"] * u.au,
        e["e"],
        *(e[k] * u.deg for k in ("i", "om", "w", "ma")),
        **push,
        law="comet",
        DT=p["DT"] * u.d if delay else 0.0 * u.d,
        name="67P",
    )


def test_67p_meets_jupiter_where_jpl_has_it():
    """JPL, solution K154/2: 1959-02-04 06:24, 0.0515584492 au (3 sigma 322 km or more), 50 years before the epoch."""
    need_ephemeris("de440")
    truth = 0.0515584492070597 * AU / 1e3
    span = Time("1958-06-01", scale="tdb"), Time("1959-10-01", scale="tdb")
    table = fs.find_encounters(comet(), *span, ["jupiter"], 0.1 * u.au, ephemeris="de440")
    assert table["distance"][0].to_value(u.km) == pytest.approx(truth, abs=100.0)
    assert abs((table["time"][0] - Time("1959-02-04 06:24", scale="tdb")).to_value(u.min)) < 1.0
    other = fs.Encounter.from_orbit(comet(), "jupiter", table["time"][0], ephemeris="de440")
    assert other.distance.to_value(u.km) == pytest.approx(table["distance"][0].to_value(u.km), abs=1.0)
    plain = fs.find_encounters(comet(delay=False), *span, ["jupiter"], 0.1 * u.au, ephemeris="de440")
    assert plain["distance"][0].to_value(u.km) - truth > 2e5


def test_a_delay_and_an_area_are_drawn_with_the_elements():
    state = np.concatenate([R, V])
    names = ("x", "y", "z", "vx", "vy", "vz", "DT", "AMRAT")
    sigma = np.array([*[1e3] * 3, *[1e-3] * 3, 2.0 * DAY, 1e-5])
    known = Covariance(EPOCH, names, np.array([*state, 30.0 * DAY, 1e-4]), np.diag(sigma**2))
    orbit = fs.Orbit.from_state(
        EPOCH,
        R * u.m,
        V * u.m / u.s,
        A1=1e-9 * u.m / u.s**2,
        DT=30 * u.d,
        AMRAT=1e-4 * u.m**2 / u.kg,
        covariance=known,
    )
    clones = orbit.clones(400, seed=3)
    delay, area = (np.array([getattr(c.nongrav, k) for c in clones]) for k in ("delay", "area_to_mass"))
    assert delay.mean() == pytest.approx(30.0 * DAY, abs=4 * 0.1 * DAY)
    assert delay.std() == pytest.approx(2.0 * DAY, rel=0.15)
    assert area.mean() == pytest.approx(1e-4, abs=4 * 5e-7)
    assert area.std() == pytest.approx(1e-5, rel=0.15)


@pytest.mark.parametrize(("name", "sigma"), [("DT", 2.0 * DAY), ("AMRAT", 1e-5), ("A2", 1e-10)])
def test_the_error_of_one_parameter_displaces_the_asteroid_as_in_the_other_integrator(name, sigma):
    mean = {"A1": 1e-8, "A2": 0.0, "DT": 30.0 * DAY, "AMRAT": 1e-4}
    units = {"A1": u.m / u.s**2, "A2": u.m / u.s**2, "DT": u.s, "AMRAT": u.m**2 / u.kg}
    values = np.array([*R, *V, mean[name]])
    matrix = np.zeros((7, 7))
    matrix[6, 6] = sigma**2
    known = Covariance(EPOCH, ("x", "y", "z", "vx", "vy", "vz", name), values, matrix)

    def orbit(change=0.0, covariance=None):
        push = {k: (x + change * (k == name)) * units[k] for k, x in mean.items()}
        return fs.Orbit.from_state(
            EPOCH, R * u.m, V * u.m / u.s, "sun", "ICRF", **push, law="comet", covariance=covariance
        )

    t = 400.0 * DAY
    window = ephemeris("de421").window(EPOCH, -DAY, t + DAY)
    forces = [n for n in FORCES if n != "non-gravitational"]
    beside = deviations_of(orbit(covariance=known), "de421")
    law = orbit().nongrav.parameters
    found = spread(beside, field(window, forces), law, window, np.array([t]), 1e-14).displacement[0]
    ends = [orbit(sign * sigma).flight(window, FORCES).to(t)[:3] for sign in (1.0, -1.0)]
    truth = 0.5 * np.linalg.norm(ends[0] - ends[1])
    assert truth > 1e3
    assert found == pytest.approx(truth, rel=1e-3)


def test_bad_laws_are_named():
    with pytest.raises(UnknownName, match="five numbers"):
        fs.Orbit.from_state(EPOCH, R * u.m, V * u.m / u.s, law="sail")
    with pytest.raises(InvalidInput, match="five numbers"):
        fs.Orbit.from_state(EPOCH, R * u.m, V * u.m / u.s, law=(1.0, 2.0))
    with pytest.raises(InvalidInput, match="AMRAT"):
        fs.Orbit.from_state(EPOCH, R * u.m, V * u.m / u.s, AMRAT=-1.0 * u.m**2 / u.kg)
    with pytest.raises(fs.errors.UnitMismatch):
        fs.Orbit.from_state(EPOCH, R * u.m, V * u.m / u.s, DT=1.0 * u.m)


@pytest.mark.parametrize("law", [None, object(), [1, 2, None, 4, 5], 3.0, [1.0] * 4, "water"])
def test_a_law_that_is_none_is_refused_by_name(law):
    with pytest.raises(FlybystabError, match="law"):
        fs.Orbit.from_elements(
            epoch=Time(2461000.5, format="jd", scale="tdb"), a=1.2 * u.au, e=0.3, i=5 * u.deg, node=10 * u.deg,
            peri=20 * u.deg, M=30 * u.deg, law=law,
        )  # fmt: skip
