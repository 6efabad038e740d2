"""Recovery of a free body from a perturbation, by the full dynamics: the reference for the energy criterion.

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
from flybystab.body.equilibrium import equilibrium
from flybystab.body.stability import unit_deviator
from flybystab.constants import G
from flybystab.core.dynamics.run import LIMITS, Run, body_state, integrate
from flybystab.core.ellipsoid.tide import components, no_tide, tensor
from flybystab.core.energy.perturbation import LARGEST_AXIS_RATIO, ellipsoid, rate_of_strain, slope_of_flow
from flybystab.core.energy.perturbation import direction as strain_direction
from flybystab.core.energy.potential import velocity_gradient
from flybystab.errors import InvalidInput, NotConverged
from flybystab.progress import Progressing, progress_bar
from flybystab.tabular import Record
from flybystab.typing import Array
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
    return _recovery(body, _push(body, direction, joule, _dilatancy(body, dilatancy), tolerance))


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


@dataclass(frozen=True, eq=False)
class RecoveryLimit(Record):
    """Least energy of a perturbation from which a body does not recover, over its directions.

    Attributes
    ----------
    energy : Quantity
        Least over all searches, J; zero if the smallest perturbation tried is too large, inf if the largest is not.
    error : float
        Sampling error: largest over least energy of the independent searches, less one; inf where only some of them
        found a direction without recovery. Bisection adds `precision`.
    direction : ndarray, shape (3, 3)
        Rate of strain in body axes, ``|D'| = 1``, with that energy; nan where there is none.
    searches : Quantity, shape (n,)
        Least energy of each independent search, J.
    precision : float
        Relative, of the bisection.
    binding_energy : Quantity
        ``(3/5) G m^2/a`` of the sphere of the same mean radius ``a``, J, for scale.
    runs : int
        Integrations of the dynamics.
    """

    energy: Quantity
    error: float
    direction: Array
    searches: Quantity
    precision: float
    binding_energy: Quantity
    runs: int

    def __repr__(self) -> str:
        if not np.isfinite(self.energy):
            return f"<RecoveryLimit no loss found up to the largest energy tried; {self.runs} runs>"
        ratio = float(self.energy / self.binding_energy)
        return f"<RecoveryLimit {ratio:.3g} of the binding energy, sampling error {self.error:.2g}; {self.runs} runs>"


@check_arguments
def recovery(
    body: Body,
    *,
    dilatancy: float | None = None,
    directions: int = 24,
    refinements: int = 24,
    searches: int = 3,
    precision: float = 0.05,
    low: float = 1e-8,
    high: float = 2.0,
    largest_strain: float | None = None,
    seed: int = 0,
    progress: Progressing = None,
) -> RecoveryLimit:
    """Least energy of a perturbation from which a body does not recover, by the full dynamics.

    Parameters
    ----------
    body : Body
        In admissible equilibrium.
    dilatancy : float, optional
        ``beta/min k``; the material's own by default.
    directions, refinements : int
        Random directions of strain of each search, and random steps, ever shorter, from the best of them.
    searches : int
        Independent searches, at least 2: their differences are the sampling error.
    precision : float
        Relative, of the energy in one direction.
    low, high : float
        Bracket, in binding energies of the sphere of the same mean radius.
    largest_strain : float, optional
        A body that is at rest after a larger change of the logarithms of its semi-axes counts as lost too. None: any
        shape inside the model.
    seed : int
        Of the random directions.

    Returns
    -------
    RecoveryLimit

    Raises
    ------
    InvalidInput
        A body that is not in equilibrium, an argument out of range.
    NotConverged
        The integration stopped.

    Notes
    -----
    A direction is bisected only if the body is lost at the least energy known so far less the precision: most
    directions cost one run. The result is the least over the directions tried, an upper bound of the least over all.
    """
    beta = _dilatancy(body, dilatancy)
    if not equilibrium(body).admissible:
        raise InvalidInput("body", body, "a body in admissible equilibrium")
    for name, value, fewest in (
        ("directions", directions, 1),
        ("refinements", refinements, 0),
        ("searches", searches, 2),
    ):
        if not (isinstance(value, int | np.integer) and value >= fewest):
            raise InvalidInput(name, value, f"an integer of at least {fewest}")
    if not 0.0 < precision < 1.0:
        raise InvalidInput("precision", precision, "a number between 0 and 1")
    if not 0.0 < low < high:
        raise InvalidInput("low", low, "a positive number below high")
    search = _Search(body, beta, precision, low, high, np.inf if largest_strain is None else largest_strain)
    with progress_bar(progress, searches, "searches", "recovery") as tick:
        found = []
        for i in range(searches):
            found.append(search.least(np.random.default_rng([seed, i]), directions, refinements))
            tick(i + 1)
    energies = np.array([e for e, _ in found])
    best = int(np.argmin(energies))
    least = float(energies[best])
    error = float(energies.max() / least - 1.0) if least > 0.0 else 0.0
    if not np.isfinite(least):
        error = 0.0
    return RecoveryLimit(
        energy=least * search.unit * u.J,
        error=error,
        direction=found[best][1],
        searches=energies * search.unit * u.J,
        precision=precision,
        binding_energy=search.unit * u.J,
        runs=search.runs,
    )


class _Search:
    """Searches over the directions of a perturbation; energies in units of :attr:`unit`."""

    def __init__(
        self, body: Body, beta: float, precision: float, low: float, high: float, largest_strain: float
    ) -> None:
        self.body, self.beta, self.precision = body, beta, precision
        self.low, self.high, self.largest_strain = low, high, largest_strain
        self.unit = 0.6 * G * body.mass.value**2 / float(np.cbrt(np.prod(body.axes)))
        self.runs = 0

    def recovers(self, direction: Array, energy: float) -> bool:
        """Whether the body is at rest inside the model, and not strained too much, after a perturbation."""
        self.runs += 1
        r = _recovery(self.body, _push(self.body, direction, energy * self.unit, self.beta, 1e-6))
        return r.recovered and r.strain <= self.largest_strain

    def threshold(self, direction: Array, lost: float) -> float:
        """Least energy in a direction at which the body is lost, by bisection of its logarithm; at `lost` it is."""
        low = lost
        while low > self.low:  # decrease by factors first: the threshold is usually close
            low = max(self.low, low / 3.0)
            if self.recovers(direction, low):
                break
            lost = low
        else:
            return 0.0
        while lost > low * (1.0 + self.precision):
            middle = float(np.sqrt(low * lost))
            if self.recovers(direction, middle):
                low = middle
            else:
                lost = middle
        return lost

    def least(self, rng: np.random.Generator, directions: int, refinements: int) -> tuple[float, Array]:
        """Least threshold over random directions and steps from the best one, with its direction."""
        best, x = np.inf, np.full(5, np.nan)
        for i in range(directions + refinements):
            if i < directions:
                y = rng.standard_normal(5)
            elif best in (0.0, np.inf):
                break
            else:
                y = x + 0.5 * 0.9 ** (i - directions) * rng.standard_normal(5)
            y = y / np.linalg.norm(y)
            energy = min(self.high, best * (1.0 - self.precision))
            if not self.recovers(_deviator(y), energy):
                best, x = self.threshold(_deviator(y), energy), y
                if best == 0.0:
                    break
        return best, _deviator(x)


def _deviator(x: Array) -> Array:
    """Deviator (3, 3) with the components ``x[5]`` in an orthonormal basis."""
    d = np.empty(6)
    rate_of_strain(x, 0.0, d)
    return tensor(d)


def _dilatancy(body: Body, dilatancy: float | None) -> float:
    check_body(body)
    refuse_cut_off(body.material, "recovery")
    own = body.material.dilatancy if dilatancy is None else dilatancy
    return float(to_si(own, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0))


def _push(
    body: Body, direction: ArrayLike | Quantity, energy: float, dilatancy: float, tolerance: float
) -> Run:
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


def _recovery(body: Body, run: Run) -> Recovery:
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
