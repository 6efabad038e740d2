"""Integration of one pile of grains through an encounter.

A run continues after the encounter until its clumps have not changed for :data:`QUIET`, or to a limit: the mass of no
clump above the fraction :data:`flybystab.flybys.grain_clumps.SMALLEST` has changed by more than that fraction.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import Body
from flybystab.body.pile import PileState
from flybystab.core.dynamics.ground import Ground, no_ground
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.grains.simulation import Simulation
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.batch import ground_near, span_of
from flybystab.flybys.grain_clumps import (
    SMALLEST,
    LargestClump,
    RotationState,
    at_positions,
    fragments_of,
    largest_clump,
    rotation_of,
)
from flybystab.flybys.grains_outcome import WHOLE, GrainsCourse, GrainsRun
from flybystab.flybys.verdict import Verdict, classed
from flybystab.typing import Array

#: Time without a change of clumps after which a run ends, in units of ``sqrt(R^3/(G M))`` (1.5 h at 2000 kg/m3), and
#: the longest time after the end of the encounter.
QUIET, LONGEST = 4.0, 40.0
#: Relative change of a semi-axis of the remnant below which the body counts as intact.
UNMOVED = 0.01
#: Rows of the course of a run during the encounter.
FRAMES = 60
#: Multiple of the longest semi-axis within which the pile may reach the ground.
_REACH = 3.0


def one_pile(
    pile: PileState,
    body: Body,
    encounter: Encounter,
    rotation: Array,
    seed: int = 0,
    tick: Callable[[], None] = lambda: None,
) -> GrainsRun:
    """Integrate one pile through an encounter (see :func:`flybystab.flybys.grains_flyby.grains_flyby`).

    `tick` is called at every frame of its course. The simulation of `pile` is changed.
    """
    begun = clock.perf_counter()
    sim, unit = pile.simulation, pile.time
    sim.rotate(rotation)
    sim.tide, sim.ground = _tide(encounter, unit), _ground(encounter, body, pile)
    before = rotation_of(at_positions(sim), np.zeros(len(sim.grains.mass), np.int64))
    start, stop, limit = span_of(encounter) / unit
    rows, places = _carry(sim, float(start), float(stop), min(float(limit), stop + LONGEST), tick)
    fragments, label = fragments_of(sim, pile)
    after = rotation_of(at_positions(sim), label)
    last = rows[-1]
    impact = sim.counts[1] > 0
    ratio, angle = _change(before, after)
    return GrainsRun(
        seed=seed,
        verdict=Verdict.IMPACT if impact else _verdict(last, pile),
        largest_fraction=last.mass,
        bound_fraction=last.bound_mass,
        ground_fraction=max(1.0 - float(sim.grains.mass.sum()), 0.0) if impact else 0.0,
        semi_axes=last.semi_axes * pile.length * u.m,
        initial_semi_axes=pile.axes * u.m,
        spin_vector=last.spin / unit * u.rad / u.s,
        initial_spin_vector=rotation @ pile.spin * u.rad / u.s,
        spin_ratio=ratio,
        pole_change=angle,
        axes_directions=after.axes,
        fragments=fragments,
        settled=_quiet(rows),
        end_time=sim.time * unit * u.s,
        course=_course(rows, places, pile),
        radius=sim.grains.radius * pile.length * u.m,
        label=label,
        steps=sim.steps,
        wall_time=(clock.perf_counter() - begun) * u.s,
    )


def _carry(
    sim: Simulation, start: float, stop: float, longest: float, tick: Callable[[], None]
) -> tuple[list[LargestClump], list[Array]]:
    """Integrate from `start` to `stop`, and on until the clumps no longer change or to `longest`.

    Returns the largest clump and the positions of the grains at each row of the course.
    """
    rows: list[LargestClump] = []
    places: list[Array] = []

    def record() -> None:
        rows.append(largest_clump(sim))
        g = sim.grains
        places.append(np.where((g.mass > 0.0)[:, None], g.x, np.nan))

    sim.time = start
    frames = np.linspace(start, stop, FRAMES)[1:]
    record()
    for moment in frames:
        if moment - sim.time > 0.5 * sim.dt:
            sim.advance(moment - sim.time)
        record()
        tick()
    step = float(frames[-1] - frames[-2])
    while not _quiet(rows) and sim.time < longest:
        sim.advance(step)
        record()
    tick()
    return rows, places


def _quiet(rows: list[LargestClump]) -> bool:
    """Whether the clumps have kept their masses during the last :data:`QUIET` of the run."""
    now = rows[-1]
    for row in reversed(rows):
        if len(row.masses) != len(now.masses) or np.abs(row.masses - now.masses).max(initial=0.0) > SMALLEST:
            return False
        if now.time - row.time >= QUIET:
            return True
    return False


def _verdict(last: LargestClump, pile: PileState) -> Verdict:
    """Verdict of a pile that has not reached the ground."""
    if last.bound_mass < 1.0 or last.mass <= WHOLE:
        return classed(last.mass)[0]
    moved = np.abs(last.semi_axes * pile.length / pile.axes - 1.0).max()
    return Verdict.INTACT if moved < UNMOVED else Verdict.RESHAPED


def _change(before: RotationState, after: RotationState) -> tuple[float, Quantity]:
    """Ratio of the spin rates, and angle between the angular momenta; nan for a pile without spin."""
    if not before.spin_rate > 1e-9:
        return float("nan"), np.nan * u.deg
    a, b = before.momentum, after.momentum
    angle = float(np.rad2deg(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))
    return after.spin_rate / before.spin_rate, angle * u.deg


def _course(rows: list[LargestClump], places: list[Array], pile: PileState) -> GrainsCourse:
    """The course of a run in SI units."""
    spin = np.array([row.spin for row in rows])
    return GrainsCourse(
        time=np.array([row.time for row in rows]) * pile.time * u.s,
        largest_fraction=np.array([row.mass for row in rows]),
        bound_fraction=np.array([row.bound_mass for row in rows]),
        semi_axes=np.array([row.semi_axes for row in rows]) * pile.length * u.m,
        spin=np.linalg.norm(spin, axis=1) / pile.time * u.rad / u.s,
        positions=np.array(places) * pile.length * u.m,
    )


def _tide(encounter: Encounter, unit: float) -> TidePanels:
    """The encounter's panels on the scaled clock."""
    tide = encounter.tide
    return TidePanels(tide.tau / unit, tide.start, tide.width, tide.coefficients * unit**2)


def _ground(encounter: Encounter, body: Body, pile: PileState) -> Ground:
    """The ground on the scaled clock; none where no part of a stretched body can reach it."""
    ground = ground_near(encounter, _REACH * float(body.axes[0]))
    if ground.coefficients.shape[0] == 0:
        return no_ground()
    return Ground(
        ground.tau / pile.time, ground.start, ground.width, ground.floor, ground.least, pile.length,
        ground.coefficients,
    )  # fmt: skip
