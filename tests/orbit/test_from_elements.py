"""Orbits from any set of elements, about any centre, in either plane, and the elements back from the state."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.constants import DAY
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.elements import GM_SUN, GM_TOTAL, ecliptic_to_icrf, elements_from_state
from flybystab.orbit.osculating_state import heliocentric
from flybystab.orbit.planets import PLANETS

EPOCH = Time(2461000.5, format="jd", scale="tdb")
ANGLES = {"i": 20.0 * u.deg, "node": 130.0 * u.deg, "peri": 250.0 * u.deg}
GM = {"sun": GM_SUN, "ssb": GM_TOTAL, "earth": PLANETS["earth"].gm, "jupiter": PLANETS["jupiter"].gm}


def state(orbit):
    return np.array([*orbit.position.to_value(u.m), *orbit.velocity.to_value(u.m / u.s)])


def elements(orbit, frame="ecliptic", gm=GM_SUN):
    """q (m), e, i, node, peri (deg), days since periapsis, from the state."""
    x = state(orbit)
    if frame == "ICRF":  # elements_from_state refers to the ecliptic
        x = np.kron(np.eye(2), ecliptic_to_icrf()) @ x
    q, e, i, node, peri, since = elements_from_state(x, gm)
    return q, e, *np.degrees([i, node, peri]), since / DAY


@pytest.mark.parametrize("centre", GM)
@pytest.mark.parametrize("frame", ["ecliptic", "ICRF"])
@pytest.mark.parametrize("e", [0.3, 0.9999, 1.0, 1.0001, 2.5])
def test_the_elements_of_the_state_are_those_given(centre, frame, e):
    size = {"earth": 1e7, "jupiter": 1e9}.get(centre, 1e11)
    days = {"earth": 0.02, "jupiter": 0.3}.get(centre, 40.0)
    orbit = fs.Orbit.from_elements(
        EPOCH, q=size * u.m, e=e, **ANGLES, Tp=EPOCH - days * u.d, centre=centre, frame=frame
    )
    assert orbit.centre == centre
    np.testing.assert_allclose(
        elements(orbit, frame, GM[centre]), (size, e, 20.0, 130.0, 250.0, days), rtol=1e-8
    )


@pytest.mark.parametrize("e", [0.2, 0.95, 1.3])
@pytest.mark.parametrize("centre", ["sun", "ssb"])
def test_the_four_ways_to_give_an_orbit_agree(e, centre):
    """a or q, with M or Tp, for ellipse and hyperbola."""
    q, days = 0.8 * u.au, 55.0
    a = q / (1.0 - e)
    motion = np.sqrt(GM[centre] / abs(a.to_value(u.m)) ** 3)
    sizes, phases = ({"a": a}, {"q": q}), ({"M": motion * days * DAY * u.rad}, {"Tp": EPOCH - days * u.d})
    states = [
        state(fs.Orbit.from_elements(EPOCH, e=e, **ANGLES, **s, **p, centre=centre))
        for s in sizes
        for p in phases
    ]
    for other in states[1:]:
        np.testing.assert_allclose(other, states[0], rtol=1e-11)


def test_a_near_parabola_is_between_its_neighbours():
    def at(e):
        return state(fs.Orbit.from_elements(EPOCH, q=0.7 * u.au, e=e, **ANGLES, Tp=EPOCH - 30 * u.d))

    np.testing.assert_allclose(0.5 * (at(1 - 1e-6) + at(1 + 1e-6)), at(1.0), rtol=1e-10)


def test_barycentric_elements_are_those_of_the_heliocentric_orbit():
    """Osculating elements about the barycentre, computed from a heliocentric orbit, give that orbit back."""
    window = need_ephemeris("de440").window(EPOCH, -DAY, DAY)
    one = fs.Asteroid.from_catalogue("Apophis").orbit
    q, e, i, node, peri, since = elements_from_state(one.barycentric(window), GM_TOTAL)
    back = fs.Orbit.from_elements(
        one.epoch, q=q * u.m, e=e, i=i * u.rad, node=node * u.rad, peri=peri * u.rad,
        Tp=one.epoch - since * u.s, centre="ssb",
    )  # fmt: skip
    difference = heliocentric(back, "de440") - heliocentric(one)
    assert np.linalg.norm(difference[:3]) < 0.1
    assert np.linalg.norm(difference[3:]) < 1e-7


def test_another_gm_is_taken_as_given():
    gauss = (0.01720209895**2) * u.au**3 / u.d**2
    one = fs.Orbit.from_elements(EPOCH, a=1.2 * u.au, e=0.1, **ANGLES, M=50 * u.deg, gm=gauss)
    r, v = np.linalg.norm(state(one)[:3]), np.linalg.norm(state(one)[3:])
    energy = v**2 / 2 - gauss.to_value(u.m**3 / u.s**2) / r
    assert energy == pytest.approx(
        -gauss.to_value(u.m**3 / u.s**2) / 2 / (1.2 * u.au).to_value(u.m), rel=1e-12
    )


WHOLE = {"a": 1.2 * u.au, "e": 0.2, **ANGLES, "M": 10 * u.deg}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": None}, "also a or q"),
        ({"M": None}, "also M or Tp"),
        ({"q": 0.9 * u.au}, "a or q, not both"),
        ({"Tp": EPOCH}, "M or Tp, not both"),
        ({"node": None, "e": None}, "also e, node"),
        ({"e": 1.0}, "q and Tp for a parabola"),
        ({"e": 1.0, "a": None, "q": 1 * u.au}, "q and Tp for a parabola"),
        ({"e": 1.2}, "above 1 for a < 0"),
        ({"a": None, "q": 0.0 * u.au}, "q above 0"),
        ({"Tp": 2461000.5, "M": None}, "Tp"),
        ({"gm": 0.0 * u.m**3 / u.s**2}, "gm"),
    ],
)
def test_mixed_and_missing_elements_are_named(change, message):
    with pytest.raises(InvalidInput, match=message):
        fs.Orbit.from_elements(EPOCH, **(WHOLE | change))


@pytest.mark.parametrize(
    "change", [{"centre": "vulcan"}, {"frame": "galactic"}, {"centre": "ssb", "barycentre": "x"}]
)
def test_unknown_centres_and_frames_are_refused(change):
    with pytest.raises(UnknownName, match="known"):
        fs.Orbit.from_elements(EPOCH, **(WHOLE | change))


def test_the_time_of_perihelion_may_be_text_and_the_inclination_ends_at_180_degrees():
    given = {"epoch": EPOCH, "q": 0.3 * u.au, "e": 1.0, "node": 10 * u.deg, "peri": 20 * u.deg}
    by_text = fs.Orbit.from_elements(**given, i=20 * u.deg, Tp="2026-01-05")
    by_time = fs.Orbit.from_elements(**given, i=20 * u.deg, Tp=Time("2026-01-05", scale="tdb"))
    np.testing.assert_array_equal(state(by_text), state(by_time))
    with pytest.raises(InvalidInput, match="Tp = soon: expected a date"):
        fs.Orbit.from_elements(**given, i=20 * u.deg, Tp="soon")
    fs.Orbit.from_elements(**given, i=180 * u.deg, Tp="2026-01-05")
    for i in (-1.0, 200.0):
        with pytest.raises(InvalidInput, match="i = "):
            fs.Orbit.from_elements(**given, i=i * u.deg, Tp="2026-01-05")
