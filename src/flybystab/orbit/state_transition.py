"""State transition matrix of an orbit: the variational equations beside the orbit in IAS15.

The deviation ``(dr, dv)`` of an orbit obeys ``d2(dr)/dt2 = A dr + B dv``, ``A`` and ``B`` the derivatives of the
acceleration by position and velocity; with the derivative of the acceleration by a non-gravitational parameter added,
the same equation gives the derivative of the orbit by that parameter. All forces of the orbit act: ``A`` and ``B`` are
five-point differences of the compiled acceleration (:mod:`flybystab.orbit.forces`), with the bodies at fixed places
relative to the asteroid, which are right to 1e-12. rebound carries the deviations as variational particles, which do
not take part in the choice of the step.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import rebound
from astropy.time import Time
from numba import carray, cfunc, types

from flybystab.constants import C_LIGHT, DAY
from flybystab.core.numerics.jit import CACHE, kernel
from flybystab.errors import NotConverged
from flybystab.orbit.covariance import PUSHES
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.ephemeris import N_ALL, N_BODIES, SUN
from flybystab.orbit.forces import (
    _LAW,
    _LOG,
    RADIATION_PRESSURE,
    acceleration_among,
    bodies,
    push,
)
from flybystab.orbit.ias15 import EPSILON, TIGHT, _address, _pointer, simulation
from flybystab.tabular import Record
from flybystab.typing import Array

#: Directions of phase space and non-gravitational parameters.
WAYS = 6 + len(PUSHES)
#: Step of the differences over the distance of the nearest body, and over the speed.
_STEP = 3e-4
#: Step of the differences by DT, s.
_DELAY_STEP = 0.01 * DAY


@kernel
def schwarzschild(r: Array, v: Array, out: Array) -> None:
    """Add the 1PN acceleration (m/s2) by the Sun alone at heliocentric ``r`` (m), ``v`` (m/s) to ``out[3]``.

    ``GM/(c^2 r^3) [(4 GM/r - v^2) r + 4 (r.v) v]``.
    """
    d2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    d = np.sqrt(d2)
    c = GM_SUN / (C_LIGHT * C_LIGHT * d2 * d)
    along = 4.0 * c * (r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
    radial = c * (4.0 * GM_SUN / d - (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
    for i in range(3):
        out[i] += radial * r[i] + along * v[i]


@kernel
def acceleration_gradient(
    model: Array, t: float, places: Array, rates: Array, v: Array, by_x: Array, by_v: Array
) -> None:
    """Write the derivatives of the acceleration by position (s^-2) and velocity (1/s), ``[i, j] = da_i/dx_j``.

    ``places`` are relative to the asteroid, so that small steps are not lost in rounding. Of 1PN the derivative of the
    Sun's term counts: the rest is 1e-3 of it, which is 1e-8 of Newton's.
    """
    nearest = np.inf
    for i in range(N_BODIES):
        nearest = min(nearest, places[i, 0] ** 2 + places[i, 1] ** 2 + places[i, 2] ** 2)
    h = _STEP * np.sqrt(nearest)
    w = _STEP * np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    here, found = np.zeros(3), np.empty(3)
    away, motion = -places[SUN], v - rates[SUN]
    relativity, model[2] = model[2], 0.0
    moves = model[4] != 0.0  # only then does the rest depend on the velocity
    by_x[:] = 0.0
    by_v[:] = 0.0
    for j in range(3):
        for weight, side in ((8.0, 1.0), (-8.0, -1.0), (-1.0, 2.0), (1.0, -2.0)):
            here[j] = side * h
            acceleration_among(model, t, places, rates, here, v, found)
            here[j] = 0.0
            if relativity != 0.0:
                away[j] = side * h - places[SUN, j]
                schwarzschild(away, motion, found)
                away[j] = -places[SUN, j]
            for i in range(3):
                by_x[i, j] += weight * found[i] / (12.0 * h)
            found[:] = 0.0
            motion[j] = v[j] + side * w - rates[SUN, j]
            if relativity != 0.0:
                schwarzschild(away, motion, found)
            if moves:
                push(model[_LAW:_LOG], away, motion, found)
            motion[j] = v[j] - rates[SUN, j]
            for i in range(3):
                by_v[i, j] += weight * found[i] / (12.0 * w)
    model[2] = relativity


@kernel
def push_gradient(law: Array, r: Array, v: Array, out: Array) -> None:
    """Write the derivatives of the acceleration (m/s2) by A1, A2, A3, DT, AMRAT (SI) into ``out[5, 3]``.

    ``law`` is :attr:`flybystab.orbit.forces.NonGravitational.row`, ``r`` (m) and ``v`` (m/s) are heliocentric.
    """
    its = law.copy()
    out[:] = 0.0
    other = np.zeros(3)
    its[9] = 0.0
    if law[0] != 0.0 or law[1] != 0.0 or law[2] != 0.0:
        its[8] = law[8] + _DELAY_STEP
        push(its, r, v, out[3])
        its[8] = law[8] - _DELAY_STEP
        push(its, r, v, other)
        for i in range(3):
            out[3, i] = (out[3, i] - other[i]) / (2.0 * _DELAY_STEP)
        its[8] = law[8]
    for k in range(3):
        its[:3] = 0.0
        its[k] = 1.0
        push(its, r, v, out[k])
    its[:3] = 0.0
    its[9] = RADIATION_PRESSURE
    push(its, r, v, out[4])


@lru_cache(maxsize=1)
def _callback() -> Any:
    """The force on an asteroid and its deviations for the rebound that is installed."""
    sim, particle = rebound.Simulation, rebound.Particle
    return _compile(
        sim.t.offset,
        sim._particles.offset,
        sim.extras.offset,
        particle.x.offset // 8,
        particle.vx.offset // 8,
        particle.ax.offset // 8,
        ctypes.sizeof(particle) // 8,
    )


def _compile(at_t: int, at_p: int, at_model: int, x: int, v: int, a: int, words: int) -> Any:
    # The offsets are closure variables: they are part of the key of numba's cache on disk.
    every = 1 + WAYS

    @cfunc(types.void(types.voidptr), cache=CACHE)
    def force(sim: Any) -> None:
        base: int = _address(sim)  # type: ignore[call-arg]
        t = carray(_pointer(base + at_t), 1, np.float64)[0]
        flat = carray(_pointer(carray(_pointer(base + at_p), 1, np.int64)[0]), every * words, np.float64)
        particles = flat.reshape((every, words))
        where = carray(_pointer(base + at_model), 1, np.int64)[0]
        size = int(carray(_pointer(where), 1, np.float64)[0])
        model = carray(_pointer(where), size, np.float64)
        scale = carray(_pointer(where + 8 * size), WAYS, np.float64)
        orbit = particles[0]
        out, by_x, by_v = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
        pushes = np.empty((WAYS - 6, 3))
        places, rates = np.empty((N_ALL, 3)), np.zeros((N_BODIES, 3))
        bodies(model, t, places, rates)
        velocity = orbit[v : v + 3]
        acceleration_among(model, t, places, rates, orbit[x : x + 3], velocity, out)
        for i in range(N_ALL):
            for j in range(3):
                places[i, j] -= orbit[x + j]
        acceleration_gradient(model, t, places, rates, velocity, by_x, by_v)
        push_gradient(model[_LAW:_LOG], -places[SUN], velocity - rates[SUN], pushes)
        for i in range(3):
            orbit[a + i] += out[i]
        for k in range(WAYS):
            way = particles[1 + k]
            for i in range(3):
                total = scale[k] * pushes[k - 6, i] if k >= 6 else 0.0
                for j in range(3):
                    total += by_x[i, j] * way[x + j] + by_v[i, j] * way[v + j]
                way[a + i] += total

    return force


def _carried(
    model: Array, law: Array, start: float, state: Array, away: Array, stop: float, epsilon: float
) -> Array:
    """Derivatives as :func:`derivatives`, with one tolerance; `away` is the heliocentric state."""
    size = _size(away)
    own = np.array(model)
    own[4], own[_LAW:_LOG] = 1.0, law  # parameters that are zero have derivatives, too
    effect = np.empty((len(PUSHES), 3))
    push_gradient(law, away[:3], away[3:], effect)
    effects = np.linalg.norm(effect, axis=1)
    strength = GM_SUN / size[0] ** 2
    scale = np.ones(WAYS)
    scale[6:] = np.divide(strength, effects, out=np.ones(len(PUSHES)), where=effects > 0.0)
    # Position and velocity deviate together: a deviation without acceleration at the start would stop the first step.
    eye = np.eye(3)
    ways = size[:, None] * np.block([[eye, eye], [eye, -eye]])
    begin = np.hstack([ways, np.zeros((6, len(PUSHES)))])
    memory = np.concatenate([own, scale])
    sim = simulation(start, np.vstack([state, begin.T]), epsilon, memory, _callback())
    sim.integrate(stop)
    end = np.array([[p.x, p.y, p.z, p.vx, p.vy, p.vz] for p in sim.particles])[1:].T
    if not np.isfinite(end).all():
        raise NotConverged(f"the orbit was lost before t = {stop:.6g} s from the epoch of the integration")
    return np.hstack([np.linalg.solve(ways.T, end[:, :6].T).T, end[:, 6:] / scale[6:]])


def _size(away: Array) -> Array:
    """Heliocentric distance (m) and speed (m/s), each three times."""
    return np.repeat([np.linalg.norm(away[:3]), np.linalg.norm(away[3:])], 3)


@dataclass(frozen=True, eq=False)
class StateTransition(Record):
    """Derivatives of the state of an orbit at one time by its state at the epoch and by its parameters.

    ICRF axes, relative to a body of the ephemeris: it moves as prescribed, so that every centre gives the same.

    Attributes
    ----------
    epoch, time : Time
        TDB.
    matrix : ndarray, shape (6, 6)
        ``d(x, y, z, vx, vy, vz at time) / d(x, y, z, vx, vy, vz at epoch)``, m and m/s.
    parameters : ndarray, shape (6, 5)
        Derivatives of the state at `time` (m, m/s) by A1, A2, A3 (m/s2), DT (s) and AMRAT (m2/kg).
    error : float
        Difference between integrations with two tolerances over the size of the matrix, positions in units of the
        heliocentric distance at the epoch, velocities in units of the speed.
    """

    epoch: Time
    time: Time
    matrix: Array
    parameters: Array
    error: float

    def __repr__(self) -> str:
        return (
            f"<StateTransition {self.epoch.tdb.iso[:16]} to {self.time.tdb.iso[:16]} TDB, "
            f"relative error {self.error:.1g}>"
        )


def derivatives(
    model: Array, law: Array, start: float, state: Array, sun: Array, stop: float
) -> tuple[Array, float]:
    """Derivatives (6, 11) of the state at `stop` (s) by that at `start` and the parameters, SI; their relative error.

    Parameters
    ----------
    model : ndarray
        From :func:`flybystab.orbit.forces.model`.
    law : ndarray, shape (10,)
        :attr:`flybystab.orbit.forces.NonGravitational.row`.
    state, sun : ndarray, shape (6,)
        Barycentric states of the asteroid and of the Sun at `start`, m and m/s.

    Raises
    ------
    NotConverged
        The orbit was lost.
    """
    away = state - sun
    size = _size(away)
    if stop == start:
        return np.hstack([np.eye(6), np.zeros((6, len(PUSHES)))]), 0.0
    tight, loose = (_carried(model, law, start, state, away, stop, epsilon) for epsilon in (TIGHT, EPSILON))
    scaled = tight[:, :6] * size / size[:, None]
    error = np.linalg.norm((tight - loose)[:, :6] * size / size[:, None]) / np.linalg.norm(scaled)
    return tight, float(error)
