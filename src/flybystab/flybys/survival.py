"""Probability of survival of a body whose orbit is uncertain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray
from scipy.stats import binomtest

from flybystab.body.body import Body, Material, refuse_cut_off
from flybystab.core.ellipsoid.yield_bound import INTACT, quick_margins
from flybystab.encounter.distribution import EncounterDistribution
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.spin_sample import SpinStates, spin_states
from flybystab.flybys.verdict import Verdict
from flybystab.tabular import Tabular
from flybystab.units import counted

#: Verdicts that leave one body with all of its mass.
SURVIVES = (Verdict.INTACT, Verdict.RESHAPED)


@dataclass(frozen=True, eq=False)
class Survival(Tabular):
    """Verdicts over the clones of an orbit, each with an attitude of its own.

    Attributes
    ----------
    verdict : ndarray of str, shape (n,)
        ``INTACT`` also for a clone that does not come near the planet.
    near : ndarray of bool, shape (n,)
        Clones that do come near.
    margin : Quantity, shape (n,)
        Friction angle of the material less the one mobilised, a lower limit to it where `bounded`; nan for clones that
        do not come near and for impacts.
    failure : ndarray of str, shape (n,)
        Why a body could not be followed; its verdict is ``FAILED``.
    bounded : ndarray of bool, shape (n,)
        Clones whose tide is too small, whatever the attitude, to make the body yield: ``INTACT`` without the dynamics.
    """

    verdict: NDArray[np.str_]
    near: NDArray[np.bool_]
    margin: Quantity
    failure: NDArray[np.str_]
    bounded: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.verdict)

    def probability(self, *verdicts: str, level: float = 0.95) -> tuple[float, float, float]:
        """Fraction of these verdicts (by default INTACT and RESHAPED) and its Clopper-Pearson interval.

        Clones and attitudes are drawn together, so that the samples are independent and the interval is that
        of a binomial law. Samples that failed count against it at the lower end and for it at the upper.
        """
        wanted = np.isin(self.verdict, [str(v) for v in (verdicts or SURVIVES)])
        lost = int(np.count_nonzero(self.verdict == "FAILED"))
        k, n = int(wanted.sum()), len(self)
        low = binomtest(k, n).proportion_ci(level, "exact").low
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


def survival(
    body: Body | SpinStates,
    distribution: EncounterDistribution,
    *,
    seed: int = 0,
    attitude: Any = None,
    material: Material | None = None,
    tolerance: float = 1e-6,
    workers: int | None = None,
    quick: bool = True,
) -> Survival:
    """Probabilities of the verdicts on a body whose orbit is uncertain.

    Each clone meets the planet on its own two-body path through closest approach (which has the tide of the
    real one to about 1e-4 of its peak near the planet), with the body at an attitude of its own. Where a bound on the
    stress (:mod:`flybystab.core.ellipsoid.yield_bound`) proves that the body cannot yield there, that decides.

    Parameters
    ----------
    body : Body or Asteroid
        An asteroid's pole counts where it is known.
    distribution : EncounterDistribution
        From :func:`flybystab.encounter_distribution`.
    seed : int
        Of the attitudes.
    attitude : array_like, shape (3, 3), optional
        Body axes -> ICRF at the start of every encounter, instead of drawing it.
    material : Material, optional
        Instead of the body's own.
    tolerance, workers
        As in :func:`flybystab.flyby_many`.
    quick : bool
        Whether the bound may decide. The verdicts are the same without it, and every margin is exact.
    """
    if not isinstance(distribution, EncounterDistribution):
        raise InvalidInput("distribution", distribution, "what fs.encounter_distribution gives")
    n = len(distribution)
    bodies, rotations = spin_states(body, n, seed, material)
    if bodies:
        refuse_cut_off(bodies[0].material, "survival")
    if attitude is not None:
        matrix = np.asarray(attitude, dtype=float)
        if matrix.shape != (3, 3):
            raise InvalidInput("attitude", attitude, "a (3, 3) rotation matrix, body axes to ICRF")
        rotations = [matrix] * n
    verdict = np.full(n, str(Verdict.INTACT), dtype="U20")
    verdict[distribution.impact] = str(Verdict.IMPACT)
    margin = np.full(n, np.nan)
    failure = np.full(n, "", dtype="U200")
    rows = np.flatnonzero(distribution.found & ~distribution.impact)
    speeds = np.nan_to_num(distribution.v_inf)
    bounded = np.zeros(n, dtype=bool)
    if quick:
        for k in map(int, rows):
            least = _bound(bodies[k], distribution, k, float(speeds[k].to_value(u.m / u.s)))
            bounded[k] = least is not None
            margin[k] = np.nan if least is None else least
        rows = rows[~bounded[rows]]
    turns = [_periapsis_axes(distribution, int(k)) @ rotations[k] for k in rows]
    encounters = [
        Encounter.hyperbolic(distribution.planet, distribution.distance[k], speeds[k]) for k in rows
    ]
    table = flyby_many([bodies[k] for k in rows], encounters, turns, tolerance=tolerance, workers=workers)
    verdict[rows], margin[rows], failure[rows] = table.verdict, table.margin.to_value(u.deg), table.failure
    return Survival(verdict, distribution.found, margin * u.deg, failure, bounded)


def _bound(body: Body, distribution: EncounterDistribution, k: int, speed: float) -> float | None:
    """Least margin (deg) of a body on the two-body path of clone `k` at any attitude; None where it may yield or touch.

    The tide of a point mass has the norm ``sqrt6 GM/r^3``; its integral over a whole hyperbola of semi-latus rectum
    p and angular momentum h is ``sqrt6 GM 2 (nu + e sin nu)/(h p)``, nu the true anomaly of the asymptote.
    """
    planet, q = distribution.planet, float(distribution.distance[k].to_value(u.m))
    if q - planet.impact_distance < body.axes[0]:
        return None
    e = 1.0 + q * speed * speed / planet.gm
    p = q * (1.0 + e)
    nu = np.arccos(-1.0 / e)
    norm = 1.001 * np.sqrt(6.0) * planet.gm
    m = body.material
    friction, verdict = np.empty((1, 2)), np.zeros(1, dtype=np.int64)
    quick_margins(
        body.axes[None], np.array([body.rho]), body.omega[None], np.array([m.phi]), np.array([m.c_pa]),
        m.surface_code, norm / q**3, norm * 2.0 * (nu + e * np.sin(nu)) / (np.sqrt(planet.gm * p) * p),
        friction, verdict,
    )  # fmt: skip
    return float(np.rad2deg(m.phi - friction[0, 1])) if verdict[0] == INTACT else None


def _periapsis_axes(distribution: EncounterDistribution, k: int) -> NDArray[np.float64]:
    """Rotation, ICRF -> x to the asteroid at closest approach, z along the orbital angular momentum."""
    r, v = distribution.position[k].value, distribution.velocity[k].value
    h = np.cross(r, v)
    x, z = r / np.linalg.norm(r), h / np.linalg.norm(h)
    return np.stack([x, np.cross(z, x), z])
