"""Encounters with piles of grains: the most detailed model, for bodies that do not survive in one piece.

Every seed gives a different pile with the body's shape, density, spin and friction angle. The outcomes scatter from
pile to pile, so that a result is a distribution.

The class (Richardson et al. 1998) is that of the largest clump at the end: S up to half of the mass, B up to 0.9, M
above if mass escapes. Satellites, bound to the largest clump but not in contact with it, contribute only to the bound
mass.
"""

from __future__ import annotations

import itertools
import os
import time as clock
import warnings
from collections.abc import Sequence

import astropy.units as u
import numpy as np

from flybystab.body.body import Body
from flybystab.body.pile import Pile, check_grains, make_pile
from flybystab.core.grains.simulation import GRAVITY_ERROR, TREE_FROM
from flybystab.core.numerics.threads import in_order
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.grains_outcome import GrainsOutcome, GrainsRun, piles_of
from flybystab.flybys.grains_run import FRAMES, QUIET, one_pile
from flybystab.progress import Progressing, progress_bar
from flybystab.typing import Array

#: Default number of seeds.
SEEDS = 8
#: Number of grains below which a warning is issued.
FEW = 100


def warn_of_few(grains: int) -> None:
    """Issue a warning if there are too few grains to resolve fragments."""
    if grains < FEW:
        warnings.warn(
            f"{grains} grains show whether a body is disrupted, but neither the masses of its fragments nor its "
            f"stretch; use {FEW} or more",
            stacklevel=4,
        )


def grains_flyby(
    body: Body,
    encounter: Encounter,
    rotation: Array,
    *,
    grains: int = 500,
    seeds: int | Sequence[int] = SEEDS,
    threads: int | None = None,
    pile: Pile | None = None,
    keep: bool = True,
    progress: Progressing = None,
) -> GrainsOutcome:
    """Compute an encounter with piles of grains.

    Parameters
    ----------
    body : Body
        With a friction angle and a cohesion in the calibrated range.
    encounter : Encounter
        With a path that does not reach the planet.
    rotation : ndarray (3, 3)
        Body axes -> frame of the encounter, at its start.
    grains : int
        Number of grains of a pile; a warning is issued below 100.
    seeds : int or sequence of int
        Number of piles, or their seeds.
    threads : int, optional
        Number of threads; one per processor by default. Results do not depend on it.
    pile : Pile, optional
        A pile of this body, whose shape and grain sizes are used.
    keep : bool
        Whether to store the settled piles on disk (:mod:`flybystab.body.pile_cache`) for the next run.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Raises
    ------
    InvalidInput
    NotConverged
    """
    check_grains(body, grains)
    chosen = seeds_of(seeds)
    if encounter.impact:
        raise InvalidInput("encounter", encounter, "one with a path that does not reach the planet")
    warn_of_few(grains)
    begun = clock.perf_counter()
    cores = os.cpu_count() or 1
    frames = FRAMES * len(chosen)
    with progress_bar(progress, frames, "frames", f"{piles_of(len(chosen))} of {grains} grains") as tick:
        counter = itertools.count(1)

        def one(seed: int) -> GrainsRun:
            state = pile.state(seed) if pile else make_pile(body, grains, seed, keep=keep)
            return one_pile(state, body, encounter, rotation, seed, lambda: tick(min(next(counter), frames)))

        runs = tuple(in_order(one, chosen, threads or cores))
    tables = []
    for run in runs:
        rows = run.fragments.copy()
        rows.add_column(np.full(len(rows), run.seed), name="seed", index=0)
        tables.append(rows)
    from astropy.table import vstack

    return GrainsOutcome(
        runs, vstack(tables), _modelled(body, encounter, grains, runs), (clock.perf_counter() - begun) * u.s
    )


def _modelled(body: Body, encounter: Encounter, grains: int, runs: tuple[GrainsRun, ...]) -> tuple[str, ...]:
    """Effects modelled in the runs: forces, piles, material and time after the encounter."""
    friction = np.rad2deg(body.material.phi)
    strength = body.material.c_pa
    cohesion = f"cohesion {strength:g} Pa (calibrated by pulling and shearing)" if strength else "no cohesion"
    gravity = (
        "direct sum of gravity" if grains < TREE_FROM else f"gravity by a tree (error {GRAVITY_ERROR:g})"
    )
    low, high = (np.percentile([r.end_time.to_value(u.h) for r in runs], q) for q in (0, 100))
    unsettled = sum(not r.settled for r in runs)
    return (
        *encounter.forces,
        f"{piles_of(len(runs))} of {grains} grains, soft spheres, {gravity}",
        f"friction angle {friction:g} deg (calibrated by spin-up), {cohesion}",
        f"until clumps had not changed for {QUIET:g} dynamical times, {low:.1f} to {high:.1f} h after closest approach"
        + (f"; still changing at the end of {unsettled} of {len(runs)} runs" if unsettled else ""),
    )


def seeds_of(seeds: int | Sequence[int]) -> list[int]:
    """Seeds from their number, or as given.

    Raises
    ------
    InvalidInput
    """
    if isinstance(seeds, bool):
        raise InvalidInput("seeds", seeds, "a number of piles, or a sequence of seeds")
    if isinstance(seeds, int | np.integer):
        if seeds < 1:
            raise InvalidInput("seeds", seeds, "one pile or more")
        return list(range(int(seeds)))
    try:
        chosen = [int(s) for s in seeds]
    except (TypeError, ValueError):
        chosen = []
    if not chosen or min(chosen) < 0 or len(set(chosen)) < len(chosen):
        raise InvalidInput("seeds", seeds, "different whole numbers of zero or more")
    return chosen
