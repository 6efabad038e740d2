"""Surface and interior of Apophis in 2029 beside published figures."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.flybys.spin_sample import spin_states

RELIEF = fs.Shape.perturbed([225.0, 165.0, 155.0] * u.m, amplitude=0.06, seed=2, facets=600).scaled(
    diameter=340 * u.m
)


@pytest.fixture(scope="module")
def histories():
    """Four attitudes at each density."""
    encounter = fs.Encounter.hyperbolic("earth", periapsis=38_012 * u.km, v_inf=5.841 * u.km / u.s)
    found = {}
    for density in (1.29, 2.2):
        body = fs.Body.from_shape(RELIEF, density=density * u.g / u.cm**3, spin_period=30.5 * u.h)
        found[density] = [
            fs.surface_history(body, encounter, r, shape=RELIEF, instants=80)
            for r in spin_states(body, 4, 1).rotations
        ]
    return found


@pytest.mark.parametrize(("density", "published"), [(1.29, 4.0), (2.2, 2.0)])
def test_changes_of_slope(histories, density, published):
    """Valvano et al. 2022: up to 4 deg at 1.29 g/cm3, 2 deg at the higher density, on a model with finer relief."""
    widest = [float((h.extremes.greatest - h.extremes.least).max().value) for h in histories[density]]
    assert 0.4 * published < np.median(widest) < 1.2 * published


def test_their_ratio_is_that_of_the_densities(histories):
    most = {d: np.median([h.extremes.largest_change.value for h in all_]) for d, all_ in histories.items()}
    assert most[1.29] / most[2.2] == pytest.approx(2.2 / 1.29, rel=0.05)


def test_refreshed_area(histories):
    """Kim et al. 2023: about 1 % of the area. Here the share that first exceeds an angle near the steepest slopes."""
    first = histories[1.29][0]
    area = first.shape.facet_area.value
    order = np.argsort(first.slope[0].value)
    steep = first.slope[0][order][np.searchsorted(np.cumsum(area[order]) / area.sum(), 0.95)]
    share = np.mean([h.share_refreshed(repose=steep) for h in histories[1.29]])
    assert 0.001 < share < 0.05
