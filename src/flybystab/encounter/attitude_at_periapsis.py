"""Attitudes given at closest approach, propagated back to the start of the encounter by free rotation."""

from __future__ import annotations

import numpy as np

from flybystab.arguments import check_arguments
from flybystab.body.body import Body
from flybystab.encounter.attitude import attitude_matrix, rotation_rates
from flybystab.encounter.encounter import Encounter
from flybystab.typing import Array

#: Relative tolerance of the integration of a tumbling rotation.
_TOLERANCE = 1e-11


@check_arguments
def attitude_at_start(body: Body, encounter: Encounter, at_periapsis: object) -> Array:
    """Attitude at the start of an encounter that without a tide leads to a given one at closest approach.

    Parameters
    ----------
    body : Body
        With its spin at the start, along its axes.
    encounter : Encounter
    at_periapsis : array_like (3, 3) or scipy Rotation
        Rotation, body axes -> periapsis frame, at closest approach.

    Returns
    -------
    ndarray (3, 3)
        Rotation, body axes -> periapsis frame, at the start: the attitude that :func:`flybystab.flyby` takes.

    Notes
    -----
    The free body turns by ``Q(t)`` from the start, ``dQ/dt = Q [omega]``, with Euler's equations for ``omega``; the
    attitude at the start is ``A Q(t)^T``. The tide changes the rotation during the encounter, so that the true attitude
    at closest approach differs slightly.
    """
    from scipy.integrate import solve_ivp
    from scipy.spatial.transform import Rotation

    target = attitude_matrix(at_periapsis)
    span = -encounter.t_start
    omega = np.asarray(body.omega, dtype=float)
    size = float(np.linalg.norm(omega))
    if size == 0.0 or span <= 0.0:
        return target
    s = body.axes**2
    moments = s.sum() - s
    if np.count_nonzero(omega) == 1:
        turned = Rotation.from_rotvec(omega * span)
    else:
        start = np.concatenate([[1.0, 0.0, 0.0, 0.0], omega])
        found = solve_ivp(
            lambda _, y: rotation_rates(y, moments),
            (0.0, span),
            start,
            method="DOP853",
            rtol=_TOLERANCE,
            atol=_TOLERANCE * size,
        )
        turned = Rotation.from_quat(np.roll(found.y[:4, -1], -1))  # scipy's scalar is the last component
    return target @ turned.as_matrix().T
