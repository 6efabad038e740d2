"""Leapfrog integration of grains under contact forces, gravity, a tide and a drag.

Velocities are those of half a step before the positions. Contact forces use velocities predicted to the time of the
positions, so that the dissipation is of second order in the step. Gravity is evaluated every few steps, at positions
predicted to the middle of that interval (a delay would cause a spurious torque), and kept constant in between; the tide
is evaluated at every step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.dynamics.ground import Ground
from flybystab.core.ellipsoid.tide import TidePanels, panel_at, tide_at
from flybystab.core.grains.contact import contact_forces
from flybystab.core.grains.gravity import direct_sum
from flybystab.core.grains.neighbours import MOVED, Pairs, find_pairs
from flybystab.core.grains.state import Contact, Grains
from flybystab.core.grains.tree import tree_sum
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

#: Outcome of :func:`advance`.
DONE, NO_ROOM, NOT_FINITE = 0, 1, 2


class Loads(NamedTuple):
    """External forces on the grains, besides contacts and mutual gravity.

    Attributes
    ----------
    tide : TidePanels
    ground : Ground
        Surface of the planet, at which grains are removed; without panels there is none.
    pull : ndarray (4,)
        Strength of a central field and ``1/a_i^2`` of its level surfaces; strength zero for none.
    drag : float
        Rate at which velocities decay.
    """

    tide: TidePanels
    ground: Ground
    pull: Array
    drag: float


class Scheme(NamedTuple):
    """Numerical choices of :func:`advance`.

    Attributes
    ----------
    dt : float
        Time step.
    every : int
        Steps between evaluations of gravity.
    skin : float
        Skin of the neighbour list.
    gravity : bool
        True if the grains attract each other.
    theta : float
        Opening angle of the tree that sums gravity (:mod:`flybystab.core.grains.tree`); zero for the direct sum.
    """

    dt: float
    every: int
    skin: float
    gravity: bool
    theta: float


class Predicted(NamedTuple):
    """Velocities and angular velocities, ``(n, 3)``, predicted to the time of the positions; kept between calls."""

    u: Array
    s: Array


@kernel
def _mean_spin(g: Grains, out: Array) -> None:
    """Write the angular velocity ``out[3]`` of the rigid rotation about the origin with the grains' momentum."""
    a = np.zeros((3, 3))
    b = np.zeros(3)
    for i in range(g.mass.shape[0]):
        m = g.mass[i]
        x, v, w = g.x[i], g.v[i], g.w[i]
        own = 0.4 * m * g.radius[i] ** 2
        r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
        for k in range(3):
            for l in range(3):
                a[k, l] -= m * x[k] * x[l]
            a[k, k] += m * r2 + own
            b[k] += own * w[k]
        b[0] += m * (x[1] * v[2] - x[2] * v[1])
        b[1] += m * (x[2] * v[0] - x[0] * v[2])
        b[2] += m * (x[0] * v[1] - x[1] * v[0])
    # Cramer's rule
    c0 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c1 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c2 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    det = a[0, 0] * c0 + a[0, 1] * c1 + a[0, 2] * c2
    out[:] = 0.0
    if det <= 0.0:
        return
    d1 = a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]
    d2 = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
    e1 = a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2]
    out[0] = (c0 * b[0] + c1 * b[1] + c2 * b[2]) / det
    out[1] = (c1 * b[0] + d1 * b[1] + e1 * b[2]) / det
    out[2] = (c2 * b[0] + e1 * b[1] + d2 * b[2]) / det


@kernel
def _moved(g: Grains, p: Pairs, spin: Array, since: float, limit: float) -> bool:
    """True if a grain is further than `limit` from its position in the list, rotated at `spin` for the time `since`."""
    rate = np.sqrt(spin[0] ** 2 + spin[1] ** 2 + spin[2] ** 2)
    q = np.eye(3)
    if rate > 0.0:
        e0, e1, e2 = spin[0] / rate, spin[1] / rate, spin[2] / rate
        s, c = np.sin(rate * since), np.cos(rate * since)
        o = 1.0 - c
        q[0, 0], q[0, 1], q[0, 2] = c + o * e0 * e0, o * e0 * e1 - s * e2, o * e0 * e2 + s * e1
        q[1, 0], q[1, 1], q[1, 2] = o * e0 * e1 + s * e2, c + o * e1 * e1, o * e1 * e2 - s * e0
        q[2, 0], q[2, 1], q[2, 2] = o * e0 * e2 - s * e1, o * e1 * e2 + s * e0, c + o * e2 * e2
    most = limit * limit
    q00, q01, q02, q10, q11, q12 = q[0, 0], q[0, 1], q[0, 2], q[1, 0], q[1, 1], q[1, 2]
    q20, q21, q22 = q[2, 0], q[2, 1], q[2, 2]
    for i in range(g.mass.shape[0]):
        a, b, c = p.origin[i, 0], p.origin[i, 1], p.origin[i, 2]
        x = g.x[i, 0] - q00 * a - q01 * b - q02 * c
        y = g.x[i, 1] - q10 * a - q11 * b - q12 * c
        z = g.x[i, 2] - q20 * a - q21 * b - q22 * c
        if x * x + y * y + z * z > most and g.mass[i] > 0.0:
            return True
    return False


@kernel
def _planet(t: float, ground: Ground, out: Array) -> None:
    """Write the position ``out[3]`` (m) of the body from the planet's centre at the scaled time `t`."""
    c = ground.coefficients
    i, x = panel_at(ground.tau, ground.start, ground.width, c.shape[0], t)
    for j in range(3):
        b1 = 0.0
        b2 = 0.0
        for k in range(c.shape[1] - 1, 0, -1):
            b1, b2 = c[i, k, j] + 2.0 * x * b1 - b2, b1
        out[j] = c[i, 0, j] + x * b1 - b2


@kernel
def _land(g: Grains, t: float, ground: Ground, where: Array) -> int:
    """Remove the grains that have reached the ground at the time `t`; returns their number."""
    _planet(t, ground, where)
    count = 0
    for i in range(g.mass.shape[0]):
        if g.mass[i] > 0.0:
            r2 = 0.0
            for k in range(3):
                r2 += (where[k] + ground.unit * g.x[i, k]) ** 2
            if np.sqrt(r2) - ground.unit * g.radius[i] <= ground.floor:
                g.mass[i] = 0.0
                for k in range(3):
                    g.v[i, k] = g.w[i, k] = 0.0
                    # far from the others and from each other
                    g.x[i, k] = 1e6 * (1.0 + i) if k == 0 else 1e6
                count += 1
    return count


@kernel
def _kick_and_drift(
    g: Grains,
    predicted: Predicted,
    loads: Loads,
    tide: Array,
    field: Array,
    dt: float,
    force: Array,
    torque: Array,
) -> float:
    """One leapfrog step from forces and torques, which are then zero; writes the predicted velocities.

    `tide` is the tidal tensor at this time, `field` the gravity of the grains, ``(3, n)``. Returns the square of the
    largest speed.
    """
    u, s, pull, drag = predicted.u, predicted.s, loads.pull, loads.drag
    kxx, kyy, kzz, kxy, kxz, kyz = tide[0], tide[1], tide[2], tide[3], tide[4], tide[5]
    fastest = 0.0
    for i in range(g.mass.shape[0]):
        m = g.mass[i]
        if m == 0.0:
            continue
        over = 1.0 / m
        twist = 2.5 * over / (g.radius[i] * g.radius[i])
        x, y, z = g.x[i, 0], g.x[i, 1], g.x[i, 2]
        ax = force[i, 0] * over + field[0, i] + kxx * x + kxy * y + kxz * z
        ay = force[i, 1] * over + field[1, i] + kxy * x + kyy * y + kyz * z
        az = force[i, 2] * over + field[2, i] + kxz * x + kyz * y + kzz * z
        if pull[0] > 0.0:
            # central field with ellipsoids as level surfaces
            sx, sy, sz = x * pull[1], y * pull[2], z * pull[3]
            c = pull[0] / max(np.sqrt(sx * x + sy * y + sz * z), 0.05)
            ax -= c * sx
            ay -= c * sy
            az -= c * sz
        bx, by, bz = twist * torque[i, 0], twist * torque[i, 1], twist * torque[i, 2]
        if drag > 0.0:
            ax -= drag * u[i, 0]
            ay -= drag * u[i, 1]
            az -= drag * u[i, 2]
            bx -= drag * s[i, 0]
            by -= drag * s[i, 1]
            bz -= drag * s[i, 2]
        vx, vy, vz = g.v[i, 0] + dt * ax, g.v[i, 1] + dt * ay, g.v[i, 2] + dt * az
        wx, wy, wz = g.w[i, 0] + dt * bx, g.w[i, 1] + dt * by, g.w[i, 2] + dt * bz
        g.v[i, 0], g.v[i, 1], g.v[i, 2] = vx, vy, vz
        g.w[i, 0], g.w[i, 1], g.w[i, 2] = wx, wy, wz
        g.x[i, 0], g.x[i, 1], g.x[i, 2] = x + dt * vx, y + dt * vy, z + dt * vz
        h = 0.5 * dt
        u[i, 0], u[i, 1], u[i, 2] = vx + h * ax, vy + h * ay, vz + h * az
        s[i, 0], s[i, 1], s[i, 2] = wx + h * bx, wy + h * by, wz + h * bz
        force[i, 0] = force[i, 1] = force[i, 2] = 0.0
        torque[i, 0] = torque[i, 1] = torque[i, 2] = 0.0
        fastest = max(fastest, vx * vx + vy * vy + vz * vz)
    return fastest


@kernel
def advance(
    g: Grains, contact: Contact, p: Pairs, predicted: Predicted, loads: Loads, scheme: Scheme, t: float, steps: int,
    ledger: Array, count: NDArray[np.int64],
) -> int:  # fmt: skip
    """Advance grains by a number of steps.

    Parameters
    ----------
    t : float
        Time of the positions, on the scaled clock of the tide.
    ledger : ndarray (2,) or (0,)
        See :func:`flybystab.core.grains.contact.contact_forces`.
    count : ndarray (2,)
        Added to: number of neighbour lists built, of grains removed at the ground.

    Returns
    -------
    int
        ``DONE``, ``NO_ROOM`` in the neighbour list, or ``NOT_FINITE``.
    """
    u, s, tide, ground = predicted.u, predicted.s, loads.tide, loads.ground
    dt, every, skin, theta = scheme.dt, scheme.every, scheme.skin, scheme.theta
    n = g.mass.shape[0]
    force, torque = np.zeros((n, 3)), np.zeros((n, 3))
    field, place = np.zeros((3, n)), np.zeros((3, n))
    k_t, spin, where = np.zeros(6), np.zeros(3), np.zeros(3)
    if not find_pairs(g, contact.beta, skin, p):
        return NO_ROOM
    _mean_spin(g, spin)
    made = 0
    for step in range(steps):
        now = t + step * dt
        if _moved(g, p, spin, (step - made) * dt, MOVED * skin):
            if not find_pairs(g, contact.beta, skin, p):
                return NO_ROOM
            _mean_spin(g, spin)
            made = step
            count[0] += 1
        if scheme.gravity and step % every == 0:
            ahead = 0.5 * dt * min(every, steps - step) - 0.5 * dt
            for i in range(n):
                for k in range(3):
                    place[k, i] = g.x[i, k] + ahead * u[i, k]
            if theta > 0.0:
                tree_sum(place, g.mass, theta, field)
            else:
                direct_sum(place, g.mass, field)
        tide_at(tide.tau, tide.start, tide.width, tide.coefficients, now, k_t)
        contact_forces(g, u, s, contact, p, dt, force, torque, ledger)
        fastest = _kick_and_drift(g, predicted, loads, k_t, field, dt, force, torque)
        if not np.isfinite(fastest):
            return NOT_FINITE
        if ground.coefficients.shape[0] > 0:
            landed = _land(g, now + dt, ground, where)
            if landed > 0:
                count[1] += landed
                if not find_pairs(g, contact.beta, skin, p):
                    return NO_ROOM
                made = step + 1
                _mean_spin(g, spin)
    return DONE
