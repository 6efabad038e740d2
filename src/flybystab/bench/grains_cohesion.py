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
from numpy.typing import ArrayLike

from flybystab.body.grain_calibration import PATCH, Friction, friction_table
from flybystab.body.packing import settled_pile, simulation_of
from flybystab.body.pile_cache import stored_pile
from flybystab.body.pile_strength import loaded, required_cohesion
from flybystab.core.grains.simulation import Simulation
from flybystab.core.numerics.threads import in_order

#: Diagonals of the tide.
LOADS = {"pull": (1.0, 0.0, 0.0), "shear": (1.0, -1.0, 0.0)}
#: First guess of ``Y/(c beta^2)``: packing 0.6, five contacts a grain.
GUESS = 0.24
#: Bulk cohesion of the guess, scaled; it sets the stiffness.
STRENGTH = 1.0


def cohesive_sphere(friction: Friction, seed: int, grains: int = 528) -> Simulation:
    """A settled sphere, cohesive and at rest without gravity."""
    mu_s, beta = friction.mu_s, max(friction.beta, PATCH)
    inputs: dict[str, ArrayLike] = {
        "shape": np.ones(3),
        "grains": grains,
        "seed": seed,
        "mu_s": mu_s,
        "beta": beta,
    }
    arrays = stored_pile(inputs, lambda: settled_pile(np.ones(3), grains, seed, mu_s, beta))
    sim = simulation_of(arrays, mu_s, beta, cohesion=STRENGTH / (GUESS * beta**2), strength=STRENGTH)
    sim.advance(1.0, gravity=False, drag=3.0)
    sim.centre()
    return sim


def ratio(friction: Friction, load: str, seed: int, grains: int = 528, slow: float = 1.0) -> float:
    """``Y/(c beta^2)`` of one sphere under one load."""
    sim = cohesive_sphere(friction, seed, grains)
    stress, _ = loaded(sim, np.array(LOADS[load]), STRENGTH, slow)
    return required_cohesion(stress, float(np.deg2rad(friction.angle))) * GUESS / STRENGTH


def table(seeds: int = 3) -> list[tuple[float, ...]]:
    """Rows of the calibrated friction with ``Y/(c beta^2)``.

    Columns: mu_s, beta, friction angle, mean of the medians of both loads, half the range, median by pulling, and by
    shearing.
    """
    points = friction_table()
    jobs = [(friction, load, seed) for friction in points for load in LOADS for seed in range(seeds)]
    found = np.array(list(in_order(lambda j: ratio(*j), jobs, os.cpu_count() or 1)))
    out: list[tuple[float, ...]] = []
    for f, values in zip(points, found.reshape(len(points), len(LOADS), seeds), strict=True):
        pull, shear = (float(np.median(v)) for v in values)
        middle, half = 0.5 * (pull + shear), float(0.5 * np.ptp(values))
        out.append((f.mu_s, max(f.beta, PATCH), f.angle, middle, half, pull, shear))
    return out


def text(rows: list[tuple[float, ...]]) -> str:
    """The table as a file."""
    head = (
        "# Bulk cohesion of piles over c beta^2, c the attraction per area (2 beta R)^2 of a contact: spheres pulled\n"
        "# and sheared without gravity (python -m flybystab.bench.grains_cohesion); Mohr-Coulomb.\n"
        "mu_s,beta,friction_angle_deg,ratio,scatter,pull,shear\n"
    )
    return head + "".join(",".join(f"{x:.4g}" for x in row) + "\n" for row in rows)


if __name__ == "__main__":
    made = text(table())
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(made)
    print(made)
