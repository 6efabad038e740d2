"""What a push does to a free body, by the full dynamics: the judge of the energy criterion.

A push is a velocity gradient in the frame without relative angular momentum (``L I`` symmetric, theory.md, section
5), on top of the spin: it adds kinetic energy and no angular momentum. The body then flows, by the dynamics that carry
it through encounters, until it comes to rest, disperses or passes the axis ratio at which the model ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import Body, check_body
from flybystab.body.stability import unit_deviator
from flybystab.constants import G
from flybystab.core.dynamics.run import Passage, passage
from flybystab.core.ellipsoid.tide import components, no_tide
from flybystab.core.energy.perturbation import EDGE
from flybystab.core.energy.potential import velocity_gradient
from flybystab.core.material.yield_surface import least_slope
from flybystab.errors import NotConverged
from flybystab.units import to_si

Array = NDArray[np.float64]

#: How long a pushed body is followed, in dynamical times: a body at rest may tumble and yield anew.
PATIENCE = 100.0


@dataclass(frozen=True, eq=False)
class Recovery:
    """What became of a pushed body.

    Attributes
    ----------
    recovered : bool
        Whether it is at rest again, inside the model.
    ending : str
        "rest", "beyond model" (axis ratio past 6:1), "dispersed" or "moving" (still, after 100 dynamical times).
    time : Quantity
        Until it came to rest for the last time, or until the end of the run, s.
    semi_axes : Quantity (3,)
        At the end, longest first, m.
    strain : float
        Norm of the change of the logarithms of the sorted semi-axes.
    """

    recovered: bool
    ending: str
    time: Quantity
    semi_axes: Quantity
    strain: float


def pushed(
    body: Body, direction: Any, energy: Quantity, *, dilatancy: float | None = None, tolerance: float = 1e-7
) -> Recovery:
    """Push a free body once, and wait.

    Parameters
    ----------
    body : Body
        It must stand before the push.
    direction : array_like, shape (3, 3)
        Symmetric rate of strain in body axes. Only its deviator counts; its trace follows from the dilatancy.
    energy : Quantity
        Kinetic energy of the push, J.
    dilatancy : float, optional
        ``beta/min k``; the material's own by default.
    tolerance : float
        Relative error allowed in each integration step.

    Returns
    -------
    Recovery

    Raises
    ------
    InvalidInput
        A direction without a deviator, a negative energy.
    NotConverged
        The integration stopped.
    """
    joule = to_si(energy, u.J, "energy", low=0.0)
    return _recovery(body, _push(body, direction, joule, _dilatancy(body, dilatancy), tolerance))


def recovery_energy(
    body: Body,
    direction: Any,
    *,
    dilatancy: float | None = None,
    low: float = 3e-4,
    high: float = 2.0,
    precision: float = 0.01,
) -> Quantity:
    """Energy of a push beyond which a body does not come to rest inside the model, by bisection.

    Parameters
    ----------
    body, direction, dilatancy
        As in :func:`pushed`.
    low, high : float
        Bracket, in binding energies ``(3/5) G m^2/a`` of a sphere of the same mean radius ``a``.
    precision : float
        Relative.

    Returns
    -------
    Quantity
        J; zero if the least push of the bracket is too much, inf if the largest is not.

    Notes
    -----
    Outcomes need not be in order: a stronger push may come to rest where a weaker one did not. One change is found.
    """
    beta = _dilatancy(body, dilatancy)
    unit = 0.6 * G * body.mass.value**2 / float(np.cbrt(np.prod(body.axes)))

    def holds(energy: float) -> bool:
        return _recovery(body, _push(body, direction, energy * unit, beta, 1e-7)).recovered

    if not holds(low):
        return 0.0 * u.J
    if holds(high):
        return np.inf * u.J
    while high > low * (1.0 + precision):
        mid = float(np.sqrt(low * high))
        if holds(mid):
            low = mid
        else:
            high = mid
    return float(np.sqrt(low * high)) * unit * u.J


def _dilatancy(body: Body, dilatancy: float | None) -> float:
    check_body(body)
    own = body.material.dilatancy if dilatancy is None else dilatancy
    return float(to_si(own, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0))


def _push(body: Body, direction: Any, energy: float, dilatancy: float, tolerance: float) -> Passage:
    d = unit_deviator(direction)
    m = body.material
    beta = dilatancy * least_slope(m.surface_code, np.sin(m.phi))
    squares = body.axes**2
    gradient = np.empty((3, 3))
    velocity_gradient(squares[0], squares[1], squares[2], components(d + beta / 3.0 * np.eye(3)), gradient)
    # K = tr(L I L^T)/2 with I = (m/5) S
    unit = body.mass.value / 10.0 * float(np.trace(gradient @ np.diag(squares) @ gradient.T))
    limit = max(EDGE, 1.001 * body.axes[0] / body.axes[2])
    return passage(
        body.axes,
        body.rho,
        body.omega,
        np.eye(3),
        0.0,
        PATIENCE * body.dynamical_time,
        no_tide(),
        phi=m.phi,
        cohesion=m.c_pa,
        dilatancy=dilatancy,
        surface=m.surface_code,
        brittle=m.brittle,
        tolerance=tolerance,
        max_axis_ratio=limit,
        deformation=gradient * np.sqrt(energy / unit) if energy > 0.0 else None,
    )


def _recovery(body: Body, run: Passage) -> Recovery:
    if run.reason == "stuck":
        raise NotConverged(f"the pushed body could not be followed beyond {run.time:.1f} s ({run.regime})")
    axes = np.sqrt(np.linalg.eigvalsh(run.shape)[::-1])
    if run.reason == "beyond model":
        ending = "beyond model"
    else:
        ending = {"rigid": "rest", "dispersed": "dispersed"}.get(run.regime, "moving")
    rests = [t for name, t, _ in run.events if name in ("arrest", "jam")]
    return Recovery(
        recovered=ending == "rest",
        ending=ending,
        time=(rests[-1] if ending == "rest" and rests else run.time) * u.s,
        semi_axes=axes * u.m,
        strain=float(np.linalg.norm(np.log(axes / body.axes))),
    )
