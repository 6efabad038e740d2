"""Rigid bodies side by side: steps and stresses of `LANES` independent bodies in vector instructions.

The states of all bodies are stored as one state of ``7 LANES`` numbers: component 0 of all bodies, then component 1,
and so on. Each body has its own time, step and tide, in its own units. The loops over bodies are innermost, so that the
compiler makes one instruction of the same operation on several of them. The operations on a body are those of
:mod:`flybystab.core.dynamics.rates` and :mod:`flybystab.core.numerics.dop853` in the same order: its numbers are the
same to the last bit, whatever the other bodies are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.state import N_RIGID, RigidShape
from flybystab.core.dynamics.step_tide import N_POINTS, N_SCRATCH, SAMPLE_POINT, STAGE_POINT, step_tide
from flybystab.core.dynamics.workspace import N_SAMPLE, copy
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.dop853 import (
    E3,
    E5,
    FROM,
    N_EXTENDED,
    N_POWERS,
    N_STAGES,
    STAGE,
    WEIGHT,
    D,
    dense_state,
    error_norm,
)
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.typing import Array

#: Bodies side by side: two vectors of four numbers, or one of eight.
LANES = 8
#: Numbers in the states of all bodies.
N_LANES = N_RIGID * LANES

# Places in `Lanes.numbers`: states, their rates, tides; pressure, norm of the deviator and determinant of the unit
# deviator of the stresses; squared semi-axes and self-gravity along them. They are in one array, at places known to the
# compiler: it makes vector instructions only where it knows that results do not overwrite arguments.
_RATE, _TIDE = N_LANES, 2 * N_LANES
PRESSURE, NORM, DETERMINANT, _S1, _S2, _S3, _G1, _G2, _G3, _N_NUMBERS = (
    2 * N_LANES + (6 + k) * LANES for k in range(10)
)


class Lanes(NamedTuple):
    """Buffers of `LANES` bodies; the last axis runs over bodies, or over components of their states and bodies.

    Attributes
    ----------
    numbers : ndarray
        States at a point of the step, their rates, tides and stresses, and the shapes of the bodies.
    y, y1 : ndarray (N_LANES,)
        States at the start and at the end of the step.
    h : ndarray (N_LANES,)
        Length of the step of each number.
    k : ndarray (16, N_LANES)
        Rates of the stages.
    sums : ndarray (3, N_LANES)
        Error estimates of order 5 and 3 of a step, over its length; scratch.
    dense : ndarray (7, N_LANES)
        Interpolant of the step.
    tides : ndarray (N_POINTS, 6 * LANES)
        Tides at the points of the step.
    one_tide, scratch : ndarray
        Tide of one body at the points, and scratch, for `step_tide`.
    """

    numbers: Array
    y: Array
    y1: Array
    h: Array
    k: Array
    sums: Array
    dense: Array
    tides: Array
    one_tide: Array
    scratch: Array


@kernel
def empty_lanes() -> Lanes:
    """Fresh buffers, of spheres at rest."""
    lanes = Lanes(
        np.zeros(_N_NUMBERS),
        np.zeros(N_LANES),
        np.zeros(N_LANES),
        np.zeros(N_LANES),
        np.zeros((N_EXTENDED, N_LANES)),
        np.zeros((3, N_LANES)),
        np.zeros((N_POWERS, N_LANES)),
        np.zeros((N_POINTS, 6 * LANES)),
        np.zeros((6, N_POINTS)),
        np.zeros(N_SCRATCH),
    )
    for j in range(LANES):
        lanes.y[j] = 1.0
        lanes.numbers[_S1 + j] = lanes.numbers[_S2 + j] = lanes.numbers[_S3 + j] = 1.0
    return lanes


@kernel
def set_lane(lane: int, y: Array, rate: Array, rigid: RigidShape, lanes: Lanes) -> None:
    """Put a body with the state ``y[7]``, its `rate` and its shape in a lane."""
    for i in range(N_RIGID):
        lanes.y[i * LANES + lane] = y[i]
        lanes.k[0, i * LANES + lane] = rate[i]
    v = lanes.numbers
    v[_S1 + lane], v[_S2 + lane], v[_S3 + lane] = rigid.s1, rigid.s2, rigid.s3
    v[_G1 + lane], v[_G2 + lane], v[_G3 + lane] = rigid.g1, rigid.g2, rigid.g3


@kernel
def set_step(lane: int, t: float, h: float, tide: TidePanels, lanes: Lanes) -> None:
    """Set time and length of the next step of a body, and the tides at its points."""
    for i in range(N_RIGID):
        lanes.h[i * LANES + lane] = h
    step_tide(t, h, tide, lanes.scratch, lanes.one_tide)
    for point in range(N_POINTS):
        for j in range(6):
            lanes.tides[point, j * LANES + lane] = lanes.one_tide[j, point]


@inlined
def _tide_along_axes(v: Array, j: int) -> tuple[float, float, float, float, float, float]:
    """Tide of body `j` along its axes: components 11, 22, 33, 12, 13, 23, as `state.rotated_to_body`."""
    w, x, y, z = v[j], v[LANES + j], v[2 * LANES + j], v[3 * LANES + j]
    k0, k1, k2 = v[_TIDE + j], v[_TIDE + LANES + j], v[_TIDE + 2 * LANES + j]
    k3, k4, k5 = v[_TIDE + 3 * LANES + j], v[_TIDE + 4 * LANES + j], v[_TIDE + 5 * LANES + j]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    m00, m01, m02 = 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)
    m10, m11, m12 = s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)
    m20, m21, m22 = s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)
    u0 = m00 * k0 + m10 * k3 + m20 * k4
    u1 = m00 * k3 + m10 * k1 + m20 * k5
    u2 = m00 * k4 + m10 * k5 + m20 * k2
    k11 = u0 * m00 + u1 * m10 + u2 * m20
    k12 = u0 * m01 + u1 * m11 + u2 * m21
    k13 = u0 * m02 + u1 * m12 + u2 * m22
    u0 = m01 * k0 + m11 * k3 + m21 * k4
    u1 = m01 * k3 + m11 * k1 + m21 * k5
    u2 = m01 * k4 + m11 * k5 + m21 * k2
    k22 = u0 * m01 + u1 * m11 + u2 * m21
    k23 = u0 * m02 + u1 * m12 + u2 * m22
    u0 = m02 * k0 + m12 * k3 + m22 * k4
    u1 = m02 * k3 + m12 * k1 + m22 * k5
    u2 = m02 * k4 + m12 * k5 + m22 * k2
    return k11, k22, u0 * m02 + u1 * m12 + u2 * m22, k12, k13, k23


@kernel
def _write_rates(v: Array) -> None:
    """Rates of the states in the numbers `v`, as :func:`flybystab.core.dynamics.rates.rigid_rate`."""
    for j in range(LANES):
        w, x, y, z = v[j], v[LANES + j], v[2 * LANES + j], v[3 * LANES + j]
        w0, w1, w2 = v[4 * LANES + j], v[5 * LANES + j], v[6 * LANES + j]
        s1, s2, s3 = v[_S1 + j], v[_S2 + j], v[_S3 + j]
        _, _, _, k12, k13, k23 = _tide_along_axes(v, j)
        v[_RATE + 4 * LANES + j] = (k23 - w1 * w2) * (s2 - s3) / (s2 + s3)
        v[_RATE + 5 * LANES + j] = (k13 - w0 * w2) * (s3 - s1) / (s3 + s1)
        v[_RATE + 6 * LANES + j] = (k12 - w0 * w1) * (s1 - s2) / (s1 + s2)
        v[_RATE + j] = 0.5 * (-x * w0 - y * w1 - z * w2)
        v[_RATE + LANES + j] = 0.5 * (w * w0 + y * w2 - z * w1)
        v[_RATE + 2 * LANES + j] = 0.5 * (w * w1 + z * w0 - x * w2)
        v[_RATE + 3 * LANES + j] = 0.5 * (w * w2 + x * w1 - y * w0)


@kernel
def _write_stresses(v: Array) -> None:
    """Invariants of the stresses ``5 sigma/rho`` of the states in the numbers `v`, as `rates.rigid_invariants`."""
    for j in range(LANES):
        w0, w1, w2 = v[4 * LANES + j], v[5 * LANES + j], v[6 * LANES + j]
        s1, s2, s3 = v[_S1 + j], v[_S2 + j], v[_S3 + j]
        k11, k22, k33, k12, k13, k23 = _tide_along_axes(v, j)
        # Stress of rigid rotation (`rigid_stress.rigid_load`), and its deviator (`tensors.deviator`).
        spin2 = w0 * w0 + w1 * w1 + w2 * w2
        c0 = (v[_G1 + j] + k11 - w0 * w0 + spin2) * s1
        c1 = (v[_G2 + j] + k22 - w1 * w1 + spin2) * s2
        c2 = (v[_G3 + j] + k33 - w2 * w2 + spin2) * s3
        c3 = (k12 - w0 * w1) * 2.0 * s1 * s2 / (s1 + s2)
        c4 = (k13 - w0 * w2) * 2.0 * s1 * s3 / (s1 + s3)
        c5 = (k23 - w1 * w2) * 2.0 * s2 * s3 / (s2 + s3)
        p = -(c0 + c1 + c2) / 3.0
        c0, c1, c2 = c0 + p, c1 + p, c2 + p
        norm = np.sqrt(c0 * c0 + c1 * c1 + c2 * c2 + 2.0 * (c3 * c3 + c4 * c4 + c5 * c5))
        f = 1.0 / norm if norm > 0.0 else 0.0
        c0, c1, c2, c3, c4, c5 = c0 * f, c1 * f, c2 * f, c3 * f, c4 * f, c5 * f
        v[PRESSURE + j] = p
        v[NORM + j] = norm
        v[DETERMINANT + j] = c0 * (c1 * c2 - c5 * c5) - c3 * (c3 * c2 - c5 * c4) + c4 * (c3 * c5 - c1 * c4)


@kernel
def _write_stage(s: int, lanes: Lanes) -> None:
    """Write the states at which the rates of stage `s` are taken, as `dop853.stage_state`."""
    total, y, h, v = lanes.sums[2], lanes.y, lanes.h, lanes.numbers
    for i in range(N_LANES):
        total[i] = 0.0
    for m in range(FROM[s], FROM[s + 1]):
        a, rate = WEIGHT[m], lanes.k[STAGE[m]]
        for i in range(N_LANES):
            total[i] += a * rate[i]
    for i in range(N_LANES):
        v[i] = y[i] + h[i] * total[i]


@kernel
def _take_stage(s: int, lanes: Lanes) -> None:
    """State and rates of the stage `s`."""
    _write_stage(s, lanes)
    copy(lanes.tides[STAGE_POINT[s]], lanes.numbers[_TIDE:], 6 * LANES)
    _write_rates(lanes.numbers)
    copy(lanes.numbers[_RATE:], lanes.k[s], N_LANES)


@kernel
def lane_steps(lanes: Lanes) -> None:
    """Take a DOP853 step of each body, with error estimates and interpolant, as `steppers.explicit_step`."""
    k, y, y1, h = lanes.k, lanes.y, lanes.y1, lanes.h
    for s in range(1, N_STAGES + 1):
        _take_stage(s, lanes)
    copy(lanes.numbers, y1, N_LANES)
    five, three = lanes.sums[0], lanes.sums[1]
    for i in range(N_LANES):
        five[i] = 0.0
        three[i] = 0.0
    for s in range(N_STAGES + 1):
        e5, e3, rate = E5[s], E3[s], k[s]
        for i in range(N_LANES):
            five[i] += e5 * rate[i]
            three[i] += e3 * rate[i]
    for s in range(N_STAGES + 1, N_EXTENDED):
        _take_stage(s, lanes)
    first, last = k[0], k[N_STAGES]
    d0, d1, d2 = lanes.dense[0], lanes.dense[1], lanes.dense[2]
    for i in range(N_LANES):
        dy = y1[i] - y[i]
        d0[i] = dy
        d1[i] = h[i] * first[i] - dy
        d2[i] = 2.0 * dy - h[i] * (last[i] + first[i])
    for r in range(N_POWERS - 3):
        row = lanes.dense[3 + r]
        for i in range(N_LANES):
            row[i] = 0.0
        for s in range(N_EXTENDED):
            d, rate = D[r, s], k[s]
            if d != 0.0:
                for i in range(N_LANES):
                    row[i] += d * rate[i]
        for i in range(N_LANES):
            row[i] *= h[i]


@kernel
def lane_error(lane: int, h: float, tolerance: float, lanes: Lanes) -> float:
    """Error norm of the step of one body (accept at <= 1), as that of `rigid.follow_rigid`."""
    y, sums = lanes.y, lanes.sums
    spin = np.sqrt(y[4 * LANES + lane] ** 2 + y[5 * LANES + lane] ** 2 + y[6 * LANES + lane] ** 2)
    five = 0.0
    three = 0.0
    for i in range(N_RIGID):
        scale = tolerance if i < 4 else tolerance * max(spin, 0.1)
        five += (sums[0, i * LANES + lane] / scale) ** 2
        three += (sums[1, i * LANES + lane] / scale) ** 2
    if not np.isfinite(five + three):
        return np.inf
    return error_norm(five, three, N_RIGID, h)


@kernel
def lane_stresses(sample: int, lanes: Lanes) -> None:
    """Write the stresses at a sample of the step into ``lanes.numbers``."""
    dense_state(sample / N_SAMPLE, lanes.y, N_LANES, lanes.dense, lanes.numbers)
    copy(lanes.tides[SAMPLE_POINT[sample]], lanes.numbers[_TIDE:], 6 * LANES)
    _write_stresses(lanes.numbers)


@kernel
def advance(lane: int, lanes: Lanes) -> None:
    """Start the next step of a body at the end of this one, with its quaternion normalised."""
    y, y1 = lanes.y, lanes.y1
    s = 1.0 / np.sqrt(
        y1[lane] ** 2 + y1[LANES + lane] ** 2 + y1[2 * LANES + lane] ** 2 + y1[3 * LANES + lane] ** 2
    )
    for i in range(N_RIGID):
        y[i * LANES + lane] = y1[i * LANES + lane] * s if i < 4 else y1[i * LANES + lane]
        lanes.k[0, i * LANES + lane] = lanes.k[N_STAGES, i * LANES + lane]
