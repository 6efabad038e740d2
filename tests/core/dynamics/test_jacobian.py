"""The Jacobian of plastic flow against central differences of the rate."""

import itertools

import astropy.units as u
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.body.body import YIELD_SURFACES
from flybystab.core.dynamics import rates as motion
from flybystab.core.dynamics import state
from flybystab.core.dynamics.jacobian import flow_jacobian
from flybystab.core.dynamics.run import parameters
from flybystab.core.ellipsoid.tide import TidePanels, components
from flybystab.core.material import parameters as material

PARTS = {
    "smooth": material.SMOOTH,
    "extension": material.EXTENSION_CORNER,
    "compression": material.COMPRESSION_CORNER,
}
CASES = [
    *itertools.product(range(len(YIELD_SURFACES)), (0.0, 0.5), ("smooth",)),
    *((surface, 1.0, "smooth") for surface in (0, 1, 3)),
    *((2, 1.0, part) for part in ("extension", "compression", "face")),
]


def flow(seed, volume):
    """A turned ellipsoid of 2 : 1.3 : 1 with a random gradient, as 15 numbers."""
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    squares = np.array([4.0, 1.7, 1.0])
    squares *= (volume**2 / np.prod(squares)) ** (1 / 3)
    strain = 0.02 * rng.standard_normal(6)
    return np.concatenate([components(turn @ np.diag(squares) @ turn.T), strain, rng.standard_normal(3)])


@pytest.mark.parametrize("volume", [1.0, 1.47], ids=["as it was", "dilation fading"])
@pytest.mark.parametrize("cohesion", [0.0, 100.0])
@pytest.mark.parametrize(("surface", "dilatancy", "part"), CASES)
def test_columns_are_central_differences(surface, dilatancy, part, cohesion, volume):
    encounter = fs.Encounter.hyperbolic("earth", 2.0 * fs.R_earth, 5.0 * u.km / u.s)
    unit = 1.0 / np.sqrt(np.pi * 6.674e-11 * 2000.0)
    tide = TidePanels(
        encounter.tide.tau / unit,
        encounter.tide.start,
        encounter.tide.width,
        encounter.tide.coefficients * unit**2,
    )
    par = parameters(np.array([1400.0, 850.0, 750.0]), 2000.0, np.deg2rad(35.0), cohesion, dilatancy, surface)
    par = par._replace(material=material.on_part(par.material, PARTS.get(part, material.FACE), 0.0))
    work = state.empty_buffers()
    t, y = 0.3, flow(11, volume)

    def rate(t, y):
        out = np.zeros(15)
        motion.rate(state.FLOWING, t, y, out, par, tide, work)
        return out

    jac, start = np.zeros((15, 16)), rate(t, y)
    flow_jacobian(t, y, start, 1e-6, par.material, tide, work, jac, np.zeros((15, 15)))
    steps = np.full(15, 1e-6)
    steps[6:12] *= 0.03
    differences = [
        (rate(t, y + h * e) - rate(t, y - h * e)) / (2 * h) for h, e in zip(steps, np.eye(15), strict=True)
    ]
    differences.append((rate(t + 1e-5, y) - rate(t - 1e-5, y)) / 2e-5)
    for column, difference in zip(jac.T, differences, strict=True):
        assert column == pytest.approx(difference, abs=1e-5 * np.abs(difference).max())
    assert np.linalg.norm(jac[6:12, 6:12]) > 1.0  # the direction of D relaxes
