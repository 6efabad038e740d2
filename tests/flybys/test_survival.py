"""Odds of survival from the uncertainty of an orbit."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab.errors import InvalidInput
from flybystab.flybys.survival import Survival
from flybystab.flybys.verdict import Verdict
from flybystab.orbit.covariance import SETS, Covariance
from flybystab.orbit.epochs import later

EPOCH = Time("2027-03-01", scale="tdb")
PILE = fs.Body(semi_axes=[140, 85, 75] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


def passing(miss, sigma, n=40):
    """Clones of a body on its way to the Earth at 6 km/s: misses and sigmas in km."""
    mean = [-6e5, *miss, 6.1, 0.0, 0.0]
    spread = np.diag([1e-6, *sigma, 1e-9, 1e-9, 1e-9]) ** 2.0
    covariance = Covariance.in_units(
        EPOCH, SETS["cartesian"], mean, spread, [*[u.km] * 3, *[u.km / u.s] * 3], "made"
    )
    orbit = fs.Orbit.from_state(
        EPOCH, mean[:3] * u.km, mean[3:] * u.km / u.s, centre="earth", name="x", covariance=covariance
    )
    return fs.encounter_distribution(orbit, "earth", later(EPOCH, 1e5), n=n, seed=2, search=1 * u.d)


@pytest.fixture(scope="module")
def uncertain():
    return passing((20_000.0, 3000.0), (6000.0, 1000.0))


def test_each_clone_meets_its_own_fate(uncertain):
    """The same as one flyby on the real orbit of that clone, at that attitude."""
    found = fs.survival(PILE, uncertain, attitude=np.eye(3))
    exact = fs.survival(PILE, uncertain, attitude=np.eye(3), quick=False)
    assert np.array_equal(found.verdict, exact.verdict)
    assert not exact.bounded.any()
    assert np.array_equal(found.verdict == "IMPACT", uncertain.impact)
    assert uncertain.impact.any()
    assert (found.verdict[~uncertain.impact] == "INTACT").any()
    near = int(np.argmin(np.where(uncertain.impact, np.inf, uncertain.distance.value)))
    for k in (near, int(np.argmax(uncertain.distance.value))):
        distance = uncertain.distance[k]
        encounter = fs.Encounter.from_orbit(
            uncertain.clones[k], "earth", later(uncertain.time, uncertain.time_offset[k].to_value(u.s)),
            start_distance=10 * max(distance, fs.R_earth),
        )  # fmt: skip
        one = fs.flyby(PILE, encounter, fs.periapsis_axes(encounter) @ np.eye(3), error=False, history=False)
        assert found.verdict[k] == one.verdict
        assert exact.margin[k].to_value(u.deg) == pytest.approx(one.margin.to_value(u.deg), abs=0.3)


@pytest.mark.parametrize("miss", [25_000.0, 60_000.0, 200_000.0])
def test_what_the_bound_decides_is_what_the_dynamics_says(miss):
    """The same verdicts, and no margin above the exact one, over attitudes; most distant clones need no dynamics."""
    spread = passing((miss, 3000.0), (0.15 * miss, 1000.0), n=30)
    found, exact = (fs.survival(PILE, spread, seed=1, quick=q) for q in (True, False))
    assert np.array_equal(found.verdict, exact.verdict)
    sure = found.bounded
    assert (found.verdict[sure] == "INTACT").all()
    assert np.all(found.margin[sure] <= exact.margin[sure] + 1e-6 * u.deg)
    assert np.array_equal(found.margin[~sure], exact.margin[~sure], equal_nan=True)
    assert sure.mean() == {25_000.0: 0.0, 200_000.0: 1.0}.get(miss, pytest.approx(0.5, abs=0.499))
    assert found.probabilities == exact.probabilities


def test_probabilities_have_intervals_and_add_up(uncertain):
    found = fs.survival(PILE, uncertain, seed=3)
    odds = found.probabilities
    assert sum(p for p, _, _ in odds.values()) == pytest.approx(1.0)
    assert odds["IMPACT"][0] == uncertain.impact_probability
    assert odds["IMPACT"][1:] == pytest.approx(uncertain.impact_interval())
    p, low, high = found.probability()
    assert low < p < high
    assert p == pytest.approx(sum(odds[v][0] for v in ("INTACT", "RESHAPED") if v in odds))
    again = fs.survival(PILE, uncertain, seed=3, workers=1)
    assert np.array_equal(again.verdict, found.verdict)


def test_a_known_orbit_gives_one_answer():
    """Far away everything survives; clones that never come near count as intact."""
    far = passing((200_000.0, 0.0), (1.0, 1.0), n=5)
    found = fs.survival(PILE, far)
    assert found.probability()[0] == 1.0
    assert found.probability()[1] == pytest.approx(0.025 ** (1 / 5))
    asteroid = fs.Asteroid.from_catalogue("Apophis")
    apophis = fs.encounter_distribution(asteroid, "earth", Time("2029-04-13", scale="tdb"), n=6)
    assert set(fs.survival(asteroid, apophis).verdict) == {"INTACT"}


def test_failures_widen_the_interval():
    verdict = np.array(["INTACT"] * 6 + ["FAILED"] * 2 + [str(Verdict.IMPACT)] * 2)
    some = Survival(
        verdict, np.ones(10, dtype=bool), np.zeros(10) * u.deg, np.full(10, ""), np.zeros(10, dtype=bool)
    )
    clean = replace(some, verdict=np.where(verdict == "FAILED", "IMPACT", verdict))
    assert some.probability()[0] == 0.6
    assert some.probability()[1] == clean.probability()[1]
    assert some.probability()[2] > clean.probability()[2]


def test_bad_arguments(uncertain):
    with pytest.raises(InvalidInput, match="attitude"):
        fs.survival(PILE, uncertain, attitude=np.eye(2))


def test_what_is_no_distribution_and_no_body_is_named(uncertain):
    encounter = fs.Encounter.hyperbolic("earth", 2.0 * fs.R_earth, 5 * u.km / u.s)
    with pytest.raises(InvalidInput, match=r"distribution = .*an EncounterDistribution, from flybystab"):
        fs.survival(PILE, encounter)
    with pytest.raises(
        InvalidInput, match=r"asteroid = PILE: expected a flybystab.Asteroid or a flybystab.Body"
    ):
        fs.survival("PILE", uncertain)
    with pytest.raises(InvalidInput, match=r"of an asteroid: asteroid.body"):
        fs.flyby(fs.Asteroid.from_catalogue("Apophis"), encounter)
