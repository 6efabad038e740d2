"""Probability of survival of a body whose orbit is uncertain."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments, finite
from flybystab.body.body import Body, Material, refuse_cut_off
from flybystab.core.ellipsoid.yield_bound import INTACT, quick_margins
from flybystab.encounter.attitude import attitude_matrix
from flybystab.encounter.distribution import EncounterDistribution
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby_many import follow_rows
from flybystab.flybys.spin_sample import SpinSampleStates, SpinStates, spin_states
from flybystab.flybys.verdict import Verdict
from flybystab.orbit.planets import Planet
from flybystab.progress import Progressing
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import counted

#: Verdicts that leave one body with all of its mass.
SURVIVES = (Verdict.INTACT, Verdict.RESHAPED)


@dataclass(frozen=True, eq=False)
class Survival(Tabular):
    """Verdicts over the clones of an orbit, each with its own attitude.

    Attributes
    ----------
    verdict : ndarray of str, shape (n,)
        ``INTACT`` also for a clone without an encounter.
    near : ndarray of bool, shape (n,)
        Clones with an encounter.
    margin : Quantity, shape (n,)
        Friction angle of the material less the one mobilised, a lower limit to it where `bounded`; nan for clones
        without an encounter and for impacts.
    failure : ndarray of str, shape (n,)
        Reason why a clone could not be computed; its verdict is ``FAILED``.
    bounded : ndarray of bool, shape (n,)
        Clones whose tide is too small to make the body yield at any attitude: ``INTACT`` without an integration.
    """

    verdict: NDArray[np.str_]
    near: NDArray[np.bool_]
    margin: Quantity
    failure: NDArray[np.str_]
    bounded: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.verdict)

    @check_arguments
    def probability(self, *verdicts: str, level: float = 0.95) -> tuple[float, float, float]:
        """Fraction of these verdicts (by default INTACT and RESHAPED) and its Clopper-Pearson interval.

        Clones and attitudes are drawn together, so that the samples are independent and the interval is that
        of a binomial distribution. Failed samples count as losses for the lower end and as survivals for the upper end.
        """
        from scipy.stats import binomtest

        wanted = np.isin(self.verdict, [str(v) for v in (verdicts or SURVIVES)])
        lost = int(np.count_nonzero(self.verdict == "FAILED"))
        k, n = int(wanted.sum()), len(self)
        low = binomtest(k, n).proportion_ci(finite(level, "level", 0.0, 1.0), "exact").low
        high = binomtest(min(k + lost, n), n).proportion_ci(level, "exact").high
        return k / n, float(low), float(high)

    @property
    def probabilities(self) -> dict[str, tuple[float, float, float]]:
        """Each verdict that occurs, most frequent first, with its probability and 95 % interval."""
        names, counts = np.unique(self.verdict, return_counts=True)
        return {str(names[k]): self.probability(str(names[k])) for k in np.argsort(-counts)}

    def __repr__(self) -> str:
        p, low, high = self.probability()
        chance = f"survives with {p:.4g} ({low:.3g} to {high:.3g})"
        return f"<Survival {len(self)} clones: {counted(self.verdict)}; {chance}>"


@check_arguments
def survival(
    body: Body | SpinStates,
    distribution: EncounterDistribution,
    *,
    seed: int = 0,
    attitude: object = None,
    material: Material | None = None,
    tolerance: float = 1e-6,
    workers: int | None = None,
    quick: bool = True,
    progress: Progressing = None,
) -> Survival:
    """Probabilities of the verdicts on a body whose orbit is uncertain.

    Each clone passes the planet on its own two-body path through closest approach (whose tide agrees with that of the
    real path to about 1e-4 of its peak near the planet), with its own attitude of the body. Where a bound on the stress
    (:mod:`flybystab.core.ellipsoid.yield_bound`) proves that the body cannot yield, nothing is integrated.

    Parameters
    ----------
    body : Body or Asteroid
        The pole of an asteroid is used where it is known.
    distribution : EncounterDistribution
        From :func:`flybystab.encounter_distribution`.
    seed : int
        Of the attitudes.
    attitude : array_like, shape (3, 3), optional
        Body axes -> ICRF at the start of every encounter, instead of drawing it.
    material : Material, optional
        Instead of the body's own.
    tolerance, workers, progress
        As in :func:`flybystab.flyby_many`.
    quick : bool
        Whether to use the bound. Without it the verdicts are the same, and every margin is exact.
    """
    if not isinstance(distribution, EncounterDistribution):
        raise InvalidInput(
            "distribution", distribution, "an EncounterDistribution, from flybystab.encounter_distribution"
        )
    n = len(distribution)
    states = spin_states(body, n, seed, material)
    refuse_cut_off(states.body.material, "survival")
    rotations = states.rotations
    if attitude is not None:
        matrix = np.asarray(attitude, dtype=float)
        if matrix.shape != (3, 3):
            raise InvalidInput("attitude", attitude, "a (3, 3) rotation matrix, body axes to ICRF")
        rotations = np.tile(attitude_matrix(matrix), (n, 1, 1))
    verdict = np.full(n, str(Verdict.INTACT), dtype="U20")
    verdict[distribution.impact] = str(Verdict.IMPACT)
    margin = np.full(n, np.nan)
    failure = np.full(n, "", dtype="U200")
    rows = np.flatnonzero(distribution.found & ~distribution.impact)
    speeds = np.nan_to_num(distribution.v_inf.to_value(u.m / u.s))
    distances = distribution.distance.to_value(u.m)
    bounded = np.zeros(n, dtype=bool)
    if quick:
        margin[rows] = _bounds(states, distribution.planet, rows, distances, speeds)
        bounded[rows] = np.isfinite(margin[rows])
        rows = rows[~bounded[rows]]
    bodies = states._replace(rotations=_periapsis_axes(distribution) @ rotations).rows()[rows]
    bodies["encounter"] = np.arange(len(rows))
    encounters = [
        Encounter.hyperbolic(distribution.planet, distances[k] * u.m, speeds[k] * u.m / u.s) for k in rows
    ]
    table = follow_rows(bodies, encounters, tolerance=tolerance, workers=workers, progress=progress)
    verdict[rows], margin[rows], failure[rows] = table.verdict, table.margin.to_value(u.deg), table.failure
    return Survival(verdict, distribution.found, margin * u.deg, failure, bounded)


def _bounds(
    states: SpinSampleStates, planet: Planet, clones: NDArray[np.int64], distances: Array, speeds: Array
) -> Array:
    """Least margins (deg) on the two-body paths of clones at any attitude; nan where the body may yield or touch.

    The tide of a point mass has the norm ``sqrt6 GM/r^3``; its integral over a whole hyperbola of semi-latus rectum
    p and angular momentum h is ``sqrt6 GM 2 (nu + e sin nu)/(h p)``, nu the true anomaly of the asymptote.
    """
    q, m = distances[clones], states.body.material
    e = 1.0 + q * speeds[clones] ** 2 / planet.gm
    p = q * (1.0 + e)
    nu = np.arccos(-1.0 / e)
    norm = 1.001 * np.sqrt(6.0) * planet.gm
    peak = norm / q**3
    integral = norm * 2.0 * (nu + e * np.sin(nu)) / (np.sqrt(planet.gm * p) * p)
    axes, rho = states.body.axes[None].copy(), np.array([states.body.rho])
    phi, cohesion, code = np.array([m.phi]), np.array([m.c_pa]), m.surface_code
    friction, verdict = np.empty((1, 2)), np.zeros(1, dtype=np.int64)
    out = np.full(len(clones), np.nan)
    for i in map(int, np.flatnonzero(q - planet.impact_distance >= states.body.axes[0])):
        omega = states.omega[clones[i] : clones[i] + 1]
        quick_margins(axes, rho, omega, phi, cohesion, code, peak[i], integral[i], friction, verdict)
        if verdict[0] == INTACT:
            out[i] = np.rad2deg(m.phi - friction[0, 1])
    return out


def _periapsis_axes(distribution: EncounterDistribution) -> Array:
    """Rotations (n, 3, 3), ICRF -> x to the asteroid at closest approach, z along the orbital angular momentum."""
    r, v = distribution.position.value, distribution.velocity.value
    with np.errstate(invalid="ignore"):  # clones without an encounter
        h = np.cross(r, v)
        x, z = (a / np.linalg.norm(a, axis=1)[:, None] for a in (r, h))
    return np.stack([x, np.cross(z, x), z], axis=1)
