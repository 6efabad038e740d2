"""The simulation of a pile of grains: the arrays of the kernels and their state between calls."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flybystab.core.dynamics.ground import Ground, no_ground
from flybystab.core.ellipsoid.tide import TidePanels, no_tide
from flybystab.core.grains.gravity import potential_energy
from flybystab.core.grains.motion import DONE, NO_ROOM, Loads, Predicted, Scheme, advance
from flybystab.core.grains.neighbours import SKIN, Pairs, empty_pairs
from flybystab.core.grains.state import STEPS_PER_CONTACT, Contact, Grains, time_step
from flybystab.core.grains.tree import opening
from flybystab.errors import NotConverged
from flybystab.typing import Array

#: Time between evaluations of gravity, scaled: 10 s at 2000 kg/m3.
GRAVITY_INTERVAL = 0.0075
#: Error of gravity by a tree (rms over the grains, relative to the rms acceleration), and the number of grains from
#: which a tree of this error is faster than the direct sum (``flybystab bench grains``).
GRAVITY_ERROR, TREE_FROM = 1e-3, 2000
_NO_LEDGER = np.zeros(0)
_NO_PULL = np.zeros(4)


@dataclass
class Simulation:
    """Grains with their contacts, advanced in time; scaled units.

    Attributes
    ----------
    grains, contact, pairs
        State, contact law, neighbour list with history.
    time : float
        Time of the positions, on the clock of the tide.
    steps_per_contact : float
        Steps in half a period of the stiffest contact.
    gravity_interval : float
        Time between evaluations of gravity; zero for every step.
    gravity_error : float
        Error of gravity by a tree (:func:`flybystab.core.grains.tree.opening`).
    tree_from : int
        Number of grains from which gravity is computed by a tree.
    skin : float
        Skin of the neighbour list, mean radii.
    """

    grains: Grains
    contact: Contact
    pairs: Pairs
    time: float = 0.0
    tide: TidePanels = field(default_factory=no_tide)
    ground: Ground = field(default_factory=no_ground)
    steps_per_contact: float = STEPS_PER_CONTACT
    gravity_interval: float = GRAVITY_INTERVAL
    gravity_error: float = GRAVITY_ERROR
    tree_from: int = TREE_FROM
    skin: float = SKIN
    ledger: Array = field(default_factory=lambda: _NO_LEDGER)
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, np.int64))
    steps: int = 0

    def __post_init__(self) -> None:
        self.dt = time_step(self.grains, self.contact, self.steps_per_contact)
        self.u, self.s = self.grains.v.copy(), self.grains.w.copy()
        held = self.grains.mass > 0.0
        self.reach = self.skin * float(self.grains.radius[held].mean())

    @classmethod
    def of(cls, grains: Grains, contact: Contact, **options: object) -> Simulation:
        """A simulation without any history of contacts."""
        return cls(grains, contact, empty_pairs(len(grains.mass)), **options)  # type: ignore[arg-type]

    def advance(
        self, duration: float, *, gravity: bool = True, pull: Array = _NO_PULL, drag: float = 0.0
    ) -> None:
        """Advance by a duration, rounded to whole steps.

        Raises
        ------
        NotConverged
            A value is not finite, or a grain has too many neighbours.
        """
        steps = max(1, round(duration / self.dt))
        every = max(1, round(self.gravity_interval / self.dt))
        theta = opening(self.gravity_error) if len(self.grains.mass) >= self.tree_from else 0.0
        outcome = advance(
            self.grains, self.contact, self.pairs, Predicted(self.u, self.s),
            Loads(self.tide, self.ground, pull, drag), Scheme(self.dt, every, self.reach, gravity, theta),
            self.time, steps, self.ledger, self.counts,
        )  # fmt: skip
        if outcome == NO_ROOM:
            raise NotConverged("neighbour list full: the sizes of the grains differ too much")
        if outcome != DONE:
            raise NotConverged(
                f"finite positions and velocities of the grains: they diverged after {self.steps} steps"
            )
        self.steps += steps
        self.time += steps * self.dt

    def rotate(self, matrix: Array) -> None:
        """Rotate positions, velocities and contact history about the origin."""
        for a in (self.grains.x, self.grains.v, self.grains.w, self.u, self.s):
            a[:] = a @ matrix.T
        spring = self.pairs.spring
        spring[:, :3] = spring[:, :3] @ matrix.T
        spring[:, 3:6] = spring[:, 3:6] @ matrix.T

    def add_spin(self, spin: Array) -> None:
        """Add a rigid rotation about the origin."""
        push = np.cross(spin, self.grains.x)
        self.grains.v[:] += push
        self.u[:] += push
        self.grains.w[:] += spin
        self.s[:] += spin

    def centre(self) -> None:
        """Move the centre of mass to the origin and remove the total momentum."""
        m = self.grains.mass / self.grains.mass.sum()
        self.grains.x[:] -= m @ self.grains.x
        for a in (self.grains.v, self.u):
            a[:] -= m @ a

    def kinetic_energy(self) -> float:
        """Kinetic energy of translation and rotation, with the velocities at the time of the positions."""
        g = self.grains
        spin = 0.4 * g.mass * g.radius**2
        return float(0.5 * (g.mass @ (self.u**2).sum(axis=1) + spin @ (self.s**2).sum(axis=1)))

    def potential_energy(self) -> float:
        """Potential energy of self-gravity."""
        return float(potential_energy(self.grains.x, self.grains.mass))
