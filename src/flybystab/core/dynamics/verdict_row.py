"""One row of many: a body through an encounter, its verdict and what there is to say of it, without Python objects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import G
from flybystab.core.dynamics.ground import Ground
from flybystab.core.dynamics.run import carry
from flybystab.core.dynamics.state import RIGID
from flybystab.core.dynamics.workspace import BEYOND, N_EVENT, N_HISTORY, ONSET, STUCK, TOUCH, Counts
from flybystab.core.ellipsoid.bound_mass import (
    angle_between,
    bound_share,
    momentum,
    principal_axes,
    spin_vector,
)
from flybystab.core.ellipsoid.rigid_stress import demand, overload, rigid_stress
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.core.verdict_codes import BEYOND_MODEL, FAILED, FLOWED, IMPACT, INTACT, NOT_IN_EQUILIBRIUM
from flybystab.typing import Array

# Columns of a body's material.
PHI = 0  # rad
COHESION = 1  # Pa
DILATANCY = 2
SURFACE = 3  # code
BRITTLE = 4  # 0 or 1

# Columns of an encounter: times (s).
START = 0
REST = 1  # a body that is rigid after this ends the run
STOP = 2

#: A body whose centre stays higher than this many long semi-axes is not looked at for touching the ground.
NEAR_GROUND = 100.0

# Columns of a row of answers.
VERDICT = 0
BOUND = 1
AXES = 2  # three, m, longest first
SPIN = 5  # three, rad/s, frame of the encounter
FRICTION = 8  # largest friction angle mobilised if rigid throughout, rad
FRICTION_TIME = 9  # s
SPIN_RATIO = 10
POLE_CHANGE = 11  # rad
LACKING = 12  # cohesion that a body lacks which cannot exist on its own, Pa
TIME = 13  # end of the run, s
REASON = 14
REGIME = 15
STEPS = 16
N_ANSWER = 17


@inlined
def judge(
    axes: Array,
    rho: float,
    omega: Array,
    attitude: Array,
    material: Array,
    span: Array,
    tide: TidePanels,
    ground: Ground,
    tolerance: float,
    limit: float,
    needs: bool,
    max_steps: int,
    shape: Array,
    gradient: Array,
    hist: Array,
    events: Array,
    count: Counts,
    out: Array,
) -> None:
    """Carry a body through an encounter and judge it.

    Parameters
    ----------
    axes, rho, omega, attitude
        As in :func:`flybystab.core.dynamics.run.passage`.
    material, span : ndarray (5,), (3,)
        See the columns above.
    tide : TidePanels
        SI.
    ground : Ground
        A body that reaches it ends there.
    tolerance, limit, max_steps
        Relative error a step, axis ratio where the model is left (never below that of the body), most steps.
    needs : bool
        Whether to follow a body that yields once more without yielding, for the friction that it would need.
    shape, gradient : ndarray (3, 3)
        ``S`` (m2) and ``L`` (1/s) at the end.
    hist, events, count : ndarray
        History and event log of :func:`flybystab.core.dynamics.regimes.follow`; times in s.
    out : ndarray (17,)
        The answers, see the columns above. FAILED: the integrator could not go on.
    """
    surface = int(material[SURFACE])
    stress = np.empty(6)
    s1, s2, s3 = axes[0] ** 2, axes[1] ** 2, axes[2] ** 2
    rigid_stress(s1, s2, s3, rho, np.pi * G * rho, omega, np.zeros(6), stress)
    size = 0.0
    for i in range(6):
        size = max(size, abs(stress[i]))
    holds = overload(surface, material[PHI], material[COHESION], stress) <= 1e-12 * size
    ratio = max(limit, 1.001 * axes[0] / axes[2])
    mark = np.zeros(2)
    # A body that cannot exist on its own is not carried on: its demand at the start is the answer.
    reason, time, regime = carry(
        axes, rho, omega, attitude, span[START], span[STOP], span[REST], tide, ground,
        material[PHI], material[COHESION], material[DILATANCY], surface, material[BRITTLE] > 0.0, 1.5,
        not holds, tolerance, ratio, max_steps, shape, gradient, hist, events, count, mark, np.zeros((3, 3)),
    )  # fmt: skip
    out[TIME], out[REASON], out[REGIME], out[STEPS] = time, reason, regime, count[2]
    out[FRICTION], out[FRICTION_TIME] = mark[0], mark[1]
    out[LACKING] = 0.0
    if not holds:
        out[LACKING] = demand(surface, material[PHI], material[COHESION], stress)[1]
    yielded = count[1] > 0 and int(events[0, 0]) == ONSET
    vectors = np.empty((3, 3))
    principal_axes(shape, out[AXES : AXES + 3], vectors)
    spin_vector(gradient, out[SPIN : SPIN + 3])
    bound = 1.0
    if holds and regime != RIGID:
        rho_now = rho * axes[0] * axes[1] * axes[2] / (out[AXES] * out[AXES + 1] * out[AXES + 2])
        bound = bound_share(shape, gradient, rho_now)
    out[BOUND] = bound
    before, after = np.empty(3), np.empty(3)
    rate = momentum(shape, gradient, after)
    first = np.empty((3, 3))
    still = np.empty((3, 3))
    _initial(axes, omega, attitude, still, first)
    rate_before = momentum(still, first, before)
    out[SPIN_RATIO] = rate / rate_before if rate_before > 0.0 else (np.inf if rate > 0.0 else 1.0)
    out[POLE_CHANGE] = angle_between(before, after)
    if yielded and needs and reason != STUCK:
        no_rows = np.zeros((1, N_HISTORY))
        no_events = np.zeros((1, N_EVENT))
        tries = np.zeros(4, dtype=np.int64)
        second, _, _ = carry(
            axes, rho, omega, attitude, span[START], span[STOP], span[REST], tide, ground,
            material[PHI], material[COHESION], material[DILATANCY], surface, False, 1.5, True, tolerance,
            ratio, max_steps, still, first, no_rows, no_events, tries, mark, np.zeros((3, 3)),
        )  # fmt: skip
        out[FRICTION], out[FRICTION_TIME] = mark[0], mark[1]
        reason = STUCK if second == STUCK else reason
    out[VERDICT] = _verdict(reason, holds, out[REASON] == TOUCH or ground.least < 0.0, yielded)


@kernel
def _verdict(reason: int, holds: bool, hits: bool, yielded: bool) -> int:
    if reason == STUCK:
        return FAILED
    if not holds:
        return NOT_IN_EQUILIBRIUM
    if hits:
        return IMPACT
    if reason == BEYOND:
        return BEYOND_MODEL
    return FLOWED if yielded else INTACT


@kernel
def _initial(axes: Array, omega: Array, attitude: Array, shape: Array, gradient: Array) -> None:
    """Shape and velocity gradient of a rigid body in the frame of its encounter."""
    w = np.zeros(3)
    for i in range(3):
        for j in range(3):
            w[i] += attitude[i, j] * omega[j]
            shape[i, j] = (
                attitude[i, 0] * attitude[j, 0] * axes[0] ** 2
                + attitude[i, 1] * attitude[j, 1] * axes[1] ** 2
                + attitude[i, 2] * attitude[j, 2] * axes[2] ** 2
            )
    gradient[0, 0] = gradient[1, 1] = gradient[2, 2] = 0.0
    gradient[2, 1], gradient[1, 2] = w[0], -w[0]
    gradient[0, 2], gradient[2, 0] = w[1], -w[1]
    gradient[1, 0], gradient[0, 1] = w[2], -w[2]


@kernel
def judge_rows(
    rows: NDArray[np.int64],
    axes: Array,
    rho: Array,
    omega: Array,
    attitude: Array,
    material: Array,
    which: NDArray[np.int64],
    spans: Array,
    scales: Array,
    first: NDArray[np.int64],
    coefficients: Array,
    grounds: Array,
    first_ground: NDArray[np.int64],
    positions: Array,
    tolerance: float,
    limit: float,
    max_steps: int,
    needs: bool,
    shape: Array,
    gradient: Array,
    hist: Array,
    events: Array,
    count: Counts,
    out: Array,
) -> None:
    """`judge` for the given rows of arrays over bodies; writes those rows of ``out[n, 17]``.

    Parameters
    ----------
    rows : ndarray of int (m,)
    axes, rho, omega, attitude, material : ndarray (n, 3), (n,), (n, 3), (n, 3, 3), (n, 5)
    which : ndarray of int (n,)
        Encounter of each row.
    spans, scales : ndarray (e, 3), (e, 3)
        Of each encounter: its span; ``tau``, ``start`` and ``width`` of its panels.
    first : ndarray of int (e + 1,)
        Where its panels begin in ``coefficients[panels, degree + 1, 6]``.
    grounds : ndarray (e, 5)
        Of each encounter: the first five of :class:`flybystab.core.dynamics.ground.Ground`.
    first_ground : ndarray of int (e + 1,)
        Where its panels begin in ``positions[panels, degree + 1, 3]``.
    shape, gradient, hist, events, count
        As in `judge`, of the last row.
    """
    for i in rows:
        e = which[i]
        tide = TidePanels(
            scales[e, 0],
            scales[e, 1],
            scales[e, 2],
            np.ascontiguousarray(coefficients[first[e] : first[e + 1]]),
        )
        g = grounds[e]
        a, b = first_ground[e], first_ground[e + 1]
        if g[4] > NEAR_GROUND * axes[i, 0]:
            b = a
        ground = Ground(g[0], g[1], g[2], g[3], g[4], 1.0, np.ascontiguousarray(positions[a:b]))
        count[:] = 0
        judge(
            axes[i], rho[i], omega[i], attitude[i], material[i], spans[e], tide, ground, tolerance,
            limit, needs, max_steps, shape, gradient, hist, events, count, out[i],
        )  # fmt: skip
