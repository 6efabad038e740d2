"""One search for many asteroids: the same encounters and rows as one search for each, whatever fails."""

import json
import os
import time
from concurrent.futures import ThreadPoolExecutor

import astropy.units as u
import pytest
from astropy.time import Time
from scripted import NAMES, screening, three

from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.errors import Impact, InvalidInput, NotConverged, OutOfSpan, WorkersLost
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import approaches, approaches_each
from flybystab.orbit.search.search_setup import groups_by_window
from flybystab.screening.encounters import BatchFinder, OrbitSearch, close_approaches
from flybystab.screening.executors import open_executor
from flybystab.screening.scheduling import SerialExecutor, scheduled
from flybystab.screening.screening import Screening
from flybystab.screening.settings import settings

SEARCH = ("2026-01-01", "2036-01-01")


def alone(asteroid, settings):
    """The default search as a function, which has no form for many asteroids."""
    return close_approaches(asteroid, settings)


class Batched:
    """The scripted encounters, with calls of both forms recorded; `error` is raised by that for many."""

    def __init__(self, error=None):
        self.calls, self.error = [], error

    def __call__(self, asteroid, settings):
        self.calls.append(asteroid.name)
        return three(asteroid, settings)

    def batch(self, asteroids, settings):
        self.calls.append(len(asteroids))
        if self.error is not None:
            raise self.error
        out = []
        for a in asteroids:
            try:
                out.append(three(a, settings) if a.name != "Toutatis" else [])
            except NotConverged as error:
                out.append(error)
        return out


class Endless(Batched):
    """The form for many asteroids never ends."""

    def batch(self, asteroids, settings):
        while True:
            time.sleep(0.001)


class Deadly(Batched):
    """The form for many asteroids ends its process."""

    def batch(self, asteroids, settings):
        os._exit(1)


def bodies():
    """Forty bodies of the catalogue, of various epochs, and Apophis."""
    found = catalogue()[::7][:40]
    apophis = Asteroid.from_catalogue("Apophis")
    return [*found[:20], apophis, *found[20:]]


def numbers(found):
    return [(a.planet, a.time.jd1, a.time.jd2, a.distance, a.v_inf) for a in found]


def text(run, *given, **more):
    return {i: json.dumps(rows) for i, rows in run.results(*given, **more)}


def test_encounters_are_those_of_single_searches_to_the_last_bit():
    span = (*(Time(t, scale="tdb") for t in SEARCH), ("earth", "venus", "mars"), 0.3 * u.au.to(u.m))
    orbits = [a.orbit for a in bodies()]
    single = [numbers(approaches(orbit, *span)) for orbit in orbits]
    assert sum(map(len, single)) > 30
    assert [numbers(found) for found in approaches_each(orbits, *span)] == single
    assert [numbers(found) for found in approaches_each(orbits[::-1], *span)] == single[::-1]
    assert len(groups_by_window([("", o) for o in orbits], *span[:2], ephemeris())) > 1


def test_errors_of_an_integration_belong_to_their_orbit():
    span = (*(Time(t, scale="tdb") for t in SEARCH), ("earth",), 0.3 * u.au.to(u.m))
    good = Asteroid.from_catalogue("Apophis").orbit
    inside = Orbit.from_state(
        good.epoch, [1e3, 0.0, 0.0] * u.km, [0.0, 1.0, 0.0] * u.km / u.s, centre="earth", name="inside"
    )
    falling = Orbit.from_state(
        good.epoch, [1e6, 0.0, 0.0] * u.km, [-8.0, 0.0, 0.0] * u.km / u.s, centre="earth", name="falling"
    )
    orbits = [good, inside, good, falling, good]
    found = approaches_each(orbits, *span)
    for k, kind in ((1, InvalidInput), (3, Impact)):
        with pytest.raises(kind) as caught:
            approaches(orbits[k], *span)
        assert type(found[k]) is kind
        assert str(found[k]) == str(caught.value)
    assert [numbers(found[k]) for k in (0, 2, 4)] == 3 * [numbers(approaches(good, *span))]
    assert approaches_each([], *span) == []


def test_an_epoch_outside_of_the_ephemeris_is_an_error():
    good = Asteroid.from_catalogue("Apophis").orbit
    epoch = Time(ephemeris().start_jd - 400.0, format="jd", scale="tdb")
    early = Orbit.from_state(epoch, good.position, good.velocity, name="early")
    with pytest.raises(OutOfSpan):
        approaches_each([good, early], *(Time(t, scale="tdb") for t in SEARCH), ("earth",), 1e9)


@pytest.mark.parametrize(("workers", "chunk"), [(0, 1), (0, 3), (2, 1), (2, 4)])
def test_rows_are_those_of_single_searches(workers, chunk):
    wanted = settings(*SEARCH, within=0.2 * u.au, samples=3, seed=5, planets=("earth", "mars"))
    asteroids = bodies()
    rows = text(Screening(asteroids, wanted, alone))
    assert sum(len(json.loads(r)["rows"]) for r in rows.values()) > 10
    run = Screening(asteroids, wanted)
    assert isinstance(run.finder, BatchFinder)
    if not workers:
        found = text(run, chunk=chunk)
        if chunk == 1:
            assert list(found) == list(range(len(asteroids)))
    else:
        with open_executor(workers) as pool:
            found = text(run, pool, chunk=chunk)
    assert found == rows


def test_a_row_that_fails_is_that_of_a_single_search():
    row = dict(Asteroid.from_catalogue("Apophis").row)
    bad = [
        Asteroid(row | {"name": "none", "a_au": ""}),
        Asteroid(row | {"name": "sun", "a_au": "0.004", "e": "0.1"}),
    ]
    good = Asteroid.from_catalogue("Apophis")
    wanted = settings("2029-04-01", "2029-05-01")
    for asteroids in ([good, bad[0], good], [bad[1], good, good], [*bad, good]):
        found = text(Screening(asteroids, wanted))
        assert found == text(Screening(asteroids, wanted, alone))
        assert "INTACT" in found[2]


@pytest.mark.parametrize("kind", [Batched, Endless])
def test_a_search_that_fails_as_a_whole_is_done_one_by_one(kind):
    finder = kind(ZeroDivisionError("no reason"))
    run = screening(6, finder, time_limit=0.5)
    assert text(run) == text(screening(6, three))
    assert [c for c in finder.calls if isinstance(c, str)] == NAMES[:6]


def test_a_finder_of_a_user_gets_many_at_once():
    finder = Batched()
    found = text(screening(6, finder))
    assert finder.calls == [6]
    rows = text(screening(6, three))
    empty = NAMES.index("Toutatis")
    assert json.loads(found.pop(empty)) == {"rows": [], "samples": []}
    del rows[empty]
    assert found == rows
    with ThreadPoolExecutor(2) as pool:
        more = text(screening(6, finder), pool, window=2)
    assert finder.calls == [6, 3, 3]
    del more[empty]
    assert more == rows


def test_a_lost_search_names_some_of_its_asteroids():
    run = screening(40, Deadly())
    with open_executor(2) as pool, pytest.raises(WorkersLost, match=r"in progress: .*, .* and 2 others\."):
        list(scheduled(run.asteroids, range(40), run.settings, run.finder, pool, chunk=1, window=4, block=16))


def test_an_interrupted_run_searches_only_what_is_missing(tmp_path):
    wanted = settings(*SEARCH, within=0.05 * u.au)
    asteroids = bodies()[:12]

    def interrupt(state):
        if state.done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Screening(asteroids, wanted).run(tmp_path / "x.ecsv", progress=interrupt)
    seen = []

    class Recorded(OrbitSearch):
        def batch(self, asteroids, settings):
            seen.extend(a.name for a in asteroids)
            return super().batch(asteroids, settings)

    Screening(asteroids, wanted, Recorded()).run(tmp_path / "x.ecsv")
    assert seen == [a.name for a in asteroids[5:]]


def test_the_serial_executor_is_not_given_all_asteroids_at_once():
    finder = Batched()
    run = screening(150, finder)
    list(
        scheduled(
            run.asteroids, range(150), run.settings, finder, SerialExecutor(), chunk=1, window=1, block=16
        )
    )
    assert [c for c in finder.calls if isinstance(c, int)] == [64, 64, 22]
