"""The body after an encounter: its axes, attitude and state."""

from __future__ import annotations

import astropy.units as u
import numpy as np

from flybystab.body.body import DENSITY_RANGE, Body
from flybystab.core.ellipsoid.bound_mass import principal_axes
from flybystab.flybys.batch import FlybyRun
from flybystab.flybys.verdict import Verdict
from flybystab.typing import Array


def final_attitude(shape: Array, spin: Array, along: float) -> Array:
    """Right-handed principal axes of a shape tensor as columns, longest first.

    Half a turn about any of its axes maps an ellipsoid onto itself, so that four such frames exist. The frame returned
    is the one in which the spin along ``a3`` has the sign of `along` (positive for zero) and ``a1`` has no negative x
    component.

    Parameters
    ----------
    shape : ndarray (3, 3)
        ``S``, m2.
    spin : ndarray (3,)
        Angular velocity in the same frame, rad/s.
    along : float
        Spin along ``a3`` before the encounter.
    """
    axes, vectors = np.empty(3), np.empty((3, 3))
    principal_axes(shape, axes, vectors)
    a1, a3 = vectors[:, 0], vectors[:, 2]
    if (spin @ a3) * (-1.0 if along < 0.0 else 1.0) < 0.0:
        a3 = -a3
    if a1[0] < 0.0:
        a1 = -a1
    return np.stack([a1, np.cross(a3, a1), a3], axis=1)


def state_after(run: FlybyRun) -> str:
    """``Body.state`` at the end of a run."""
    if run.verdict == Verdict.IMPACT:
        return "on the ground"
    if run.verdict in (Verdict.MASS_LOSS, Verdict.DISRUPTED):
        return "partly unbound"
    return run.regime


def body_after(body: Body, run: FlybyRun, attitude: Array, yielded: bool) -> Body:
    """The body at the end of a run, along the axes of `attitude`; brittle cohesion is lost with the first yield."""
    material = body.material
    if yielded and material.brittle:
        material = material.with_(cohesion=0.0 * u.Pa)
    rho = float(body.rho * np.prod(body.axes) / np.prod(run.axes))
    return Body(
        semi_axes=run.axes * u.m,
        density=rho * u.kg / u.m**3,
        spin=attitude.T @ run.spin * u.rad / u.s,
        material=material,
        dispersed=not DENSITY_RANGE[0] <= rho <= DENSITY_RANGE[1],
        state=state_after(run),
    )
