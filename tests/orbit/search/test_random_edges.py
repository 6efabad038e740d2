"""Random windows, epochs, directions and falls into the Sun (`benchmarks/edges.py`), fewer of them."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from reference import need_ephemeris

edges = runpy.run_path(str(Path(__file__).resolve().parents[3] / "benchmarks" / "edges.py"))


@pytest.mark.parametrize("name", ["windows", "epochs", "backwards", "sun"])
def test_properties_of_the_search(name):
    need_ephemeris("de421")

    @settings(max_examples=4, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(st.integers(0, 2**32 - 1))
    def check(seed):
        why, _ = edges["PROPERTIES"][name](np.random.default_rng(seed))
        assert not why

    check()


def test_the_comparison_sees_a_lost_and_a_moved_encounter():
    need_ephemeris("de421")
    rng = np.random.default_rng(1)
    while True:
        whole = edges["found"](edges["random_orbit"](rng, edges["START"]), edges["START"], edges["STOP"])
        if len(whole) > 1:
            break
    same = edges["same"]
    assert same([whole], whole) == ""
    assert "instead of" in same([whole[1:]], whole)
    assert "instead of" in same([whole, whole[:1]], whole)
    moved = whole.copy()
    moved["distance"] = moved["distance"] * (1.0 - 1e-4)
    assert same([moved], whole) != ""
