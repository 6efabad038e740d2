"""The names and arguments that scripts outside rely on."""

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable
from astropy.time import Time

import flybystab as fs


@pytest.fixture(scope="module")
def body():
    material = fs.Material(
        friction_angle=35 * u.deg, cohesion=0 * u.Pa, dilatancy=0.0, yield_surface="drucker-prager"
    )
    return fs.Body(
        semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h, material=material
    )


def test_equilibrium(body):
    e = fs.equilibrium(body)
    assert 0 * u.deg < e.required_friction_angle < 35 * u.deg
    assert e.mean_pressure > 0 * u.Pa
    assert e.required_cohesion == 0 * u.Pa
    assert e.stress.shape == (3, 3)
    assert -np.trace(e.stress.to_value(u.Pa)) / 3 == pytest.approx(e.mean_pressure.to_value(u.Pa))
    assert e.admissible


def test_recovery(body):
    r = fs.recovery(body, directions=4, refinements=2, searches=2)
    assert r.energy.unit.is_equivalent(u.J)
    assert r.direction.shape == (3, 3)
    assert r.error >= 0.0
    assert r.searches.shape == (2,)


def test_stability(body):
    s = fs.stability(body)
    assert s.stable_infinitesimal
    for orders in (s.critical_strain, s.critical_energy):
        assert all(getattr(orders, name) > 0 for name in ("second", "third", "barrier"))
    assert s.kappa_crit is None  # associative by default: kappa has no effect


def test_flyby(body):
    passage = fs.Encounter.hyperbolic(
        "earth", periapsis=2.2 * fs.R_earth, v_inf=5 * u.km / u.s, start_distance=10 * fs.R_earth
    )
    r = fs.flyby(body, passage, attitude=None)
    assert r.verdict == "RESHAPED"
    assert r.bound_fraction == 1.0
    assert r.semi_axes.shape == (3,)
    assert r.spin > 0 * u.rad / u.s
    assert 0 * u.s < r.onset_time < r.arrest_time
    assert r.max_required_friction_angle > 35 * u.deg
    assert 0.0 < r.error.semi_axes < 1e-6
    assert len(r.history) > 10
    np.testing.assert_allclose(r.body.semi_axes.to_value(u.m), r.semi_axes.to_value(u.m))


def test_real_orbit():
    a = fs.Asteroid.from_catalogue("Apophis")
    start, stop = Time("2029-01-01", scale="tdb"), Time("2030-01-01", scale="tdb")
    for what in (a, a.orbit, [a]):
        t = fs.find_encounters(what, start, stop, planets=["earth"], within=0.01 * u.au)
        assert isinstance(t, QTable)
        assert t["planet"].tolist() == ["earth"]
        assert t["time"].scale == "tdb"
        assert t["distance"][0].to_value(u.km) == pytest.approx(38011, abs=5)
        assert t["v_inf"][0] < t["v_rel"][0]
    passage = fs.Encounter.from_orbit(a.orbit, "earth", t["time"][0])
    assert fs.flyby(a.body, passage).verdict == "INTACT"


def test_elements_without_a_push():
    o = fs.Orbit.from_elements(
        epoch=Time(2461000.5, format="jd", scale="tdb"), a=0.92 * u.au, e=0.19, i=3.3 * u.deg,
        node=203 * u.deg, peri=126 * u.deg, M=312 * u.deg, A1=0, A2=0, A3=0,
    )  # fmt: skip
    assert o.nongrav.a == (0.0, 0.0, 0.0)
    again = fs.Orbit.from_state(o.epoch, o.position, o.velocity)
    np.testing.assert_allclose(again.position.to_value(u.m), o.position.to_value(u.m))


def test_screen():
    tab = fs.screen(
        ["Apophis"], "2029-04-01", "2029-05-01", planets=["earth"], samples=4, seed=1, executor=None
    )
    assert tab["verdict"].tolist() == ["INTACT"]
