"""Scripted encounters: times, tide, impacts and bad input."""

import pickle

import astropy.units as u
import numpy as np
import pytest

from flybystab.core.ellipsoid.tide import tensor, tide_at
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, UnitMismatch, UnknownName
from flybystab.orbit.planets import PLANETS, Planet, R_earth, planet


def make(q=2.2, v=5.0, start=10, **more):
    return Encounter.hyperbolic(
        "earth", q * R_earth, v * u.km / u.s, None if start is None else start * R_earth, **more
    )


def stored_tide(enc, t):
    out = np.empty((t.size, 6))
    for i, time in enumerate(t):
        tide_at(*enc.tide, time, out[i])
    return tensor(out)


@pytest.mark.parametrize(("q", "end"), [(2.2, 33529.41), (2.0, 33433.08)])
def test_duration_of_the_reference_flybys(q, end):
    enc = make(q)
    assert enc.t_stop - enc.t_start == pytest.approx(end, abs=0.005)
    assert enc.radius(enc.t_start * u.s).value == pytest.approx(10 * R_earth.value, rel=1e-13)
    assert enc.radius(-enc.t_start * u.s).value == pytest.approx(10 * R_earth.value, rel=1e-13)


def test_frame_has_periapsis_on_x_and_momentum_on_z():
    enc = make()
    r, v = enc.position(0 * u.s).value, enc.velocity(0 * u.s).value
    np.testing.assert_allclose(r, [2.2 * R_earth.value, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(v, [0, enc.v_periapsis.to_value(u.m / u.s), 0], rtol=1e-14)
    assert enc.position(enc.t_start * u.s)[1] < 0  # comes in from -y
    assert enc.time is None
    assert enc.frame == "periapsis"


@pytest.mark.parametrize("q", [1.02, 1.5, 6.0, 60.0])
@pytest.mark.parametrize("v", [0.0, 0.01, 5.0, 40.0])
def test_stored_tide_is_the_closed_form(q, v):
    """K = GM/r^3 (3 n n - 1) along the hyperbola, at times that are no nodes, up to 100 h after the end."""
    enc = make(q, v, None)
    assert enc.tide_error < 1e-11
    t = np.sort(np.random.default_rng(1).uniform(enc.t_start, enc.t_stop + 360e3, 400))
    t = np.concatenate([t, np.linspace(-1000, 1000, 101)])
    r = enc.position(t * u.s).value
    d = np.linalg.norm(r, axis=1)[:, None, None]
    exact = planet("earth").gm / d**3 * (3 * r[:, :, None] * r[:, None, :] / d**2 - np.eye(3))
    peak = 2 * planet("earth").gm / (q * R_earth.value) ** 3
    assert np.abs(stored_tide(enc, t) - exact).max() < 1e-11 * peak


def test_tide_stretches_toward_the_planet():
    k = stored_tide(make(), np.array([0.0]))[0]
    assert k[0, 0] > 0 > k[1, 1]
    assert k[1, 1] == pytest.approx(k[2, 2], rel=1e-9)
    assert abs(np.trace(k)) < 1e-12 * k[0, 0]


def test_j2_adds_its_share_and_is_listed():
    plain, flat = make(1.1), make(1.1, j2=True)
    gain = stored_tide(flat, np.zeros(1))[0, 0, 0] / stored_tide(plain, np.zeros(1))[0, 0, 0] - 1
    assert gain == pytest.approx(3 * planet("earth").j2 / 1.1**2, rel=1e-9)  # in the equator plane
    assert "earth J2" in dict(plain.left_out)
    assert "earth J2" not in dict(flat.left_out)
    assert dict(plain.left_out)["earth J2"] >= gain


def test_small_v_inf_tends_to_the_parabola():
    parabola = make(v=0.0)
    last = None
    for v in (0.1, 0.01, 0.001):
        gap = abs(make(v=v).t_start - parabola.t_start)
        assert last is None or gap == pytest.approx(last / 100, rel=0.02)  # goes as v_inf squared
        last = gap


@pytest.mark.parametrize(
    ("q", "level"), [(0.3, "surface"), (0.9999, "surface"), (1.01, "atmosphere"), (1.02, None)]
)
def test_impact_is_an_encounter_not_an_error(q, level):
    enc = make(q)
    assert enc.impact == (level is not None)
    assert enc.impact_level == level
    if level:
        assert enc.t_start < enc.impact_time < 0
        assert enc.radius(enc.impact_time * u.s).value == pytest.approx(
            planet("earth").impact_distance, rel=1e-12
        )
    else:
        assert enc.impact_time is None


def test_pickles():
    enc = pickle.loads(pickle.dumps(make()))
    np.testing.assert_array_equal(enc.position(100 * u.s).value, make().position(100 * u.s).value)


def test_bad_input_is_named():
    good = {"periapsis": 2 * R_earth, "v_inf": 5 * u.km / u.s}
    for bad in (
        {"periapsis": 0 * u.m},
        {"periapsis": -2 * R_earth},
        {"periapsis": np.nan * u.m},
        {"v_inf": -1 * u.km / u.s},
        {"v_inf": np.inf * u.km / u.s},
        {"start_distance": 1.9 * R_earth},
        {"settle": -1 * u.h},
        {"pole": (0, 0, 0), "j2": True},
        {"pole": "up"},
    ):
        with pytest.raises(InvalidInput) as caught:
            Encounter.hyperbolic("earth", **{**good, **bad})
        assert caught.value.name in bad
    for bad in ({"periapsis": 2.0}, {"v_inf": 5 * u.km}, {"settle": 3}):
        with pytest.raises(UnitMismatch):
            Encounter.hyperbolic("earth", **{**good, **bad})
    with pytest.raises(UnknownName, match="earth"):
        Encounter.hyperbolic("eart", **good)
    with pytest.raises(InvalidInput):
        Encounter.hyperbolic(3, **good)


def test_planet_table_is_sane():
    for body in PLANETS.values():
        assert np.linalg.norm(body.pole) == pytest.approx(1)
        assert 100 < body.gm / body.radius**3 * 1e9 < 3000  # mean density 0.7 to 5.5 g/cm3
        assert body.impact_distance >= body.radius
    assert planet(" Earth ") is PLANETS["earth"]


def test_speeds_beyond_that_of_light_and_planets_without_mass_are_refused():
    with pytest.raises(InvalidInput, match="v_inf"):
        Encounter.hyperbolic("earth", 2 * R_earth, 3e5 * u.km / u.s)
    with pytest.raises(InvalidInput, match="v_inf"):
        Encounter.hyperbolic("earth", [2, 3] * R_earth, 3e5 * u.km / u.s)
    good = {"name": "x", "gm": 1e14, "radius": 1e7, "j2": 0.0, "pole": (0, 0, 1), "atmosphere": 0.0}
    for name, value in (("gm", 0.0), ("gm", np.nan), ("radius", -1.0), ("atmosphere", -1.0)):
        with pytest.raises(InvalidInput, match=name):
            Planet(**(good | {name: value}), target=0, orbit_radius=0.0)
