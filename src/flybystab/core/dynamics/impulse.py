"""Friction impulse: the effect of a set-valued yield law on a velocity gradient at one instant.

``Delta L = -That S^-1`` with ``That = -Phat 1 + (k Phat + chat) Dhat``, where ``Dhat`` is the direction of the
deviatoric rate of strain *after* the impulse (for associative flow on ``k(theta)``, ``That`` is the point of the yield
surface with the normal ``Dhat``) and ``Phat`` is such that ``tr D`` after the impulse obeys the flow rule. Rest: the
``That`` that makes ``D`` zero is inside the yield surface. Free: the flow rule is met or exceeded with ``Phat = 0``.
``That`` is symmetric, so that the angular momentum is conserved; the kinetic energy does not increase.

It is the impulse by which a dispersed body regains contact (theory, section 3), and one step of the time-stepping
integrator of :mod:`flybystab.core.dynamics.moreau`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.dynamics.state import (
    OTHER,
    TIDE,
    UNIT,
    W_A,
    W_B,
    W_L,
    W_N,
    W_S,
    W_SINV,
    Buffers,
    gradient,
    set_gradient,
)
from flybystab.core.dynamics.workspace import copy
from flybystab.core.ellipsoid.tide import COMPONENTS
from flybystab.core.material.flow_rule import dilatancy, dilation, flow_stress, isotropic
from flybystab.core.material.mohr_coulomb_hexagon import on_hexagon
from flybystab.core.material.parameters import (
    COMPRESSION_CORNER,
    EXTENSION_CORNER,
    FACE,
    SMOOTH,
    MaterialParameters,
    on_part,
    with_friction,
)
from flybystab.core.material.yield_surface import beyond_face, corner, flow_direction, slope_over_sine
from flybystab.core.numerics.jit import code, kernel
from flybystab.core.numerics.lu import factorise, solve
from flybystab.core.numerics.tensors import determinant, deviator, inverse, multiply, pack, unpack
from flybystab.typing import Array

# Outcomes of an impulse.
FREE = code(0)
REST = code(1)
SLIDING = code(2)
FAILED = code(3)


class RestImpulse(NamedTuple):
    """Invariants of the impulse required for rest, and its excess over the yield surface."""

    p: float
    norm: float  # of its deviator
    det: float  # of its unit deviator
    excess: float  # as a rate of strain


class Contact(NamedTuple):
    """Outcome of an impulse, and the part of the yield section on which its stress lies."""

    outcome: int  # FREE, REST, SLIDING or FAILED
    part: int


class ImpulseRoom(NamedTuple):
    """Scratch of `friction_impulse`: Newton's method for the unknowns of a sliding impulse (`_residual`)."""

    x: Array  # unknowns: deviator of D (6), Phat, place of the stress on a face
    kept: Array  # the last solution of the continuation in the friction
    step: Array
    residual: Array
    moved: Array  # residual at a displaced point
    jac: Array
    pivots: NDArray[np.int64]
    spin: Array  # after an impulse to rest


# Unknowns and equations 6 and 7 of a sliding impulse; 0 to 5 are the deviator of ``D`` and its balance.
_PRESSURE, _PLACE = 6, 7


@kernel
def impulse_room() -> ImpulseRoom:
    """Fresh scratch."""
    return ImpulseRoom(
        np.zeros(8),
        np.zeros(8),
        np.zeros(8),
        np.zeros(8),
        np.zeros(8),
        np.zeros((8, 8)),
        np.zeros(8, dtype=np.int64),
        np.zeros(3),
    )


class ImpulseProblem(NamedTuple):
    """Equations of a sliding impulse (`_residual`): ``D`` before it, coefficients and scratch."""

    d_star: Array
    beta: float
    cos_c: float
    scale: float  # of the rates of strain
    work: Buffers
    room: ImpulseRoom


@kernel
def rest_spin(y: Array, s: Array, big_l: Array, work: Buffers, w: Array) -> None:
    """Spin ``w[3]`` of the rigid rotation with the angular momentum of ``big_l`` (``J w = H``)."""
    a = work.m[W_A]
    multiply(big_l, s, a)
    h0, h1, h2 = a[2, 1] - a[1, 2], a[0, 2] - a[2, 0], a[1, 0] - a[0, 1]
    # J = tr S 1 - S
    c = work.c[UNIT]
    c[0], c[1], c[2] = y[1] + y[2], y[0] + y[2], y[0] + y[1]
    c[3], c[4], c[5] = -y[3], -y[4], -y[5]
    inverse(c, a)
    for i in range(3):
        w[i] = a[i, 0] * h0 + a[i, 1] * h1 + a[i, 2] * h2


@kernel
def _residual(x: Array, material: MaterialParameters, problem: ImpulseProblem, f: Array) -> float:
    """Equations of the sliding impulse; returns its strength ``Phat sin + chat cos``.

    ``x`` holds the deviator of D afterwards, Phat and, on a face of Mohr-Coulomb, the place of the stress between
    its corners. ``D - sym L* - Phat S^-1 + (Phat sin + chat cos) sym(N S^-1) = 0`` and ``tr x = 0``, with ``N`` the
    stress deviator of `flow_stress` and ``tr D`` the `dilation` of ``x``; on a face ``x`` is normal to it.
    """
    work, d_star = problem.work, problem.d_star
    n, b, sinv = work.m[W_N], work.m[W_B], work.m[W_SINV]
    unit = work.c[UNIT]
    norm, _, support, _ = flow_stress(x[0:6], material, unit, n)
    if material.part == FACE:
        det = determinant(unit)
        f[_PLACE] = norm * beyond_face(material.sin_phi, det)
        p1, p2, _, _, _ = corner(material.sin_phi, det, False)
        isotropic(p1, p2, unit, b)
        for i in range(3):
            for j in range(3):
                n[i, j] += x[_PLACE] * (b[i, j] - n[i, j])
    multiply(n, sinv, b)
    p = x[_PRESSURE]
    strength = material.sin_phi * p + problem.cos_c
    mean = dilation(problem.beta, norm, support, material) / 3.0
    f[0] = x[0] + mean - d_star[0] - p * sinv[0, 0] + strength * b[0, 0]
    f[1] = x[1] + mean - d_star[1] - p * sinv[1, 1] + strength * b[1, 1]
    f[2] = x[2] + mean - d_star[2] - p * sinv[2, 2] + strength * b[2, 2]
    f[3] = x[3] - d_star[3] - p * sinv[0, 1] + 0.5 * strength * (b[0, 1] + b[1, 0])
    f[4] = x[4] - d_star[4] - p * sinv[0, 2] + 0.5 * strength * (b[0, 2] + b[2, 0])
    f[5] = x[5] - d_star[5] - p * sinv[1, 2] + 0.5 * strength * (b[1, 2] + b[2, 1])
    f[_PRESSURE] = x[0] + x[1] + x[2]
    return strength


@kernel
def friction_impulse(
    y: Array,
    material: MaterialParameters,
    duration: float,
    offset: Array,
    work: Buffers,
    room: ImpulseRoom,
) -> Contact:
    """Apply the impulse to the state ``y[15]``.

    Parameters
    ----------
    duration : float
        Time over which cohesion acts; 0 for an instant.
    offset : ndarray (6,)
        Rate of strain that counts as rest; the friction law holds for ``D`` less this.
    work, room : Buffers, ImpulseRoom
        Scratch.
    """
    x = room.x
    s, sinv, before = work.m[W_S], work.m[W_SINV], work.m[W_L]
    unpack(y[0:6], s)
    volume = np.sqrt(inverse(y[0:6], sinv))
    gradient(y, before)
    for c, (i, j) in enumerate(COMPONENTS):
        before[i, j] -= offset[c]
        if i != j:
            before[j, i] -= offset[c]
    beta, _ = dilatancy(volume, material)
    cos_c = material.cos_phi * material.cohesion * volume * duration
    # The impulse required for rest is That = (L - W) S; the outcome is REST if it is inside the yield surface.
    that = work.c[TIDE]
    w = room.spin
    _impulse_to_rest(y, s, before, work, w, that)
    p, norm, det = deviator(that, work.c[UNIT])
    g = slope_over_sine(material.surface, material.sin_phi, det)
    if norm <= g * (p * material.sin_phi + cos_c):
        for i in range(6):
            y[6 + i] = offset[i]
        y[12], y[13], y[14] = w[0], w[1], w[2]
        return Contact(REST, material.part)
    d_star = work.c[OTHER]
    for i in range(6):
        d_star[i] = y[6 + i] - offset[i]
    trace_sinv = sinv[0, 0] + sinv[1, 1] + sinv[2, 2]
    mean, start, _ = deviator(d_star, work.c[UNIT])
    scale = start + abs(mean) + abs(p) * trace_sinv
    excess = (norm - g * (p * material.sin_phi + cos_c)) * trace_sinv / 3.0
    problem = ImpulseProblem(d_star, beta, cos_c, scale, work, room)
    found, part = _sliding_impulse(that, RestImpulse(p, norm, det, excess), mean, start, material, problem)
    material = on_part(material, part, material.fan_limit)
    if not found:
        return Contact(FAILED, part)
    strength = _residual(x, material, problem, room.residual)
    if strength < 0.0 or (material.sin_phi == 0.0 and material.cohesion == 0.0 and x[_PRESSURE] < 0.0):
        return Contact(FREE, part)
    # Delta L = Phat S^-1 - (Phat sin + chat cos) N S^-1; b = N S^-1 is left by the residual.
    b = work.m[W_B]
    for i in range(3):
        for j in range(3):
            before[i, j] += x[_PRESSURE] * sinv[i, j] - strength * b[i, j]
    set_gradient(before, y)
    for i in range(6):
        y[6 + i] += offset[i]
    return Contact(SLIDING, part)


@kernel
def _impulse_to_rest(y: Array, s: Array, before: Array, work: Buffers, w: Array, that: Array) -> None:
    """Write the impulse ``that[6]`` that would bring ``L = before`` to rest, and the spin ``w[3]`` after it."""
    rest_spin(y, s, before, work, w)
    a = work.m[W_A]
    n = work.m[W_N]
    for i in range(3):
        for j in range(3):
            n[i, j] = before[i, j]
    n[0, 1] += w[2]
    n[1, 0] -= w[2]
    n[0, 2] -= w[1]
    n[2, 0] += w[1]
    n[1, 2] += w[0]
    n[2, 1] -= w[0]
    multiply(n, s, a)
    pack(a, that)


@kernel
def _sliding_impulse(
    that: Array,
    rest: RestImpulse,
    mean: float,
    start: float,
    material: MaterialParameters,
    problem: ImpulseProblem,
) -> tuple[bool, int]:
    """Solve the equations of sliding for ``room.x``; returns True if a solution was found, and its part of the section.

    Two guesses are tried, by Newton's method and then by continuation: near rest, ``D'`` along the deviator of the
    impulse required for rest, of a size proportional to its excess; far from it, ``D`` before the impulse, with
    ``-tr D/3`` = `mean` and ``|D'|`` = `start`.
    """
    work, d_star, x = problem.work, problem.d_star, problem.room.x
    sinv = work.m[W_SINV]
    trace_sinv = sinv[0, 0] + sinv[1, 1] + sinv[2, 2]
    hexagon = on_hexagon(material)
    first = EXTENSION_CORNER if hexagon and material.part == SMOOTH else material.part
    part = first
    # The continuation takes up to a hundred times as long as Newton's method from a guess: it is tried last.
    for guess in range(4):
        for turn in range(3 if hexagon else 1):
            part = first if turn == 0 else part % 3 + 1
            m = on_part(material, part, material.fan_limit)
            if guess % 2 == 0:
                _along_rest(that, rest, m, x, work)
            elif start > 0.0:
                for i in range(6):
                    x[i] = d_star[i] + (mean if i < 3 else 0.0)
                x[_PRESSURE] = max(0.0, 3.0 * mean / trace_sinv)
                x[_PLACE] = 0.5
            else:
                continue
            found = _newton(m, problem) if guess < 2 else _by_weaker_friction(m, problem)
            if found and (not hexagon or _belongs(x, m, work)):
                return True, part
    return False, part


@kernel
def _along_rest(
    that: Array, rest: RestImpulse, material: MaterialParameters, x: Array, work: Buffers
) -> None:
    """First guess ``x[8]``: ``D'`` along the impulse required for rest, of a size proportional to its excess."""
    unit, n = work.c[UNIT], work.m[W_N]
    for i in range(6):
        unit[i] = (that[i] + (rest.p if i < 3 else 0.0)) / rest.norm
    a, b = 1.0, 0.0
    if material.normal:
        a, b, _ = flow_direction(material.surface, material.sin_phi, rest.det)
    isotropic(a, b, unit, n)
    pack(n, x[0:6])
    for i in range(6):
        x[i] *= rest.excess
    x[_PRESSURE] = rest.p
    x[_PLACE] = 0.5


@kernel
def _by_weaker_friction(material: MaterialParameters, problem: ImpulseProblem) -> bool:
    """`_newton` by continuation in ``sin(phi)`` up to its value, with steps that adapt; True if it is reached."""
    x, kept = problem.room.x, problem.room.kept
    copy(x, kept, 8)
    fraction_reached, increment = 0.0, 0.5
    for _ in range(80):
        trial_fraction = min(1.0, fraction_reached + increment)
        if _newton(with_friction(material, material.sin_phi * trial_fraction), problem):
            fraction_reached = trial_fraction
            copy(x, kept, 8)
            increment *= 2.0
        else:
            copy(kept, x, 8)
            increment *= 0.5
        if fraction_reached == 1.0 or increment < 1e-6:
            break
    return fraction_reached == 1.0


@kernel
def _belongs(x: Array, material: MaterialParameters, work: Buffers) -> bool:
    """True if a solution is consistent with its part of the hexagon: within the face, or in the fan of the corner."""
    part = material.part
    if part == FACE:
        return -1e-9 <= x[_PLACE] <= 1.0 + 1e-9
    _, _, det = deviator(x[0:6], work.c[UNIT])
    past = beyond_face(material.sin_phi, det)
    return past >= -1e-9 if part == COMPRESSION_CORNER else past <= 1e-9


@kernel
def _newton(material: MaterialParameters, problem: ImpulseProblem) -> bool:
    """Solve `_residual` for ``room.x`` from the guess in it; the position of the stress is unknown on a face only."""
    room, scale = problem.room, problem.scale
    x, trial, f, moved, jac, pivots = room.x, room.step, room.residual, room.moved, room.jac, room.pivots
    m = 8 if material.part == FACE else 7
    for turn in range(60):
        _residual(x, material, problem, f)
        _, size, _ = deviator(x[0:6], problem.work.c[UNIT])
        if not size > 1e-300:
            return False
        for j in range(m):
            delta = (
                1e-7 * size
                if j < 6
                else 1e-7 * max(abs(x[_PRESSURE]), 1e-6 * scale)
                if j == _PRESSURE
                else 1e-7
            )
            saved = x[j]
            x[j] = saved + delta
            delta = x[j] - saved
            _residual(x, material, problem, moved)
            x[j] = saved
            for i in range(m):
                jac[i, j] = (moved[i] - f[i]) / delta
            if turn < 8:
                continue
            # Where D stays at the kink of k(theta) at a corner (a sphere without spin), the residual has no derivative:
            # with a one-sided quotient each step leaves a fixed fraction of the error. Central differences converge.
            x[j] = saved - delta
            _residual(x, material, problem, moved)
            x[j] = saved
            for i in range(m):
                jac[i, j] = 0.5 * (jac[i, j] + (f[i] - moved[i]) / delta)
        for i in range(m):
            trial[i] = -f[i]
        if not factorise(jac, m, pivots):
            return False
        solve(jac, m, pivots, trial)
        step = 0.0
        along = 0.0
        for i in range(6):
            weight = 1.0 if i < 3 else 2.0
            step += weight * trial[i] * trial[i]
            along += weight * trial[i] * x[i]
        step = np.sqrt(step)
        if not step < np.inf:
            return False
        # Damping: one iteration turns the direction of x by at most half a radian and reduces |x| by at most half.
        across = np.sqrt(max(0.0, step * step - (along / size) ** 2))
        fraction = 1.0
        if along < -0.5 * size * size:
            fraction = min(fraction, -0.5 * size * size / along)
        if across > 0.5 * (size + max(0.0, along / size)):
            fraction = min(fraction, 0.5 * (size + max(0.0, along / size)) / across)
        for i in range(m):
            x[i] += fraction * trial[i]
        # At the kink the error of the Lode angle, an arcsine near +-1, is the square root of the rounding error.
        if fraction == 1.0 and step <= max(1e-12 * size, (1e-15 if turn < 20 else 1e-9) * scale):
            return True
    return False
