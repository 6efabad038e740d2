"""Piles of grains through an encounter: the top rung, for bodies that do not survive as one.

Every seed is another pile with the body's shape, density, spin and friction angle; outcomes scatter from pile to pile,
so that a result is a distribution. A run goes on after the encounter until its clumps have not changed for
:data:`QUIET` (every clump of at least :data:`SMALLEST` of the mass has kept its mass to that share) or to a limit.

The class (Richardson et al. 1998) is that of the largest clump at the end: S up to half of the mass, B up to 0.9, M
above if mass escapes. What is bound to it but apart, as satellites are, counts in the bound share only.
"""

from __future__ import annotations

import itertools
import os
import time as clock
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import DENSITY_RANGE, Body
from flybystab.body.pile import Pile, PileState, check_grains, make_pile
from flybystab.core.dynamics.ground import Ground, no_ground
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.grains.clumps import LINK, bound_clumps, friends_of_friends, moments, semi_axes, spin_of
from flybystab.core.grains.simulation import GRAVITY_ERROR, TREE_FROM, Simulation
from flybystab.core.grains.state import Grains
from flybystab.core.numerics.threads import in_order
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.batch import ground_near, span_of
from flybystab.flybys.remnant import final_attitude
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.verdict import Verdict, classed, letter_of
from flybystab.progress import Progressing, progress_bar
from flybystab.tabular import Collection, Record, Tabular
from flybystab.typing import Array
from flybystab.units import brief

if TYPE_CHECKING:
    from astropy.table import QTable

#: Piles whose distribution is a result.
SEEDS = 8
#: Fewer grains than this warn.
FEW = 100
#: Clumps below this share of the mass are not fragments of their own.
SMALLEST = 0.01
#: Time without a change of clumps after which a run ends, in units of ``sqrt(R^3/(G M))`` (1.5 h at 2000 kg/m3), and
#: the longest time after the end of the encounter.
QUIET, LONGEST = 4.0, 40.0
#: A pile of which nothing escapes is whole if its largest clump has more than this share of the mass: the rest are
#: loose grains and small satellites.
WHOLE = 0.9
#: Change of a semi-axis of the remnant below which nothing has moved.
UNMOVED = 0.01
#: Rows of the course of a run.
_FRAMES = 60
#: Scale of ``R (tau)`` within which the pile may reach the ground: longest semi-axes.
_REACH = 3.0


@dataclass(frozen=True, eq=False)
class GrainsCourse(Tabular):
    """Clumps of one pile against time; every array has the same first dimension.

    Attributes
    ----------
    time : Quantity (m,)
        Since closest approach.
    largest_fraction, bound_fraction : ndarray (m,)
        Mass of the largest clump, and of it with what is bound to it, over that of the body.
    semi_axes : Quantity (m, 3)
        Of the largest clump, longest first.
    spin : Quantity (m,)
        Spin rate of the largest clump.
    positions : Quantity (m, n, 3)
        Places of the grains, from the centre of the unperturbed body, frame of the encounter; nan for those lost.
    """

    time: Quantity
    largest_fraction: Array
    bound_fraction: Array
    semi_axes: Quantity
    spin: Quantity
    positions: Quantity

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"<GrainsCourse {len(self)} rows, {self.positions.shape[1]} grains>"


@dataclass(frozen=True, eq=False, repr=False)
class GrainsRun(Record):
    """One pile after an encounter.

    Attributes
    ----------
    seed : int
    verdict : Verdict
    largest_fraction, bound_fraction : float
        Mass of the largest clump, and of it with what is bound to it, over that of the body.
    ground_fraction : float
        Mass that reached the ground or the atmosphere.
    semi_axes, initial_semi_axes : Quantity (3,)
        Of the ellipsoid with the inertia of the largest clump, and of the pile at the start.
    spin_vector, initial_spin_vector : Quantity (3,)
        Angular velocity of the largest clump, and of the pile, frame of the encounter.
    fragments : QTable
        As :attr:`GrainsOutcome.fragments`, without the seed.
    spin_ratio, pole_change : float, Quantity
        Effective spin rate ``2 E/H`` of the largest clump over that of the pile at the start, and the angle between
        their angular momenta; nan for a pile without spin.
    axes_directions : ndarray (3, 3)
        Principal axes of the largest clump as columns, frame of the encounter.
    settled : bool
        Whether clumps had stopped changing at the end of the run.
    end_time : Quantity
        Of the run, since closest approach.
    course : GrainsCourse
    radius : Quantity (n,)
        Of the grains.
    label : ndarray (n,)
        Row of `fragments` of each grain at the end; -1 for loose grains and lost ones.
    steps : int
    wall_time : Quantity
    """

    seed: int
    verdict: Verdict
    largest_fraction: float
    bound_fraction: float
    ground_fraction: float
    semi_axes: Quantity
    initial_semi_axes: Quantity
    spin_vector: Quantity
    initial_spin_vector: Quantity
    spin_ratio: float
    pole_change: Quantity
    axes_directions: Array = field(repr=False)
    fragments: QTable = field(repr=False)
    settled: bool
    end_time: Quantity
    course: GrainsCourse = field(repr=False)
    radius: Quantity = field(repr=False)
    label: NDArray[np.int64] = field(repr=False)
    steps: int
    wall_time: Quantity

    _left_out: ClassVar[tuple[str, ...]] = ("course", "radius", "label")

    @property
    def stretch(self) -> float:
        """Longest semi-axis of the largest clump over that of the pile at the start."""
        return float((self.semi_axes[0] / self.initial_semi_axes[0]).to_value(u.one))

    @property
    def spin(self) -> Quantity:
        """Spin rate of the largest clump."""
        return np.linalg.norm(self.spin_vector)


@dataclass(frozen=True, eq=False)
class GrainsOutcome(Collection):
    """What grains say of an encounter: a distribution over piles.

    Attributes
    ----------
    runs : tuple of GrainsRun
        One a seed.
    fragments : QTable
        Clumps of at least 1 % of the mass: ``seed``, ``mass_fraction``, ``semi_axes`` (3), ``spin`` (3), ``position``
        and ``velocity`` (3) relative to the largest of the same seed, ``bound_to`` (row of the same seed; -1 for
        none), and the orbit about it: ``a`` and ``e`` (nan where unbound). Frame of the encounter.
    modelled : tuple of str
    wall_time : Quantity
        Of all runs together, as they ran.
    """

    runs: tuple[GrainsRun, ...]
    fragments: QTable = field(repr=False)
    modelled: tuple[str, ...] = field(repr=False)
    wall_time: Quantity = field(repr=False)

    def _rows(self) -> dict[str, Any]:
        tables = [run.to_table() for run in self.runs]
        names = [name for name in tables[0].colnames if name not in ("axes_directions", "wall_time")]
        return {
            name: Quantity([t[name][0] for t in tables])
            if isinstance(tables[0][name], Quantity)
            else np.array([t[name][0] for t in tables])
            for name in names
        }

    @property
    def median(self) -> GrainsRun:
        """The run with the median mass of the largest clump, the lower one of two."""
        ordered = sorted(self.runs, key=lambda r: (r.largest_fraction, r.bound_fraction, -r.stretch))
        return ordered[(len(ordered) - 1) // 2]

    @property
    def verdict(self) -> Verdict:
        """That of the median run, or IMPACT if most runs are."""
        hits = sum(r.verdict == Verdict.IMPACT for r in self.runs)
        if 2 * hits > len(self.runs):
            return Verdict.IMPACT
        if self.median.verdict != Verdict.IMPACT:
            return self.median.verdict
        return classed(self.median.largest_fraction)[0]

    @property
    def largest_fraction(self) -> float:
        """Of the median run: mass of the largest clump over that of the body."""
        return self.median.largest_fraction

    @property
    def bound_fraction(self) -> float:
        """Of the median run: the largest clump with what is bound to it, over the mass of the body."""
        return self.median.bound_fraction

    @property
    def largest_range(self) -> tuple[float, float]:
        """Least and largest mass of the largest clump over the seeds."""
        found = [r.largest_fraction for r in self.runs]
        return min(found), max(found)

    def probabilities(self, confidence: float = 0.68) -> dict[Verdict, tuple[float, float, float]]:
        """Share of the seeds with each verdict, and its interval (Jeffreys) at a level of confidence.

        Every verdict that occurs is listed, in the order of severity.
        """
        from scipy.stats import beta

        n, tail = len(self.runs), 0.5 * (1.0 - confidence)
        out = {}
        for verdict in Verdict:
            k = sum(r.verdict == verdict for r in self.runs)
            if k:
                low = 0.0 if k == 0 else float(beta.ppf(tail, k + 0.5, n - k + 0.5))
                high = 1.0 if k == n else float(beta.ppf(1.0 - tail, k + 0.5, n - k + 0.5))
                out[verdict] = (k / n, low, high)
        return out

    def __repr__(self) -> str:
        low, high = self.largest_range
        shares = ", ".join(f"{v} {p[0]:.2g}" for v, p in self.probabilities().items())
        return (
            f"<GrainsOutcome {len(self.runs)} piles: {shares}; largest clump {self.largest_fraction:.3g} "
            f"({low:.3g} to {high:.3g}), {len(self.fragments)} fragments, {brief(self.wall_time, u.s)}>"
        )


def warn_of_few(grains: int) -> None:
    """Warn of a number of grains that resolves little."""
    if grains < FEW:
        warnings.warn(
            f"{grains} grains tell whether a body comes apart, not the mass of its fragments nor how far it stretches; "
            f"use {FEW} or more",
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
    """Carry piles of grains through an encounter.

    Parameters
    ----------
    body : Body
        With a friction angle and a cohesion in the calibrated range.
    encounter : Encounter
        One whose path clears the planet.
    rotation : ndarray (3, 3)
        Body axes -> frame of the encounter, at its start.
    grains : int
        Number of grains of a pile; fewer than 100 warn.
    seeds : int or sequence of int
        How many piles, or which.
    threads : int, optional
        At a time; all cores by default. Results do not depend on it.
    pile : Pile, optional
        Of this body: gives the shape and the sizes of the grains.
    keep : bool
        Whether piles are kept in the cache.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Raises
    ------
    InvalidInput
    NotConverged
    """
    check_grains(body, grains)
    chosen = _seeds(seeds)
    if encounter.impact:
        raise InvalidInput(
            "encounter", encounter, "one whose path clears the planet: nothing is left for grains"
        )
    warn_of_few(grains)
    begun = clock.perf_counter()
    cores = os.cpu_count() or 1
    rows = _FRAMES * len(chosen)
    with progress_bar(progress, rows, "frames", f"{len(chosen)} piles of {grains} grains") as tick:
        counter = itertools.count(1)

        def one(seed: int) -> GrainsRun:
            state = pile.state(seed) if pile else make_pile(body, grains, seed, keep=keep)
            return one_pile(state, body, encounter, rotation, seed, lambda: tick(min(next(counter), rows)))

        runs = tuple(in_order(one, chosen, threads or cores))
    tables = []
    for run in runs:
        rows = run.fragments.copy()
        rows.add_column(np.full(len(rows), run.seed), name="seed", index=0)
        tables.append(rows)
    friction = np.rad2deg(body.material.phi)
    strength = body.material.c_pa
    cohesion = f"cohesion {strength:g} Pa (calibrated by pulling and shearing)" if strength else "no cohesion"
    gravity = (
        "direct sum of gravity" if grains < TREE_FROM else f"gravity by a tree (error {GRAVITY_ERROR:g})"
    )
    low, high = (np.percentile([r.end_time.to_value(u.h) for r in runs], q) for q in (0, 100))
    unsettled = sum(not r.settled for r in runs)
    modelled = (
        *encounter.forces,
        f"{len(runs)} piles of {grains} grains, soft spheres, {gravity}",
        f"friction angle {friction:g} deg (calibrated by spin-up), {cohesion}",
        f"until clumps had not changed for {QUIET:g} dynamical times, {low:.1f} to {high:.1f} h after closest approach"
        + (f"; in {unsettled} runs they still did" if unsettled else ""),
    )
    from astropy.table import vstack

    return GrainsOutcome(runs, vstack(tables), modelled, (clock.perf_counter() - begun) * u.s)


def _seeds(seeds: int | Sequence[int]) -> list[int]:
    if isinstance(seeds, bool):
        raise InvalidInput("seeds", seeds, "how many piles, or a sequence of seeds")
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


def one_pile(
    pile: PileState,
    body: Body,
    encounter: Encounter,
    rotation: Array,
    seed: int = 0,
    tick: Callable[[], None] = lambda: None,
) -> GrainsRun:
    """Carry one pile through an encounter (see :func:`grains_flyby`); `tick` is called at every frame of its course."""
    begun = clock.perf_counter()
    sim, unit = pile.simulation, pile.time
    sim.rotate(rotation)
    sim.tide, sim.ground = _tide(encounter, unit), _ground(encounter, body, pile)
    start, stop, limit = span_of(encounter) / unit
    sim.time = float(start)
    _, _, rate, momentum = _turning(_at_positions(sim), np.zeros(len(sim.grains.mass), np.int64))
    longest = min(float(limit), stop + LONGEST)
    rows: list[tuple[float, ...]] = []
    places: list[Array] = []
    masses: list[Array] = []
    frames = np.linspace(start, stop, _FRAMES)[1:]
    _record(sim, rows, places, masses)
    for moment in frames:
        if moment - sim.time > 0.5 * sim.dt:
            sim.advance(moment - sim.time)
        _record(sim, rows, places, masses)
        tick()
    step = float(frames[-1] - frames[-2])
    while not _quiet(rows, masses) and sim.time < longest:
        sim.advance(step)
        _record(sim, rows, places, masses)
    tick()
    settled = _quiet(rows, masses)
    fragments, label = _fragments(sim, pile)
    directions, _, rate_after, momentum_after = _turning(_at_positions(sim), label)
    last = rows[-1]
    total = 1.0  # of the body, scaled
    ground = total - float(sim.grains.mass.sum())
    axes = np.array(last[3:6]) * pile.length
    course = np.array(rows)
    if sim.counts[1] > 0:
        verdict = Verdict.IMPACT
    elif last[2] < 1.0 or last[1] <= WHOLE:
        verdict, _ = classed(last[1])
    else:
        moved = np.abs(axes / pile.axes - 1.0).max()
        verdict = Verdict.INTACT if moved < UNMOVED else Verdict.RESHAPED
    return GrainsRun(
        seed=seed,
        verdict=verdict,
        largest_fraction=last[1],
        bound_fraction=last[2],
        ground_fraction=max(ground, 0.0) if sim.counts[1] > 0 else 0.0,
        semi_axes=axes * u.m,
        initial_semi_axes=pile.axes * u.m,
        spin_vector=np.array(last[6:9]) / unit * u.rad / u.s,
        initial_spin_vector=rotation @ pile.spin * u.rad / u.s,
        spin_ratio=rate_after / rate if rate > 1e-9 else float("nan"),
        pole_change=_angle(momentum, momentum_after) * u.deg if rate > 1e-9 else np.nan * u.deg,
        axes_directions=directions,
        fragments=fragments,
        settled=settled,
        end_time=sim.time * unit * u.s,
        course=GrainsCourse(
            time=course[:, 0] * unit * u.s,
            largest_fraction=course[:, 1],
            bound_fraction=course[:, 2],
            semi_axes=course[:, 3:6] * pile.length * u.m,
            spin=np.linalg.norm(course[:, 6:9], axis=1) / unit * u.rad / u.s,
            positions=np.array(places) * pile.length * u.m,
        ),
        radius=sim.grains.radius * pile.length * u.m,
        label=label,
        steps=sim.steps,
        wall_time=(clock.perf_counter() - begun) * u.s,
    )


def _tide(encounter: Encounter, unit: float) -> TidePanels:
    """The encounter's panels on the scaled clock."""
    tide = encounter.tide
    return TidePanels(tide.tau / unit, tide.start, tide.width, tide.coefficients * unit**2)


def _ground(encounter: Encounter, body: Body, pile: PileState) -> Ground:
    """The ground on the scaled clock; none where no part of a stretched body gets there."""
    ground = ground_near(encounter, _REACH * float(body.axes[0]))
    if ground.coefficients.shape[0] == 0:
        return no_ground()
    return Ground(
        ground.tau / pile.time, ground.start, ground.width, ground.floor, ground.least, pile.length,
        ground.coefficients,
    )  # fmt: skip


def _at_positions(sim: Simulation) -> Grains:
    """The grains with their velocities at the time of the positions."""
    return sim.grains._replace(v=sim.u, w=sim.s)


def _record(sim: Simulation, rows: list[tuple[float, ...]], places: list[Array], masses: list[Array]) -> None:
    """Add the largest clump, the places, and the masses of clumps."""
    g = _at_positions(sim)
    sizes, label = _clumps(g)
    member = label == int(np.argmax(sizes)) if len(sizes) else np.zeros(len(label), np.bool_)
    if not member.any():
        rows.append((sim.time, 0.0, 0.0, *([np.nan] * 6)))
        masses.append(np.zeros(0))
        places.append(np.full_like(g.x, np.nan))
        return
    mass, _, _, inertia, momentum = moments(g, member)
    axes, _ = semi_axes(mass, inertia)
    spin = spin_of(inertia, momentum)
    bound = bound_clumps(g, label, int(np.argmax(sizes)))
    held = label >= 0
    inside = held & bound[np.where(held, label, 0)]
    rows.append((sim.time, _share(g, member), _share(g, inside), *axes, *spin))
    places.append(np.where((g.mass > 0.0)[:, None], g.x, np.nan))
    masses.append(np.sort(sizes[sizes >= SMALLEST])[::-1])


def _turning(g: Grains, label: NDArray[np.int64]) -> tuple[Array, Array, float, Array]:
    """Principal axes, angular velocity, ``2 E/H`` and angular momentum of the grains with the label zero."""
    member = (label == 0) & (g.mass > 0.0)
    if not member.any():
        return np.full((3, 3), np.nan), np.full(3, np.nan), float("nan"), np.full(3, np.nan)
    mass, _, _, inertia, momentum = moments(g, member)
    spin = spin_of(inertia, momentum)
    size = float(np.linalg.norm(momentum))
    return semi_axes(mass, inertia)[1], spin, float(spin @ momentum) / size if size > 0.0 else 0.0, momentum


def _angle(a: Array, b: Array) -> float:
    """Angle between two vectors, deg."""
    return float(np.rad2deg(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def _share(g: Grains, member: NDArray[np.bool_]) -> float:
    """Mass of some grains over that of the body; one, not one less rounding, if it is all of them."""
    return 1.0 if member.all() else float(g.mass[member].sum())


def _clumps(g: Grains) -> tuple[Array, NDArray[np.int64]]:
    """Masses of all clumps and the number of each grain's."""
    label = np.empty(len(g.mass), np.int64)
    count = friends_of_friends(g, LINK, label)
    held = label >= 0
    sizes: Array = np.bincount(label[held], weights=g.mass[held], minlength=count).astype(float)
    return sizes, label


def _quiet(rows: list[tuple[float, ...]], masses: list[Array]) -> bool:
    """Whether the clumps have kept their masses for the last :data:`QUIET` of the run."""
    now = masses[-1]
    for row, sizes in zip(reversed(rows), reversed(masses), strict=True):
        if len(sizes) != len(now) or np.abs(sizes - now).max(initial=0.0) > SMALLEST:
            return False
        if rows[-1][0] - row[0] >= QUIET:
            return True
    return False


def _fragments(sim: Simulation, pile: PileState) -> tuple[QTable, NDArray[np.int64]]:
    """Table of the clumps, the most massive first, and the row of each grain."""
    g = _at_positions(sim)
    sizes, label = _clumps(g)
    order = [int(k) for k in np.argsort(-sizes, kind="stable") if sizes[k] >= SMALLEST]
    row_of = np.full(len(g.mass), -1, np.int64)
    found = []
    for row, k in enumerate(order):
        member = label == k
        row_of[member] = row
        mass, centre, velocity, inertia, momentum = moments(g, member)
        axes, _ = semi_axes(mass, inertia)
        spin = spin_of(inertia, momentum)
        found.append((_share(g, member), axes, spin, centre, velocity))
    n = len(found)
    parents, a, e = np.full(n, -1, np.int64), np.full(n, np.nan), np.full(n, np.nan)
    for i in range(n):
        least = np.float64(0.0)
        for j in range(i):  # the more massive ones
            total = found[i][0] + found[j][0]
            d, w = found[i][3] - found[j][3], found[i][4] - found[j][4]
            r = float(np.linalg.norm(d))
            energy = np.float64(0.5 * w @ w - total / r)
            if energy < least:
                least = energy
                parents[i], a[i] = j, -0.5 * total / energy
                h2 = float(np.sum(np.cross(d, w) ** 2))
                e[i] = np.sqrt(max(0.0, 1.0 - h2 / (total * a[i])))
    length, speed = pile.length, pile.length / pile.time
    origin = found[0][3:5] if n else (np.zeros(3), np.zeros(3))

    def column(values: list[Array]) -> Array:
        return np.array(values).reshape(n, 3)

    from astropy.table import QTable

    table = QTable(
        {
            "mass_fraction": np.array([f[0] for f in found]),
            "semi_axes": column([f[1] for f in found]) * length * u.m,
            "spin": column([f[2] for f in found]) / pile.time * u.rad / u.s,
            "position": column([f[3] - origin[0] for f in found]) * length * u.m,
            "velocity": column([f[4] - origin[1] for f in found]) * speed * u.m / u.s,
            "bound_to": parents,
            "a": a * length * u.m,
            "e": e,
        }
    )
    return table, row_of


#: Verdicts of the ellipsoid that hand on to grains: it cannot say what becomes of the body.
HANDED_ON = (Verdict.BEYOND_MODEL, Verdict.MASS_LOSS, Verdict.DISRUPTED)
#: Number of grains where it is not given.
GRAINS = 500


class Request(NamedTuple):
    """When to run grains, and how many: ``grains=``, ``seeds=`` and ``model=`` of ``flyby``, checked."""

    grains: int  #: 0 for never
    always: bool
    seeds: list[int]


def request(
    grains: int | str | None, seeds: int | Sequence[int] | None, model: str | None, pile: Pile | None = None
) -> Request:
    """Check ``grains=``, ``seeds=`` and ``model=``; a pile is always run, by default alone.

    Raises
    ------
    InvalidInput
    """
    if model not in (None, "ellipsoid", "grains"):
        raise InvalidInput("model", model, "'ellipsoid', 'grains', or None for the first that can answer")
    if pile is not None:
        if grains is not None:
            raise InvalidInput("grains", grains, "none beside a Pile, which has its own")
        if model == "ellipsoid":
            raise InvalidInput("model", model, "'grains' or None for a Pile; pile.body is the ellipsoid")
        if seeds is None:
            return Request(pile.grains, True, [pile.seed])
        numbered = isinstance(seeds, int | np.integer)
        return Request(pile.grains, True, [k + pile.seed if numbered else k for k in _seeds(seeds)])
    chosen = _seeds(SEEDS if seeds is None else seeds)
    if grains is None and model != "grains":
        return Request(0, False, chosen)
    if model == "ellipsoid":
        raise InvalidInput("model", model, "no grains= beside it")
    if isinstance(grains, str) and grains != "always":
        raise InvalidInput("grains", grains, "a number of grains, or 'always'")
    count = GRAINS if grains is None or isinstance(grains, str) else grains
    return Request(count, model == "grains" or grains == "always", chosen)


def handed_on(
    result: FlybyResult,
    body: Body,
    encounter: Encounter,
    rotation: Array,
    asked: Request,
    pile: Pile | None = None,
    progress: Progressing = None,
) -> FlybyResult:
    """The result of the ellipsoid, or of grains where it hands on to them or they are forced.

    The ellipsoid hands on past its largest axis ratio, with loss of mass, and where its grains are out of contact at
    the end. A centre that reaches the ground leaves nothing for grains.
    """
    if asked.grains == 0:
        return result
    check_grains(body, asked.grains)
    apart = [name for name, _ in result.events if name in ("contact", "loss of contact")][-1:] == [
        "loss of contact"
    ]
    needed = result.verdict in HANDED_ON or (apart and result.verdict != Verdict.IMPACT)
    if encounter.impact or not (asked.always or needed):
        return result
    outcome = grains_flyby(
        body, encounter, rotation, grains=asked.grains, seeds=asked.seeds, pile=pile, progress=progress
    )
    run, verdict = outcome.median, outcome.verdict
    return result.with_(
        verdict=verdict,
        verdict_class=letter_of(verdict, outcome.largest_fraction),
        bound_fraction=outcome.bound_fraction,
        semi_axes=run.semi_axes,
        spin=run.spin,
        spin_vector=run.spin_vector,
        end_time=run.end_time - encounter.t_start * u.s,
        spin_ratio=run.spin_ratio,
        pole_change=run.pole_change,
        attitude=_attitude(body, run),
        body=_remnant(body, run),
        modelled=outcome.modelled,
        rung="grains",
        grains=outcome,
    )


def _attitude(body: Body, run: GrainsRun) -> Array:
    """Principal axes of the largest clump, as :attr:`FlybyResult.attitude`."""
    vectors = run.axes_directions
    if not np.isfinite(vectors).all():
        return vectors
    shape = vectors @ np.diag(run.semi_axes.to_value(u.m) ** 2) @ vectors.T
    return final_attitude(shape, run.spin_vector.to_value(u.rad / u.s), float(body.omega[2]))


def _remnant(body: Body, run: GrainsRun) -> Body:
    """The largest clump as a body."""
    axes = run.semi_axes.to_value(u.m)
    rho = float(run.largest_fraction * body.rho * np.prod(body.axes) / np.prod(axes))
    return Body(
        semi_axes=run.semi_axes,
        density=rho * u.kg / u.m**3,
        spin=_attitude(body, run).T @ run.spin_vector,
        material=body.material,
        dispersed=not DENSITY_RANGE[0] <= rho <= DENSITY_RANGE[1],
    )
