"""Attitudes of bodies at the start of an encounter, as rotation matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.typing import Array

#: Largest departure of ``A A^T`` of an attitude from 1.
ORTHOGONAL = 1e-8


@check_arguments
def periapsis_axes(encounter: Encounter) -> Array:
    """Rotation matrix, frame of the encounter -> periapsis frame (x periapsis, z angular momentum).

    For an attitude ``A`` (body axes -> ICRF) pass ``periapsis_axes(encounter) @ A`` to `flyby`.
    """
    return encounter.periapsis_axes


def about_z(angle: float) -> Array:
    """Matrix of the rotation by `angle` (rad) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_rates(y: Array, moments: Array, torque: Array | None = None) -> Array:
    """Time derivative of the rotation of a rigid body.

    Parameters
    ----------
    y : ndarray (7,)
        Quaternion, scalar first, body axes -> inertial frame; then the spin along the principal axes, rad/s.
    moments : ndarray (3,)
        Principal moments of inertia over the mass, m2.
    torque : ndarray (3,), optional
        Torque over the mass along the principal axes, m2/s2.

    Returns
    -------
    ndarray (7,)
        ``q' = q (0, w)/2`` and Euler's equations ``I w' = N - w x I w``.
    """
    (a, b, c, d), w = y[:4], y[4:]
    euler = np.cross(moments * w, w) if torque is None else torque - np.cross(w, moments * w)
    turn = [
        -b * w[0] - c * w[1] - d * w[2],
        a * w[0] + c * w[2] - d * w[1],
        a * w[1] + d * w[0] - b * w[2],
        a * w[2] + b * w[1] - c * w[0],
    ]
    return np.concatenate([0.5 * np.array(turn), euler / moments])


def attitude_matrix(attitude: object) -> Array:
    """Rotation matrix (3, 3), checked, of a matrix or scipy Rotation; the identity for None."""
    if attitude is None:
        return np.eye(3)
    matrix = attitude.as_matrix() if hasattr(attitude, "as_matrix") else attitude
    try:
        matrix = np.asarray(matrix, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput("attitude", attitude, "a rotation matrix or a scipy Rotation") from None
    if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)):
        raise InvalidInput("attitude", attitude, "a (3, 3) rotation matrix of finite numbers")
    off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if off > ORTHOGONAL or np.linalg.det(matrix) < 0.0:
        expected = f"a proper rotation: A A^T = 1 to {ORTHOGONAL:g}, det A = +1"
        if ORTHOGONAL < off < 1e-5:
            expected += f" (A A^T is off by {off:.1g}: single precision?)"
        raise InvalidInput("attitude", attitude, expected)
    return matrix


def attitude_matrices(attitudes: Sequence[object] | None, n: int) -> tuple[Array, NDArray[np.object_]]:
    """Rotation matrices (n, 3, 3) of attitudes, and for each the reason why it is invalid (empty if it is valid)."""
    out = np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
    failures = np.full(n, "", dtype=object)
    if attitudes is None:
        return out, failures
    suspect = []
    for i, attitude in enumerate(attitudes):
        if isinstance(attitude, np.ndarray) and attitude.shape == (3, 3) and attitude.dtype == np.float64:
            out[i] = attitude
        elif attitude is not None:
            suspect.append(i)
    with np.errstate(invalid="ignore"):
        off = np.abs(out @ np.swapaxes(out, 1, 2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        good = (off <= ORTHOGONAL) & (np.linalg.det(out) > 0.0)
    for i in (*suspect, *map(int, np.flatnonzero(~good))):
        try:
            out[i] = attitude_matrix(attitudes[i])
        except InvalidInput as reason:
            failures[i] = str(reason)
    return out, failures
