"""Random bodies: catalogue values within their errors, and priors for unmeasured quantities.

A sample depends on the seed, the asteroid and the sample number only: sample 17 of Apophis is the same for any list
of asteroids, any order, any number of workers and any number of samples. All encounters of an asteroid use the same
bodies; the attitudes are drawn for each encounter.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import DENSITY_RANGE, Body, Material
from flybystab.catalogues.asteroid import Asteroid, identity
from flybystab.catalogues.catalogue import catalogue
from flybystab.catalogues.lightcurves import periods_like
from flybystab.catalogues.magnitude import diameter_of
from flybystab.catalogues.record import SHAPE
from flybystab.catalogues.spin_solutions import chosen
from flybystab.catalogues.tumbling import attitude_matrices, ecliptic_direction, isotropic_directions
from flybystab.errors import InvalidInput
from flybystab.flybys.batch import body_rows
from flybystab.screening.distributions import truncated_normal
from flybystab.screening.priors import Population
from flybystab.typing import Array


@lru_cache(maxsize=1)
def _catalogue_values() -> dict[str, Array]:
    """Spin periods (h) and elongations a/b of the embedded catalogue, tumblers left out."""
    bodies = [a for a in catalogue() if a.row["spin_state"] == "principal"]
    periods = np.array([a.quantity("spin_period_h").value for a in bodies])
    axes = np.array([a.semi_axes.value for a in bodies])
    return {"spin_period_h": np.sort(periods), "elongation": np.sort(axes[:, 0] / axes[:, 1])}


def stream(seed: int, *names: object, skip: int = 0) -> np.random.Generator:
    """Random numbers that depend on the seed and the names only, without the first `skip` of them."""
    digest = hashlib.sha256("|".join(str(n) for n in names).encode()).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
    bits = np.random.PCG64(np.random.SeedSequence([seed, *words]))
    return np.random.Generator(bits.advance(skip) if skip else bits)


class Draws(NamedTuple):
    """Samples of one asteroid; sample 0 of a nominal draw holds the catalogue's values.

    Attributes
    ----------
    axes : ndarray (n, 3)
        Semi-axes, m, longest first.
    rho, period, phi, cohesion : ndarray (n,)
        kg/m3, s, rad, Pa.
    omega : ndarray (n, 3)
        Angular velocity along the axes, rad/s.
    phase : ndarray (n,)
        Phase of a tumbler in its rotation period.
    drawn : tuple of str
        Quantities drawn from a prior instead of the catalogue.
    solution : ndarray (n,) of int
        Number of the rival spin solution; -1 for the values of the catalogue.
    """

    axes: Array
    rho: Array
    period: Array
    phi: Array
    cohesion: Array
    omega: Array
    phase: Array
    drawn: tuple[str, ...]
    solution: NDArray[np.int64]

    def part(self, first: int, last: int) -> Draws:
        """Samples `first` to ``last - 1``."""
        arrays = {name: getattr(self, name)[first:last] for name in self._fields if name != "drawn"}
        return self._replace(**arrays)

    def rows(self, samples: NDArray[np.int64], attitudes: Array, material: Material) -> NDArray[Any]:
        """Records of samples in one encounter, with rotations (n, 3, 3), body axes -> frame of the encounter.

        Raises
        ------
        InvalidInput
            For a density that no asteroid has.
        """
        rho = self.rho[samples]
        for i in samples[~((DENSITY_RANGE[0] <= rho) & (rho <= DENSITY_RANGE[1]))]:
            self.body(int(i), material)  # raises
        return body_rows(
            self.axes[samples], rho, self.omega[samples], attitudes, self.phi[samples], self.cohesion[samples], material
        )  # fmt: skip

    def body(self, i: int, material: Material) -> Body:
        """Sample `i` as a body; friction and cohesion are the sample's, the rest is of `material`."""
        return Body(
            semi_axes=self.axes[i] * u.m,
            density=self.rho[i] * u.kg / u.m**3,
            spin=self.omega[i] * u.rad / u.s,
            material=material.with_(
                friction_angle=np.rad2deg(self.phi[i]) * u.deg, cohesion=self.cohesion[i] * u.Pa
            ),
        )


#: Columns of uniform numbers behind a draw.
_SIZE, _SHAPE, _FLAT, _THIRD, _DENSITY, _PERIOD, _FRICTION, _COHESION, _PHASE, _ALBEDO, _SOLUTION = range(11)
_WIDTH = 12


def nominal(asteroid: Asteroid, material: Material, population: Population | None = None) -> Draws:
    """The catalogue body as a draw of one; missing quantities have the median of their prior.

    Raises
    ------
    InvalidInput
        The row has neither a size nor an absolute magnitude, or a value is not a number.
    """
    middle = np.full((1, _WIDTH), 0.5)
    draw = _draws(asteroid, middle, population or Population(), keep=True)
    return draw._replace(phi=np.array([material.phi]), cohesion=np.array([material.c_pa]))


def free_rotation(asteroid: Asteroid, draw: Draws, phases: int = 720) -> Draws:
    """The catalogue body, a draw of one, at equally spaced phases of its free rotation; itself unless it tumbles."""
    if not asteroid.tumbles:
        return draw
    omega = asteroid.angular_velocities(np.arange(phases) / phases)
    axes, rho, phi, cohesion = (
        np.repeat(x, phases, axis=0) for x in (draw.axes, draw.rho, draw.phi, draw.cohesion)
    )
    period = 2.0 * np.pi / np.linalg.norm(omega, axis=1)
    return draw._replace(
        axes=axes,
        rho=rho,
        phi=phi,
        cohesion=cohesion,
        omega=omega,
        period=period,
        solution=np.repeat(draw.solution, phases),
    )


def completed(asteroid: Asteroid, population: Population | None = None) -> Asteroid:
    """The asteroid with the medians of the population for missing values, which are listed as assumptions.

    Raises
    ------
    InvalidInput
        The row has neither a size nor an absolute magnitude.
    """
    found = nominal(asteroid, asteroid.material, population)
    row = dict(asteroid.row)
    values = dict(zip(SHAPE, found.axes[0].tolist(), strict=True)) | {"density_kg_m3": float(found.rho[0])}
    if not asteroid.tumbles:
        values["spin_period_h"] = float(found.period[0]) / 3600.0
    missing = [c for c in values if not row.get(c)]
    if not missing:
        return asteroid
    if set(missing) & set(SHAPE):
        missing = [*SHAPE, *(c for c in missing if c not in SHAPE)]
    row |= {c: repr(values[c]) for c in missing}
    row["assumed"] = ";".join(dict.fromkeys([*asteroid.assumed, *missing]))
    row["drawn"] = ";".join(found.drawn)
    return replace(asteroid, row=row)


def draws(
    asteroid: Asteroid, samples: int, seed: int, population: Population | None = None, *, first: int = 0
) -> Draws:
    """Samples of an asteroid from number `first` on (arguments as in :func:`nominal`)."""
    uniform = stream(seed, "body", identity(asteroid), skip=first * _WIDTH).random((samples, _WIDTH))
    return _draws(asteroid, uniform, population or Population(), keep=False)


def _draws(asteroid: Asteroid, x: Array, population: Population, *, keep: bool) -> Draws:
    """`keep` uses known values without their errors and ignores `replace_assumed`."""
    n = len(x)
    drawn: list[str] = []
    replace = population.replace_assumed and not keep
    tumbles = asteroid.tumbles

    def known(*columns: str) -> bool:
        return asteroid.knows(*columns) and not (replace and any(c in asteroid.assumed for c in columns))

    def value(column: str) -> float:
        return asteroid._number(column)

    def relative(column: str) -> float:
        """Relative 1-sigma; zero where none is given."""
        sigma = column.removesuffix("_m") + "_sigma_m"
        return value(sigma) / value(column) if asteroid.knows(sigma) and not keep else 0.0

    # Size
    if asteroid.knows("diameter_m"):
        size = value("diameter_m") * truncated_normal(x[:, _SIZE], 1.0, relative("diameter_m"), 0.1, 10.0)
    elif asteroid.knows("semi_axis_a_m", "semi_axis_b_m", "semi_axis_c_m"):
        size = np.full(n, 2.0 * float(np.prod(asteroid.semi_axes.value)) ** (1 / 3))
    elif asteroid.knows("H_mag"):
        albedo = population.albedo.quantile(x[:, _ALBEDO])
        size = diameter_of(value("H_mag"), albedo)
        drawn.append("diameter (from H and albedo)")
    else:
        raise InvalidInput(
            "diameter_m",
            "(empty)",
            f"a size (--axes, --diameter, --H; Asteroid(body=...)) for {asteroid.label} in {asteroid.file}",
        )

    # Shape, then scaled to the size
    if known("semi_axis_a_m", "semi_axis_b_m", "semi_axis_c_m") and (
        keep or tumbles or asteroid.row.get("shape_kind") != "size+elongation"
    ):
        shape = np.tile(asteroid.semi_axes.value, (n, 1))
        if not keep and not tumbles:
            common = relative("diameter_m")
            for i, (axis, column) in enumerate(zip("abc", (_SHAPE, _FLAT, _THIRD), strict=True)):
                own = np.sqrt(max(0.0, relative(f"semi_axis_{axis}_m") ** 2 - common**2))
                shape[:, i] *= truncated_normal(x[:, column], 1.0, own, 0.2, 5.0)
    else:
        if known("amplitude_mag") and not replace:
            centre = population.log_elongation_per_mag * value("amplitude_mag")
            elongation = 10.0 ** truncated_normal(
                x[:, _SHAPE], centre, population.log_elongation_sigma, 0.0, np.log10(4.0)
            )
            drawn.append("elongation (from the lightcurve amplitude)")
        else:
            elongation = population.elongation.quantile(x[:, _SHAPE], _catalogue_values()["elongation"])
            elongation = np.maximum(1.0, elongation)
            drawn.append("elongation")
        flat = np.minimum(1.0, population.flattening.quantile(x[:, _FLAT]))
        drawn.append("flattening")
        shape = np.column_stack([elongation, np.ones(n), flat])
    shape = np.sort(shape, axis=1)[:, ::-1]
    axes = shape * (0.5 * size / np.cbrt(np.prod(shape, axis=1)))[:, None]

    # Density
    if known("density_kg_m3"):
        centre = value("density_kg_m3")
        has_sigma = asteroid.knows("density_sigma_kg_m3") and not keep
        sd = value("density_sigma_kg_m3") if has_sigma else 0.0
        least, most = max(0.25 * centre, DENSITY_RANGE[0]), min(4.0 * centre, DENSITY_RANGE[1])
        rho = truncated_normal(x[:, _DENSITY], centre, sd, least, most)
        if "density_kg_m3" in asteroid.assumed:
            drawn.append("density (from the class)" if asteroid.row.get("taxonomic_class") else "density")
    else:
        distribution, name = population.density_of(asteroid.row.get("taxonomic_class", ""))
        rho = distribution.quantile(x[:, _DENSITY])
        drawn.append(name)

    # Spin
    phase = x[:, _PHASE] if not keep else np.zeros(n)
    solutions = () if tumbles else asteroid.spin_solutions
    solution = (
        chosen(solutions, x[:, _SOLUTION]) if solutions and not keep else np.full(n, -1, dtype=np.int64)
    )
    if tumbles:
        omega = asteroid.angular_velocities(phase)
        period = 2.0 * np.pi / np.linalg.norm(omega, axis=1)
    else:
        if solutions and not keep:
            period = np.empty(n)
            for k, s in enumerate(solutions):
                u01 = x[solution == k, _PERIOD]
                hours = truncated_normal(u01, s.period, s.sigma, 0.2 * s.period, 5.0 * s.period)
                period[solution == k] = 3600.0 * hours
        elif known("spin_period_h"):
            has_sigma = asteroid.knows("spin_period_sigma_h") and not keep
            centre, sd = value("spin_period_h"), value("spin_period_sigma_h") if has_sigma else 0.0
            period = 3600.0 * truncated_normal(x[:, _PERIOD], centre, sd, 0.2 * centre, 5.0 * centre)
        else:
            values = _catalogue_values()["spin_period_h"]
            if population.spin_period_h.kind == "lightcurves":
                values = periods_like(value("H_mag") if asteroid.knows("H_mag") else None)
            period = 3600.0 * population.spin_period_h.quantile(x[:, _PERIOD], values)
            drawn.append("spin period")
        omega = np.column_stack([np.zeros(n), np.zeros(n), 2.0 * np.pi / period])

    phi = np.radians(population.friction_angle_deg.quantile(x[:, _FRICTION]))
    cohesion = population.cohesion_Pa.quantile(x[:, _COHESION])
    return Draws(axes, rho, period, phi, cohesion, omega, phase, tuple(drawn), solution)


@dataclass(frozen=True)
class Attitudes:
    """Attitudes of an asteroid's samples at one encounter, computed on demand."""

    asteroid: Asteroid
    draws: Draws
    uniform: Array = field(repr=False)

    @classmethod
    def at(cls, asteroid: Asteroid, draws: Draws, seed: int, *encounter: object, first: int = 0) -> Attitudes:
        """Attitudes of samples from number `first` on; they depend on seed, asteroid, encounter and number only."""
        numbers = stream(seed, "attitude", identity(asteroid), *encounter, skip=3 * first)
        return cls(asteroid, draws, numbers.random((len(draws.rho), 3)))

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.uniform)

    def part(self, first: int, last: int) -> Attitudes:
        """Attitudes of samples `first` to ``last - 1``."""
        return Attitudes(self.asteroid, self.draws.part(first, last), self.uniform[first:last])

    def matrices(self, samples: NDArray[np.int64]) -> Array:
        """Rotations of samples, body axes -> ICRF, shape (n, 3, 3)."""
        s = self.draws.axes[samples] ** 2
        momentum = (s.sum(axis=1)[:, None] - s) * self.draws.omega[samples]
        return attitude_matrices(momentum, self.poles[samples], 2.0 * np.pi * self.uniform[samples, 2])

    @property
    def poles(self) -> Array:
        """Directions of the angular momentum of the samples, ICRF, shape (n, 3)."""
        known, solutions = self.asteroid.pole, self.asteroid.spin_solutions
        if known is not None and not solutions:
            return np.tile(known, (len(self.uniform), 1))
        out = isotropic_directions(self.uniform[:, :2])
        if known is not None:
            out[self.draws.solution < 0] = known
        for k, solution in enumerate(solutions):  # one without a pole leaves it unknown
            if solution.pole is not None:
                out[self.draws.solution == k] = ecliptic_direction(*np.radians(solution.pole).tolist())
        return out

    def matrix(self, i: int) -> Array:
        """Rotation of sample `i`, body axes -> ICRF."""
        return self.matrices(np.array([i]))[0]


@dataclass(frozen=True)
class Samples:
    """Samples of an asteroid at one encounter, drawn part by part: memory does not grow with their number."""

    asteroid: Asteroid
    count: int
    seed: int
    population: Population | None
    encounter: tuple[object, ...]

    def part(self, first: int, last: int) -> Attitudes:
        """Samples `first` to ``last - 1``: the same as those of a draw of all."""
        draw = draws(self.asteroid, last - first, self.seed, self.population, first=first)
        return Attitudes.at(self.asteroid, draw, self.seed, *self.encounter, first=first)
