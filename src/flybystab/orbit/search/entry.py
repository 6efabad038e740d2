"""Time and place at which an asteroid reaches the top of the atmosphere, or the surface of a body without one."""

from __future__ import annotations

import numpy as np

from flybystab.orbit.ephemeris import Window
from flybystab.orbit.kepler import time_at_distance
from flybystab.orbit.nongravitational import NonGravitationalParameters
from flybystab.orbit.search.acceleration import Field
from flybystab.orbit.search.minima import two_body
from flybystab.orbit.search.neighbours import carry
from flybystab.orbit.search.steps import empty_room
from flybystab.typing import Array


def entry(
    field: Field,
    law: NonGravitationalParameters,
    window: Window,
    body: int,
    row: np.void,
    floor: float,
    sign: float,
) -> tuple[float, Array]:
    """First contact of an impact that a search has found.

    The first guess is that of two-body motion; it is refined by Newton's method on the distance, with the state
    integrated with all forces from the last step outside.

    Parameters
    ----------
    field, law : Field, NonGravitationalParameters
        Forces of the search.
    window : Window
    body : int
        Place in ``BODIES``.
    row : record of FOUND
        The impact: periapsis time (s) of the two-body orbit and the state (m, m/s) before it.
    floor : float
        Distance of contact, m.
    sign : float
        Direction of the integration in time. Backward in time, the contact is where the path leaves the body.

    Returns
    -------
    float
        Time, s from the epoch of the window.
    ndarray, shape (6,)
        State relative to the body, m and m/s.
    """
    gm, state = float(window.gm[body]), row["state"]
    q, ahead, energy = two_body(gm, state)
    inbound = sign * float(state[:3] @ state[3:]) < 0.0 and np.isfinite(ahead)
    start = float(row["time"]) - (sign * ahead if inbound else 0.0)
    last = time_at_distance(gm, q, q * energy / gm, floor)
    t = start + sign * (ahead - last) if inbound and np.isfinite(last) else start
    origin = state + window.states(body, np.array([start]))[0]
    there = state
    for _ in range(20):
        out = np.empty((1, 6))
        if carry(field, law, start, origin, np.array([t]), 1e-14, empty_room(), out) < 1:
            break
        there = out[0] - window.states(body, np.array([t]))[0]
        r = float(np.linalg.norm(there[:3]))
        speed = float(there[:3] @ there[3:]) / r
        step = (floor - r) / speed
        if abs(floor - r) < 1e-2 or not np.isfinite(step):
            break
        t += step
    return t, there
