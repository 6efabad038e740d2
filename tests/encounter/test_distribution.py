"""Clones at an encounter: against a normal law in closed form, two routes against each other, published odds."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from scipy.stats import binom, ncx2, norm

import flybystab as fs
from flybystab.catalogues.catalogue import catalogue
from flybystab.encounter.linear_target_plane import disc_probability, ellipse
from flybystab.errors import InvalidInput, NoEncounter
from flybystab.orbit.covariance import SETS, Covariance
from flybystab.orbit.epochs import later
from flybystab.orbit.planets import planet
from flybystab.orbit.target_plane import capture_radius

EARTH = planet("earth")
EPOCH = Time("2027-03-01", scale="tdb")
SPEED = 15.0  # km/s at the epoch


def impactor(miss, sigma, distance=1.3e6):
    """A day before it meets the Earth along +x, off by `miss` (km; y, z); sigmas (km) across the path alone."""
    spread = np.diag([1e-6, sigma[0], sigma[1], 1e-9, 1e-9, 1e-9]) ** 2.0
    mean = [-distance, *miss, SPEED, 0.0, 0.0]
    covariance = Covariance.in_units(
        EPOCH, SETS["cartesian"], mean, spread, [*[u.km] * 3, *[u.km / u.s] * 3], "made"
    )
    return fs.Orbit.from_state(
        EPOCH, mean[:3] * u.km, mean[3:] * u.km / u.s, centre="earth", name="impactor", covariance=covariance
    )


#: Hyperbolic excess speed, and misses to target-plane points: B = miss v/v_inf. The tides of Sun and Moon shift all of
#: them alike, by 0.2 thousand km: the middle is taken from the nominal orbit.
V_INF = np.sqrt(SPEED**2 - 2 * EARTH.gm * 1e-9 / 1.3e6)
SCALE = SPEED / V_INF
DISC = capture_radius(EARTH.gm * 1e-9, EARTH.impact_distance * 1e-3, V_INF)


@pytest.fixture(scope="module")
def round_one():
    orbit = impactor((4000.0, 3000.0), (6000.0, 6000.0))
    return fs.encounter_distribution(orbit, "earth", later(EPOCH, 86400.0), n=2000, seed=4, search=0.9 * u.d)


def test_probability_of_a_round_normal_law(round_one):
    """Miss distances over sigma are noncentral chi-squared with two degrees of freedom."""
    sigma = 6000.0 * SCALE
    centre = round_one.linear.centre.to_value(u.km)
    np.testing.assert_allclose(centre, [-4000.0, -3000.0], atol=300.0)
    exact = ncx2.cdf((DISC / sigma) ** 2, 2, centre @ centre / sigma**2)
    assert round_one.linear.impact_probability == pytest.approx(exact, rel=3e-3)
    low, high = binom.ppf([1e-4, 1 - 1e-4], 2000, exact)
    assert low <= round_one.impact.sum() <= high
    assert round_one.impact_interval(0.999)[0] < exact < round_one.impact_interval(0.999)[1]
    assert round_one.linear.nonlinearity < 1e-2
    assert round_one.found.all()


def test_target_plane_points_are_the_misses(round_one):
    """T = x cross z = -y and R = -z: the clones' B are their misses, scaled by v/v_inf."""
    clones = np.array([c.position.to_value(u.km)[1:] for c in round_one.clones])
    v_inf = round_one.v_inf.to_value(u.km / u.s)
    b = round_one.b.to_value(u.km)
    shift = round_one.linear.centre.to_value(u.km) - [-4000.0 * SCALE, -3000.0 * SCALE]
    np.testing.assert_allclose(b, -clones * SCALE + shift, atol=100.0)
    np.testing.assert_allclose(v_inf, V_INF, rtol=2e-3)
    major, minor, _ = ellipse(round_one.linear.covariance)
    assert major.to_value(u.km) == pytest.approx(6000 * SCALE, rel=3e-3)
    assert minor.to_value(u.km) == pytest.approx(6000 * SCALE, rel=3e-3)
    sample = round_one.b_covariance.to_value(u.km**2)
    error = 5 * np.sqrt(2 / 2000)
    np.testing.assert_allclose(
        sample / round_one.linear.covariance.to_value(u.km**2)[0, 0], np.eye(2), atol=error
    )
    # impacts carry the distance of the two-body orbit: the same B
    q = round_one.distance.to_value(u.m)
    want = capture_radius(EARTH.gm, q, v_inf * 1e3)
    np.testing.assert_allclose(np.hypot(*b.T) * 1e3, want, rtol=2e-3, atol=2e4)
    assert (q[round_one.impact] < EARTH.impact_distance * 1.001).all()
    assert (q[~round_one.impact] > EARTH.impact_distance * 0.999).all()


def test_a_long_ellipse():
    """One direction uncertain: the chord through the disc."""
    orbit = impactor((30_000.0, 2000.0), (20_000.0, 1.0))
    found = fs.encounter_distribution(orbit, "earth", later(EPOCH, 86400.0), n=50, search=0.9 * u.d)
    t, r = found.linear.centre.to_value(u.km)
    half, sigma = np.sqrt(DISC**2 - r**2), 20_000 * SCALE
    exact = norm.cdf((half - t) / sigma) - norm.cdf((-half - t) / sigma)
    assert found.linear.impact_probability == pytest.approx(exact, rel=1e-2)
    _, _, angle = ellipse(found.linear.covariance)
    assert min(angle.value, 180 - angle.value) < 0.1  # along T


@pytest.mark.parametrize("far", [0.0, 3.0, 8.0])
@pytest.mark.parametrize("sigma", [0.01, 1.0, 300.0])
def test_disc_probability_against_the_noncentral_law(far, sigma):
    exact = ncx2.cdf(1 / sigma**2, 2, (far / sigma) ** 2) if far < 40 * sigma else 0.0
    ours = disc_probability(np.array([0.6 * far, -0.8 * far]), np.eye(2) * sigma**2, 1.0)
    assert ours == pytest.approx(exact, rel=1e-6, abs=1e-30)


def test_disc_probability_of_a_tilted_ellipse_against_sampling():
    rng = np.random.default_rng(1)
    half = np.array([[2.0, 0.0], [-1.1, 0.2]])
    points = np.array([0.4, 0.7]) + rng.normal(size=(400_000, 2)) @ half.T
    share = np.mean(np.hypot(*points.T) < 1)
    ours = disc_probability(np.array([0.4, 0.7]), half @ half.T, 1.0)
    assert abs(ours - share) < 5 * np.sqrt(share / 400_000)


def test_apophis_by_both_routes():
    orbit = fs.Asteroid.from_catalogue("Apophis")
    found = fs.encounter_distribution(orbit, "earth", Time("2029-04-13", scale="tdb"), n=100, seed=3)
    assert 3 * found.linear.distance_sigma.to_value(u.km) == pytest.approx(3.3, abs=0.1)
    assert (found.distance_sigma / found.linear.distance_sigma).value == pytest.approx(
        1, abs=4 / np.sqrt(200)
    )
    assert (found.time_sigma / found.linear.time_sigma).value == pytest.approx(1, abs=4 / np.sqrt(200))
    low, high = found.distance_interval(0.9)
    assert low < found.nominal["distance"] < high
    assert found.impact_probability == 0.0
    assert found.impact_interval()[1] == pytest.approx(1 - 0.025 ** (1 / 100))
    assert found.linear.impact_probability == 0.0
    assert found.correlated


def test_2024_yr4_and_the_moon(shared):
    """CNEOS gave 4.3 % for the Moon on 2032-12-22 (June 2025), ESA about 4 %; nothing for the Earth."""
    (asteroid,) = catalogue(shared / "neocc" / "2024YR4.ke1")
    day = Time("2032-12-22", scale="tdb")
    moon = fs.encounter_distribution(asteroid, "moon", day, n=200, seed=1, search=5 * u.d)
    assert moon.linear.impact_probability == pytest.approx(0.043, abs=0.01)
    low, high = binom.ppf([1e-3, 1 - 1e-3], 200, moon.linear.impact_probability)
    assert low <= moon.impact.sum() <= high
    earth = fs.encounter_distribution(asteroid, "earth", day, n=20, seed=1, search=5 * u.d)
    assert earth.linear.impact_probability < 1e-6
    assert earth.distance_interval(1.0)[0] > 1e5 * u.km


def test_bad_arguments_are_named():
    bare = fs.Orbit.from_state(EPOCH, [1, 0, 0] * u.au, [0, 30, 0] * u.km / u.s)
    with pytest.raises(InvalidInput, match="covariance"):
        fs.encounter_distribution(bare, "earth", EPOCH)
    with pytest.raises(InvalidInput, match="orbit"):
        fs.encounter_distribution("Apophis", "earth", EPOCH)
    orbit = fs.Asteroid.from_catalogue("Apophis")
    with pytest.raises(NoEncounter, match="mars"):
        fs.encounter_distribution(orbit, "mars", Time("2029-04-13", scale="tdb"), n=5)
