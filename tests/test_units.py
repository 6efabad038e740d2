"""Every public callable converts the units of its arguments, refuses bare numbers and wrong dimensions by name."""

import datetime

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from scenes import PILE, R_E, earth

import flybystab as fs
from flybystab.errors import InvalidInput, UnitMismatch
from flybystab.units import checked_time, number_of, to_si

KMS = u.km / u.s
GCC = u.g / u.cm**3
DAY = Time("2029-04-13", scale="tdb")
E = earth(2.2)


def hyperbolic(**changed):
    arguments = {"periapsis": 2 * R_E, "v_inf": 5 * KMS}
    e = fs.Encounter.hyperbolic("earth", **(arguments | changed))
    return e.t_start, e.t_stop, e.distance.value, e.v_inf.value


def body(**changed):
    arguments = {"semi_axes": [3, 2, 1] * u.km, "density": 2 * GCC}
    b = fs.Body(**(arguments | changed))
    return *b.axes, b.rho, *b.omega


def material(**changed):
    m = fs.Material(**changed)
    return m.phi, m.c_pa, 0.0 if m.bulk_modulus is None else m.bulk_modulus.to_value(u.Pa)


def trajectory(**changed):
    t = np.linspace(-3.0, 3.0, 30) * u.h
    arguments = {"times": t, "positions": E.position(t), "velocities": E.velocity(t), "planet": "earth"}
    e = fs.Encounter.from_trajectory(**(arguments | changed))
    return e.t_start, e.t_stop, e.distance.value


def state(**changed):
    arguments = {"position": [1, 0, 0] * u.au, "velocity": [0, 30, 0] * KMS}
    o = fs.Orbit.from_state(DAY, **(arguments | changed))
    return *o.position.to_value(u.m), *o.velocity.to_value(u.m / u.s)


def elements(**changed):
    arguments = {
        "a": 0.92 * u.au,
        "i": 3.3 * u.deg,
        "node": 203 * u.deg,
        "peri": 126 * u.deg,
        "M": 312 * u.deg,
    }
    o = fs.Orbit.from_elements(epoch=DAY, e=0.19, **(arguments | changed))
    return tuple(o.position.to_value(u.m))


T = np.linspace(-3.0, 3.0, 30)
APOPHIS = fs.Asteroid.from_catalogue("Apophis")

#: name, call with one argument, a value of it, another unit of the same dimension
CALLS = [
    ("t", lambda x: E.position(x).to_value(u.m), 1.0 * u.h, u.s),
    ("t", lambda x: E.velocity(x).to_value(u.m / u.s), 1.0 * u.h, u.min),
    ("t", lambda x: E.radius(x).to_value(u.m), -1.5 * u.h, u.d),
    ("periapsis", lambda x: hyperbolic(periapsis=x), 15000.0 * u.km, u.m),
    ("v_inf", lambda x: hyperbolic(v_inf=x), 5.0 * KMS, u.m / u.h),
    ("start_distance", lambda x: hyperbolic(start_distance=x), 80000.0 * u.km, u.au),
    ("settle", lambda x: hyperbolic(settle=x), 3.0 * u.h, u.s),
    ("times", lambda x: trajectory(times=x), T * u.h, u.s),
    ("positions", lambda x: trajectory(positions=x), E.position(T * u.h), u.km),
    ("velocities", lambda x: trajectory(velocities=x), E.velocity(T * u.h), u.km / u.h),
    ("settle", lambda x: trajectory(settle=x), 3.0 * u.h, u.s),
    ("start_distance", lambda x: trajectory(start_distance=x), 30000.0 * u.km, u.m),
    ("semi_axes", lambda x: body(semi_axes=x), [300, 200, 100] * u.m, u.km),
    ("density", lambda x: body(density=x), 2.0 * GCC, u.kg / u.m**3),
    ("spin_period", lambda x: body(spin_period=x), 6.0 * u.h, u.s),
    ("spin", lambda x: body(spin=x), [0, 0, 1] * u.rad / u.h, u.deg / u.s),
    ("friction_angle", lambda x: material(friction_angle=x), 30.0 * u.deg, u.rad),
    ("cohesion", lambda x: material(cohesion=x), 0.1 * u.kPa, u.Pa),
    ("bulk_modulus", lambda x: material(bulk_modulus=x), 3.0 * u.kPa, u.Pa),
    ("position", lambda x: state(position=x), [1, 0, 0] * u.au, u.km),
    ("velocity", lambda x: state(velocity=x), [0, 30, 0] * KMS, u.au / u.d),
    ("a", lambda x: elements(a=x), 0.92 * u.au, u.km),
    ("i", lambda x: elements(i=x), 3.3 * u.deg, u.rad),
    ("M", lambda x: elements(M=x), 312.0 * u.deg, u.rad),
    ("angle", lambda x: APOPHIS.attitude(x), 20.0 * u.deg, u.rad),
    ("angle", lambda x: fs.surface_change(PILE, earth(3.0), count=50).share_passing(x), 30.0 * u.deg, u.rad),
    (
        "within",
        lambda x: len(
            fs.find_encounters(
                APOPHIS, Time("2029-04-01", scale="tdb"), Time("2029-05-01", scale="tdb"), within=x
            )
        ),
        0.01 * u.au,
        u.km,
    ),
]
NAMES = [f"{n}-{k}" for k, (n, *_) in enumerate(CALLS)]


@pytest.mark.parametrize(("name", "call", "value", "unit"), CALLS, ids=NAMES)
def test_units_are_converted(name, call, value, unit):
    given, converted = call(value), call(value.to(unit))
    np.testing.assert_allclose(converted, given, rtol=1e-9, atol=1e-9 * np.abs(given).max())


@pytest.mark.parametrize(("name", "call", "value", "unit"), CALLS, ids=NAMES)
def test_bare_numbers_and_wrong_dimensions_are_refused(name, call, value, unit):
    for wrong in (value.value, value.value * u.K, value.value * u.Unit("kg m / s4")):
        with pytest.raises(UnitMismatch, match=name):
            call(wrong)


# Times and thresholds are taken as arrays, and scripted encounters are made from arrays of periapsis and v_inf.
SCALARS = [row for row in CALLS if row[2].shape == () and row[0] not in ("t", "within", "periapsis", "v_inf")]


@pytest.mark.parametrize(
    ("name", "call", "value", "unit"), SCALARS, ids=[f"{n[0]}-{k}" for k, n in enumerate(SCALARS)]
)
def test_an_array_in_place_of_a_scalar_is_refused(name, call, value, unit):
    with pytest.raises(InvalidInput, match=name):
        call(np.array([1.0, 2.0]) * value)


def test_the_path_of_an_encounter_takes_arrays_of_any_shape():
    t = np.array([[-2.0, 0.0, 1.0], [3.0, 0.5, -1.0]]) * u.h
    r, v, d = E.position(t), E.velocity(t), E.radius(t)
    assert (r.shape, v.shape, d.shape) == ((2, 3, 3), (2, 3, 3), (2, 3))
    assert (r.unit, v.unit, d.unit) == (u.m, u.m / u.s, u.m)
    np.testing.assert_allclose(np.linalg.norm(r, axis=-1).value, d.value, rtol=1e-14)
    assert E.radius(1 * u.h) == E.radius(3600 * u.s) == d[0, 2]
    assert E.position(1 * u.h).shape == (3,)
    # the velocity is the derivative of the position
    step = 1.0 * u.s
    slope = (E.position(1 * u.h + step) - E.position(1 * u.h - step)) / (2 * step)
    np.testing.assert_allclose(slope.to_value(u.m / u.s), E.velocity(1 * u.h).value, rtol=1e-6)


def test_results_are_quantities():
    r = fs.flyby(PILE, E, error=True)
    for name, unit in {
        "semi_axes": u.m, "spin": u.rad / u.s, "spin_vector": u.rad / u.s, "onset_time": u.s, "arrest_time": u.s,
        "end_time": u.s, "max_required_friction_angle": u.deg, "max_required_friction_time": u.s, "margin": u.deg,
        "required_cohesion": u.Pa, "lode_angle": u.deg, "pole_change": u.deg,
    }.items():  # fmt: skip
        assert getattr(r, name).unit == unit, name
    for name in ("distance", "v_inf", "v_periapsis", "start_distance"):
        assert isinstance(getattr(E, name), u.Quantity), name
    assert E.b_plane().unit == u.km


def test_dates_as_text_are_tdb():
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    when = Time("2029-04-13", scale="tdb")
    table = fs.find_encounters(orbit, "2029-04-12", "2029-04-15")
    other = fs.find_encounters(orbit, when - 1 * u.d, when + 2 * u.d)
    assert len(table) == len(other) == 1
    assert abs((table["time"][0] - other["time"][0]).to_value(u.s)) < 1e-3
    assert (
        fs.Encounter.from_orbit(orbit, "earth", "2029-04-13").time
        == fs.Encounter.from_orbit(orbit, "earth", when).time
    )
    assert (
        fs.encounter_distribution(orbit, "earth", "2029-04-13", n=2).time
        == fs.encounter_distribution(orbit, "earth", when, n=2).time
    )
    given, other = orbit.at("2028-01-01"), orbit.at(Time("2028-01-01", scale="tdb"))
    assert np.all(given[0] == other[0])
    for wrong in ("April", "2029-13-01", ""):
        with pytest.raises(InvalidInput, match="read as TDB"):
            fs.find_encounters(orbit, wrong, "2029-04-15")


@pytest.mark.parametrize(
    ("text", "iso"),
    [
        ("2029-04-13", "2029-04-13 00:00:00.000"),
        ("2029-04-13T21:46", "2029-04-13 21:46:00.000"),
        ("2029-04-13 21:46:12.5", "2029-04-13 21:46:12.500"),
        ("2029-Apr-13 21:46", "2029-04-13 21:46:00.000"),
        ("2029-apr-13", "2029-04-13 00:00:00.000"),
        ("2029-4-3 9:05", "2029-04-03 09:05:00.000"),
        ("2029-04-13.25", "2029-04-13 06:00:00.000"),
        ("2029-04", "2029-04-01 00:00:00.000"),
        ("2029", "2029-01-01 00:00:00.000"),
        (" JD 2462240.40703 ", "2029-04-13 21:46:07.392"),
        ("jd2462239.5", "2029-04-13 00:00:00.000"),
        ("2029-04-13 21:45:03 UTC", "2029-04-13 21:46:12.184"),
        ("2029-04-13T21:45:03Z", "2029-04-13 21:46:12.184"),
        ("2029:103:12:00", "2029-04-13 12:00:00.000"),
    ],
)
def test_dates_as_text(text, iso):
    found = checked_time(text, "start")
    assert found.tdb.iso[:-2] == iso[:-2]
    if not text.endswith(("UTC", "Z")):
        assert found.scale == "tdb"


def test_dates_of_python_numpy_and_pandas():
    pandas = pytest.importorskip("pandas")
    for date in (
        datetime.datetime(2029, 4, 13, 21, 46, 12),
        np.datetime64("2029-04-13T21:46:12"),
        pandas.Timestamp("2029-04-13 21:46:12"),
    ):
        found = checked_time(date, "time")
        assert (found.scale, found.iso[:19]) == ("tdb", "2029-04-13 21:46:12")
    assert checked_time(datetime.date(2029, 4, 13), "time").iso == "2029-04-13 00:00:00.000"
    east = datetime.timezone(datetime.timedelta(hours=2))
    for aware in (
        datetime.datetime(2029, 4, 13, 23, 45, 3, tzinfo=east),
        pandas.Timestamp("2029-04-13 21:45:03Z"),
    ):
        assert checked_time(aware, "time").tdb.iso[:19] == "2029-04-13 21:46:12"
    for nothing in (np.datetime64("NaT"), pandas.NaT):
        with pytest.raises(InvalidInput, match="time = NaT"):
            checked_time(nothing, "time")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "soon",
        "2029-13-01",
        "2029-Abc-13",
        "2029-04-31",
        "13.4.2029",
        "2029-04 12:00",
        "JD",
        "12",
        "2029-04-13Z",
    ],
)
def test_texts_that_are_no_dates(text):
    with pytest.raises(InvalidInput, match="a date such as 2029-04-13"):
        checked_time(text, "start")


def test_ranges_without_an_end_are_described_by_their_beginning():
    with pytest.raises(InvalidInput, match=r"cohesion = -1\.0 Pa: expected a value of at least 0 Pa"):
        to_si(-1 * u.Pa, u.Pa, "cohesion", low=0.0)
    with pytest.raises(InvalidInput, match="expected a value above 0 m"):
        to_si(0 * u.m, u.m, "radius", low=0.0, open_low=True)
    with pytest.raises(InvalidInput, match=r"expected a value in \[0, 90\) deg"):
        to_si(90 * u.deg, u.deg, "angle", low=0.0, high=90.0, open_high=True)


def test_number_of():
    assert [number_of(n, "encounter") for n in (0, 1, 2)] == ["0 encounters", "1 encounter", "2 encounters"]
