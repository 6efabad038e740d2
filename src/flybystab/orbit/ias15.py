"""Integration of an asteroid among prescribed bodies by rebound (IAS15) with a compiled force.

rebound calls the force and the log through C function pointers that numba compiles: a Python callback costs
about 90 times as much.
"""

from __future__ import annotations

from ctypes import Structure
from functools import lru_cache

import numpy as np
import rebound
from numba import cfunc
from numba.core.ccallback import CFunc

from flybystab.constants import DAY
from flybystab.core.numerics.jit import CACHE
from flybystab.errors import NotConverged
from flybystab.orbit.callbacks import CALLBACK, Layout, layout, numbers_at, under_way
from flybystab.orbit.closest_approach import ACCELERATION, LOG_WIDTH, POSITION, TIME, VELOCITY
from flybystab.orbit.forces import LOG_ADDRESS, LOG_COUNT, LOG_ROWS, acceleration
from flybystab.typing import Array

#: Step-size criterion of IAS15 (Aarseth 1985) and its number in rebound 4, which takes no names. With rebound's
#: default (Pham, Rein & Spiegel 2024, "PRS23") a step can skip an encounter: after ten years the errors of 10 of 635
#: near-Earth asteroids exceed 100 km (up to 12,000 km); with this criterion none does, at 1.2 times the cost.
STEP_CONTROL, _STEP_CONTROL_4 = "AARSETH85", 3
#: Tolerances: the default, and the one that measures its error.
EPSILON, TIGHT = 1e-9, 1e-11


def set_step_control(sim: rebound.Simulation, epsilon: float) -> Structure:
    """Choose criterion and tolerance of the step size of a simulation; returns the settings of its IAS15."""
    old = hasattr(sim, "ri_ias15")  # rebound 4
    settings = sim.ri_ias15 if old else sim.integrator
    settings.adaptive_mode = _STEP_CONTROL_4 if old else STEP_CONTROL
    settings.epsilon = epsilon
    return settings


@lru_cache(maxsize=1)
def _callbacks() -> tuple[CFunc, CFunc]:
    """The callbacks of force and log for the installed version of rebound."""
    return _compile(layout())


def _compile(at: Layout) -> tuple[CFunc, CFunc]:
    # The layout is a closure variable: it is part of the key of numba's cache on disk.
    x, v, a = at.x, at.v, at.a

    @cfunc(CALLBACK, cache=CACHE)
    def force(sim: int) -> None:
        t, particles, model, _ = under_way(sim, at, 1)
        particle = particles[0]
        out = np.empty(3)
        acceleration(model, t, particle[x : x + 3], particle[v : v + 3], out)
        for j in range(3):
            particle[a + j] += out[j]

    @cfunc(CALLBACK, cache=CACHE)
    def log(sim: int) -> None:
        t, particles, model, _ = under_way(sim, at, 1)
        particle = particles[0]
        n = int(model[LOG_COUNT])
        model[LOG_COUNT] = n + 1
        if n >= int(model[LOG_ROWS]):
            return
        row = numbers_at(int(model[LOG_ADDRESS]) + 8 * LOG_WIDTH * n, LOG_WIDTH)
        row[TIME] = t
        for j in range(3):
            row[POSITION + j] = particle[x + j]
            row[VELOCITY + j] = particle[v + j]
        acceleration(model, t, particle[x : x + 3], particle[v : v + 3], row[ACCELERATION:])

    return force, log


def simulation(t: float, states: Array, epsilon: float, memory: Array, force: CFunc) -> rebound.Simulation:
    """A simulation of test particles at `t` (s) with states (n, 6), m and m/s, moved by a compiled force alone.

    The force reads `memory`, which must not be freed before the simulation.
    """
    sim = rebound.Simulation()
    for x, y, z, vx, vy, vz in states:
        sim.add(x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)
    sim.t = t
    sim.integrator = "ias15"
    sim.gravity = "none"
    sim.force_is_velocity_dependent = 1
    sim.dt = 3600.0
    # Far below any step outside a planet, so that an integration cannot stall.
    set_step_control(sim, epsilon).min_dt = 0.1
    sim.extras = memory.ctypes.data
    sim.additional_forces = force.ctypes
    return sim


def not_finite(t: float) -> NotConverged:
    """The error of an integration whose state at `t` (s from the epoch of the force model) is not finite."""
    return NotConverged(
        f"the integration to {abs(t) / DAY:.6g} d {'before' if t < 0.0 else 'after'} the epoch of the force model "
        "gave a state that is not finite: the orbit passes too close to the centre of the Sun or of a planet, "
        "or its state is out of range"
    )


class Flight:
    """Integration of one asteroid by rebound.

    Parameters
    ----------
    model : ndarray
        From :func:`flybystab.orbit.forces.model`; times in seconds from its epoch.
    t : float
        Start, s.
    state : ndarray, shape (6,)
        Barycentric position (m) and velocity (m/s) at `t`.
    epsilon : float
        Tolerance of IAS15.
    """

    def __init__(self, model: Array, t: float, state: Array, epsilon: float = EPSILON) -> None:
        self._model = np.array(model)
        self._epsilon = epsilon
        force, self._log = _callbacks()
        self._sim = simulation(t, state[None], epsilon, self._model, force)

    @property
    def t(self) -> float:
        """Time reached, s."""
        return float(self._sim.t)

    @property
    def state(self) -> Array:
        """Barycentric position (m) and velocity (m/s), shape (6,)."""
        p = self._sim.particles[0]
        return np.array([p.x, p.y, p.z, p.vx, p.vy, p.vz])

    def to(self, t: float) -> Array:
        """Integrate to time `t`, s; returns the state there, shape (6,)."""
        self._sim.integrate(t)
        state = self.state
        if not np.isfinite(state).all():
            raise not_finite(t)
        return state

    def log_to(self, t: float, rows: int = 4096) -> Array:
        """Integrate to time `t`; returns all steps: time, position, velocity, acceleration, shape (n, 10), SI.

        Times increase along the motion and do not repeat.
        """
        start, state = self.t, self.state
        while True:
            out = np.zeros((rows, LOG_WIDTH))
            self._model[[LOG_ADDRESS, LOG_ROWS, LOG_COUNT]] = out.ctypes.data, rows, 0
            self._sim.heartbeat = self._log.ctypes
            self.to(t)
            count = int(self._model[LOG_COUNT])
            self._model[LOG_ROWS] = 0
            if count <= rows:
                out = out[:count]
                return out[np.concatenate([[True], np.diff(out[:, TIME]) != 0.0])]
            # The log was too short: integrate again with a longer one.
            self._sim, rows = Flight(self._model, start, state, self._epsilon)._sim, 2 * count
            self._sim.extras = self._model.ctypes.data
