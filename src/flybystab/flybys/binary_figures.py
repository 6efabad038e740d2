"""Figures of the components of a binary: quadrupoles of primary and companion, and the rotation of the companion.

With the second moments ``S`` over the mass of a body (``int x x dm/m``) the mutual potential to second order is

    V = -G m1 m2 [1/d + q1(d) + q2(d)],      q(d) = (3 d.S d - d^2 tr S)/(2 d^5),

so that the separation obeys ``d'' = G (m1 + m2) grad(1/d + q1 + q2) + K d``. The companion rotates by Euler's equations
under the torque on its second moments by the tidal tensors of the encounter and of the primary as a point mass
(MacCullagh's torque). The primary rotates fast about a fixed pole, about which its figure is averaged. All arrays are
over the members of a sample, in any consistent units.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.typing import Array


class Figures(NamedTuple):
    """Figures of the two bodies.

    Attributes
    ----------
    primary : ndarray (n, 3, 3)
        Second moments over the mass in the frame of the encounter, constant; zero for a point mass.
    companion : ndarray (3,)
        Principal second moments over the mass, greatest first.
    mass_fraction : float
        Mass of the primary over that of both.
    """

    primary: Array
    companion: Array
    mass_fraction: float


def averaged(axes: Array, poles: Array) -> Array:
    """Second moments (n, 3, 3) of an ellipsoid averaged over its rotation about its shortest axis along `poles`."""
    equatorial, polar = (axes[0] ** 2 + axes[1] ** 2) / 10.0, axes[2] ** 2 / 5.0
    along = np.einsum("ni,nj->nij", poles, poles)
    return equatorial * np.eye(3) + (polar - equatorial) * along


def quadrupole_field(second: Array, x: Array) -> Array:
    """``grad q`` (n, 3) at the separations `x` (n, 3) for second moments (n, 3, 3)."""
    r2 = np.sum(x * x, axis=1)
    r = np.sqrt(r2)
    moment = np.einsum("nij,nj->ni", second, x)
    trace = np.trace(second, axis1=1, axis2=2)
    along = np.sum(moment * x, axis=1)
    return (3.0 * moment - trace[:, None] * x) / (r2 * r2 * r)[:, None] - (
        2.5 * (3.0 * along - r2 * trace) / (r2**3 * r)
    )[:, None] * x


def rotation_matrices(q: Array) -> Array:
    """Matrices (n, 3, 3), body -> frame, of quaternions (n, 4), scalar first, of any length."""
    w, x, y, z = q.T / np.linalg.norm(q, axis=1)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def rates(y: Array, tide: Array, figures: Figures) -> Array:
    """Time derivatives of separation, velocity, quaternion and spin, ``(n, 13)``, with ``G (m1 + m2) = 1``.

    Parameters
    ----------
    y : ndarray (n, 13)
        The spin along the principal axes of the companion.
    tide : ndarray (3, 3)
        Tidal tensor of the encounter.
    figures : Figures
    """
    x, v, q, w = y[:, :3], y[:, 3:6], y[:, 6:10], y[:, 10:]
    r2 = np.sum(x * x, axis=1)
    r3 = r2 * np.sqrt(r2)
    turned = rotation_matrices(q)
    second = figures.companion
    own = np.einsum("nij,j,nkj->nik", turned, second, turned)
    out = np.empty_like(y)
    out[:, :3] = v
    out[:, 3:6] = -x / r3[:, None] + quadrupole_field(figures.primary + own, x) + x @ tide
    # tidal tensor on the companion along its axes, (f/d^3)(3 n n - 1) + K, f the mass fraction
    along = np.einsum("nij,ni->nj", turned, x)
    pull = figures.mass_fraction / r3
    off = 3.0 * (pull / r2)[:, None, None] * np.einsum("ni,nj->nij", along, along)
    field = off + np.einsum("nji,jk,nkl->nil", turned, tide, turned)
    # N_i = eps_ijk S_jl K_lk for diagonal S
    s1, s2, s3 = second
    torque = np.column_stack(
        [(s2 - s3) * field[:, 1, 2], (s3 - s1) * field[:, 2, 0], (s1 - s2) * field[:, 0, 1]]
    )
    moments = second.sum() - second
    out[:, 6] = -0.5 * np.sum(q[:, 1:] * w, axis=1)
    out[:, 7:10] = 0.5 * (q[:, :1] * w + np.cross(q[:, 1:], w))
    out[:, 10:] = (torque + np.cross(moments * w, w)) / moments
    return out


def synchronous(frames: Array, state: Array, rate: float) -> tuple[Array, Array]:
    """Attitudes (quaternions, scalar first) and spins of companions whose longest axis points to the primary.

    Parameters
    ----------
    frames : ndarray (n, 3, 3)
        Columns: two directions in the orbital plane and its normal.
    state : ndarray (n, 6)
    rate : float
        Spin rate about the normal, the shortest axis.
    """
    from scipy.spatial.transform import Rotation

    first = -state[:, :3] / np.linalg.norm(state[:, :3], axis=1)[:, None]
    normal = frames[:, :, 2]
    axes = np.stack([first, np.cross(normal, first), normal], axis=2)
    spin = np.tile([0.0, 0.0, rate], (len(state), 1))
    # scipy's scalar is the last component
    return np.roll(Rotation.from_matrix(axes).as_quat(), 1, axis=-1), spin
