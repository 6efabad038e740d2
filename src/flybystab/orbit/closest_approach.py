"""Closest approach as a zero of ``r.v``, and the relative motion around it as a smooth function of time.

A log of integration steps (time, position, velocity, acceleration) is interpolated between its rows by the quintic that
matches all three at both ends. Minima of the distance are located on it; the root itself is then found on the
trajectory of the integrator, restarted from the preceding step, so that its accuracy depends neither on the step length
nor on the quintic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from flybystab.core.numerics.jit import kernel
from flybystab.errors import NotConverged
from flybystab.orbit.ephemeris import Window, body_states
from flybystab.typing import Array

#: Columns of a log of steps: time (s), then three each of position (m), velocity (m/s), acceleration (m/s2).
TIME, POSITION, VELOCITY, ACCELERATION = 0, 1, 4, 7
#: Position and velocity.
STATE = slice(1, 7)
#: Numbers of a row of a log.
LOG_WIDTH = 10


@kernel
def between(log: Array, k: int, t: float, out: Array) -> None:
    """Write into ``out[6]`` position (m) and velocity (m/s) at ``t`` inside step ``k`` (row k to k + 1)."""
    h = log[k + 1, TIME] - log[k, TIME]
    s = (t - log[k, TIME]) / h
    for j in range(3):
        x0, x1 = log[k, POSITION + j], log[k + 1, POSITION + j]
        v0, v1 = h * log[k, VELOCITY + j], h * log[k + 1, VELOCITY + j]
        a0, a1 = 0.5 * h * h * log[k, ACCELERATION + j], 0.5 * h * h * log[k + 1, ACCELERATION + j]
        # x0 + v0 s + a0 s^2 + s^3 (c3 + c4 s + c5 s^2), matched at s = 1
        d = (x1 - x0) - v0 - a0
        dv = v1 - v0 - 2.0 * a0
        da = a1 - a0
        c3 = 10.0 * d - 4.0 * dv + da
        c4 = -15.0 * d + 7.0 * dv - 2.0 * da
        c5 = 6.0 * d - 3.0 * dv + da
        out[j] = x0 + s * (v0 + s * (a0 + s * (c3 + s * (c4 + s * c5))))
        out[3 + j] = (v0 + s * (2.0 * a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / h


@kernel
def relative(
    log: Array, k: int, head: Array, data: Array, gm: Array, body: int, t: float, out: Array
) -> None:
    """Write into ``out[6]`` the state (m, m/s) relative to a body at ``t`` inside step ``k``."""
    between(log, k, t, out)
    place = body_states(head, data, gm, body, np.array([t]))
    for j in range(6):
        out[j] -= place[0, j]


@kernel
def crossings(
    log: Array, head: Array, data: Array, gm: Array, body: int, level: float, cuts: int
) -> tuple[Array, Array]:
    """Zeros of ``r.v`` (level < 0), or of ``r - level`` (level in m), along a log that runs forward in time.

    Each step is cut into `cuts` pieces; a piece with a change of sign holds one zero.

    Returns
    -------
    ndarray, shape (n, 3)
        Time (s), distance (m), and direction: +1 where the function rises (a minimum of distance; outbound).
    ndarray, shape (n,)
        Step of each.
    """
    found = []
    steps = []
    s = np.empty(6)
    for k in range(log.shape[0] - 1):
        h = (log[k + 1, TIME] - log[k, TIME]) / cuts
        for i in range(cuts):
            ta = log[k, TIME] + i * h
            tb = ta + h
            relative(log, k, head, data, gm, body, ta, s)
            fa = _measure(s, level)
            relative(log, k, head, data, gm, body, tb, s)
            fb = _measure(s, level)
            if (fa < 0.0) == (fb < 0.0):
                continue
            for _ in range(60):  # Illinois false position
                tm = (ta * fb - tb * fa) / (fb - fa)
                if not (min(ta, tb) < tm < max(ta, tb)):
                    tm = 0.5 * (ta + tb)
                relative(log, k, head, data, gm, body, tm, s)
                fm = _measure(s, level)
                moved = abs(tm - tb)
                if (fm < 0.0) == (fb < 0.0):
                    fa *= 0.5
                else:
                    ta, fa = tb, fb
                tb, fb = tm, fm
                if moved < 1e-6 or fm == 0.0:
                    break
            relative(log, k, head, data, gm, body, tb, s)
            d = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
            relative(log, k, head, data, gm, body, log[k, TIME] + i * h, s)
            found.append((tb, d, 1.0 if _measure(s, level) < 0.0 else -1.0))
            steps.append(k)
    out = np.empty((len(found), 3))
    where = np.empty(len(found))
    for n in range(len(found)):
        out[n, 0], out[n, 1], out[n, 2] = found[n]
        where[n] = steps[n]
    return out, where


@kernel
def steps_into(log: Array, head: Array, data: Array, gm: Array, body: int, floor: float) -> NDArray[np.int64]:
    """Steps of a log on which the distance from a body may fall below ``floor`` (m), as row numbers.

    The chord of the relative path less its largest sagitta, ``h^2 |a| / 8``, bounds the distance from below.
    """
    out = np.zeros(log.shape[0], dtype=np.int64)
    count = 0
    states = body_states(head, data, gm, body, log[:, TIME].copy())
    for k in range(log.shape[0] - 1):
        h = log[k + 1, TIME] - log[k, TIME]
        rr = rd = dd = bend = pull = 0.0
        for j in range(3):
            r = log[k, POSITION + j] - states[k, j]
            d = log[k + 1, POSITION + j] - states[k + 1, j] - r
            rr += r * r
            rd += r * d
            dd += d * d
            bend = max(bend, log[k, ACCELERATION + j] ** 2, log[k + 1, ACCELERATION + j] ** 2)
            pull += (states[k + 1, 3 + j] - states[k, 3 + j]) ** 2
        s = min(max(-rd / dd, 0.0), 1.0) if dd > 0.0 else 0.0
        chord = np.sqrt(max(rr + s * (2.0 * rd + s * dd), 0.0))
        # Three times the larger acceleration at the ends, since it may be larger between them.
        if chord < floor + 0.375 * h * h * np.sqrt(3.0 * bend) + 0.375 * abs(h) * np.sqrt(pull):
            out[count] = k
            count += 1
    return out[:count]


def first_contact(log: Array, window: Window, floors: Array) -> tuple[float, int] | None:
    """Time (s) and body of the first fall below ``floors`` (m, one per body) along a log in either direction of time.

    Returns
    -------
    tuple or None
        None where the path stays outside of every body.
    """
    best: tuple[float, int] | None = None
    sign = 1.0 if log[-1, TIME] >= log[0, TIME] else -1.0
    tables = (window.head, window.data, window.gm)
    for body, floor in enumerate(floors):
        for k in steps_into(log, *tables, body, float(floor)):
            pair = log[k : k + 2] if sign > 0.0 else log[k : k + 2][::-1]
            found, _ = crossings(np.ascontiguousarray(pair), *tables, body, float(floor), 16)
            into = found[found[:, 2] * sign < 0.0, 0]
            if into.size and (
                best is None or (into.min() * sign if sign > 0 else -into.max()) < best[0] * sign
            ):
                best = (float(into.min() if sign > 0.0 else into.max()), body)
    return best


@kernel
def _measure(s: Array, level: float) -> float:
    """``r.v`` (m2/s) for a negative level, else ``r - level`` (m)."""
    if level < 0.0:
        return s[0] * s[3] + s[1] * s[4] + s[2] * s[5]
    return np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2) - level


def periapsis_time(state_at: Callable[[float], Array], t: float) -> tuple[float, Array]:
    """Zero of ``r.v`` near `t` on an exact trajectory, and the relative state there.

    Secant method: the derivative of ``r.v`` is a difference quotient, since far from the planet the acceleration by the
    Sun contributes as much to it as that by the planet.

    Parameters
    ----------
    state_at : callable
        Time (s) to relative state (m, m/s), shape (6,).
    t : float
        First guess, s.
    """
    s = state_at(t)
    last, step = float(s[:3] @ s[3:]), 60.0
    for _ in range(40):
        t += step
        s = state_at(t)
        rv = float(s[:3] @ s[3:])
        slope = (rv - last) / step
        if not slope > 0.0:
            break
        last, step = rv, -rv / slope
        # A decimetre along the path: over centuries rounding errors are centimetres.
        if abs(step) * float(np.linalg.norm(s[3:])) < 0.1:
            return t + step, state_at(t + step)
    raise NotConverged(f"closest approach near t = {t:.6g} s: the last correction was {step:.3g} s")


@dataclass(frozen=True)
class PanelTrack:
    """Relative motion as Chebyshev panels in ``u = asinh((t)/tau)``, like the tide.

    Attributes
    ----------
    tau, start, width : float
        Time scale (s), ``u`` at the start, width of a panel in ``u``.
    coefficients : ndarray, shape (panels, degree + 1, 3)
        Position, m.
    """

    tau: float
    start: float
    width: float
    coefficients: Array

    def states(self, t: Array) -> Array:
        """Position (m) and velocity (m/s), shape (n, 6), at ``t`` s from closest approach, shape (n,).

        nan outside the span of the track.
        """
        time = np.asarray(t, dtype=float)
        v = (np.arcsinh(time / self.tau) - self.start) / self.width
        count = len(self.coefficients)
        panel = np.clip(np.floor(v), 0, count - 1).astype(int)
        x = 2.0 * (v - panel) - 1.0
        rate = 2.0 / self.width / np.hypot(self.tau, time)
        out = np.empty((time.size, 6))
        for p in np.unique(panel):
            here = panel == p
            c = self.coefficients[p]
            out[here, :3] = chebyshev.chebval(x[here], c).T
            out[here, 3:] = (chebyshev.chebval(x[here], chebyshev.chebder(c)) * rate[here]).T
        out[(v < -1e-9) | (v > count + 1e-9)] = np.nan
        return out


def panel_track(
    state_at: Callable[[float], Array],
    t_start: float,
    t_stop: float,
    tau: float,
    *,
    width: float = 0.5,
    degree: int = 17,
) -> PanelTrack:
    """Sample a trajectory, in order of time, at the Chebyshev nodes of its panels.

    Parameters
    ----------
    state_at : callable
        Time (s from closest approach) to relative state, shape (6,); called with increasing times.
    t_start, t_stop, tau, width, degree
        As in :func:`flybystab.core.ellipsoid.tide.tide_panels`.
    """
    u0, u1 = np.arcsinh(t_start / tau), np.arcsinh(t_stop / tau)
    n = max(1, int(np.ceil((u1 - u0) / width)))
    w = (u1 - u0) / n
    k = np.arange(degree + 1)
    nodes = -np.cos(np.pi * (k + 0.5) / (degree + 1))
    inverse = np.linalg.inv(chebyshev.chebvander(nodes, degree))
    coefficients = np.empty((n, degree + 1, 3))
    for p in range(n):
        times = tau * np.sinh(u0 + w * (p + 0.5 * (1.0 + nodes)))
        coefficients[p] = inverse @ np.array([state_at(t)[:3] for t in times])
    return PanelTrack(float(tau), float(u0), float(w), coefficients)


def nearest_minimum(log: Array, window: Window, body: int, near: float) -> tuple[float, float, int] | None:
    """Time (s), distance (m) and step of the minimum of distance to a body nearest in time to `near`."""
    found, steps = crossings(log, window.head, window.data, window.gm, body, -1.0, 8)
    rows = np.flatnonzero(found[:, 2] > 0.0)
    if rows.size == 0:
        return None
    best = rows[np.argmin(np.abs(found[rows, 0] - near))]
    return float(found[best, 0]), float(found[best, 1]), int(steps[best])
