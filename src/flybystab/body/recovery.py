"""Least energy of a perturbation from which a body does not recover, over the directions of strain.

Each perturbation is followed by the full dynamics (:mod:`flybystab.body.perturbed_motion`); the result is the reference
for the energy criterion of :func:`flybystab.stability`.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.body.body import Body
from flybystab.body.equilibrium import equilibrium
from flybystab.body.perturbed_motion import (
    Recovery,
    checked_dilatancy,
    perturbed_run,
    pushed,
    recovery_energy,
    recovery_of,
)
from flybystab.constants import G
from flybystab.core.ellipsoid.tide import tensor
from flybystab.core.energy.perturbation import rate_of_strain
from flybystab.errors import InvalidInput
from flybystab.progress import Progressing, progress_bar
from flybystab.tabular import Record
from flybystab.typing import Array

__all__ = ["Recovery", "RecoveryLimit", "pushed", "recovery", "recovery_energy"]


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
    beta = checked_dilatancy(body, dilatancy)
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
        r = recovery_of(self.body, perturbed_run(self.body, direction, energy * self.unit, self.beta, 1e-6))
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
