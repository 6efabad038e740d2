"""Piles of grains against flybys of an independent soft-sphere code (four piles of about 570 grains each).

Earth, 5 km/s, semi-axes 1408 x 850 x 748 m, 2000 kg/m3, friction of the contacts 0.6, patch 0.3. All 138 flybys:
``python benchmarks/grains_references.py flybys``. Here with 300 grains and one pile; the margin is twice the half range
of the reference over its piles, and 0.05 (clump) or 0.15 (stretch) for the coarser grains.
"""

import astropy.units as u
import numpy as np
import pytest
from scenes import earth

from flybystab.body.body import Body
from flybystab.body.grain_calibration import Friction
from flybystab.body.pile import make_pile
from flybystab.flybys.grains_run import one_pile

#: Periapsis (R_E), period (h; 0: none), range of the largest clump, range of the stretch of its long axis or None.
FLYBYS = (
    (1.3, 6.0, (0.13, 0.19), None),
    (1.6, 6.0, (0.18, 0.38), None),
    (2.3, 6.0, (0.97, 1.0), (1.12, 1.22)),
    (1.6, 0.0, (0.99, 1.0), (2.22, 2.32)),
    (1.6, -6.0, (1.0, 1.0), (1.78, 1.86)),
)


@pytest.mark.parametrize(("q", "period", "clump", "stretch"), FLYBYS)
def test_clump_and_stretch_are_those_of_the_reference(q, period, clump, stretch, tmp_path, monkeypatch):
    monkeypatch.setenv("FLYBYSTAB_CACHE", str(tmp_path))
    rate = 2 * np.pi / (period * 3600) if period else 0.0
    body = Body([1408, 850, 748] * u.m, 2000 * u.kg / u.m**3, spin=[0, 0, rate] * u.rad / u.s)
    pile = make_pile(body, 300, 1, Friction(0.6, 0.3, 36.46))
    run = one_pile(pile, body, earth(q), np.eye(3), 1)
    half = 0.5 * (clump[1] - clump[0])
    assert run.largest_fraction == pytest.approx(np.mean(clump), abs=2 * half + 0.05)
    if stretch is not None:
        half = 0.5 * (stretch[1] - stretch[0])
        assert run.stretch == pytest.approx(np.mean(stretch), abs=2 * half + 0.15)
