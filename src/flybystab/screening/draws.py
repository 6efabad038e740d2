"""Random bodies: catalogue values within their errors, and priors for unmeasured quantities.

A sample depends on the seed, the asteroid and the sample number only: sample 17 of Apophis is the same for any list
of asteroids, any order, any number of workers and any number of samples. All encounters of an asteroid use the same
bodies; the attitudes are drawn for each encounter.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import DENSITY_RANGE, Body, Material
from flybystab.catalogues.asteroid import Asteroid, identity
from flybystab.catalogues.record import SHAPE
from flybystab.catalogues.tumbling import attitude_matrices, ecliptic_direction, isotropic_directions
from flybystab.flybys.batch import body_rows
from flybystab.screening.priors import Population
from flybystab.screening.sampled_inputs import WIDTH, SampledInputs
from flybystab.typing import Array


def stream(seed: int, *names: object, skip: int = 0) -> np.random.Generator:
    """Generator of random numbers that depend on the seed and the names only; the first `skip` are omitted."""
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
        Number of the alternative spin solution; -1 for the values of the catalogue.
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

    def rows(self, samples: NDArray[np.int64], attitudes: Array, material: Material) -> NDArray[np.void]:
        """Records of samples in one encounter, with rotations (n, 3, 3), body axes -> frame of the encounter.

        Raises
        ------
        InvalidInput
            A density is outside :data:`DENSITY_RANGE`.
        """
        rho = self.rho[samples]
        for i in samples[~((DENSITY_RANGE[0] <= rho) & (rho <= DENSITY_RANGE[1]))]:
            self.body(int(i), material)  # raises
        return body_rows(
            self.axes[samples], rho, self.omega[samples], attitudes, self.phi[samples], self.cohesion[samples], material
        )  # fmt: skip

    def body(self, i: int, material: Material) -> Body:
        """Sample `i` as a body; with the friction and cohesion of the sample, otherwise of `material`."""
        return Body(
            semi_axes=self.axes[i] * u.m,
            density=self.rho[i] * u.kg / u.m**3,
            spin=self.omega[i] * u.rad / u.s,
            material=material.with_(
                friction_angle=np.rad2deg(self.phi[i]) * u.deg, cohesion=self.cohesion[i] * u.Pa
            ),
        )


def nominal(asteroid: Asteroid, material: Material, population: Population | None = None) -> Draws:
    """The catalogue body as a single sample; missing quantities have the median of their prior.

    Raises
    ------
    InvalidInput
        The row has neither a size nor an absolute magnitude, or a value is not a number.
    """
    middle = np.full((1, WIDTH), 0.5)
    draw = _draws(asteroid, middle, population or Population(), keep=True)
    return draw._replace(phi=np.array([material.phi]), cohesion=np.array([material.c_pa]))


def free_rotation(asteroid: Asteroid, draw: Draws, phases: int = 720) -> Draws:
    """The catalogue body at equally spaced phases of its free rotation; unchanged unless it tumbles."""
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
    uniform = stream(seed, "body", identity(asteroid), skip=first * WIDTH).random((samples, WIDTH))
    return _draws(asteroid, uniform, population or Population(), keep=False)


def _draws(asteroid: Asteroid, x: Array, population: Population, *, keep: bool) -> Draws:
    """Samples from uniform numbers, shape (n, WIDTH); `keep` as in :class:`SampledInputs`."""
    inputs = SampledInputs(asteroid, x, population, keep=keep)
    axes, rho, spins = inputs.semi_axes(), inputs.densities(), inputs.spins()
    return Draws(
        axes,
        rho,
        spins.period,
        inputs.friction_angles(),
        inputs.cohesions(),
        spins.omega,
        spins.phase,
        tuple(inputs.drawn),
        spins.solution,
    )


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
        for k, solution in enumerate(solutions):  # a solution without a pole leaves it unknown
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
        """Samples `first` to ``last - 1``: the same as in a draw of all samples."""
        draw = draws(self.asteroid, last - first, self.seed, self.population, first=first)
        return Attitudes.at(self.asteroid, draw, self.seed, *self.encounter, first=first)
