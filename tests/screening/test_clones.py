"""The uncertainty of an orbit in the samples of its encounters."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import AU, R_EARTH
from flybystab.encounter.encounter import Encounter
from flybystab.errors import NotConverged
from flybystab.orbit.orbit import Orbit
from flybystab.screening.clones import Clones, orbit_sampling
from flybystab.screening.encounters import CloseApproach, close_approaches
from flybystab.screening.screening import Screening, screen
from flybystab.screening.settings import settings

APOPHIS = Asteroid.from_catalogue("Apophis")
SPAN = "2029-04-01", "2029-05-01"


def with_spread(factor):
    """Apophis with all sigmas multiplied."""
    c = APOPHIS.orbit.covariance
    return replace(APOPHIS, covariance=replace(c, matrix=c.matrix * factor**2))


def only(asteroid):
    (found,) = close_approaches(asteroid, settings(*SPAN, within=0.01 * u.au))
    return found


def test_a_well_known_orbit_is_shared_by_all_samples():
    s = orbit_sampling(only(APOPHIS), 100, 0)
    assert s.clones is None
    assert s.sigma == pytest.approx(1100, rel=0.03)  # 3.3 km at three sigma (JPL)
    assert s.note == ""


def test_samples_of_a_badly_known_orbit_have_encounters_of_their_own():
    many, few = (orbit_sampling(only(with_spread(1000.0)), n, 3) for n in (24, 8))
    assert many.sigma == pytest.approx(1.1e6, rel=0.05)
    followed = many.clones.close_approaches(0, 24)
    distances = np.array([p.distance for p in followed])
    assert distances.std(ddof=1) == pytest.approx(1.1e6, rel=0.35)  # four sigma of the sampling of 24
    assert [p.distance for p in few.clones.close_approaches(0, 8)] == pytest.approx(distances[:8], rel=1e-9)
    p = min(followed, key=lambda p: p.distance)
    assert p.meet().distance.to_value(u.m) == pytest.approx(p.distance, abs=1e3)


#: Samples of the badly known orbit: several blocks of two and a part of one.
SAMPLES = 7


@pytest.fixture(scope="module")
def spread():
    """A screening of a badly known orbit, and its result with all samples in one block."""
    run = Screening(
        [with_spread(7000.0)], settings(*SPAN, within=0.01 * u.au, samples=SAMPLES, keep_samples=True)
    )
    ((_, result),) = run.results(block=SAMPLES)
    return run, result


def test_rows_draw_the_orbit_and_name_the_distance_among_the_contributors(spread):
    run, result = spread
    (row,) = result["rows"]
    assert "orbit" in row["drawn"].split("; ")
    assert row["error"] == ""
    assert row["distance_sigma"] == pytest.approx(7700, rel=0.1)
    assert len({s["distance"] for s in result["samples"]}) == SAMPLES
    assert run.fingerprint() != Screening([APOPHIS], run.settings).fingerprint()


def test_clones_and_rows_are_the_same_to_the_bit_however_they_are_split(spread):
    run, together = spread
    clones = orbit_sampling(only(run.asteroids[0]), SAMPLES, 0).clones
    whole = [p.distance for p in clones.close_approaches(0, SAMPLES)]
    assert whole == [clones.close_approaches(k, k + 1)[0].distance for k in range(SAMPLES)]
    with ThreadPoolExecutor(2) as pool:
        ((_, split),) = run.results(pool, block=2)
    assert repr(split) == repr(together)  # nan is nan
    assert [s["distance"] * AU for s in split["samples"]] == pytest.approx(whole, rel=1e-15)


def test_a_clone_that_cannot_be_followed_costs_its_own_sample_only(monkeypatch, spread):
    run, whole = spread
    lost = 3
    original = Clones.close_approaches

    def approaches_but_one(self, first, last):
        if first <= lost < last:
            raise NotConverged(f"clone {lost}: the step size collapsed")
        return original(self, first, last)

    monkeypatch.setattr(Clones, "close_approaches", approaches_but_one)
    for block in (SAMPLES, 2):
        ((_, found),) = Screening(run.asteroids, run.settings).results(block=block)
        errors = [s["error"] for s in found["samples"]]
        assert [k for k, e in enumerate(errors) if e] == [lost]
        assert errors[lost] == f"NotConverged: clone {lost}: the step size collapsed"
        assert found["rows"][0]["error"] == "1 samples: " + errors[lost]
        for k in set(range(SAMPLES)) - {lost}:
            assert found["samples"][k]["verdict"] == whole["samples"][k]["verdict"]


def test_what_is_not_known_of_an_orbit_is_said():
    bare = Asteroid(dict(APOPHIS.row) | {"number": "", "designation": "X"}, file="mine.csv")
    (row,) = screen([bare], *SPAN, within=0.01 * u.au, samples=4)
    assert "1-sigmas without correlations" in row["assumed"]
    assert np.isnan(row["distance_sigma"])
    row = {k: v for k, v in bare.row.items() if not k.startswith("sigma_")}
    (row_by_u,) = screen([Asteroid(row, file="mine.csv")], *SPAN, within=0.01 * u.au, samples=4)
    assert "U of its elements" in row_by_u["assumed"]
    none = Asteroid(row | {"condition_code": ""}, file="mine.csv")
    (row,) = screen([none], *SPAN, within=0.01 * u.au, samples=4)
    # the printed digits of the elements count where there is no U
    assert "known only by the digits" in row["assumed"]


def test_a_clone_that_stays_away_is_judged_without_following_it():
    p = CloseApproach(APOPHIS, "earth", Time(2462240.5, format="jd", scale="tdb"), 4.5e9, 6000.0, missed=True)
    assert np.isfinite(p.bounds()[0])
    with pytest.raises(LookupError, match="no encounter"):
        p.meet()


def test_periapsis_axes_of_an_impact_are_those_of_the_orbit_without_a_surface():
    axes = []
    for q in (0.95 * R_EARTH, 1.05 * R_EARTH):
        epoch = Time(2462240.5, format="jd", scale="tdb")
        start = Encounter.hyperbolic("earth", q * u.m, 6 * u.km / u.s, start_distance=60 * R_EARTH * u.m)
        r, v = (f(start.t_start * u.s).value for f in (start.position, start.velocity))
        orbit = Orbit.from_state(epoch, r * u.m, v * u.m / u.s, centre="earth")
        e = Encounter.from_orbit(orbit, "earth", epoch, start_distance=20 * R_EARTH * u.m)
        assert e.impact == (q < R_EARTH)
        assert e.periapsis_axes @ e.periapsis_axes.T == pytest.approx(np.eye(3), abs=1e-12)
        axes.append(e.periapsis_axes)
    # Scripted along x and z; the Moon and the Sun bend the way by a little.
    assert axes[0] == pytest.approx(np.eye(3), abs=0.02)
    assert axes[1] == pytest.approx(np.eye(3), abs=0.02)
