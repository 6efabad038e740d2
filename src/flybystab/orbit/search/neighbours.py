"""The neighbours of many orbits, followed to the encounters that were found: one more integration each."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.constants import DAY
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.threads import in_order
from flybystab.orbit.ephemeris import BODIES, Window
from flybystab.orbit.orbit import seconds
from flybystab.orbit.planets import planet
from flybystab.orbit.predictability import Neighbour, predictability
from flybystab.orbit.search.acceleration import Field, borrowed_field, rate
from flybystab.orbit.search.dop853 import Room, advance, borrowed_room, empty_room
from flybystab.typing import Array


@kernel
def carry(
    field: Field, law: Array, t0: float, y0: Array, times: Array, tolerance: float, room: Room, out: Array
) -> int:
    """Write barycentric states (m, m/s) at ``times`` (s), in order away from ``t0``, into ``out[n, 6]``.

    Steps as in :func:`flybystab.orbit.search.track.track_encounters`. Returns the number written.
    """
    field = borrowed_field(field)
    k, places = borrowed_room(room)
    y = y0.copy()
    new = np.empty(6)
    h = DAY
    t = t0
    rate(field, law, t, y, places, k[0])
    for n in range(times.size):
        while t != times[n]:
            t, h = advance(field, law, t, y, h, times[n], tolerance, k, new, places)
            if t != t:  # the step size collapsed
                return n
            y[:] = new
            k[0] = k[12]
        out[n] = y
    return times.size


def add_growth(
    table: QTable,
    neighbours: Mapping[int, Neighbour],
    laws: Array,
    window: Window,
    field_of: Callable[[int], Field],
    tolerances: Array,
    threads: int,
) -> None:
    """Add to a table of encounters ``displacement`` (km), ``growth`` and ``predictability``.

    Displacement: of the neighbour from the asteroid at the time of closest approach; on an impact, of the
    neighbour from the planet's centre, less the distance of the two-body orbit. Growth: displacement over
    that at the epoch.

    Parameters
    ----------
    table : QTable
        From :func:`flybystab.find_encounters`.
    neighbours : mapping
        By number of the asteroid, of each that the table has.
    laws : ndarray, shape (n, 8)
        A1, A2, A3 of each asteroid with their law.
    window, tolerances
        Of the search.
    field_of : callable
        Number of an asteroid to the forces that it was given: the neighbour has the same.
    """
    t = seconds(table["time"][0], window.epoch) if len(table) else 0.0
    times = t + (table["time"] - table["time"][0]).to_value(u.s) if len(table) else np.zeros(0)
    bodies = np.array([BODIES.index(name) for name in table["planet"]], dtype=int)
    index = np.asarray(table["index"])
    shift = np.full(len(table), np.nan)

    def one(i: int) -> None:
        beside = neighbours[i]
        start = seconds(beside.orbit.epoch, window.epoch)
        state = beside.orbit.barycentric(window)
        rows = np.flatnonzero(index == i)
        law = laws[i].copy()
        field = field_of(i)
        if law.any():
            law[:3] = beside.orbit.nongrav.a
        for side in (rows[times[rows] >= start], rows[times[rows] < start][::-1]):
            out = np.empty((side.size, 6))
            done = carry(field, law, start, state, times[side], tolerances[i], empty_room(), out)
            for row, found in zip(side[:done], out, strict=False):
                away = found[:3] - window.states(int(bodies[row]), times[row : row + 1])[0, :3]
                if table["impact"][row]:
                    distance = table["distance"][row].to_value(u.m)
                    shift[row] = max(float(np.linalg.norm(away)) - distance, 0.0)
                else:
                    shift[row] = np.linalg.norm(away - table["position"][row].to_value(u.m))

    wanted = np.unique(index).tolist()
    for _ in in_order(one, wanted, threads):
        pass
    shift[np.isnan(shift)] = np.inf  # the neighbour was lost
    scale = np.array([planet(name).impact_distance for name in table["planet"]])
    size = np.maximum(table["distance"].to_value(u.m), np.where(table["impact"], scale, 0.0))
    table["displacement"] = (shift * u.m).to(u.km)
    table["growth"] = shift / np.array([neighbours[i].shift for i in index])
    table["predictability"] = np.array(
        [str(predictability(d, x)) for d, x in zip(size, shift, strict=True)], dtype="U12"
    )
    table.meta["neighbours"] = sorted({n.label for n in neighbours.values()})
