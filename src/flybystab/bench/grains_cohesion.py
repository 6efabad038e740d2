"""Bulk cohesion of piles of grains, by pulling and shearing spheres: makes ``data/grains_cohesion.csv``.

``python -m flybystab.bench.grains_cohesion [FILE]`` prints, or writes, the table; it takes some minutes. A cohesive
sphere without gravity is loaded by a tide that grows slowly until it fails. Pulling along one axis (mean stress ``T``)
and shearing (``tau, -tau, 0``) give the cohesion ``Y`` that Mohr-Coulomb needs at the friction angle of the pile:
``Y = T (1 + sin phi)/(2 cos phi)`` and ``Y = tau/cos phi``. Without gravity ``Y`` goes as the attraction per area ``c``
of a contact, and the table gives ``Y/(c beta^2)``.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np

from flybystab.body.grain_calibration import friction_table
from flybystab.body.packing import simulation_of
from flybystab.body.pile_cache import stored_pile
from flybystab.body.pile_strength import loaded, required_cohesion
from flybystab.core.grains.simulation import Simulation
from flybystab.core.numerics.threads import in_order

#: Sizes of the contact patch in the table.
PATCHES = (0.15, 0.3, 0.45, 0.7)
#: Diagonals of the tide.
LOADS = {"pull": (1.0, 0.0, 0.0), "shear": (1.0, -1.0, 0.0)}
#: First guess of ``Y/(c beta^2)``: packing 0.6, five contacts a grain.
GUESS = 0.24
#: Bulk cohesion of the guess, scaled; it sets the stiffness.
STRENGTH = 1.0


def cohesive_sphere(beta: float, seed: int, grains: int = 528) -> Simulation:
    """A settled sphere, cohesive and at rest without gravity."""
    from flybystab.body.packing import settled_pile

    inputs = {"shape": np.ones(3), "grains": grains, "seed": seed, "mu_s": 0.6, "beta": beta}
    arrays = stored_pile(inputs, lambda: settled_pile(np.ones(3), grains, seed, 0.6, beta))
    cohesion = STRENGTH / (GUESS * beta**2)
    sim = simulation_of(arrays, 0.6, beta, cohesion=cohesion, strength=STRENGTH)
    sim.advance(1.0, gravity=False, drag=3.0)
    sim.centre()
    return sim


def ratio(beta: float, load: str, seed: int, grains: int = 528, slow: float = 1.0) -> float:
    """``Y/(c beta^2)`` of one sphere under one load."""
    angle = next(f.angle for f in friction_table() if f.mu_s == 0.6 and abs(f.beta - beta) < 1e-9)
    sim = cohesive_sphere(beta, seed, grains)
    stress, _ = loaded(sim, np.array(LOADS[load]), STRENGTH, slow)
    return required_cohesion(stress, float(np.deg2rad(angle))) * GUESS / STRENGTH


def table(seeds: int = 3) -> list[tuple[float, ...]]:
    """Rows of beta, ``Y/(c beta^2)`` (mean of both loads), half of its range, median by pulling, and by shearing."""
    jobs = [(beta, load, seed) for beta in PATCHES for load in LOADS for seed in range(seeds)]
    found = np.array(list(in_order(lambda j: ratio(*j), jobs, os.cpu_count() or 1)))
    out: list[tuple[float, ...]] = []
    for beta, values in zip(PATCHES, found.reshape(len(PATCHES), len(LOADS), seeds), strict=True):
        pull, shear = (float(np.median(v)) for v in values)
        out.append((beta, 0.5 * (pull + shear), float(0.5 * np.ptp(values)), pull, shear))
    return out


def text(rows: list[tuple[float, ...]]) -> str:
    """The table as a file."""
    head = (
        "# Bulk cohesion of piles over c beta^2, c the attraction per area (2 beta R)^2 of a contact: spheres pulled\n"
        "# and sheared without gravity (python -m flybystab.bench.grains_cohesion); mu_s 0.6, Mohr-Coulomb.\n"
        "beta,ratio,scatter,pull,shear\n"
    )
    return head + "".join(",".join(f"{x:.4g}" for x in row) + "\n" for row in rows)


if __name__ == "__main__":
    made = text(table())
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(made)
    print(made)
