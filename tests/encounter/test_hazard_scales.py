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
        (0.031, 7.8, 7.86, -0.18, 3),  # 2024 YR4 on 2025-02-18, Sentry
        (0.027, 1480.0, 24.3, 1.10, 4),  # Apophis on 2004-12-27, Sentry
        (
            3.7e-4,
            1420.0,
            161.0,
            -1.59,
            None,
        ),  # Bennu 2182 (Farnocchia et al. 2021); beyond the century of Torino
    ],
)
def test_published_values(chance, energy, years, palermo, torino):
    assert palermo_scale(chance, energy * MT, years * u.yr) == pytest.approx(palermo, abs=0.05)
    if torino is not None:
        assert torino_scale(chance, energy * MT) == torino


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
