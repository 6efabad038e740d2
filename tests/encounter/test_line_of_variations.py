"""The line of variations carried to a time near the span, against integration from the epoch."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

from flybystab.catalogues.catalogue import catalogue
from flybystab.encounter import line_of_variations as module
from flybystab.encounter.line_of_variations import LineOfVariations
from flybystab.encounter.virtual_impactors import virtual_impactors
from flybystab.orbit.planets import planet

SPAN = Time("2032-12-15", scale="tdb"), Time("2032-12-30", scale="tdb")


@pytest.fixture(scope="module")
def yr4(shared):
    need_ephemeris("de440")
    return catalogue(shared / "neocc" / "2024YR4.ke1")[0].orbit


def test_orbits_from_the_spline_meet_the_moon_where_those_from_the_epoch_do(yr4, monkeypatch):
    """On the line and off it, out to four sigma."""
    line = LineOfVariations(yr4, planet("moon"), *SPAN, 4.0, None, None)
    assert line.ahead is not None
    assert line.ahead.orbit.epoch > Time("2032-01-01", scale="tdb")
    across = np.eye(len(line.way))[np.argmin(np.abs(line.way))]
    across -= (across @ line.way) * line.way
    z = np.concatenate([np.outer([-4.0, -1.3, 0.0, 0.4, 4.0], line.way), line.way + across[None, :]])
    near = line.encounters(z, *SPAN, 5e9)
    monkeypatch.setattr(LineOfVariations, "_ahead", lambda *_: None)
    whole = LineOfVariations(yr4, planet("moon"), *SPAN, 4.0, None, None)
    assert whole.ahead is None
    assert abs(whole.way @ line.way) == pytest.approx(1.0)
    far = whole.encounters(z, *SPAN, 5e9)
    assert list(near["index"]) == list(far["index"])
    assert len(near) >= 6
    # 24,000 km by one sigma along the line
    gap = np.hypot(*((near[k] - far[k]).to_value(u.km) for k in ("b_t", "b_r")))
    assert gap.max() < 5.0


def test_the_probability_does_not_depend_on_the_spline(yr4, monkeypatch):
    near = virtual_impactors(yr4, *SPAN, "moon", n=41)
    monkeypatch.setattr(LineOfVariations, "_ahead", lambda *_: None)
    far = virtual_impactors(yr4, *SPAN, "moon", n=41)
    assert near["probability"][0] == pytest.approx(far["probability"][0], rel=2e-3)
    assert near["width"][0].to_value(u.km) == pytest.approx(far["width"][0].to_value(u.km), rel=0.02)


def test_an_encounter_on_the_way_ends_the_spline(yr4):
    """The passage of December 2032 spreads the line: a search in 2050 starts before it."""
    later = Time("2050-01-01", scale="tdb"), Time("2050-06-01", scale="tdb")
    line = LineOfVariations(yr4, planet("earth"), *later, 3.0, None, None)
    assert line.ahead is not None
    assert Time("2031-01-01", scale="tdb") < line.ahead.orbit.epoch < Time("2033-01-01", scale="tdb")


def test_no_spline_from_an_epoch_inside_the_span(yr4):
    epoch = yr4.covariance.epoch
    line = LineOfVariations(yr4, planet("earth"), epoch - 300 * u.d, epoch + 300 * u.d, 3.0, None, None)
    assert line.ahead is None
    assert np.linalg.norm(line.way) == pytest.approx(1.0)
    assert module._NODES % 2 == 1  # the middle one is z = 0
