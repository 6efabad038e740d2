"""Encounters from SPK kernels and orbit ephemeris messages, against the encounter of the orbit behind them."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab.catalogues.catalogue import catalogue
from flybystab.constants import DAY
from flybystab.errors import InvalidInput, NoEncounter, OutOfSpan, UnitMismatch
from flybystab.orbit.ephemeris import BODIES, ephemeris

spice = pytest.importorskip("spiceypy")

MIDDLE = Time("2029-04-13T21:46:00", scale="tdb")
ET = ((MIDDLE.jd1 - 2451545.0) + MIDDLE.jd2) * DAY


@pytest.fixture(scope="module")
def track():
    """Apophis from 2029-04-08 to 04-18: s from MIDDLE, barycentric states of it and of the Sun (km, km/s)."""
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    t = np.concatenate([np.arange(-5.0 * DAY, -20000.0, 1800.0), np.arange(-20000.0, 20000.0, 60.0)])
    t = np.concatenate([t, np.arange(20000.0, 5.0 * DAY, 1800.0)])
    first = (orbit.epoch.tdb.jd - MIDDLE.jd) * DAY
    window = ephemeris().window(MIDDLE, first - 1.0, 6.0 * DAY)
    flight = orbit.flight(window)
    states = np.array([flight.to(x)[:6].copy() for x in t])
    return t, states / 1e3, window.states(BODIES.index("sun"), t) / 1e3


@pytest.fixture(scope="module")
def direct():
    return fs.Encounter.from_orbit(fs.Asteroid.from_catalogue("Apophis"), "earth", MIDDLE)


def written(path, track, kind, centre=10, body=20099942):
    t, states, sun = track
    relative = states - sun if centre == 10 else states
    handle = spice.spkopn(str(path), "test", 0)
    span = (body, centre, "J2000", ET + t[0], ET + t[-1], "seg")
    if kind == 13:  # Hermite, unequal steps
        spice.spkw13(handle, *span, 7, len(t), relative, ET + t)
    elif kind == 9:  # Lagrange, unequal steps
        spice.spkw09(handle, *span, 9, len(t), relative, ET + t)
    spice.spkcls(handle)
    return path


@pytest.mark.parametrize(("kind", "centre"), [(13, 10), (9, 10), (13, 0)])
def test_an_encounter_along_a_kernel(tmp_path, track, direct, kind, centre):
    path = written(tmp_path / "sb.bsp", track, kind, centre)
    found = fs.Encounter.from_spk(path, 99942, "earth", MIDDLE)
    assert abs((found.distance - direct.distance).to_value(u.km)) < 0.02
    assert abs((found.time - direct.time).to_value(u.s)) < 0.05
    assert found.distance_error < 2.0 * u.m
    start = direct.start_distance.to_value(u.km)
    assert found.start_distance.to_value(u.km) == pytest.approx(start, rel=1e-3)
    t = np.array([-3600.0, 0.0, 4000.0])
    np.testing.assert_allclose(found.positions(t), direct.positions(t), atol=500.0)


def test_the_same_verdict_as_along_the_orbit(tmp_path, track, direct):
    body = fs.Body(semi_axes=(200, 150, 140) * u.m, density=2000 * u.kg / u.m**3, spin_period=12 * u.h)
    path = written(tmp_path / "sb.bsp", track, 13)
    found = fs.Encounter.from_spk(path, None, "earth", MIDDLE)
    a, b = fs.flyby(body, direct), fs.flyby(body, found)
    assert a.verdict == b.verdict
    assert a.margin.to_value(u.deg) == pytest.approx(b.margin.to_value(u.deg), rel=1e-3)


def test_targets_and_spans_of_a_kernel(tmp_path, track):
    path = written(tmp_path / "sb.bsp", track, 13)
    assert fs.Encounter.from_spk(path, 20099942, "earth", MIDDLE).planet.name == "earth"
    with pytest.raises(InvalidInput, match="20099942"):
        fs.Encounter.from_spk(path, 433, "earth", MIDDLE)
    with pytest.raises(OutOfSpan):
        fs.Encounter.from_spk(path, None, "earth", MIDDLE + 30 * u.d)
    with pytest.raises(NoEncounter):
        fs.Encounter.from_spk(path, None, "mars", MIDDLE)
    (tmp_path / "x.bsp").write_text("DAF")
    with pytest.raises(InvalidInput, match="SPK"):
        fs.Encounter.from_spk(tmp_path / "x.bsp", None, "earth", MIDDLE)
    (tmp_path / "y.bsp").write_bytes(path.read_bytes()[:1500])
    with pytest.raises(InvalidInput, match="SPK"):
        fs.Encounter.from_spk(tmp_path / "y.bsp", None, "earth", MIDDLE)


def test_a_kernel_is_no_catalogue(tmp_path, track):
    path = written(tmp_path / "sb.bsp", track, 13)
    with pytest.raises(InvalidInput, match="from_spk"):
        catalogue(path)


def message(track, centre="SUN", scale="TDB", every=1):
    t, states, sun = track
    relative = (states - sun if centre == "SUN" else states)[::every]
    times = MIDDLE + t[::every] * u.s
    isot = getattr(times, scale.lower()).isot if scale != "TDB" else times.tdb.copy()
    if scale == "TDB":
        isot.precision = 9
        isot = isot.isot
    lines = ["CCSDS_OEM_VERS = 2.0", "CREATION_DATE = 2026-01-01T00:00:00", "ORIGINATOR = TEST", "META_START"]
    lines += ["OBJECT_NAME = APOPHIS", "OBJECT_ID = 99942", f"CENTER_NAME = {centre}", "REF_FRAME = ICRF"]
    lines += [f"TIME_SYSTEM = {scale}", "META_STOP"]
    lines += [f"{a} " + " ".join(f"{x:.12E}" for x in row) for a, row in zip(isot, relative, strict=True)]
    lines += ["COVARIANCE_START", "EPOCH = 2029-04-13T00:00:00", "1.0", "0.0 1.0", "COVARIANCE_STOP"]
    return "\n".join(lines)


def test_an_encounter_along_a_message(tmp_path, track, direct):
    path = tmp_path / "x.oem"
    path.write_text(message(track))
    found = fs.Encounter.from_oem(path, "earth")
    assert abs((found.distance - direct.distance).to_value(u.km)) < 0.05
    assert found.distance_error < 0.1 * u.km
    path.write_text(message(track, "SOLAR SYSTEM BARYCENTER"))
    assert abs((fs.Encounter.from_oem(path, "earth").distance - direct.distance).to_value(u.km)) < 0.05
    with pytest.raises(InvalidInput, match="from_oem"):
        catalogue(path)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("ICRF", "ITRF2000", "REF_FRAME"),
        ("= SUN", "= SIRIUS", "CENTER_NAME"),
        ("= TDB", "= GPS", "TIME_SYSTEM"),
        ("CCSDS_OEM_VERS", "CCSDS_OPM_VERS", "CCSDS_OEM_VERS"),
    ],
)
def test_messages_that_are_refused(tmp_path, track, old, new, match):
    path = tmp_path / "x.oem"
    path.write_text(message(track).replace(old, new))
    with pytest.raises(InvalidInput, match=match):
        fs.Encounter.from_oem(path, "earth")


def test_a_start_distance_below_zero_is_an_error_on_every_way_in():
    t = np.array([-1.0, 0.0, 1.0]) * u.h
    x = np.ones((3, 3)) * u.km
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    for way in (
        lambda d: fs.Encounter.from_trajectory(t, x, x / u.s, "earth", start_distance=d),
        lambda d: fs.Encounter.from_spk("sb.bsp", None, "earth", MIDDLE, start_distance=d),
        lambda d: fs.Encounter.from_oem("sb.oem", "earth", start_distance=d),
        lambda d: fs.Encounter.from_orbit(orbit, "earth", MIDDLE, start_distance=d),
    ):
        with pytest.raises(InvalidInput, match="start_distance"):
            way(-1.0 * u.km)
        with pytest.raises(UnitMismatch, match="start_distance"):
            way(1.0 * u.s)
