"""Bounds on the material of a body from its shape, its spin and the encounters that it survived.

For each density and cohesion there is a least friction angle at which the body is in equilibrium (theory,
section 4) and one at which it survives an encounter without yielding. The second depends on the attitude, which is
unknown for past encounters: its minimum over all attitudes is necessary, its maximum is sufficient. The bounds
from encounters assume that the body kept its shape; a body that yielded and took its present shape in the
encounter is not constrained by them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity

from flybystab.body.body import DEFAULT_SURFACE, Body, Material
from flybystab.catalogues.asteroid import identity
from flybystab.catalogues.catalogue import Asteroid
from flybystab.catalogues.tumbling import attitude_matrix, isotropic_direction
from flybystab.constants import G
from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.core.ellipsoid.yield_bound import quick_margins, tide_size
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.orbit.search.encounter_finder import find_encounters
from flybystab.progress import Progressing, progress_bar
from flybystab.result_table import ResultTable
from flybystab.screening.draws import stream
from flybystab.typing import Document
from flybystab.units import to_si, whole

_TOLERANCE = 1e-7
#: Increase of the mobilised friction angle below which an encounter is not integrated, rad.
NEGLIGIBLE = float(np.radians(0.05))
#: Friction angle above that of any material, rad: upper end of the search of the bound.
_STEEP = 1.5


def infer(
    asteroid: Asteroid | Body,
    encounters: Sequence[Encounter] = (),
    densities: Quantity | None = None,
    cohesions: Quantity | None = None,
    *,
    attitudes: int = 32,
    seed: int = 0,
    yield_surface: str = DEFAULT_SURFACE,
    progress: Progressing = None,
) -> ResultTable:
    """Least friction angles compatible with the shape and spin of a body and with its past encounters.

    Parameters
    ----------
    asteroid : Asteroid or Body
    encounters : sequence of Encounter
        Encounters that it is known to have survived. Where the analytic bound on the increase is below 0.05 deg the
        encounter is not integrated: the bound counts at the worst attitude and zero at the best.
    densities, cohesions : Quantity (n,), (m,)
        The grid; by default 1000 to 3500 kg/m3, and cohesions from zero to three times the mean internal stress.
    attitudes : int
        Attitudes sampled in every encounter: about the catalogued pole where it is known, else isotropic.
    seed : int
        Seed of the random attitudes.
    yield_surface : str
        As in :class:`flybystab.Material`.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    ResultTable
        Rows over densities, then cohesions: ``density``, ``cohesion``, ``friction_equilibrium`` (of a tumbler: over
        all its phases), and over all encounters ``friction_any_attitude`` (necessary at any attitude) and
        ``friction_every_attitude`` (sufficient at every sampled attitude); deg, inf where no friction suffices.
        ``meta["passages"]`` gives the increase by each encounter.

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName
    """
    whole(attitudes, "attitudes", 1)
    whole(seed, "seed", 0)
    _check_bodies(asteroid, encounters)
    rho = np.linspace(1000.0, 3500.0, 11)
    if densities is not None:
        rho = _grid(densities, u.kg / u.m**3, "densities")
    if np.any(rho <= 0.0):
        raise InvalidInput("densities", densities, "positive values")
    code = Material(yield_surface=yield_surface).surface_code
    bodies, turns = _attitudes(asteroid, attitudes, seed)
    cohesion = _cohesions(bodies[0]) if cohesions is None else _grid(cohesions, u.Pa, "cohesions")
    friction = _over_grid(bodies, turns, encounters, rho, cohesion, code, progress)
    table = ResultTable()
    table["density"] = np.repeat(rho, len(cohesion)) * u.kg / u.m**3
    table["cohesion"] = np.tile(cohesion, len(rho)) * u.Pa
    for name, values in (
        ("equilibrium", friction.equilibrium),
        ("any_attitude", friction.over_encounters(0)),
        ("every_attitude", friction.over_encounters(1)),
    ):
        table[f"friction_{name}"] = np.rad2deg(values.ravel()) * u.deg
    table.meta = {
        "title": "least friction angle by density and cohesion",
        "asteroid": asteroid.label if isinstance(asteroid, Asteroid) else "body",
        "semi_axes_m": [float(a) for a in bodies[0].axes],
        "spin_period_h": 2.0 * np.pi / float(np.linalg.norm(bodies[0].omega)) / 3600.0,
        "catalogue_density_kg_m3": _known_density(asteroid),
        "passages": friction.by_encounter(encounters),
        "attitudes": attitudes,
        "pole": "catalogue" if isinstance(asteroid, Asteroid) and asteroid.pole is not None else "isotropic",
        "seed": seed,
        "yield_surface": yield_surface,
        "reading": "bounds from encounters hold for a body that has kept its shape since",
    }
    return table


class _Friction(NamedTuple):
    """Mobilised friction angles (rad) over the grid of densities (n) and cohesions (m), for k encounters.

    Attributes
    ----------
    equilibrium : ndarray (n, m)
        Of the isolated body, the largest over its phases.
    in_encounters : ndarray (n, m, k, 2)
        In each encounter, at the most and at the least favourable attitude.
    integrated : ndarray (k,) of bool
        The encounter was integrated for at least one point of the grid; otherwise the analytic bound was sufficient.
    tides : sequence of tuple
        Largest norm (1/s2) of each tide and its time integral (1/s).
    """

    equilibrium: np.ndarray
    in_encounters: np.ndarray
    integrated: np.ndarray
    tides: Sequence[tuple[float, float]]

    def over_encounters(self, side: int) -> np.ndarray:
        """Largest angle in equilibrium and all encounters, at the most (0) or least (1) favourable attitude."""
        if not len(self.tides):
            return self.equilibrium
        return np.maximum(self.equilibrium, self.in_encounters[..., side].max(axis=2))

    def by_encounter(self, encounters: Sequence[Encounter]) -> list[dict[str, object]]:
        """Strength of the tide and largest increase of the friction angle (deg) in each encounter."""
        return [
            {
                "passage": _label(e),
                "tide_s-2": float(self.tides[k][0]),
                "followed": bool(self.integrated[k]),
                "adds_at_any_attitude_deg": _largest(self.in_encounters[..., k, 0], self.equilibrium),
                "adds_at_worst_attitude_deg": _largest(self.in_encounters[..., k, 1], self.equilibrium),
            }
            for k, e in enumerate(encounters)
        ]


def _check_bodies(asteroid: object, encounters: object) -> None:
    """Check the types of the asteroid and of its encounters."""
    if not isinstance(encounters, Iterable) or not all(isinstance(e, Encounter) for e in encounters):
        raise InvalidInput("encounters", encounters, "a sequence of Encounter")
    if not isinstance(asteroid, Asteroid | Body):
        raise InvalidInput(
            "asteroid", asteroid, "an Asteroid (Asteroid.from_catalogue finds a name) or a Body"
        )


def _over_grid(
    bodies: Sequence[Body],
    turns: Sequence[np.ndarray],
    encounters: Sequence[Encounter],
    rho: np.ndarray,
    cohesion: np.ndarray,
    code: int,
    progress: Progressing,
) -> _Friction:
    """Friction angles at every density (kg/m3) and cohesion (Pa), by the bound or by integration."""
    sizes = [tide_size(e.tide, e.t_start, e.t_stop) for e in encounters]
    shape = (len(rho), len(cohesion))
    found = _Friction(
        np.empty(shape), np.empty((*shape, len(encounters), 2)), np.zeros(len(encounters), dtype=bool), sizes
    )
    with progress_bar(progress, len(rho) * len(cohesion), "materials", "bounds") as tick:
        for i, j in np.ndindex(shape):
            r, c = float(rho[i]), float(cohesion[j])
            free, bounds = _by_bound(bodies, r, c, code, sizes)
            found.equilibrium[i, j] = free
            for k, encounter in enumerate(encounters):
                if bounds[k] < free + NEGLIGIBLE or not np.isfinite(free):
                    found.in_encounters[i, j, k] = free, max(free, bounds[k] if np.isfinite(free) else free)
                    continue
                found.integrated[k] = True
                needed = [_need(b, q, encounter, r, c, code) for b, q in zip(bodies, turns, strict=True)]
                found.in_encounters[i, j, k] = max(free, min(needed)), max(free, *needed)
            tick(i * len(cohesion) + j + 1)
    return found


def strongest_encounter(table: QTable) -> Document | None:
    """The encounter with the strongest tide in ``meta["passages"]``; None without encounters.

    Encounters are ordered by tide, not by increase, since an increase may be an upper bound.
    """
    return max(table.meta.get("passages", []), key=lambda p: p["tide_s-2"], default=None)


def _largest(need: np.ndarray, rest: np.ndarray) -> float:
    """Largest finite rise of `need` above `rest` (rad) over the grid, deg."""
    need, rest = np.broadcast_arrays(need, rest)
    usable = np.isfinite(need) & np.isfinite(rest)
    finite = need[usable] - rest[usable]
    return float(np.rad2deg(finite.max())) if len(finite) else 0.0


def _known_density(asteroid: Asteroid | Body) -> list[float]:
    """Density and its 1-sigma in the catalogue, kg/m3; empty for a user-defined body."""
    columns = ("density_kg_m3", "density_sigma_kg_m3")
    if not isinstance(asteroid, Asteroid) or not asteroid.knows(columns[0]):
        return []
    return [float(asteroid.quantity(c).value) if asteroid.knows(c) else 0.0 for c in columns]


def _cohesions(body: Body) -> np.ndarray:
    """Zero, and the steps 1, 3, 10 ... Pa from a hundredth to three times the mean internal stress."""
    a = body.axes
    weight = 2.0 / 15.0 * np.pi * G * 2000.0**2 * np.cbrt(np.prod(a)) ** 2
    spin = 2000.0 / 5.0 * float(body.omega @ body.omega) * a[0] ** 2
    top = 3.0 * max(weight, spin)
    steps = np.array([m * 10.0**k for k in range(-6, 10) for m in (1.0, 3.0)])
    return np.concatenate([[0.0], steps[(steps <= top) & (steps >= top / 300.0)]])


def _by_bound(
    bodies: Sequence[Body], rho: float, cohesion: float, code: int, sizes: Sequence[tuple[float, float]]
) -> tuple[float, list[float]]:
    """Friction (rad) mobilised at rest, largest over the phases, and bounds on it in each of the tides."""
    n = len(bodies)
    axes = np.array([b.axes for b in bodies])
    omega = np.array([b.omega for b in bodies])
    friction, verdict = np.empty((n, 2)), np.empty(n, dtype=np.int64)
    bounds = []
    for size in [(0.0, 0.0), *sizes]:
        args = axes, np.full(n, rho), omega, np.full(n, _STEEP), np.full(n, cohesion), code
        quick_margins(*args, *size, friction, verdict)
        bounds.append(float(friction[:, 1].max()))
    return float(friction[:, 0].max()), bounds[1:]


def survived(
    asteroid: Asteroid,
    start: Time,
    stop: Time,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
) -> list[Encounter]:
    """Encounters of an asteroid between two dates, integrated with all forces, for :func:`infer`.

    Raises
    ------
    OutOfSpan
        The span reaches beyond the ephemeris.
    """
    table = find_encounters(asteroid, start, stop, planets=list(planets), within=within)
    table = table[table["planet"] != "sun"]
    return [Encounter.from_orbit(asteroid.orbit, str(row["planet"]), row["time"]) for row in table]


def _grid(values: Quantity, unit: u.UnitBase, name: str) -> np.ndarray:
    grid = np.atleast_1d(to_si(values, unit, name, shape=None, low=0.0))
    if grid.ndim != 1 or not len(grid):
        raise InvalidInput(name, values, "a list of values")
    return grid


def _attitudes(asteroid: Asteroid | Body, n: int, seed: int) -> tuple[list[Body], list[np.ndarray]]:
    """Bodies (a tumbler at different phases) and their rotations to the frame of the encounter."""
    key = identity(asteroid) if isinstance(asteroid, Asteroid) else "body"
    bodies, turns = [], []
    for x in stream(seed, "infer", key).random((n, 4)):
        tumbles = isinstance(asteroid, Asteroid) and asteroid.tumbles
        if isinstance(asteroid, Body):
            body, pole = asteroid, None
        else:
            body, pole = asteroid.body_with(phase=float(x[3]) if tumbles else 0.0), asteroid.pole
        s = body.axes**2
        momentum = (s.sum() - s) * body.omega
        if not np.any(momentum):
            momentum = np.array([0.0, 0.0, 1.0])
        direction = isotropic_direction(x[:2]) if pole is None else pole
        bodies.append(body)
        turns.append(attitude_matrix(momentum, direction, 2.0 * np.pi * x[2]))
    return bodies, turns


def _need(
    body: Body, turn: np.ndarray, encounter: Encounter, rho: float, cohesion: float, code: int
) -> float:
    """Largest friction angle (rad) that the rigid body mobilises in an encounter."""
    run = integrate(
        body_state(body.axes, rho, body.omega, turn, phi=0.5, cohesion=cohesion, surface=code),
        (encounter.t_start, encounter.t_stop),
        encounter.tide,
        limits=LIMITS._replace(tolerance=_TOLERANCE),
        unyielding=True,
    )
    return float(run.max_friction)


def _label(encounter: Encounter) -> str:
    when = "scripted" if encounter.time is None else encounter.time.tdb.iso[:16]
    return f"{encounter.planet.name.capitalize()} {when}, {encounter.distance.to_value(u.km):,.0f} km"
