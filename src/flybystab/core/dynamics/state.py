"""State of a body, parameters of a run and scratch of its rates.

Kernels work in the units of the body: length ``a0 = (a1 a2 a3)^(1/3)``, time ``1/sqrt(pi G rho0)`` at the
initial density, stress in the form ``T = 5 sigma/rho``. Then ``det S = (V/V0)^2``. Two states:

RIGID, 7 numbers: unit quaternion (body axes -> fixed frame, scalar first), ``omega`` along the body axes.
Every other regime, 15 numbers, fixed frame: ``S`` (6 components), ``D = sym L`` (6), ``w``: ``W x = w x x``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.ellipsoid.tide import COMPONENTS
from flybystab.core.material.parameters import MaterialParameters
from flybystab.core.numerics.jit import code, kernel
from flybystab.core.numerics.tensors import multiply, pack, unpack
from flybystab.typing import Array

RIGID = code(0)
FLOWING = code(1)
DISPERSED = code(2)
FLUID = code(3)

# Numbers in a state.
N_RIGID = code(7)
N_FULL = code(15)


class RigidShape(NamedTuple):
    """Squared semi-axes of a rigid body, and its self-gravity ``K_g,i = -2 (V0/V) A_i`` along them."""

    s1: float
    s2: float
    s3: float
    g1: float
    g2: float
    g3: float


class Parameters(NamedTuple):
    """Parameters of a run: the material, and the shape that the body has while it is rigid."""

    material: MaterialParameters
    rigid: RigidShape


@kernel
def rigid_shape(s1: float, s2: float, s3: float) -> RigidShape:
    """Shape record of squared semi-axes."""
    a1, a2, a3 = gravity_coefficients(s1, s2, s3)
    c = -2.0 / np.sqrt(s1 * s2 * s3)
    return RigidShape(s1, s2, s3, c * a1, c * a2, c * a3)


@kernel
def rigid_volume(shape: RigidShape) -> float:
    """``V/V0`` of the rigid body."""
    return np.sqrt(shape.s1 * shape.s2 * shape.s3)


# Matrices of `Buffers.m` that `gravity_terms` fills and the rates read.
W_SINV = 0
W_K = 1  # K_g + K_t
W_L = 2
W_R = 3  # K_g + K_t - L^2
W_S = 4
W_N = 5  # FLOWING: stress deviator over p sin(phi) + c cos(phi)
W_A = 6
W_B = 7
W_VECTORS = 8
W_SCRATCH = 9
W_FACE = 10  # difference of N at the compression and at the extension corner
# Scratch of `flybystab.core.dynamics.jacobian`.
J_RATE = 11
J_UNIT = 12
J_SQUARE = 13
J_STRESS = 14
J_SLIP = 15
J_FACE = 16
J_ACROSS = 17
J_CHANGE = 18
J_TURN = 19
J_PRODUCT = 20
J_NORMAL = 21
N_WORK = 22


# Components of `Buffers.c`.
TIDE = 0  # tidal tensor at the time of the last rate
OTHER = 1  # a second tensor: the tide along the body axes, or at another time; the rate of strain before an impulse
UNIT = 2  # unit deviator of the rate of strain

# Numbers of `Buffers.s` that `gravity_terms` and the rates leave.
VOLUME = 0  # V/V0
STRENGTH = 1  # k P + k c
PRESSURE = 2
DETERMINANT = 3  # of the unit stress deviator
PLACE = 4  # of the stress on a face, between the corners (0: extension, 1: compression)
BEYOND_FACE = 5  # Lode angle of D beyond the normal of the face, rad
N_NUMBERS = 6


class Buffers(NamedTuple):
    """Scratch of the rates: matrices ``m[N_WORK, 3, 3]``, components ``c[3, 6]`` and numbers ``s[N_NUMBERS]``."""

    m: Array
    c: Array
    s: Array


@kernel
def empty_buffers() -> Buffers:
    """Fresh scratch."""
    return Buffers(np.zeros((N_WORK, 3, 3)), np.zeros((3, 6)), np.zeros(N_NUMBERS))


@kernel
def rotation_matrix(q: Array, m: Array) -> None:
    """Rotation matrix ``m[3, 3]`` (body -> fixed) of a quaternion that need not be normalised."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    m[0, 0] = 1.0 - s * (y * y + z * z)
    m[1, 1] = 1.0 - s * (x * x + z * z)
    m[2, 2] = 1.0 - s * (x * x + y * y)
    m[0, 1] = s * (x * y - w * z)
    m[1, 0] = s * (x * y + w * z)
    m[0, 2] = s * (x * z + w * y)
    m[2, 0] = s * (x * z - w * y)
    m[1, 2] = s * (y * z - w * x)
    m[2, 1] = s * (y * z + w * x)


@kernel
def rotated_to_body(q: Array, k: Array, m: Array, out: Array) -> None:
    """Components ``out[6]`` along the body axes of a fixed-frame tensor ``k[6]``; `m` is scratch (3, 3)."""
    rotation_matrix(q, m)
    for a in range(3):
        # row a of m^T K
        u0 = m[0, a] * k[0] + m[1, a] * k[3] + m[2, a] * k[4]
        u1 = m[0, a] * k[3] + m[1, a] * k[1] + m[2, a] * k[5]
        u2 = m[0, a] * k[4] + m[1, a] * k[5] + m[2, a] * k[2]
        out[a] = u0 * m[0, a] + u1 * m[1, a] + u2 * m[2, a]
        if a == 0:
            out[3] = u0 * m[0, 1] + u1 * m[1, 1] + u2 * m[2, 1]
            out[4] = u0 * m[0, 2] + u1 * m[1, 2] + u2 * m[2, 2]
        elif a == 1:
            out[5] = u0 * m[0, 2] + u1 * m[1, 2] + u2 * m[2, 2]


@kernel
def to_fixed_frame(y: Array, rigid: RigidShape, m: Array, shape: Array, spin: Array) -> None:
    """Write ``S`` (``shape[6]``) and ``w`` (``spin[3]``) of a RIGID state; ``m[3, 3]`` gets the rotation."""
    rotation_matrix(y, m)
    s1, s2, s3 = rigid.s1, rigid.s2, rigid.s3
    for c, (i, j) in enumerate(COMPONENTS):
        shape[c] = s1 * m[i, 0] * m[j, 0] + s2 * m[i, 1] * m[j, 1] + s3 * m[i, 2] * m[j, 2]
    for i in range(3):
        spin[i] = m[i, 0] * y[4] + m[i, 1] * y[5] + m[i, 2] * y[6]


@kernel
def gradient(y: Array, out: Array) -> None:
    """Velocity gradient ``L = D + W`` of a 15-number state."""
    unpack(y[6:12], out)
    out[0, 1] -= y[14]
    out[1, 0] += y[14]
    out[0, 2] += y[13]
    out[2, 0] -= y[13]
    out[1, 2] -= y[12]
    out[2, 1] += y[12]


@kernel
def set_gradient(m: Array, y: Array) -> None:
    """Store ``D`` and ``w`` of a velocity gradient ``m[3, 3]`` in a 15-number state, or of its rate."""
    pack(m, y[6:12])
    y[12] = 0.5 * (m[2, 1] - m[1, 2])
    y[13] = 0.5 * (m[0, 2] - m[2, 0])
    y[14] = 0.5 * (m[1, 0] - m[0, 1])


@kernel
def angular_momentum(y: Array, work: Buffers, h: Array) -> None:
    """Angular momentum ``H = axial(L S - S L^T)`` about the centre, per ``m/5``, of a 15-number state."""
    big_l = work.m[W_L]
    gradient(y, big_l)
    unpack(y[0:6], work.m[W_S])
    multiply(big_l, work.m[W_S], work.m[W_A])
    a = work.m[W_A]
    # H = int rho x x (L x) = axial vector of (L I) - (L I)^T
    h[0] = a[2, 1] - a[1, 2]
    h[1] = a[0, 2] - a[2, 0]
    h[2] = a[1, 0] - a[0, 1]
