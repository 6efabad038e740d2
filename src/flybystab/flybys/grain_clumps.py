"""Clumps of a pile of grains: their masses, the largest one, and the table of fragments."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.pile import PileState
from flybystab.core.grains.clumps import LINK, bound_clumps, friends_of_friends, moments, semi_axes, spin_of
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.state import Grains
from flybystab.typing import Array

if TYPE_CHECKING:
    from astropy.table import QTable

#: Clumps with less than this fraction of the mass are not listed as fragments.
SMALLEST = 0.01


class RotationState(NamedTuple):
    """Rotation of some grains, scaled units; nan where there are none.

    Attributes
    ----------
    axes : ndarray (3, 3)
        Principal axes as columns.
    spin_rate : float
        Effective spin rate ``2 E/H`` of the rigid rotation with the same angular momentum.
    momentum : ndarray (3,)
        Angular momentum about their centre.
    """

    axes: Array
    spin_rate: float
    momentum: Array


class LargestClump(NamedTuple):
    """The largest clump at one time, scaled units.

    Attributes
    ----------
    time : float
    mass : float
        Over that of the body.
    bound_mass : float
        Of the clump together with the material bound to it.
    semi_axes, spin : ndarray (3,)
        Of the ellipsoid with its inertia, longest first; angular velocity. nan where no grain is left.
    masses : ndarray
        Masses of all clumps of at least :data:`SMALLEST`, in descending order.
    """

    time: float
    mass: float
    bound_mass: float
    semi_axes: Array
    spin: Array
    masses: Array


def at_positions(sim: Simulation) -> Grains:
    """The grains with their velocities at the time of the positions."""
    return sim.grains._replace(v=sim.u, w=sim.s)


def _mass_fraction(g: Grains, member: NDArray[np.bool_]) -> float:
    """Mass of some grains over that of the body; exactly one for all of them."""
    return 1.0 if member.all() else float(g.mass[member].sum())


def _clumps(g: Grains) -> tuple[Array, NDArray[np.int64]]:
    """Masses of all clumps, and the number of the clump of each grain (-1 for none)."""
    label = np.empty(len(g.mass), np.int64)
    count = friends_of_friends(g, LINK, label)
    held = label >= 0
    sizes: Array = np.bincount(label[held], weights=g.mass[held], minlength=count).astype(float)
    return sizes, label


def largest_clump(sim: Simulation) -> LargestClump:
    """The largest clump at the present time of a simulation."""
    g = at_positions(sim)
    sizes, label = _clumps(g)
    largest = int(np.argmax(sizes)) if len(sizes) else -1
    member = (label == largest) & (label >= 0)
    if not member.any():
        return LargestClump(sim.time, 0.0, 0.0, np.full(3, np.nan), np.full(3, np.nan), np.zeros(0))
    mass, _, _, inertia, momentum = moments(g, member)
    axes, _ = semi_axes(mass, inertia)
    bound = bound_clumps(g, label, largest)
    inside = (label >= 0) & bound[np.where(label >= 0, label, 0)]
    return LargestClump(
        sim.time,
        _mass_fraction(g, member),
        _mass_fraction(g, inside),
        axes,
        spin_of(inertia, momentum),
        np.sort(sizes[sizes >= SMALLEST])[::-1],
    )


def rotation_of(g: Grains, label: NDArray[np.int64]) -> RotationState:
    """Rotation of the grains with the label zero."""
    member = (label == 0) & (g.mass > 0.0)
    if not member.any():
        return RotationState(np.full((3, 3), np.nan), float("nan"), np.full(3, np.nan))
    mass, _, _, inertia, momentum = moments(g, member)
    size = float(np.linalg.norm(momentum))
    spin = float(spin_of(inertia, momentum) @ momentum) / size if size > 0.0 else 0.0
    return RotationState(semi_axes(mass, inertia)[1], spin, momentum)


class _Fragment(NamedTuple):
    """A clump, scaled units: mass, semi-axes, spin, and position and velocity of its centre."""

    mass: float
    axes: Array
    spin: Array
    centre: Array
    velocity: Array


def _orbit(a: _Fragment, b: _Fragment) -> tuple[float, float, float]:
    """Energy per reduced mass, semi-major axis and eccentricity of the orbit of two fragments about each other."""
    total = a.mass + b.mass
    d, w = a.centre - b.centre, a.velocity - b.velocity
    energy = np.float64(0.5 * w @ w - total / float(np.linalg.norm(d)))
    axis = -0.5 * total / energy
    h2 = float(np.sum(np.cross(d, w) ** 2))
    return energy, axis, float(np.sqrt(max(0.0, 1.0 - h2 / (total * axis))))


def fragments_of(sim: Simulation, pile: PileState) -> tuple[QTable, NDArray[np.int64]]:
    """Table of the clumps in descending order of mass, and the row of each grain (-1 for none)."""
    g = at_positions(sim)
    sizes, label = _clumps(g)
    order = [int(k) for k in np.argsort(-sizes, kind="stable") if sizes[k] >= SMALLEST]
    row_of = np.full(len(g.mass), -1, np.int64)
    found: list[_Fragment] = []
    for row, k in enumerate(order):
        member = label == k
        row_of[member] = row
        mass, centre, velocity, inertia, momentum = moments(g, member)
        axes, _ = semi_axes(mass, inertia)
        found.append(_Fragment(_mass_fraction(g, member), axes, spin_of(inertia, momentum), centre, velocity))
    n = len(found)
    parents, a, e = np.full(n, -1, np.int64), np.full(n, np.nan), np.full(n, np.nan)
    for i in range(n):
        least = 0.0
        for j in range(i):  # the more massive ones
            energy, axis, eccentricity = _orbit(found[i], found[j])
            if energy < least:
                least = energy
                parents[i], a[i], e[i] = j, axis, eccentricity
    length, speed = pile.length, pile.length / pile.time
    centre, velocity = (found[0].centre, found[0].velocity) if n else (np.zeros(3), np.zeros(3))

    def column(values: list[Array]) -> Array:
        return np.array(values).reshape(n, 3)

    from astropy.table import QTable

    table = QTable(
        {
            "mass_fraction": np.array([f.mass for f in found]),
            "semi_axes": column([f.axes for f in found]) * length * u.m,
            "spin": column([f.spin for f in found]) / pile.time * u.rad / u.s,
            "position": column([f.centre - centre for f in found]) * length * u.m,
            "velocity": column([f.velocity - velocity for f in found]) * speed * u.m / u.s,
            "bound_to": parents,
            "a": a * length * u.m,
            "e": e,
        }
    )
    return table, row_of
