"""The bodies around an asteroid in an encounter: their positions, the relevant sources of the tide, and the tide."""

from __future__ import annotations

import numpy as np

from flybystab.core.ellipsoid.tide import tide_j2, tide_point
from flybystab.core.numerics.jit import kernel
from flybystab.orbit.closest_approach import PanelTrack
from flybystab.orbit.ephemeris import BODIES, Window
from flybystab.orbit.planets import Planet
from flybystab.typing import Array


@kernel
def planet_tide(gm: float, j2: float, radius: float, pole: Array, position: Array, out: Array) -> None:
    """Add to ``out[n, 6]`` the tide (s^-2) of a planet with J2 on a body ``position[n, 3]`` (m) from it."""
    for i in range(position.shape[0]):
        x, y, z = -position[i, 0], -position[i, 1], -position[i, 2]
        tide_point(gm, x, y, z, out[i])
        if j2 != 0.0:
            tide_j2(gm, j2, radius, pole[0], pole[1], pole[2], x, y, z, out[i])


@kernel
def _add_tides(gm: Array, places: Array, use: Array, out: Array) -> None:
    """Add to ``out[n, 6]`` the tides (s^-2) of the bodies at ``places[n, 10, 3]`` (m from the asteroid)."""
    for i in range(places.shape[0]):
        for b in range(places.shape[1]):
            if use[b]:
                tide_point(gm[b], places[i, b, 0], places[i, b, 1], places[i, b, 2], out[i])


def _places(track: PanelTrack, window: Window, index: int, zero: float, t: Array) -> Array:
    """Bodies as seen from the asteroid, m, shape (n, 10, 3), ICRF axes, at `t` s from closest approach."""
    near = track.states(t)[:, :3]
    time = t + zero
    centre = window.states(index, time)[:, :3]
    out = np.empty((t.size, len(BODIES), 3))
    for b in range(len(BODIES)):
        # The encountered planet relative to the asteroid directly, which avoids the rounding of barycentric
        # coordinates.
        out[:, b] = -near if b == index else (window.states(b, time)[:, :3] - centre) - near
    return out


def tide_of(
    track: PanelTrack,
    window: Window,
    index: int,
    body: Planet,
    axis: Array,
    zero: float,
    t: Array,
    sources: tuple[Array, bool],
) -> Array:
    """Tide (s^-2), shape (n, 6), of the bodies that `sources` switches on, at `t` s from closest approach."""
    out = np.zeros((t.size, 6))
    places = _places(track, window, index, zero, t)
    _add_tides(window.gm, places, sources[0], out)
    if sources[1]:
        flat = np.zeros((t.size, 6))
        planet_tide(window.gm[index], body.j2, body.radius, axis, -places[:, index], flat)
        point = np.zeros((t.size, 6))
        planet_tide(window.gm[index], 0.0, body.radius, axis, -places[:, index], point)
        out += flat - point
    return out


def chosen_sources(
    track: PanelTrack,
    window: Window,
    index: int,
    body: Planet,
    zero: float,
    t_in: float,
    stop: float,
    threshold: float,
) -> tuple[tuple[Array, bool], list[str], list[tuple[str, float]]]:
    """Sources of the tide above `threshold` of the peak: switches and names; the others with their relative size."""
    t = np.unique(np.concatenate([np.linspace(t_in - zero, stop - zero, 33), [min(0.0, stop - zero)]]))
    places = _places(track, window, index, zero, t)
    size = 2.0 * window.gm / np.sum(places**2, axis=2) ** 1.5
    share = size.max(axis=0) / size[:, index].max()
    q = float(np.sqrt(np.sum(places[:, index] ** 2, axis=1).min()))
    flat = 6.0 * body.j2 * (body.radius / q) ** 2
    use = share >= threshold
    use[index] = True
    kept = [n for n, on in zip(BODIES, use, strict=True) if on]
    dropped = [(n, float(v)) for n, v, on in zip(BODIES, share, use, strict=True) if not on]
    if flat >= threshold:
        kept.append(f"{body.name} J2")
    else:
        dropped.append((f"{body.name} J2", flat))
    return (use, flat >= threshold), kept, dropped
