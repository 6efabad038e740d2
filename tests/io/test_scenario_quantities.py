"""Quantities in scenario files: lists with commas or crosses, radii of planets."""

import astropy.units as u
import pytest

from flybystab.errors import InvalidInput
from flybystab.io.scenario import quantity
from flybystab.orbit.planets import PLANETS


@pytest.mark.parametrize(
    "text", ["1400, 850, 750 m", "1400 x 850 x 750 m", "1400x850x750 m", "1.4 × 0.85 × 0.75 km"]
)
def test_semi_axes_with_commas_or_crosses(text):
    assert quantity(text, "body.semi_axes").to_value(u.m) == pytest.approx([1400.0, 850.0, 750.0])


def test_radii_of_planets():
    found = quantity("1.5, 2 R_jupiter", "encounter.periapsis").to_value(u.m)
    assert found == pytest.approx([1.5 * PLANETS["jupiter"].radius, 2 * PLANETS["jupiter"].radius])


@pytest.mark.parametrize("value", [[1400, 850, 750], "1400 x wide", "1400 m x 850 m x 750 m"])
def test_the_example_of_semi_axes_has_three(value):
    with pytest.raises(InvalidInput, match="1400, 850, 750 m"):
        quantity(value, "body.semi_axes")
