"""Random flybys of `benchmarks/campaign.py`, fewer of them."""

import runpy
from pathlib import Path

campaign = runpy.run_path(str(Path(__file__).resolve().parents[2] / "benchmarks" / "campaign.py"))


def test_no_random_flyby_fails_gains_energy_or_hangs_on_its_tolerance():
    count = campaign["stress"](120, 5)
    assert count["ran"] == 120
    assert count["onset"] > 24
    assert count["loss of contact"] > 2
    assert count["not finite"] == count["energy gained"] == count["verdicts differ"] == 0


def test_the_ends_of_every_range_at_once():
    count = campaign["extremes"](300, 6)
    assert count["ran"] == 300
    assert count["onset"] > 100
    assert count["loss of contact"] > 10
    assert count["not finite"] == count["energy gained"] == count["verdicts differ"] == 0


def test_integrators_with_and_without_events_agree():
    count = campaign["integrators"](40, 6)
    assert count["flowed in both"] > 5
    assert (
        count["default not converged"] == count["event-free not converged"] == count["verdicts differ"] == 0
    )
    assert count["apart by more than 3 times"] <= 1  # an event that both step sizes find equally late
    assert count["of these, not with the step"] == 0


def test_error_estimate_covers_the_true_error():
    """208 random encounters with flow, the four yield surfaces, volume-preserving and associative."""
    shares = campaign["coverage"](26, 11, 1e-7, 1e-10)
    assert len(shares) == 4
    assert all(share >= 0.97 for share in shares.values())
