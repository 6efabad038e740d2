"""Virtual impactors: rare impacts against a normal law in closed form, and the published odds of 2024 YR4."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris
from scipy.stats import norm

import flybystab as fs
from flybystab.catalogues.catalogue import catalogue
from flybystab.constants import DAY
from flybystab.encounter.virtual_impactors import _width
from flybystab.errors import InvalidInput
from flybystab.orbit.covariance import SETS, Covariance
from flybystab.orbit.epochs import later
from flybystab.orbit.planets import planet
from flybystab.orbit.target_plane import capture_radius

EARTH = planet("earth")
EPOCH = Time("2027-03-01", scale="tdb")
SPEED = 15.0  # km/s at the epoch
V_INF = np.sqrt(SPEED**2 - 2 * EARTH.gm * 1e-9 / 1.3e6)
SCALE = SPEED / V_INF
DISC = capture_radius(EARTH.gm * 1e-9, EARTH.impact_distance * 1e-3, V_INF)


def impactor(miss, sigma):
    """A day before it meets the Earth along +x, off by `miss` (km; y, z); sigmas (km) across the path alone."""
    spread = np.diag([1e-6, *sigma, 1e-9, 1e-9, 1e-9]) ** 2.0
    mean = [-1.3e6, *miss, SPEED, 0.0, 0.0]
    units = [*[u.km] * 3, *[u.km / u.s] * 3]
    known = Covariance.in_units(EPOCH, SETS["cartesian"], mean, spread, units, "made")
    return fs.Orbit.from_state(
        EPOCH, mean[:3] * u.km, mean[3:] * u.km / u.s, centre="earth", covariance=known
    )


@pytest.mark.parametrize("miss", [30e3, 90e3, 120e3])
def test_the_chord_through_the_disc(miss):
    """One direction uncertain: probabilities down to 1e-8, which no number of clones reaches."""
    sigma = 20e3
    orbit = impactor((miss, 2000.0), (sigma, 1.0))
    found = fs.virtual_impactors(orbit, EPOCH, later(EPOCH, 3 * DAY), n=81, sigmas=8.0)
    assert len(found) == 1
    near = fs.find_encounters(orbit, EPOCH, later(EPOCH, 3 * DAY))[0]
    t, r = -near["b_t"].to_value(u.km), near["b_r"].to_value(u.km)
    half = np.sqrt(DISC**2 - r**2)
    exact = norm.sf((t - half) / (sigma * SCALE)) - norm.sf((t + half) / (sigma * SCALE))
    assert found["probability"][0] == pytest.approx(exact, rel=0.05)
    assert exact < 0.2 * (miss / 30e3) ** -8
    assert abs(found["sigma"][0]) == pytest.approx(t / (sigma * SCALE), rel=0.02)
    assert found["stretching"][0].to_value(u.km) == pytest.approx(sigma * SCALE, rel=0.02)


def test_no_impact_is_an_empty_table():
    found = fs.virtual_impactors(impactor((120e3, 2e3), (1e3, 1.0)), EPOCH, later(EPOCH, 3 * DAY), n=21)
    assert len(found) == 0
    assert found.colnames == ["time", "distance", "sigma", "stretching", "width", "probability", "v_inf"]


def test_2024_yr4_and_the_moon(shared):
    """CNEOS: 4.3 % on 2032-12-22 (June 2025), ESA about 4 %."""
    (asteroid,) = catalogue(shared / "neocc" / "2024YR4.ke1")
    span = Time("2032-12-15", scale="tdb"), Time("2032-12-30", scale="tdb")
    found = fs.virtual_impactors(asteroid, *span, "moon", n=101)
    assert len(found) == 1
    assert found["probability"][0] == pytest.approx(0.043, abs=0.01)
    assert found["time"][0].tdb.iso[:10] == "2032-12-22"
    assert len(fs.virtual_impactors(asteroid, *span, "earth", n=101, least=1e-9)) == 0


def test_bad_arguments_are_named():
    bare = fs.Orbit.from_state(EPOCH, [1, 0, 0] * u.au, [0, 30, 0] * u.km / u.s)
    end = later(EPOCH, 3 * DAY)
    with pytest.raises(InvalidInput, match="covariance"):
        fs.virtual_impactors(bare, EPOCH, end)
    with pytest.raises(InvalidInput, match="orbit"):
        fs.virtual_impactors("Apophis", EPOCH, end)
    with pytest.raises(InvalidInput, match=r"sigmas = 20.0: .* at most 10 standard deviations"):
        fs.virtual_impactors(impactor((1e4, 1e3), (1e3, 1.0)), EPOCH, end, sigmas=20.0)


def test_a_line_beyond_the_conics_is_an_error_that_names_where():
    """A nearly circular orbit with an uncertainty of 0.02 in its eccentricity of 0.01."""
    need_ephemeris("de421")
    names = SETS["keplerian"]
    mean, sigma = [1.0, 0.01, 3.0, 10.0, 20.0, 30.0], [1e-9, 2e-2, 1e-9, 1e-9, 1e-9, 1e-9]
    units = [u.au, u.one, *[u.deg] * 4]
    known = Covariance.in_units(EPOCH, names, mean, np.diag(sigma) ** 2.0, units, "made")
    orbit = fs.Orbit.from_elements(
        epoch=EPOCH,
        a=1.0 * u.au,
        e=0.01,
        i=3 * u.deg,
        node=10 * u.deg,
        peri=20 * u.deg,
        M=30 * u.deg,
        covariance=known,
    )
    with pytest.raises(InvalidInput, match=r"sigmas = [0-9.]+: .*not those of a conic") as error:
        fs.virtual_impactors(orbit, later(EPOCH, DAY), later(EPOCH, 2 * DAY), sigmas=3.0, ephemeris="de421")
    assert 0.5 <= float(error.value.value) <= 0.6


def test_the_width_of_a_narrow_ellipse_is_a_number():
    rng = np.random.default_rng(1)
    negative = 0
    for _ in range(200):
        way, line = rng.normal(size=6), rng.normal(size=2)
        way /= np.linalg.norm(way)
        matrix = 1e12 * np.outer(line, way) + 1e-6 * rng.normal(size=(2, 6))
        along = matrix @ way
        across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        negative += across @ (matrix @ matrix.T) @ across < 0.0
        assert 0.0 <= _width(matrix, along) < 1e-2
    assert negative > 20  # the quadratic form has no root there
    turned = np.array([[3.0, 0.0], [0.0, 0.5]])
    assert _width(turned, turned @ [1.0, 0.0]) == pytest.approx(0.5)
