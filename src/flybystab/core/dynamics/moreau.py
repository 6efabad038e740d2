"""A second integrator, without event location: time stepping with a set-valued friction law (after Moreau 1999).

Each step drifts for half its length (free motion, in closed form: ``x -> (1 + t L) x``), kicks, and drifts
again. The kick adds ``h K`` and then the impulse of :mod:`flybystab.core.dynamics.impulse`, which finds out by itself
whether the body is rigid, flows or has no contact: rest, yield, arrest and contact need no root-finding and
no switch. Angular momentum about the centre is kept to rounding, tides apart. The shape of a rigid body is
kept to second order in the step; plastic flow is first order: runs with halved steps measure the error.

It shares the self-gravity, the tide and the yield surfaces with :mod:`flybystab.core.dynamics.regimes`, nothing else.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.impulse import FAILED, FREE, REST, SLIDING, friction_impulse
from flybystab.core.dynamics.rates import gravity_terms
from flybystab.core.dynamics.state import (
    N_FULL,
    W_A,
    W_B,
    W_K,
    W_L,
    W_S,
    Buffers,
    empty_buffers,
    gradient,
    set_gradient,
)
from flybystab.core.dynamics.workspace import copy
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.flow_rule import dilatancy, dilation
from flybystab.core.material.parameters import MaterialParameters, on_part, without_cohesion
from flybystab.core.material.yield_surface import normal
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import determinant, deviator, multiply, pack, unpack
from flybystab.typing import Array


@kernel
def drift(h: float, y: Array, work: Buffers) -> bool:
    """Free motion for a time `h`: ``S -> F S F^T``, ``L -> L F^-1``, ``F = 1 + h L``; False if it folds."""
    big_l, f, b, s = work.m[W_L], work.m[W_A], work.m[W_B], work.m[W_S]
    gradient(y, big_l)
    for i in range(3):
        for j in range(3):
            f[i, j] = h * big_l[i, j]
        f[i, i] += 1.0
    unpack(y[0:6], s)
    multiply(f, s, b)
    for i in range(3):
        for j in range(3):
            s[i, j] = b[i, 0] * f[j, 0] + b[i, 1] * f[j, 1] + b[i, 2] * f[j, 2]
    pack(s, y[0:6])
    # F^-1 by cofactors
    c00 = f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1]
    c01 = f[1, 2] * f[2, 0] - f[1, 0] * f[2, 2]
    c02 = f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0]
    det = f[0, 0] * c00 + f[0, 1] * c01 + f[0, 2] * c02
    if not det > 0.0:
        return False
    d = 1.0 / det
    b[0, 0], b[1, 0], b[2, 0] = c00 * d, c01 * d, c02 * d
    b[0, 1] = (f[0, 2] * f[2, 1] - f[0, 1] * f[2, 2]) * d
    b[1, 1] = (f[0, 0] * f[2, 2] - f[0, 2] * f[2, 0]) * d
    b[2, 1] = (f[0, 1] * f[2, 0] - f[0, 0] * f[2, 1]) * d
    b[0, 2] = (f[0, 1] * f[1, 2] - f[0, 2] * f[1, 1]) * d
    b[1, 2] = (f[0, 2] * f[1, 0] - f[0, 0] * f[1, 2]) * d
    b[2, 2] = (f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]) * d
    multiply(big_l, b, s)
    set_gradient(s, y)
    return True


@kernel
def _dilation(y: Array, offset: Array, beta: float, material: MaterialParameters, less: Array) -> float:
    """``tr D`` of the flow rule for the deviator of ``D - offset``."""
    for i in range(6):
        less[i] = y[6 + i] - offset[i]
    _, norm, det = deviator(less, less)
    _, _, support, _, _ = normal(material.surface, material.sin_phi, det)
    return dilation(beta, norm, support, material)


@kernel
def follow_steps(
    t0: float,
    t1: float,
    n: int,
    y: Array,
    material: MaterialParameters,
    tide: TidePanels,
    brittle: bool,
    summary: Array,
) -> bool:
    """Carry the state ``y[15]`` from `t0` to `t1` in `n` equal steps; False if an impulse could not be found.

    ``summary[4]`` gets the start of the first and the end of the last step that flowed (-1 if none), the
    number of steps that flowed, and the number without contact.
    """
    work = empty_buffers()
    jac = np.zeros((15, 15))
    pivots = np.zeros(15, dtype=np.int64)
    spare = np.zeros(36)
    offset = np.zeros(6)
    less = np.zeros(6)
    kicked = np.zeros(N_FULL)
    gap = 0.0
    last = np.zeros((3, 3))
    gradient(y, last)
    h = (t1 - t0) / n
    contact = 1.0  # V/V0 at which the grains touch
    summary[0] = summary[1] = -1.0
    summary[2] = summary[3] = 0.0
    touching = True
    for step in range(n):
        t = t0 + (step + 0.5) * h
        if not drift(0.5 * h, y, work):
            return False
        gravity_terms(t, y, tide, work)
        big_l = work.m[W_L]
        gradient(y, big_l)
        for i in range(3):
            for j in range(3):
                big_l[i, j] += h * work.m[W_K, i, j]
        set_gradient(big_l, y)
        volume = np.sqrt(determinant(y[0:6]))
        if step == 0:  # volumes are compared at the kicks: the drift of a spinning body opens it a little
            contact = volume
        beta, _ = dilatancy(contact, material)
        did = FREE
        for turn in range(1 if touching else 4):
            # The drift to the next kick is 1 + h L, of mean gradient L - h L^2/2: that is what must obey the law
            # of friction, and L^2 of the last step is near enough, except where the grains meet: there it is that
            # of the impulse itself, by iteration. What volume error is left is undone, again except there: what
            # the grains overlap would throw them apart.
            multiply(last, last, work.m[W_A])
            pack(work.m[W_A], offset)
            for i in range(6):
                offset[i] *= 0.5 * h
            if turn == 0:
                copy(y, kicked, N_FULL)
                gap = np.log(contact / volume) / h
            else:
                copy(kicked, y, N_FULL)
            for i in range(3):
                offset[i] += gap / 3.0
            # Only grains that cohere bear a tension: whether it is too much, the impulse says.
            free = not (touching and material.cohesion > 0.0)
            if free and y[6] + y[7] + y[8] - offset[0] - offset[1] - offset[2] >= _dilation(
                y, offset, beta, material, less
            ):
                did = FREE
                break
            if not touching and turn == 0:
                contact = volume
                beta, _ = dilatancy(contact, material)
                gap = 0.0
                for i in range(3):
                    offset[i] = 0.0
            impulse = friction_impulse(y, material, h, offset, work, jac, pivots, spare)
            did = impulse.outcome
            material = on_part(material, impulse.part, material.fan_limit)
            if did == FAILED:
                return False
            gradient(y, last)
        gradient(y, last)
        touching = did != FREE
        if did == SLIDING:
            contact *= np.exp(h * _dilation(y, offset, beta, material, less))
            if brittle:
                material = without_cohesion(material)
            if summary[2] == 0.0:
                summary[0] = t - 0.5 * h
            summary[1] = t + 0.5 * h
            summary[2] += 1.0
        elif did != REST:
            summary[3] += 1.0
        if not drift(0.5 * h, y, work):
            return False
    return True
