"""Palermo and Torino scales: closed forms, corners of the diagram, and published values."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.encounter.hazard_scales import MEGATON, impact_energy, palermo_scale, torino_scale

MT = MEGATON * u.J


def test_the_background_itself_has_zero():
    """P = f dt, and a factor of ten is one unit."""
    chance = 0.03 * 100.0**-0.8 * 20.0
    assert palermo_scale(chance, 100 * MT, 20 * u.yr) == pytest.approx(0.0, abs=1e-4)  # a Julian year
    assert palermo_scale(chance / 10, 100 * MT, 20 * u.yr) == pytest.approx(-1.0, abs=1e-4)
    assert palermo_scale(0.0, 100 * MT, 20 * u.yr) == -np.inf


def test_energy():
    """The Tsar bomb: 50 Mt."""
    assert impact_energy(2.0 * 50 * MEGATON / 4e8 * u.kg, 20 * u.km / u.s).to_value(u.J) == pytest.approx(
        50 * MEGATON
    )


@pytest.mark.parametrize(
    ("chance", "energy", "years", "palermo", "torino"),
    [
        # Sentry on 2006-02-23: 2004 VD17 in 2102, 2.7e11 kg at 21.4 km/s, -0.40 and 2, the second ever above 1
        (5.4e-4, 1.48e4, 96.2, -0.40, 2),
        # Sentry on 2006-10-19: Apophis in 2036, -2.52 and 0 (it had been 1 until August)
        (2.2e-5, 400.0, 29.5, -2.52, 0),
        # Sentry on 2004-12-27: Apophis in 2029, 1 in 37 against a background of 1 in 472, 1.10 and 4
        (0.027, 1480.0, 24.3, 1.10, 4),
        # Sentry on 2025-02-18: 2024 YR4 in 2032, 3.1 %, 3
        (0.031, 7.8, 7.86, -0.18, 3),
        # Bennu in 2182 (0.037 %: Farnocchia et al. 2021); beyond the century of Torino
        (3.7e-4, 1420.0, 161.0, -1.59, None),
    ],
)
def test_published_values(chance, energy, years, palermo, torino):
    assert palermo_scale(chance, energy * MT, years * u.yr) == pytest.approx(palermo, abs=0.05)
    if torino is not None:
        assert torino_scale(chance, energy * MT) == torino


def test_the_background_published_for_apophis():
    """1 in 472 until April 2029 (December 2004): the ratio to 1 in 37 is the 12.6 of its Palermo value of 1.10."""
    assert palermo_scale(1 / 472, 1480 * MT, 24.3 * u.yr) == pytest.approx(0.0, abs=0.005)
    assert np.log10(472 / 37) == pytest.approx(1.10, abs=0.01)


def test_torino_of_2024_yr4_as_its_probability_fell():
    """3 at 3.1 %, 1 at 0.28 % (2025-02-20), 0 at 0.005 % (2025-02-24)."""
    assert [torino_scale(p, 7.8 * MT) for p in (0.031, 0.0028, 5e-5)] == [3, 1, 0]


def test_energy_of_2004_vd17():
    """2.7e11 kg (Sentry, 2006-02-23) and 15 Gt, as reported then."""
    energy = impact_energy(2.7e11 * u.kg, 21.4 * u.km / u.s)
    assert energy.to_value(u.J) / MEGATON == pytest.approx(15e3, rel=0.05)


@pytest.mark.parametrize(
    ("chance", "energy", "torino"),
    [
        (0.5, 0.9, 0),
        (1.0, 1.1, 8),
        (1.0, 1.1e2, 9),
        (1.0, 1.1e5, 10),
        (0.98, 50.0, 3),
        (0.011, 1.1e2, 4),
        (0.98, 9e4, 5),
        (0.5, 1.1e5, 7),
        (0.0099, 1.1e5, 6),
        (0.0099, 1.1e2, 2),
        (0.0099, 9e1, 1),
        (1e-8, 1e7, 0),
        (1e-8, 1.1e8, 1),
        (1e-6, 1.1e8, 2),
        (1e-6, 1.1e11, 6),
    ],
)
def test_corners_of_the_diagram(chance, energy, torino):
    assert torino_scale(chance, energy * MT) == torino


def test_it_never_falls_with_probability():
    for energy in np.logspace(-1, 8, 40):
        found = [torino_scale(p, energy * MT) for p in np.logspace(-9, -2.001, 60)]
        assert found == sorted(found)


def test_bad_arguments_are_named():
    with pytest.raises(fs.errors.InvalidInput, match="probability"):
        torino_scale(1.1, 1 * MT)
    with pytest.raises(fs.errors.InvalidInput, match="energy"):
        palermo_scale(0.1, -1 * MT, 1 * u.yr)
    with pytest.raises(fs.errors.UnitMismatch):
        palermo_scale(0.1, 1 * u.m, 1 * u.yr)
