"""The quick margin of a flyby against the full dynamics, over periapsis, speed and attitude.

    python benchmarks/margin.py [phases]

Three piles (the rubble pile of Richardson et al. 1998, a rounder and a weaker one) past the Earth: 9 periapses from 1.2
to 2.8 R_E, v_inf of 0, 5, 10 and 20 km/s, prograde and retrograde spin and spin on its side, at `phases` phases (4).
The outcome of the dynamics is INTACT, RESHAPED (whole, inside the model) or lost (beyond 6:1 or with loss of mass).
"""

from __future__ import annotations

import sys

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.margin import HOLDS, RECOVERS, RUNS_AWAY, flyby_margin

GCC = u.g / u.cm**3
BODIES = {
    "1400 x 850 x 750 m, 35 deg": fs.Body([1400, 850, 750] * u.m, 2 * GCC, 6 * u.h),
    "1000 x 900 x 800 m, 35 deg": fs.Body([1000, 900, 800] * u.m, 2 * GCC, 5 * u.h),
    "1400 x 850 x 750 m, 20 deg": fs.Body(
        [1400, 850, 750] * u.m, 2 * GCC, 12 * u.h, material=fs.Material(friction_angle=20 * u.deg)
    ),
}
PERIAPSES = np.arange(1.2, 2.81, 0.2)
SPEEDS = (0.0, 5.0, 10.0, 20.0)
SPINS = {"prograde": (1, 0, 0, 0), "retrograde": (0, 1, 0, 0), "on its side": (1, 1, 0, 0)}
OUTCOMES = ("INTACT", "RESHAPED", "lost")


def attitudes(phases: int) -> list[Rotation]:
    """Spin up, down and in the plane of the orbit (about x), at phases of half a turn."""
    turned = [Rotation.from_quat([x, y, z, w]) for w, x, y, z in SPINS.values()]
    return [r * Rotation.from_euler("z", np.pi * i / phases) for r in turned for i in range(phases)]


def main(phases: int) -> None:
    total = np.zeros((3, 3), dtype=int)
    ratios = []
    for name, body in BODIES.items():
        cases = [
            (
                fs.Encounter.hyperbolic(
                    "earth", q * fs.R_earth, v * u.km / u.s, start_distance=10 * fs.R_earth
                ),
                a,
            )
            for q in PERIAPSES
            for v in SPEEDS
            for a in attitudes(phases)
        ]
        table = flyby_many([body] * len(cases), [e for e, _ in cases], [a for _, a in cases])
        counts = np.zeros((3, 3), dtype=int)
        for (encounter, attitude), verdict, axes in zip(
            cases, table.verdict, table.semi_axes.value, strict=True
        ):
            margin = flyby_margin(body, encounter, attitude)
            outcome = verdict if verdict in OUTCOMES else "lost"
            counts[(HOLDS, RECOVERS, RUNS_AWAY).index(margin.expected), OUTCOMES.index(outcome)] += 1
            if outcome == "RESHAPED":
                strain = np.linalg.norm(np.log(axes / body.axes))
                if strain > 1e-3:
                    ratios.append(margin.strain / strain)
        report(name, counts)
        total += counts
    report("all", total)
    low, mid, high = np.quantile(ratios, (0.1, 0.5, 0.9))
    print(
        "strain of the slide / strain of the dynamics, reshaped bodies: "
        f"median {mid:.2f}, 10 to 90 %: {low:.2f} to {high:.2f}"
    )


def report(name: str, counts: np.ndarray) -> None:
    print(f"{name}: {counts.sum()} encounters")
    print(f"{'expected':>12} " + " ".join(f"{o:>9}" for o in OUTCOMES))
    for expected, row in zip((HOLDS, RECOVERS, RUNS_AWAY), counts, strict=True):
        print(f"{expected:>12} " + " ".join(f"{c:9d}" for c in row))
    yielding = counts[1:].sum()
    missed, alarms = counts[1, 2] + counts[0, 1:].sum(), counts[2, :2].sum() + counts[1, 0]
    print(
        f"{'':>12} wrong in {missed + alarms} ({(missed + alarms) / counts.sum():.1%} of all, "
        f"{(missed + alarms) / yielding:.1%} of those that yield): {missed} too optimistic, {alarms} too pessimistic",
        flush=True,
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4)
