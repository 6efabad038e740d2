"""A scripted encounter: two-body motion past one planet, and the tide along it."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.core.ellipsoid.tide import tide_panels
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.reach import TAIL
from flybystab.encounter.tide_sources import planet_tide
from flybystab.orbit.kepler import states_at_times, time_at_distance
from flybystab.orbit.planets import PLANETS, Planet
from flybystab.typing import Array

_KM_S = u.km / u.s


@dataclass(frozen=True)
class KeplerTrack:
    """Two-body motion in the xy plane with periapsis on +x and angular momentum on +z.

    Attributes
    ----------
    gm : float
        Gravitational parameter, m3/s2.
    q : float
        Periapsis distance, m.
    f : float
        Eccentricity - 1 = q v_inf^2 / gm.
    """

    gm: float
    q: float
    f: float

    def states(self, t: Array) -> Array:
        """Position (m) and velocity (m/s), shape (n, 6), at ``t`` s from periapsis, shape (n,)."""
        s = states_at_times(self.gm, self.q, self.f, np.ascontiguousarray(t, dtype=float))
        out = np.zeros((s.shape[0], 6))
        out[:, [0, 1, 3, 4]] = s
        return out


def scripted(
    cls: type[Encounter], body: Planet, q: float, v: float, start: float, wait: float, j2: bool, axis: Array
) -> Encounter:
    """The encounter with periapsis `q` (m) and speed `v` (m/s); as checked by :meth:`Encounter.hyperbolic`, in SI."""
    f = q * v * v / body.gm
    speed = np.sqrt(body.gm * (2.0 + f) / q)
    track = KeplerTrack(body.gm, q, f)
    half = time_at_distance(body.gm, q, f, start)
    level = body.impact_level(q)
    entry = None
    if level is not None:
        entry = -float(time_at_distance(body.gm, q, f, min(body.impact_distance, start)))

    def tide(t: Array) -> Array:
        out = np.zeros((t.size, 6))
        planet_tide(body.gm, body.j2 if j2 else 0.0, body.radius, axis, track.states(t)[:, :3], out)
        return out

    stop = half + wait
    panels, error = tide_panels(tide, -half, stop + TAIL, q / speed)
    forces = ["orbit: two-body", f"tide: {body.name}"] + ([f"tide: {body.name} J2"] if j2 else [])
    return cls(
        planet=body,
        time=None,
        distance=Quantity(q * 1e-3, u.km),
        v_inf=Quantity(v * 1e-3, _KM_S),
        v_periapsis=Quantity(speed * 1e-3, _KM_S),
        start_distance=Quantity(start * 1e-3, u.km),
        impact=level is not None,
        impact_level=level,
        impact_time=entry,
        frame="periapsis",
        forces=tuple(forces),
        left_out=left_out(body, q, j2),
        tide_error=error,
        t_start=-float(half),
        t_stop=float(stop),
        tide=panels,
        track=track,
    )


def left_out(body: Planet, q: float, j2: bool) -> tuple[tuple[str, float], ...]:
    """Tides that a two-body encounter neglects, each with its relative size at periapsis.

    J2: at most 6 J2 (a/q)^2 of the tide (over the pole) and 3 J2 (a/q)^2 of the acceleration. A source GM'
    at distance d: (GM'/GM) (q/d)^3 of both.
    """
    flat = body.j2 * (body.radius / q) ** 2
    out = [("orbit: " + body.name + " J2", 3.0 * flat)]
    if not j2:
        out.append((f"{body.name} J2", 6.0 * flat))
    if body.orbit_radius > 0.0:
        out.append(("sun", PLANETS["sun"].gm / body.gm * (q / body.orbit_radius) ** 3))
    pair = {"earth": "moon", "moon": "earth"}.get(body.name)
    if pair is not None:
        out.append((pair, PLANETS[pair].gm / body.gm * (q / 3.844e8) ** 3))
    return tuple(out)
