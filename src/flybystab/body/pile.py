"""Rubble piles of grains with the shape, density, spin and friction angle of a body.

A pile is made in scaled units (:mod:`flybystab.core.grains.state`), where one without cohesion has neither size nor
density, and kept on disk by its inputs. Recipe: spheres fall together with little friction in a central field whose
level surfaces are similar to the ellipsoid; the wanted number is carved out; friction is switched on, and the pile
settles under its own gravity, at first with a drag. A spinning pile is spun up rigidly and relaxes.
"""

from __future__ import annotations

import csv
import hashlib
import json
import os
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import Body
from flybystab.constants import G
from flybystab.core.grains.clumps import moments, semi_axes, spin_of
from flybystab.core.grains.neighbours import Pairs, empty_pairs
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.state import Grains, contact_parameters
from flybystab.errors import InvalidInput
from flybystab.typing import Array

#: Changes with the recipe, so that piles made by an older one are not taken for new ones.
RECIPE = 1
#: Radii of grains, over their mean.
SIZES = (0.6, 1.4)
#: Sum of the grains' volumes over that of the ellipsoid, of the first guess.
_PACKING = 0.6
#: Grains in the cloud, over those wanted.
_SURPLUS = 1.35
#: Size of the cloud, over that of the ellipsoid.
_CLOUD = 1.75
#: Fewer grains than this resolve no shape, more than this need hours.
LEAST, MOST = 20, 200_000


@dataclass(frozen=True)
class Friction:
    """Contact friction with the friction angle that a pile of such grains has."""

    mu_s: float
    beta: float
    angle: float  #: deg


@cache
def friction_table() -> tuple[Friction, ...]:
    """Calibrated friction, by angle: spin-up of spheres, ``flybystab bench grains``."""
    lines = [x for x in files("flybystab.data").joinpath("grains_friction.csv").read_text().splitlines() if x]
    rows = csv.DictReader(x for x in lines if not x.startswith("#"))
    found = [Friction(float(r["mu_s"]), float(r["beta"]), float(r["friction_angle_deg"])) for r in rows]
    return tuple(sorted(found, key=lambda f: f.angle))


def contact_friction(angle: float) -> Friction:
    """Contact friction of a pile with a friction angle (rad), interpolated in the calibrated table.

    Raises
    ------
    InvalidInput
        The angle is beyond the table.
    """
    table, degrees = friction_table(), float(np.rad2deg(angle))
    angles = [f.angle for f in table]
    if not angles[0] - 1e-9 <= degrees <= angles[-1] + 1e-9:
        raise InvalidInput(
            "friction_angle",
            f"{degrees:g} deg",
            f"an angle for which grains are calibrated: {angles[0]:.1f} to {angles[-1]:.1f} deg",
        )
    mu_s = float(np.interp(degrees, angles, [f.mu_s for f in table]))
    beta = float(np.interp(degrees, angles, [f.beta for f in table]))
    return Friction(mu_s, beta, degrees)


@dataclass
class Pile:
    """A pile of grains in scaled units, with its body's scale.

    Attributes
    ----------
    simulation : Simulation
        Grains, contacts and history, centred, with the spin of the body, in body axes.
    length, time : float
        Units of the simulation, m and s.
    friction : Friction
    axes : ndarray (3,)
        Semi-axes of the ellipsoid with the pile's inertia, longest first, m.
    spin : ndarray (3,)
        Angular velocity of the rigid body with the pile's inertia and angular momentum, body axes, rad/s.
    """

    simulation: Simulation
    length: float
    time: float
    friction: Friction
    axes: Array
    spin: Array

    @property
    def count(self) -> int:
        """Number of grains."""
        return len(self.simulation.grains.mass)


def make_pile(body: Body, grains: int = 500, seed: int = 0, **options: Any) -> Pile:
    """A pile with the shape, density, spin and friction angle of a body.

    Parameters
    ----------
    body : Body
        Its cohesion must be zero.
    grains : int
        Number of grains.
    seed : int
        Piles of different seeds differ in the places and sizes of all grains.
    **options
        Of :class:`flybystab.core.grains.simulation.Simulation`, for tests of the numerics; and `overlap`, the mean
        overlap that sets the stiffness. Not for piles from the cache.

    Raises
    ------
    InvalidInput
        A friction angle beyond the calibrated range, cohesion, or a number of grains out of range.
    """
    check_grains(body, grains)
    friction = contact_friction(body.material.phi)
    shape = body.axes / np.cbrt(np.prod(body.axes))
    settled = _cached(
        {"shape": shape, "grains": grains, "seed": seed, "mu_s": friction.mu_s, "beta": friction.beta},
        lambda: settled_pile(shape, grains, seed, friction.mu_s, friction.beta),
    )
    sim = simulation_of(settled, friction.mu_s, friction.beta, **options)
    return spun(sim, body, friction)


def check_grains(body: Body, grains: int) -> None:
    """Refuse a number of grains, or a body, for which no pile is made."""
    if not isinstance(grains, int | np.integer) or isinstance(grains, bool) or not grains >= LEAST:
        raise InvalidInput("grains", grains, f"a whole number of grains, {LEAST} or more")
    most = min(MOST, int(_memory() / 4000))
    if grains > most:
        raise InvalidInput(
            "grains", grains, f"at most {most} grains, for the memory and the time that they take"
        )
    if body.material.c_pa > 0.0:
        raise InvalidInput(
            "cohesion",
            body.material.cohesion,
            "no cohesion: that of grains is not calibrated against the bulk's",
        )
    contact_friction(body.material.phi)


def _memory() -> float:
    """Bytes of memory of this machine; unlimited where it does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return np.inf


def spun(sim: Simulation, body: Body, friction: Friction) -> Pile:
    """The pile spun up to the body's spin, relaxed and turned back to body axes."""
    g = sim.grains
    everything = g.mass > 0.0
    mass, _, _, inertia, _ = moments(g, everything)
    axes, _ = semi_axes(mass, inertia)
    length = float(np.cbrt(np.prod(body.axes) / np.prod(axes)))
    unit = float(np.sqrt(length**3 / (G * body.mass.to_value(u.kg))))
    spin = body.omega * unit
    start = g.x.copy()
    sim.add_spin(spin - spin_of(inertia, moments(g, everything)[4]))
    sim.advance(2.2)
    # undo the rotation that the pile has made: the best one between the positions (Kabsch 1976)
    left, _, right = np.linalg.svd(g.x.T @ (g.mass[:, None] * start))
    turn = right.T @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ left.T
    sim.rotate(turn)
    sim.centre()
    mass, _, _, inertia, momentum = moments(g, everything)
    sim.add_spin(spin - spin_of(inertia, momentum))
    mass, _, _, inertia, momentum = moments(g, everything)
    axes, _ = semi_axes(mass, inertia)
    sim.time = 0.0
    return Pile(sim, length, unit, friction, axes * length, spin_of(inertia, momentum) / unit)


def settled_pile(shape: Array, grains: int, seed: int, mu_s: float, beta: float) -> Simulation:
    """A pile at rest with semi-axes in the ratios of `shape` (longest first, product one), scaled units."""
    generator = np.random.default_rng(np.random.SeedSequence([seed, grains]))
    cloud = round(_SURPLUS * grains) + 20
    radius = generator.uniform(*SIZES, cloud)
    radius *= np.cbrt(_PACKING / (grains * np.mean(radius**3)))
    x = _scattered(shape * _CLOUD, radius, generator)
    mass = radius**3 / (grains * np.mean(radius**3))
    falling = Grains(x, np.zeros_like(x), np.zeros_like(x), radius, mass)
    loose = contact_parameters(float(radius.mean()), mu_s=0.2, beta=0.0)
    sim = Simulation.of(falling, loose)
    field = np.array([1.0, *(1.0 / shape**2)])
    sim.advance(3.5, gravity=False, pull=field, drag=0.6)
    sim.advance(1.5, gravity=False, pull=field, drag=3.0)
    chosen = _carved(sim.grains, shape, grains)
    g = Grains(*(a[chosen].copy() for a in sim.grains))
    g = g._replace(mass=g.mass / g.mass.sum())
    everything = np.ones(grains, np.bool_)
    m, _, _, inertia, _ = moments(g, everything)
    axes, turn = semi_axes(m, inertia)
    g.x[:] /= np.cbrt(np.prod(axes))
    g.radius[:] /= np.cbrt(np.prod(axes))
    g.v[:], g.w[:] = 0.0, 0.0
    sim = Simulation.of(g, contact_parameters(float(g.radius.mean()), mu_s=mu_s, beta=beta))
    sim.centre()
    sim.advance(1.9, drag=3.0)
    sim.advance(1.9)
    sim.centre()
    m, _, _, inertia, momentum = moments(g, everything)
    sim.add_spin(-spin_of(inertia, momentum))
    _, turn = semi_axes(m, inertia)
    sim.rotate(turn.T)
    return sim


def _scattered(axes: Array, radius: Array, generator: np.random.Generator) -> Array:
    """Places of spheres at random in an ellipsoid, none overlapping, the largest placed first."""
    x = np.empty((len(radius), 3))
    order = np.argsort(-radius)
    for k, i in enumerate(order):
        placed = order[:k]
        while True:
            p = generator.uniform(-1.0, 1.0, 3)
            if p @ p > 1.0:
                continue
            p = p * axes
            gap = ((x[placed] - p) ** 2).sum(axis=1) - (radius[placed] + radius[i]) ** 2
            if not (gap < 0.0).any():
                x[i] = p
                break
    return x


def _carved(g: Grains, shape: Array, count: int) -> NDArray[np.int64]:
    """The `count` grains inside an ellipsoid, its axes such that those of the grains' inertia have the right ratios."""
    axes = shape.copy()
    chosen = np.arange(count)
    for _ in range(30):
        order = np.argsort(((g.x / axes) ** 2).sum(axis=1), kind="stable")
        chosen = np.sort(order[:count])
        member = np.zeros(len(g.mass), np.bool_)
        member[chosen] = True
        x, m = g.x[member], g.mass[member]
        x = x - m @ x / m.sum()
        # second moments along the axes of the ellipsoid, the grains' own included
        a2 = 5.0 * (m @ x**2 + 0.2 * m @ g.radius[member] ** 2) / m.sum()
        found = np.sqrt(a2 / np.cbrt(np.prod(a2)))
        axes *= np.sqrt(shape / found)
        axes /= np.cbrt(np.prod(axes))
    return chosen


def cache_folder() -> Path:
    """Folder of the stored piles: ``$FLYBYSTAB_CACHE``, or ``flybystab`` in the user's cache folder."""
    own = os.environ.get("FLYBYSTAB_CACHE")
    if own:
        return Path(own) / "piles"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flybystab" / "piles"


def _cached(inputs: dict[str, Any], make: Callable[[], Simulation]) -> dict[str, Array]:
    """The arrays of a settled pile, read from disk if they are there and whole."""
    plain = {k: [round(float(x), 9) for x in np.atleast_1d(v)] for k, v in inputs.items()}
    key = hashlib.sha256(json.dumps([RECIPE, plain], sort_keys=True).encode()).hexdigest()[:32]
    path = cache_folder() / f"{key}.npz"
    n = int(inputs["grains"])
    try:
        with np.load(path, allow_pickle=False) as stored:
            found = {k: stored[k] for k in _STORED}
        if found["x"].shape == (n, 3) and all(np.all(np.isfinite(a)) for a in found.values()):
            return found
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        pass
    arrays = _arrays(make())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        os.replace(file.name, path)
    except OSError:  # a cache that cannot be written is none
        pass
    return arrays


_STORED = ("x", "v", "w", "radius", "mass", "first", "other", "spring", "touching")


def _arrays(sim: Simulation) -> dict[str, Array]:
    p, last = sim.pairs, sim.pairs.first[-1]
    return {
        **sim.grains._asdict(),
        "first": p.first,
        "other": p.other[:last],
        "spring": p.spring[:last],
        "touching": p.touching[:last],
    }


def simulation_of(
    arrays: dict[str, Array], mu_s: float, beta: float, overlap: float | None = None, **options: Any
) -> Simulation:
    """A simulation from stored arrays, with the history of its contacts.

    With another `overlap` than the pile was made with, springs keep their forces.
    """
    g = Grains(*(np.array(arrays[k], dtype=float) for k in ("x", "v", "w", "radius", "mass")))
    n, last = len(g.mass), len(arrays["other"])
    pairs: Pairs = empty_pairs(n)
    pairs.first[:] = arrays["first"]
    pairs.other[:last] = arrays["other"]
    pairs.spring[:last] = arrays["spring"]
    pairs.touching[:last] = arrays["touching"]
    contact = contact_parameters(float(g.radius.mean()), mu_s=mu_s, beta=beta)
    if overlap is not None:
        contact_of = contact_parameters(float(g.radius.mean()), mu_s=mu_s, beta=beta, overlap=overlap)
        pairs.spring[:last] *= contact.k_n / contact_of.k_n
        contact = contact_of
    return Simulation(g, contact, pairs, **options)
