"""Every example runs, and one number of each is held against what it must be."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def ran(name):
    return runpy.run_path(str(EXAMPLES / name))


def test_tidal_tensor_by_hand():
    assert ran("tidal_tensor_by_hand.py")["error"] < 1e-9


def test_apophis_spin():
    names = ran("apophis_spin.py")
    assert names["slowest"] == pytest.approx(0.59, abs=0.03)
    assert names["fastest"] == pytest.approx(1.58, abs=0.04)


def test_roche_limit_by_friction():
    assert ran("roche_limit_by_friction.py")["worst"] < 1e-8


def test_pile_at_two_radii():
    # between these the answer hangs on the surface
    assert ran("pile_at_two_radii.py")["robust"] == [1.8, 2.2, 3.0]


def test_every_example_is_tested():
    scripts = {p.name for p in EXAMPLES.glob("*.py")}
    text = Path(__file__).read_text()
    assert all(f'"{name}"' in text for name in scripts)
