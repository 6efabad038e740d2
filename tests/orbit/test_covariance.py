"""Clones of an orbit: their distribution, the epoch of the covariance, published errors."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from scipy.stats import chi2

from flybystab.catalogues.catalogue import Asteroid
from flybystab.errors import InvalidInput, UnitMismatch, UnknownName
from flybystab.orbit.covariance import SETS, Covariance
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

EPOCH = Time(2461000.5, format="jd", scale="tdb")
WEEKS = Time("2029-04-06", scale="tdb"), Time("2029-04-20", scale="tdb")
UNITS = {
    "cometary": (u.one, u.au, u.d, u.deg, u.deg, u.deg),
    "keplerian": (u.au, u.one, u.deg, u.deg, u.deg, u.deg),
    "equinoctial": (u.au, *[u.one] * 4, u.deg),
    "cartesian": (*[u.km] * 3, *[u.mm / u.s] * 3),
}
VALUES = {
    "cometary": (0.3, 0.9, 50.0, 10.0, 20.0, 5.0),
    "keplerian": (1.3, 0.3, 5.0, 10.0, 20.0, 40.0),
    "equinoctial": (1.3, 0.15, 0.26, 0.0076, 0.043, 70.0),
    "cartesian": (1.5e8, 2e7, 1e6, -3e6, 2.9e7, 1e6),
}


def random_covariance(kind, seed=0, scale=1e-7):
    """A full covariance with one direction known a thousand times better than the others."""
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(6, 6)) * np.array([1e-3, 1, 1, 1, 1, 1])
    half *= (scale * np.abs(VALUES[kind]))[:, None]
    return Covariance.in_units(EPOCH, SETS[kind], VALUES[kind], half @ half.T, UNITS[kind], "made up")


def apophis():
    return Asteroid.from_catalogue("Apophis").orbit


@pytest.mark.parametrize("kind", SETS)
def test_samples_have_the_mean_and_covariance_that_were_given(kind):
    covariance = random_covariance(kind)
    n = 40_000
    x, again = covariance.samples(n, 3)
    assert again == 0
    # Whitened along the principal axes: every entry within 5 standard errors.
    z = np.linalg.solve(covariance.factor, (x - covariance.values).T)
    assert np.abs(z.mean(axis=1)).max() < 5 / np.sqrt(n)
    assert np.abs(np.cov(z) - np.eye(6)).max() < 5 * np.sqrt(2 / n)


@pytest.mark.parametrize("kind", SETS)
def test_states_deviate_by_the_derivative_times_the_deviation(kind):
    """The state of each set against its own numerical derivative, and all three sets through one state."""
    covariance = random_covariance(kind, scale=1e-6)
    x = covariance.samples(5, 1)[0]
    states, pushes = covariance.deviations(x)
    assert not pushes.any()
    jacobian = np.empty((6, 6))
    for j in range(6):
        step = np.zeros(6)
        step[j] = 1e-5 * abs(covariance.values[j])
        plus, minus = (covariance.states((covariance.values + s * step)[None])[0] for s in (1, -1))
        jacobian[:, j] = (plus - minus) / (2 * step[j])
    linear = (x - covariance.values) @ jacobian.T
    size = np.array([1.0] * 3 + [2e-7] * 3)
    assert np.abs((states - linear) * size).max() < 1e-4 * np.abs(linear * size).max()


def as_elements(kind, values):
    """Arguments of Orbit.from_elements from values in the units of UNITS."""
    at = dict(zip(SETS[kind], (v * x for v, x in zip(values, UNITS[kind], strict=True)), strict=True))
    if kind == "cometary":
        at["Tp"] = EPOCH + at.pop("tp")
    return at


@pytest.mark.parametrize("kind", ["cometary", "keplerian"])
@pytest.mark.parametrize("centre", ["sun", "ssb"])
@pytest.mark.parametrize("frame", ["ecliptic", "ICRF"])
def test_states_of_a_covariance_are_those_of_orbits_with_its_frame_and_centre(kind, centre, frame):
    matrix = np.diag((1e-8 * np.abs(VALUES[kind])) ** 2)
    made = Covariance.in_units(
        EPOCH, SETS[kind], VALUES[kind], matrix, UNITS[kind], frame=frame, centre=centre
    )
    orbit = Orbit.from_elements(EPOCH, **as_elements(kind, VALUES[kind]), frame=frame, centre=centre)
    state = [*orbit.position.to_value(u.m), *orbit.velocity.to_value(u.m / u.s)]
    np.testing.assert_allclose(made.states(made.values[None, :])[0], state, rtol=1e-11, atol=1e-6)
    others = [
        Covariance.in_units(EPOCH, SETS[kind], VALUES[kind], matrix, UNITS[kind], frame=f, centre=c)
        for f in ("ecliptic", "ICRF") for c in ("sun", "ssb") if (f, c) != (frame, centre)
    ]  # fmt: skip
    for other in others:
        assert not np.allclose(other.states(made.values[None, :])[0], state, rtol=1e-5)


@pytest.mark.parametrize("kind", SETS)
@pytest.mark.parametrize("centre", ["sun", "ssb"])
@pytest.mark.parametrize("frame", ["ecliptic", "ICRF"])
def test_sigma_points_have_the_covariance_of_the_state(kind, centre, frame):
    """The columns of the sigma points, rotated to the frame explicitly, against a covariance converted as a whole."""
    plain = random_covariance(kind)
    made = replace(plain, frame=frame, centre=centre)
    orbit = replace(apophis(), epoch=EPOCH, centre=centre, covariance=made)
    pairs = orbit.sigma_points()
    assert all(x.centre == centre for pair in pairs for x in pair)
    columns = np.array(
        [[*(p.position - m.position).to_value(u.m), *(p.velocity - m.velocity).to_value(u.m / u.s)] for p, m in pairs]
    ).T / 2.0  # fmt: skip
    state = made.as_state()
    assert (state.frame, state.centre, state.elements) == ("ICRF", centre, "cartesian")
    size = np.sqrt(np.outer(np.diag(state.matrix), np.diag(state.matrix)))
    np.testing.assert_allclose(columns @ columns.T / size, state.matrix / size, atol=2e-6)
    # The same numbers in the other frame are the same points turned.
    other = replace(made, frame="ICRF" if frame == "ecliptic" else "ecliptic").as_state()
    c, s = np.cos(np.radians(84381.448 / 3600)), np.sin(np.radians(84381.448 / 3600))
    turn = np.kron(np.eye(2), np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))
    if frame == "ecliptic":
        turn = turn.T
    np.testing.assert_allclose(turn @ state.matrix @ turn.T / size, other.matrix / size, atol=2e-6)


def test_estimated_parameters_stay_in_the_covariance_of_the_state():
    names = (*SETS["keplerian"], "A2")
    half = (
        np.random.default_rng(4).normal(size=(7, 7))
        * (1e-8 * np.array([2e11, 0.3, 0.1, 0.2, 0.3, 0.7, 1e-12]))[:, None]
    )
    values = np.array([1.3 * 1.495978707e11, 0.3, 0.1, 0.2, 0.3, 0.7, -5e-13])
    state = Covariance(EPOCH, names, values, half @ half.T).as_state()
    assert state.names == (*SETS["cartesian"], "A2")
    assert state.values[-1] == values[-1]
    assert state.sigma[-1] == pytest.approx(np.linalg.norm(half[-1]))


def test_unknown_frames_and_centres_are_refused():
    with pytest.raises(UnknownName, match="ecliptic"):
        replace(random_covariance("keplerian"), frame="galactic")
    with pytest.raises(UnknownName, match="ssb"):
        replace(random_covariance("keplerian"), centre="vulcan")


def test_keplerian_and_cometary_elements_are_the_same_state():
    kepler = random_covariance("keplerian")
    a, e, i, node, peri, mean = kepler.values
    n = np.sqrt(1.32712440041279419e20 / a**3)
    other = Covariance(
        EPOCH, SETS["cometary"], np.array([e, a * (1 - e), -mean / n, node, peri, i]), np.eye(6) * 1e-12
    )
    gap = kepler.states(kepler.values[None]) - other.states(other.values[None])
    assert np.abs(gap[0, :3]).max() < 1e-2


def test_clones_depend_on_the_seed_and_their_number_alone():
    orbit = Orbit.from_state(
        EPOCH,
        [1.5e8, 2e7, 1e6] * u.km,
        [-3, 29, 1] * u.km / u.s,
        name="X",
        covariance=random_covariance("cartesian"),
    )
    few, many, other = orbit.clones(3, seed=5), orbit.clones(10, seed=5), orbit.clones(3, seed=6)
    for k in range(3):
        assert np.array_equal(few[k].position.value, many[k].position.value)
        assert not np.array_equal(few[k].position.value, other[k].position.value)
    assert few[2].name == "X clone 2"
    assert few[2].covariance is None


def test_wide_distributions_stay_conics():
    """Near e = 1 cometary elements go on to hyperbolas; e below zero is drawn again, from the same seed."""
    wide = Covariance.in_units(
        EPOCH,
        SETS["cometary"],
        (0.98, 0.9, 50, 10, 20, 5),
        np.diag([0.05, 1e-3, 1, 1, 1, 1]) ** 2.0,
        UNITS["cometary"],
    )
    x, again = wide.samples(500, 1)
    assert again == 0
    assert (x[:, 0] > 1).any()
    assert np.isfinite(wide.states(x)).all()
    round_ = Covariance.in_units(
        EPOCH,
        SETS["keplerian"],
        (1.3, 0.01, 5, 10, 20, 5),
        np.diag([1e-6, 0.01, 1, 1, 1, 1]) ** 2.0,
        UNITS["keplerian"],
    )
    x, again = round_.samples(500, 1)
    assert 40 < again < 160  # a sixth of a normal distribution lies below minus one sigma
    assert (x[:, 1] >= 0).all()
    assert np.array_equal(x[:100], round_.samples(100, 1)[0])


def test_what_is_no_covariance_is_refused():
    good = random_covariance("cartesian")
    with pytest.raises(InvalidInput, match="eigenvalue"):
        Covariance(EPOCH, good.names, good.values, np.ones((6, 6)) * 2 - np.eye(6))
    skew = good.matrix.copy()
    skew[0, 1] *= 1.1
    with pytest.raises(InvalidInput, match="symmetric"):
        Covariance(EPOCH, good.names, good.values, skew)
    with pytest.raises(InvalidInput, match="names"):
        Covariance(EPOCH, ("a", "e", "i", "node", "peri", "tp"), good.values, good.matrix)
    with pytest.raises(InvalidInput, match="variances"):
        Covariance(EPOCH, good.names, good.values, -good.matrix)
    with pytest.raises(InvalidInput, match="conic"):
        Covariance(EPOCH, SETS["keplerian"], np.array([1e11, 1.2, 0, 0, 0, 0]), np.eye(6))
    with pytest.raises(UnitMismatch):
        Covariance.in_units(EPOCH, good.names, good.values, good.matrix, [u.km] * 6)
    orbit = Orbit.from_state(EPOCH, [1, 0, 0] * u.au, [0, 30, 0] * u.km / u.s)
    with pytest.raises(InvalidInput, match="covariance"):
        orbit.clones(3)
    with pytest.raises(InvalidInput, match="n = 0"):
        apophis().clones(0)


def test_an_epoch_apart_from_the_elements_is_met():
    """JPL's covariance of Apophis belongs to 2021, its elements to 2025; they are one orbit.

    The way there, by this package's forces, ends well inside the covariance: a wrong angle, epoch or order
    would be off by thousands of sigmas.
    """
    orbit = apophis()
    covariance = orbit.covariance
    assert abs(covariance.epoch.jd - orbit.epoch.jd) > 1000
    r, v = orbit.at(covariance.epoch, "sun")
    gap = (
        np.concatenate([r.to_value(u.m), v.to_value(u.m / u.s)])
        - covariance.states(covariance.values[None])[0]
    )
    deviations, _ = covariance.deviations(covariance.samples(2000, 1)[0])
    assert gap @ np.linalg.solve(np.cov(deviations.T), gap) < chi2.ppf(0.95, 6)
    assert np.linalg.norm(gap[:3]) < 500


def test_perigee_of_apophis_is_as_uncertain_as_jpl_says():
    """3.3 km at 3 sigma (JPL 220), by the linear map and by clones."""
    orbit = apophis()
    pairs = orbit.sigma_points()
    table = find_encounters([o for pair in pairs for o in pair], *WEEKS, within=0.01 * u.au)
    q = table["distance"].to_value(u.km).reshape(-1, 2)
    linear = np.sqrt(np.sum((0.5 * (q[:, 0] - q[:, 1])) ** 2))
    assert 3 * linear == pytest.approx(3.3, abs=0.1)
    assert np.abs(q.mean(axis=1) - q.mean()).max() < 1e-2  # nothing beyond the linear map
    n = 100
    table = find_encounters(list(orbit.clones(n, seed=2)), *WEEKS, within=0.01 * u.au)
    assert len(table) == n
    spread = np.std(table["distance"].to_value(u.km), ddof=1)
    assert spread == pytest.approx(linear, rel=4 / np.sqrt(2 * n))
