"""Default forces on an orbit, and identification of orbits that belong to massive asteroids."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from flybystab.orbit.ephemeris import BELT, N_BODIES, Window
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import FORCES
from flybystab.typing import Array

if TYPE_CHECKING:
    from flybystab.orbit.osculating_state import OsculatingState

#: An orbit within this distance (m) and relative speed (m/s) of a massive asteroid at its epoch counts as its orbit.
TWIN_DISTANCE, TWIN_SPEED = 1e8, 100.0


def default_forces(orbit: OsculatingState, *bodies: str) -> tuple[str, ...]:
    """All point masses, 1PN, J2 of Sun, Earth and `bodies`, J3, J4 of the Earth, the non-gravitational law if any."""
    flat = {"earth J3", "earth J4", *(f"{name} J2" for name in ("sun", "earth", *bodies))}
    return tuple(
        name
        for name in FORCES
        if name.endswith("point mass")
        or name == "1PN"
        or name in flat
        or (name == "non-gravitational" and orbit.nongrav.active)
    )


def massive_twin(window: Window, epoch: float, state: Array) -> str | None:
    """Name of the massive asteroid to which an orbit belongs, or None.

    The table of the massive asteroids has errors up to 60,000 km. An orbit is taken for that of a massive asteroid if
    it is within 100,000 km of it at less than 100 m/s; encounters in the main belt are much faster.

    Parameters
    ----------
    epoch, state : float, ndarray
        Time (s from the epoch of the window) and barycentric state (m, m/s).
    """
    for i, name in enumerate(BELT, N_BODIES):
        away = state - window.states(i, np.array([epoch]))[0]
        if np.linalg.norm(away[:3]) < TWIN_DISTANCE and np.linalg.norm(away[3:]) < TWIN_SPEED:
            return name
    return None


def without_itself(forces: Iterable[str], orbit: OsculatingState, window: Window) -> tuple[str, ...]:
    """The forces without the point mass of the massive asteroid to which the orbit belongs."""
    twin = massive_twin(window, seconds(orbit.epoch, window.epoch), orbit.barycentric(window))
    return tuple(name for name in forces if name != f"{twin} point mass")
