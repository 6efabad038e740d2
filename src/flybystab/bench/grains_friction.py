"""Friction angle of piles of grains by the spin-up of spheres: makes ``data/grains_friction.csv``.

``python -m flybystab.bench.grains_friction [FILE]`` prints, or writes, the table that maps a friction angle to contact
friction; it takes about ten minutes on two cores.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np

from flybystab.body.pile import settled_pile
from flybystab.core.ellipsoid.rigid_stress import demand, rigid_stress
from flybystab.core.grains.clumps import moments, semi_axes, spin_of
from flybystab.core.grains.simulation import Simulation
from flybystab.core.material.surfaces import code_of
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
#: Increment of ``omega^2/(pi G rho)`` and time between two increments (scaled).
INCREMENT, REST = 0.03, 4.0
#: First ``omega^2/(pi G rho)``, where friction of 5 deg is mobilised.
FIRST = 0.24


def mobilised(sim: Simulation) -> tuple[float, float, Array]:
    """Friction angle (deg, compression cone) required by a rigid ellipsoid with the inertia and spin of the pile.

    Also ``omega^2/(pi G rho)`` and the semi-axes, scaled units. A pile in flow need not be in equilibrium.
    """
    mass, _, _, inertia, momentum = moments(sim.grains, sim.grains.mass > 0.0)
    axes, vectors = semi_axes(mass, inertia)
    spin = vectors.T @ spin_of(inertia, momentum)
    rho = 3.0 / (4.0 * np.pi * np.prod(axes))
    stress = np.empty(6)
    s = axes**2
    rigid_stress(s[0], s[1], s[2], float(rho), float(np.pi * rho), spin, np.zeros(6), stress)
    angle, _ = demand(code_of("drucker-prager"), 0.0, 0.0, stress)
    return float(np.rad2deg(angle)), float(spin @ spin / (np.pi * rho)), axes


def friction_angle(mu_s: float, beta: float, seed: int, grains: int = 528) -> tuple[float, Array]:
    """Largest friction angle (deg) that a sphere mobilises in a spin-up, and the course.

    Columns of the course: ``omega^2/(pi G rho)``, mobilised angle, axis ratio c/a. The spin-up ends where c/a falls
    below 0.8.
    """
    sim = settled_pile(np.ones(3), grains, seed, mu_s, beta)
    course = []
    for w2 in np.arange(FIRST, 1.8, INCREMENT):
        mass, _, _, inertia, momentum = moments(sim.grains, sim.grains.mass > 0.0)
        axes, _ = semi_axes(mass, inertia)
        rate = np.sqrt(w2 * np.pi * 3.0 / (4.0 * np.pi * np.prod(axes)))
        sim.add_spin(np.array([0.0, 0.0, rate]) - spin_of(inertia, momentum))
        sim.advance(REST)
        angle, reached, axes = mobilised(sim)
        course.append((reached, angle, axes[2] / axes[0]))
        if axes[2] / axes[0] < 0.8:
            break
    rows = np.array(course)
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


def text(rows: list[tuple[float, float, float, float]]) -> str:
    """The table as a file."""
    head = (
        "# Friction angle of piles against contact friction: peak of the angle mobilised in a spin-up of spheres\n"
        "# (python -m flybystab.bench.grains_friction); rolling 1.05, twisting 1.3, restitution 0.3.\n"
        "mu_s,beta,friction_angle_deg,scatter_deg\n"
    )
    return head + "".join(f"{a:g},{b:g},{c:.2f},{d:.2f}\n" for a, b, c, d in rows)


if __name__ == "__main__":
    made = text(table())
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(made)
    print(made)
