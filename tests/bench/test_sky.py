"""``flybystab bench sky`` on a few asteroids: its tables hold the measured values."""

import numpy as np
import pytest

from flybystab.bench import jpl, oracle, sky
from flybystab.constants import AU
from flybystab.errors import InvalidInput


def test_differences_count_what_is_not_there():
    truth = [np.array([[10.0, 1e9], [300.0, 2e9], [500.0, 0.4999 * AU]]), np.zeros((0, 2))]
    found = [np.array([[10.1, 1.5e9], [305.0, 2e9]]), np.array([[1.0, 5.0]])]
    gaps, missed = sky.differences(found, truth)
    assert gaps == pytest.approx([5e8])
    assert missed == 1  # five days off is another passage; the last may lie beyond the limit


@pytest.mark.skipif(not jpl.SHARED.is_dir(), reason=f"reference data are not at {jpl.SHARED}")
def test_the_tables(monkeypatch, tmp_path):
    known = jpl.orbits()
    few = {e["des"] for e in jpl.read(jpl.APPROACHES)[::60]} & set(known) | {"2020 CR2"}
    monkeypatch.setattr(sky, "orbits", lambda: {n: known[n] for n in sorted(few)})
    monkeypatch.setattr(sky, "YEARS", (0.6,))
    monkeypatch.setattr(sky, "ERRORS", (0.1, 1e4))
    monkeypatch.setattr(sky, "EPSILONS", ())
    rows = sky.rows(tmp_path / "sky.png", asteroids=20)
    accuracy = [r for r in rows if r["table"] == "accuracy"]
    assert accuracy[0]["ephemeris"] == "de421"
    for row in accuracy:
        assert row["events"] >= len(few)
        assert row["missed"] == 0
        assert row["distance_error_median_km"] < 0.25
    odd = [r for r in rows if r["table"] == "outlier"]
    assert {r["asteroid"] for r in odd} >= {"2020 CR2"}
    for row in odd:
        assert row["displacement_at_epoch_km"] * row["growth"] == pytest.approx(abs(row["distance_error_km"]))
        assert row["error_without_earth_j2_km"] == pytest.approx(row["distance_error_km"], abs=1.0)
        if row["asteroid"] == "2020 CR2" and not oracle.missing():
            assert row["error_of_assist_km"] == pytest.approx(row["distance_error_km"], abs=0.5)
    fine, coarse = [r for r in rows if r["table"] == "speed" and r["code"] == "flybystab"]
    assert fine["missed"] == 0
    assert fine["encounters"] > 5
    assert fine["distance_error_median_km"] < 0.1
    assert coarse["distance_error_median_km"] > fine["distance_error_median_km"]
    text = "\n".join(sky.lines(rows))
    assert "2020 CR2" in text
    assert "error 0.1 km" in text
    assert (tmp_path / "sky.png").stat().st_size > 1000


def test_data_that_are_not_there(tmp_path):
    with pytest.raises(InvalidInput, match="FLYBYSTAB_SHARED"):
        jpl.orbits(tmp_path)
