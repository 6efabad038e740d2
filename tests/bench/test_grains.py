"""Benchmark of grains: tables of numerical errors and of the number of grains."""

import pytest

from flybystab.bench.grains import VARIANTS, lines, numerics, resolution


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("FLYBYSTAB_CACHE", str(tmp_path))


def test_numerical_errors_are_those_of_the_same_piles():
    rows = numerics(q=2.6, seeds=2, grains=40)
    found = {r["variant"]: r for r in rows}
    assert set(found) == {name for name, _ in VARIANTS}
    assert found["default"]["stretch_change_rms"] == found["default"]["spin_change_rms"] == 0.0
    # nothing but rounding depends on the skin; the step, the stiffness and gravity change the outcome
    for name in ("half the step", "half the stiffness", "gravity half as often"):
        assert 0.0 < found[name]["stretch_change_rms"] < 0.3
    text = "\n".join(lines(rows))
    assert all(name in text for name, _ in VARIANTS)


def test_the_number_of_grains_is_compared_with_the_second_one():
    rows = resolution(q=2.6, counts=(30, 60, 90), seeds=2)
    assert [r["grains"] for r in rows] == [30, 60, 90]
    assert rows[1]["stretch_change"] == rows[1]["stretch_change_error"] == 0.0
    assert all(r["stretch_low"] <= r["stretch_median"] <= r["stretch_high"] for r in rows)
    assert len(lines(rows)) > 4
