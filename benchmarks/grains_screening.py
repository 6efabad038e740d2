"""Time of a screening in which about one sample in a hundred needs grains.

python benchmarks/grains_screening.py [--samples N] [--grains N]

One asteroid (Anteros, drawn shapes, spins and materials) passes the Earth at several distances; the first distance at
which at most 1 % of the samples need grains is timed without and with them, on one core.
"""

from __future__ import annotations

import argparse
import time

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.catalogues.catalogue import Asteroid
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.escalation import ESCALATED
from flybystab.screening.encounters import CloseApproach
from flybystab.screening.screening import Screening
from flybystab.screening.settings import settings
from flybystab.units import R_earth


class At:
    """Finder of one encounter with the Earth at a distance in Earth radii."""

    def __init__(self, q: float) -> None:
        self.encounter = Encounter.hyperbolic("earth", q * R_earth, v_inf=6 * u.km / u.s)

    def __call__(self, asteroid: Asteroid, settings: object) -> list[CloseApproach]:
        """The encounter."""
        when = Time(2462000.5, format="jd", scale="tdb")
        distance = self.encounter.distance.to_value(u.m)
        return [CloseApproach(asteroid, "earth", when, distance, 6000.0, self.encounter)]


def screened(q: float, samples: int, grains: int | None) -> tuple[list[dict[str, object]], float]:
    """Samples of an encounter and the processor time, s."""
    chosen = settings("2026-01-01", "2036-01-01", samples=samples, seed=1, grains=grains, keep_samples=True)
    run = Screening([Asteroid.from_catalogue("Anteros")], chosen, At(q))
    begun = time.thread_time()
    ((_, found),) = run.results()
    return found["samples"], time.thread_time() - begun


def main(arguments: list[str] | None = None) -> None:
    """Run it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=300)
    parser.add_argument("--grains", type=int, default=200)
    options = parser.parse_args(arguments)
    screened(1.4, 4, 100)  # compiled
    for q in np.arange(1.5, 4.0, 0.1):
        rows, without = screened(float(q), options.samples, None)
        needing = sum(r["verdict"] in ESCALATED for r in rows)
        if needing <= 0.01 * options.samples:
            break
    rows, seconds = screened(float(q), options.samples, options.grains)
    continued = sum(r["decided_by"] == "grains" for r in rows)
    dynamic = sum(r["decided_by"] != "bound" for r in rows)
    print(
        f"{options.samples} samples at {q:.1f} Earth radii, {dynamic} integrated, {needing} in need of grains, "
        f"{continued} continued with {options.grains} grains"
    )
    print(f"processor time without grains {without:.2f} s, with grains {seconds:.2f} s")
    if continued:
        print(f"{(seconds - without) / continued:.1f} s per sample with grains, including its pile")


if __name__ == "__main__":
    main()
