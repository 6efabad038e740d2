"""State transition matrix of an orbit: the variational equations beside the orbit in IAS15.

The deviation ``(dr, dv)`` of an orbit obeys ``d2(dr)/dt2 = A dr + B dv``, ``A`` and ``B`` the derivatives of the
acceleration by position and velocity; with the derivative of the acceleration by a non-gravitational parameter added,
the same equation gives the derivative of the orbit by that parameter. All forces of the orbit act; their gradients are
those of :mod:`flybystab.orbit.gradients` and :mod:`flybystab.orbit.nongravitational`. rebound carries the deviations as
variational particles, which do not take part in the choice of the step.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from astropy.time import Time
from numba import cfunc
from numba.core.ccallback import CFunc

from flybystab.core.numerics.jit import CACHE, kernel
from flybystab.orbit.callbacks import CALLBACK, Layout, layout, numbers_at, under_way
from flybystab.orbit.covariance import NONGRAV_PARAMETERS
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.ephemeris import N_ALL, N_BODIES, SUN
from flybystab.orbit.forces import ForceModel, acceleration_among, bodies, unpacked, with_law
from flybystab.orbit.gradients import (
    add_attraction_gradient,
    add_oblateness_gradient,
    add_relativity_gradient,
)
from flybystab.orbit.ias15 import EPSILON, TIGHT, not_finite, simulation
from flybystab.orbit.nongravitational import (
    N_PARAMETERS,
    NonGravitationalParameters,
    add_nongravitational_gradient,
    nongravitational_by_parameters,
)
from flybystab.tabular import Record
from flybystab.typing import Array

#: Directions of phase space and non-gravitational parameters.
WAYS = 6 + len(NONGRAV_PARAMETERS)


@kernel
def acceleration_gradient(
    model: ForceModel, t: float, places: Array, rates: Array, v: Array, gradient: Array, by_law: Array
) -> None:
    """Write the derivatives of the acceleration.

    By position (1/s2) and velocity (1/s) into ``gradient[3, 6]``, by the non-gravitational parameters (SI) into
    ``by_law[N_PARAMETERS, 3]``. ``places`` (m) are relative to the asteroid, ``rates`` (m/s) and ``v`` (m/s) are
    barycentric.
    """
    gradient[:] = 0.0
    grid = places.T.copy().reshape(3 * N_ALL)
    add_attraction_gradient(grid, N_ALL, model.used, model.inner**2, np.zeros(3), gradient)
    for i in range(N_BODIES):
        c = model.harmonics[i]
        if model.oblate and (c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0):
            pole = model.poles[i, :3] + t * model.poles[i, 3:]
            add_oblateness_gradient(c[0], c[1], c[2], pole, model.inner[i] ** 2, -places[i], gradient)
    away, motion = -places[SUN], v - rates[SUN]
    if model.relativity:
        add_relativity_gradient(model.gm[SUN], away, motion, gradient)
    add_nongravitational_gradient(model.law, away, motion, gradient)
    nongravitational_by_parameters(model.law, away, motion, True, by_law)


@lru_cache(maxsize=1)
def _callback() -> CFunc:
    """The callback of the force on an asteroid and its deviations for the installed version of rebound."""
    return _compile(layout())


def _compile(at: Layout) -> CFunc:
    # The layout is a closure variable: it is part of the key of numba's cache on disk.
    x, v, a = at.x, at.v, at.a

    @cfunc(CALLBACK, cache=CACHE)
    def force(sim: int) -> None:
        t, particles, flat, after = under_way(sim, at, 1 + WAYS)
        model = unpacked(flat)
        scale = numbers_at(after, WAYS)
        orbit = particles[0]
        out, gradient, by_law = np.empty(3), np.empty((3, 6)), np.empty((N_PARAMETERS, 3))
        places, rates = np.zeros((N_ALL, 3)), np.zeros((N_BODIES, 3))
        bodies(model, t, places, rates)
        velocity = orbit[v : v + 3]
        acceleration_among(model, t, places, rates, orbit[x : x + 3], velocity, out)
        for i in range(N_ALL):
            for j in range(3):
                places[i, j] -= orbit[x + j]
        acceleration_gradient(model, t, places, rates, velocity, gradient, by_law)
        for i in range(3):
            orbit[a + i] += out[i]
        for k in range(WAYS):
            way = particles[1 + k]
            for i in range(3):
                total = scale[k] * by_law[k - 6, i] if k >= 6 else 0.0
                for j in range(3):
                    total += gradient[i, j] * way[x + j] + gradient[i, 3 + j] * way[v + j]
                way[a + i] += total

    return force


def _carried(
    model: Array,
    law: NonGravitationalParameters,
    start: float,
    state: Array,
    away: Array,
    stop: float,
    epsilon: float,
) -> Array:
    """Derivatives as :func:`derivatives`, with one tolerance; `away` is the heliocentric state."""
    size = _size(away)
    effect = np.empty((N_PARAMETERS, 3))
    nongravitational_by_parameters(law, away[:3], away[3:], True, effect)
    effects = np.linalg.norm(effect, axis=1)
    strength = GM_SUN / size[0] ** 2
    scale = np.ones(WAYS)
    scale[6:] = np.divide(strength, effects, out=np.ones(len(NONGRAV_PARAMETERS)), where=effects > 0.0)
    # Position and velocity deviate together: with a zero initial acceleration of a deviation the first step would fail.
    eye = np.eye(3)
    ways = size[:, None] * np.block([[eye, eye], [eye, -eye]])
    begin = np.hstack([ways, np.zeros((6, len(NONGRAV_PARAMETERS)))])
    memory = np.concatenate([with_law(model, law), scale])
    sim = simulation(start, np.vstack([state, begin.T]), epsilon, memory, _callback())
    sim.integrate(stop)
    end = np.array([[p.x, p.y, p.z, p.vx, p.vy, p.vz] for p in sim.particles])[1:].T
    if not np.isfinite(end).all():
        raise not_finite(stop)
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
    model: Array, law: NonGravitationalParameters, start: float, state: Array, sun: Array, stop: float
) -> tuple[Array, float]:
    """Derivatives (6, 11) of the state at `stop` (s) by that at `start` and the parameters, SI; their relative error.

    Parameters
    ----------
    model : ndarray
        From :func:`flybystab.orbit.forces.model`.
    law : NonGravitationalParameters
        Parameters that are zero have derivatives, too.
    state, sun : ndarray, shape (6,)
        Barycentric states of the asteroid and of the Sun at `start`, m and m/s.

    Raises
    ------
    NotConverged
        The integration gave a state that is not finite.
    """
    away = state - sun
    size = _size(away)
    if stop == start:
        return np.hstack([np.eye(6), np.zeros((6, len(NONGRAV_PARAMETERS)))]), 0.0
    tight, loose = (_carried(model, law, start, state, away, stop, epsilon) for epsilon in (TIGHT, EPSILON))
    scaled = tight[:, :6] * size / size[:, None]
    error = np.linalg.norm((tight - loose)[:, :6] * size / size[:, None]) / np.linalg.norm(scaled)
    return tight, float(error)
