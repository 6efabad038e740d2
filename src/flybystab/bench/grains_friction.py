"""Friction angle of piles of grains by the spin-up of spheres: makes ``data/grains_friction.csv``.

``python -m flybystab.bench.grains_friction [FILE]`` prints, or writes, the table that maps a friction angle to contact
friction; it takes about ten minutes on two cores. ``python -m flybystab.bench.grains_friction numbers`` prints the
friction angle against the number of grains.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np

from flybystab.body.packing import settled_pile
from flybystab.body.pile_strength import spin_up
from flybystab.core.numerics.threads import in_order
from flybystab.typing import Array

#: Contact friction of the table: sliding, then the size of the contact patch.
POINTS = (
    (0.1, 0.0),
    (0.2, 0.0),
    (0.35, 0.0),
    (0.6, 0.0),
    (0.6, 0.15),
    (0.6, 0.3),
    (0.6, 0.45),
    (0.6, 0.7),
)
#: First ``omega^2/(pi G rho)`` in the comparison of numbers of grains: a sphere then mobilises 28 deg.
_LATE = 8.0 / 3.0 * np.sin(np.deg2rad(28.0)) / (1.0 + np.sin(np.deg2rad(28.0)))


def friction_angle(mu_s: float, beta: float, seed: int, grains: int = 528) -> tuple[float, Array]:
    """Largest friction angle (deg) that a sphere mobilises in a spin-up, and the course.

    Columns of the course as of :func:`flybystab.body.pile_strength.spin_up`.
    """
    rows = spin_up(settled_pile(np.ones(3), grains, seed, mu_s, beta), surface="drucker-prager")
    return float(rows[:, 1].max()), rows


def table(seeds: int = 3) -> list[tuple[float, float, float, float]]:
    """Rows of mu_s, beta, friction angle (median over seeds) and half the range over seeds, deg."""
    jobs = [(mu, beta, seed) for mu, beta in POINTS for seed in range(seeds)]
    found = list(in_order(lambda j: friction_angle(*j)[0], jobs, os.cpu_count() or 1))
    out = []
    for k, (mu, beta) in enumerate(POINTS):
        angles = np.array(found[k * seeds : (k + 1) * seeds])
        out.append((mu, beta, float(np.median(angles)), float(0.5 * np.ptp(angles))))
    return out


def numbers() -> None:
    """Print the friction angle of spheres of different numbers of grains with the same contact friction."""
    print("grains  spheres  friction angle (deg), standard error")
    for grains, seeds in ((125, 4), (250, 4), (528, 4), (2000, 1)):
        angles = np.array(
            [
                spin_up(settled_pile(np.ones(3), grains, seed, 0.6, 0.3), _LATE, surface="drucker-prager")[
                    :, 1
                ].max()
                for seed in range(seeds)
            ]
        )
        error = f" +- {angles.std(ddof=1) / np.sqrt(seeds):.2f}" if seeds > 1 else ""
        print(f"{grains:6d} {seeds:8d}  {angles.mean():.2f}{error}", flush=True)


def text(rows: list[tuple[float, float, float, float]]) -> str:
    """The table as a file."""
    head = (
        "# Friction angle of piles against contact friction: peak of the angle mobilised in a spin-up of spheres\n"
        "# (python -m flybystab.bench.grains_friction); rolling 1.05, twisting 1.3, restitution 0.3.\n"
        "mu_s,beta,friction_angle_deg,scatter_deg\n"
    )
    return head + "".join(f"{a:g},{b:g},{c:.2f},{d:.2f}\n" for a, b, c, d in rows)


if __name__ == "__main__":
    if sys.argv[1:] == ["numbers"]:
        numbers()
    else:
        made = text(table())
        if len(sys.argv) > 1:
            Path(sys.argv[1]).write_text(made)
        print(made)
