"""A second integrator, without event location: time stepping with a set-valued friction law (after Moreau 1999).

Each step drifts for half its length (free motion, in closed form: ``x -> (1 + t L) x``), kicks, and drifts again. The
kick adds ``h K`` to ``L`` and then the impulse of :mod:`flybystab.core.dynamics.impulse`, whose solution is rest,
sliding or loss of contact: yield, arrest and contact need no event location. Without a tide the angular momentum about
the centre is conserved to rounding. The shape of a rigid body is conserved to second order in the step; plastic flow is
of first order, and its error is measured by halving the step.

Self-gravity, tide and yield surfaces are those of :mod:`flybystab.core.dynamics.regimes`; nothing else is shared.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.impulse import (
    FAILED,
    FREE,
    REST,
    SLIDING,
    ImpulseRoom,
    friction_impulse,
    impulse_room,
)
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
    """Free motion for a time `h`: ``S -> F S F^T``, ``L -> L F^-1``, ``F = 1 + h L``; False if ``det F <= 0``."""
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
def _dilation(
    y: Array, offset: Array, beta: float, material: MaterialParameters, relative_rate: Array
) -> float:
    """``tr D`` of the flow rule for the deviator of ``D - offset``."""
    for i in range(6):
        relative_rate[i] = y[6 + i] - offset[i]
    _, norm, det = deviator(relative_rate, relative_rate)
    _, _, support, _, _ = normal(material.surface, material.sin_phi, det)
    return dilation(beta, norm, support, material)


class Steps(NamedTuple):
    """Summary of a run.

    Attributes
    ----------
    done : bool
        True if `t1` was reached; False if the solver of an impulse failed or a drift had ``det(1 + h L) <= 0``.
    first, last : float
        Start of the first and end of the last step with plastic flow; -1 if there is none.
    flowing, free : int
        Number of steps with plastic flow, and of those without contact.
    """

    done: bool
    first: float
    last: float
    flowing: int
    free: int


class _Grains(NamedTuple):
    """State of the contacts between the grains after a step."""

    material: MaterialParameters
    volume: float  # V/V0 at which the grains are in contact
    touching: bool
    outcome: int  # of the last impulse


class _Scratch(NamedTuple):
    """Buffers of a run."""

    work: Buffers
    room: ImpulseRoom
    offset: Array
    deviator: Array
    kicked: Array  # state before the impulse
    last: Array  # velocity gradient after the last impulse


@kernel
def _scratch() -> _Scratch:
    """Fresh buffers."""
    return _Scratch(
        empty_buffers(), impulse_room(), np.zeros(6), np.zeros(6), np.zeros(N_FULL), np.zeros((3, 3))
    )


@kernel
def _kick(t: float, h: float, y: Array, tide: TidePanels, work: Buffers) -> None:
    """Add ``h (K_g + K_t)`` to ``L``."""
    gravity_terms(t, y, tide, work)
    big_l = work.m[W_L]
    gradient(y, big_l)
    for i in range(3):
        for j in range(3):
            big_l[i, j] += h * work.m[W_K, i, j]
    set_gradient(big_l, y)


@kernel
def _impulse(y: Array, h: float, grains: _Grains, scratch: _Scratch) -> _Grains:
    """Apply the impulse of friction to the state ``y[15]`` after a kick.

    The drift to the next kick is ``1 + h L``, of mean velocity gradient ``L - h L^2/2`` to second order: the friction
    law is imposed on its symmetric part. ``L^2`` is taken from the last step; at the step in which contact is regained
    it is that of the impulse itself, by fixed-point iteration. The error ``ln(contact/volume)`` of the volume is
    removed over the step, but not at the step in which contact is regained, where the correction would add kinetic
    energy.
    """
    material, contact, touching, outcome = grains
    work, _, offset, relative_rate, kicked, last = scratch
    volume = np.sqrt(determinant(y[0:6]))
    beta, _ = dilatancy(contact, material)
    gap = 0.0
    for turn in range(1 if touching else 4):
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
        # Opening ends the contact, unless there is cohesion: then the impulse tests the tensile strength.
        free = not (touching and material.cohesion > 0.0)
        opening = y[6] + y[7] + y[8] - offset[0] - offset[1] - offset[2]
        if free and opening >= _dilation(y, offset, beta, material, relative_rate):
            outcome = FREE
            break
        if not touching and turn == 0:
            contact = volume
            beta, _ = dilatancy(contact, material)
            gap = 0.0
            for i in range(3):
                offset[i] = 0.0
        impulse = friction_impulse(y, material, h, offset, work, scratch.room)
        outcome = impulse.outcome
        material = on_part(material, impulse.part, material.fan_limit)
        if outcome == FAILED:
            break
        gradient(y, last)
    gradient(y, last)
    if outcome == SLIDING:
        contact *= np.exp(h * _dilation(y, offset, beta, material, relative_rate))
    return _Grains(material, contact, outcome != FREE, outcome)


@kernel
def follow_steps(
    t0: float, t1: float, n: int, y: Array, material: MaterialParameters, tide: TidePanels, brittle: bool
) -> Steps:
    """Integrate the state ``y[15]`` from `t0` to `t1` in `n` equal steps."""
    scratch = _scratch()
    gradient(y, scratch.last)
    h = (t1 - t0) / n
    grains = _Grains(material, 1.0, True, FREE)
    first = last = -1.0
    flowing = free = 0
    for step in range(n):
        t = t0 + (step + 0.5) * h
        if not drift(0.5 * h, y, scratch.work):
            return Steps(False, first, last, flowing, free)
        _kick(t, h, y, tide, scratch.work)
        # Volumes are compared at the kicks: half a drift of a spinning body raises the volume to second order.
        if step == 0:
            grains = _Grains(material, np.sqrt(determinant(y[0:6])), True, FREE)
        grains = _impulse(y, h, grains, scratch)
        if grains.outcome == FAILED:
            return Steps(False, first, last, flowing, free)
        if grains.outcome == SLIDING:
            if brittle:
                grains = _Grains(
                    without_cohesion(grains.material), grains.volume, grains.touching, grains.outcome
                )
            if flowing == 0:
                first = t - 0.5 * h
            last = t + 0.5 * h
            flowing += 1
        elif grains.outcome != REST:
            free += 1
        if not drift(0.5 * h, y, scratch.work):
            return Steps(False, first, last, flowing, free)
    return Steps(True, first, last, flowing, free)
