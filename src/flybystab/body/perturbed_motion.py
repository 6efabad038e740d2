"""Motion of a free body after a perturbation, by the full dynamics.

A perturbation is a velocity gradient in the frame without relative angular momentum (``L I`` symmetric, theory,
section 5), added to the spin: it adds kinetic energy and no angular momentum. The body then flows, by the equations
that are integrated through encounters, until it is at rest, disperses or passes the axis ratio at which the model
ends. A deforming body is at yield: brittle cohesion is lost at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import ArrayLike

from flybystab.arguments import check_arguments
from flybystab.body.body import Body, check_body, refuse_cut_off
from flybystab.body.perturbation import unit_deviator
from flybystab.constants import G
from flybystab.core.dynamics.run import LIMITS, Run, body_state, integrate
from flybystab.core.ellipsoid.tide import components, no_tide
from flybystab.core.energy.perturbation import LARGEST_AXIS_RATIO, ellipsoid, slope_of_flow
from flybystab.core.energy.perturbation import direction as strain_direction
from flybystab.core.energy.potential import velocity_gradient
from flybystab.errors import NotConverged
from flybystab.tabular import Record
from flybystab.units import to_si

#: Duration of the integration of a perturbed body, in dynamical times: a body at rest may tumble and yield again.
PATIENCE = 100.0


@dataclass(frozen=True, eq=False, repr=False)
class Recovery(Record):
    """End of the motion of a perturbed body.

    Attributes
    ----------
    recovered : bool
        Whether it is at rest again, inside the model.
    ending : str
        "rest", "beyond model" (axis ratio past 6:1), "dispersed" or "moving" (after 100 dynamical times).
    time : Quantity
        Until the last arrest, or until the end of the run, s.
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
    body: Body,
    direction: ArrayLike | Quantity,
    energy: Quantity,
    *,
    dilatancy: float | None = None,
    tolerance: float = 1e-7,
) -> Recovery:
    """Motion of a free body after one perturbation.

    Parameters
    ----------
    body : Body
        In admissible equilibrium.
    direction : array_like, shape (3, 3)
        Symmetric rate of strain in body axes. Only its deviator counts; its trace follows from the dilatancy.
    energy : Quantity
        Kinetic energy of the perturbation, J.
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
    return recovery_of(
        body, perturbed_run(body, direction, joule, checked_dilatancy(body, dilatancy), tolerance)
    )


@check_arguments
def recovery_energy(
    body: Body,
    direction: ArrayLike | Quantity,
    *,
    dilatancy: float | None = None,
    low: float = 3e-4,
    high: float = 2.0,
    precision: float = 0.01,
) -> Quantity:
    """Energy of a perturbation in one direction beyond which a body does not come to rest inside the model.

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
        J; zero if the least energy of the bracket is too large, inf if the largest is not.

    Notes
    -----
    Found by bisection. Recovery need not be monotonic in the energy: one change is found.
    """
    beta = checked_dilatancy(body, dilatancy)
    unit = 0.6 * G * body.mass.value**2 / float(np.cbrt(np.prod(body.axes)))

    def recovers(energy: float) -> bool:
        return recovery_of(body, perturbed_run(body, direction, energy * unit, beta, 1e-7)).recovered

    if not recovers(low):
        return 0.0 * u.J
    if recovers(high):
        return np.inf * u.J
    while high > low * (1.0 + precision):
        mid = float(np.sqrt(low * high))
        if recovers(mid):
            low = mid
        else:
            high = mid
    return float(np.sqrt(low * high)) * unit * u.J


def checked_dilatancy(body: Body, dilatancy: float | None) -> float:
    """``beta/min k`` of the material, or the given one; raises InvalidInput for an invalid body or value."""
    check_body(body)
    refuse_cut_off(body.material, "recovery")
    own = body.material.dilatancy if dilatancy is None else dilatancy
    return float(to_si(own, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0))


def perturbed_run(
    body: Body, direction: ArrayLike | Quantity, energy: float, dilatancy: float, tolerance: float
) -> Run:
    """Run of the dynamics of a free body after a perturbation; arguments as of :func:`pushed`, `energy` in J."""
    d = unit_deviator(direction)
    m = body.material
    squares = s1, s2, s3 = body.axes**2
    scene = ellipsoid(s1, s2, s3, np.zeros(3), m.surface_code, m.phi, 0.0, dilatancy, 0.0)
    x = np.empty(5)
    strain_direction(components(d), x)
    _, beta = slope_of_flow(scene, x)  # tr D of the flow rule at |D'| = 1
    gradient = np.empty((3, 3))
    velocity_gradient(s1, s2, s3, components(d + beta / 3.0 * np.eye(3)), gradient)
    # K = tr(L I L^T)/2 with I = (m/5) S
    unit = body.mass.value / 10.0 * float(np.trace(gradient @ np.diag(squares) @ gradient.T))
    limit = max(LARGEST_AXIS_RATIO, 1.001 * body.axes[0] / body.axes[2])
    cohesion = 0.0 if m.brittle and energy > 0.0 else m.c_pa
    return integrate(
        body_state(
            body.axes, body.rho, body.omega, np.eye(3), m.phi, cohesion, dilatancy, m.surface_code, m.brittle
        ),
        (0.0, PATIENCE * body.dynamical_time),
        no_tide(),
        limits=LIMITS._replace(tolerance=tolerance, axis_ratio=limit),
        deformation=gradient * np.sqrt(energy / unit) if energy > 0.0 else None,
    )


def recovery_of(body: Body, run: Run) -> Recovery:
    """End of the motion of a run of a perturbed body."""
    if run.reason == "stuck":
        raise NotConverged(f"the perturbed body could not be followed beyond {run.time:.1f} s ({run.regime})")
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
