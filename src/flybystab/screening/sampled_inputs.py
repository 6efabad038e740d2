"""Samples of size, shape, density and spin: catalogue values within their errors, or priors."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import DENSITY_RANGE
from flybystab.catalogues.asteroid import Asteroid
from flybystab.catalogues.catalogue import catalogue
from flybystab.catalogues.lightcurves import periods_like
from flybystab.catalogues.magnitude import diameter_of
from flybystab.catalogues.record import SHAPE
from flybystab.catalogues.spin_solutions import SpinSolution, chosen
from flybystab.errors import InvalidInput
from flybystab.screening.distributions import truncated_normal
from flybystab.screening.priors import Population
from flybystab.typing import Array

#: Columns of uniform numbers behind a draw.
_SIZE, _SHAPE, _FLAT, _THIRD, _DENSITY, _PERIOD, _FRICTION, _COHESION, _PHASE, _ALBEDO, _SOLUTION = range(11)
#: Number of uniform numbers of a sample; one is unused.
WIDTH = 12


@lru_cache(maxsize=1)
def _catalogue_values() -> dict[str, Array]:
    """Spin periods (h) and elongations a/b of the embedded catalogue, without tumblers."""
    bodies = [a for a in catalogue() if a.row["spin_state"] == "principal"]
    periods = np.array([a.quantity("spin_period_h").value for a in bodies])
    axes = np.array([a.semi_axes.value for a in bodies])
    return {"spin_period_h": np.sort(periods), "elongation": np.sort(axes[:, 0] / axes[:, 1])}


class SampledSpins(NamedTuple):
    """Spins of the samples: period (s), angular velocity along the axes (rad/s), phase, and number of the solution."""

    period: Array
    omega: Array
    phase: Array
    solution: NDArray[np.int64]


class SampledInputs:
    """Samples of the inputs of one asteroid from uniform numbers.

    Parameters
    ----------
    asteroid : Asteroid
    x : ndarray (n, WIDTH)
        Uniform numbers.
    population : Population
        Priors.
    keep : bool
        Use known values without their errors, and ignore `replace_assumed` of the population.

    Attributes
    ----------
    drawn : list of str
        Quantities that were drawn from a prior, filled by the methods.
    """

    def __init__(self, asteroid: Asteroid, x: Array, population: Population, *, keep: bool) -> None:
        self.asteroid, self.x, self.population, self.keep = asteroid, x, population, keep
        self.replace = population.replace_assumed and not keep
        self.drawn: list[str] = []

    def _known(self, *columns: str) -> bool:
        """True if the columns have values that the prior does not replace."""
        assumed = self.replace and any(c in self.asteroid.assumed for c in columns)
        return self.asteroid.knows(*columns) and not assumed

    def _value(self, column: str) -> float:
        return self.asteroid._number(column)

    def _sigma(self, column: str) -> float:
        """The error in a column; zero where none is given or known values are kept."""
        return self._value(column) if self.asteroid.knows(column) and not self.keep else 0.0

    def _relative(self, column: str) -> float:
        """Relative 1-sigma of a length; zero where none is given."""
        sigma = self._sigma(column.removesuffix("_m") + "_sigma_m")
        return sigma / self._value(column) if sigma else 0.0

    def diameters(self) -> Array:
        """Diameters (m), shape (n,): measured, of the semi-axes, or from absolute magnitude and albedo.

        Raises
        ------
        InvalidInput
            None of these is known.
        """
        x, asteroid = self.x, self.asteroid
        if asteroid.knows("diameter_m"):
            spread = self._relative("diameter_m")
            return self._value("diameter_m") * truncated_normal(x[:, _SIZE], 1.0, spread, 0.1, 10.0)
        if asteroid.knows(*SHAPE):
            return np.full(len(x), 2.0 * float(np.prod(asteroid.semi_axes.value)) ** (1 / 3))
        if asteroid.knows("H_mag"):
            albedo = self.population.albedo.quantile(x[:, _ALBEDO])
            self.drawn.append("diameter (from H and albedo)")
            return diameter_of(self._value("H_mag"), albedo)
        raise InvalidInput(
            "diameter_m",
            "(empty)",
            f"a size (--axes, --diameter, --H; Asteroid(body=...)) for {asteroid.label} in {asteroid.file}",
        )

    def semi_axes(self) -> Array:
        """Semi-axes (m), shape (n, 3), longest first: the sampled shapes, scaled to the sampled diameters."""
        size = self.diameters()
        measured = (
            self.keep or self.asteroid.tumbles or self.asteroid.row.get("shape_kind") != "size+elongation"
        )
        shape = self._measured_shapes() if self._known(*SHAPE) and measured else self._shapes_by_prior()
        shape = np.sort(shape, axis=1)[:, ::-1]
        return shape * (0.5 * size / np.cbrt(np.prod(shape, axis=1)))[:, None]

    def _measured_shapes(self) -> Array:
        """Catalogued semi-axes; their errors beyond the common one of the size are independent."""
        shape = np.tile(self.asteroid.semi_axes.value, (len(self.x), 1))
        if not self.keep and not self.asteroid.tumbles:
            common = self._relative("diameter_m")
            for i, (axis, column) in enumerate(zip("abc", (_SHAPE, _FLAT, _THIRD), strict=True)):
                own = np.sqrt(max(0.0, self._relative(f"semi_axis_{axis}_m") ** 2 - common**2))
                shape[:, i] *= truncated_normal(self.x[:, column], 1.0, own, 0.2, 5.0)
        return shape

    def _shapes_by_prior(self) -> Array:
        """Axis ratios from the amplitude of the lightcurve, or from the population."""
        x, population = self.x, self.population
        if self._known("amplitude_mag") and not self.replace:
            centre = population.log_elongation_per_mag * self._value("amplitude_mag")
            elongation = 10.0 ** truncated_normal(
                x[:, _SHAPE], centre, population.log_elongation_sigma, 0.0, np.log10(4.0)
            )
            self.drawn.append("elongation (from the lightcurve amplitude)")
        else:
            elongation = population.elongation.quantile(x[:, _SHAPE], _catalogue_values()["elongation"])
            elongation = np.maximum(1.0, elongation)
            self.drawn.append("elongation")
        flat = np.minimum(1.0, population.flattening.quantile(x[:, _FLAT]))
        self.drawn.append("flattening")
        return np.column_stack([elongation, np.ones(len(x)), flat])

    def densities(self) -> Array:
        """Densities (kg/m3), shape (n,)."""
        x, asteroid = self.x[:, _DENSITY], self.asteroid
        if not self._known("density_kg_m3"):
            distribution, name = self.population.density_of(asteroid.row.get("taxonomic_class", ""))
            self.drawn.append(name)
            return distribution.quantile(x)
        centre = self._value("density_kg_m3")
        least, most = max(0.25 * centre, DENSITY_RANGE[0]), min(4.0 * centre, DENSITY_RANGE[1])
        if "density_kg_m3" in asteroid.assumed:
            self.drawn.append(
                "density (from the class)" if asteroid.row.get("taxonomic_class") else "density"
            )
        return truncated_normal(x, centre, self._sigma("density_sigma_kg_m3"), least, most)

    def spins(self) -> SampledSpins:
        """Spins: of a tumbler at random phases, of alternative solutions by their weights, or from the period."""
        n = len(self.x)
        phase = np.zeros(n) if self.keep else self.x[:, _PHASE]
        none = np.full(n, -1, dtype=np.int64)
        if self.asteroid.tumbles:
            omega = self.asteroid.angular_velocities(phase)
            return SampledSpins(2.0 * np.pi / np.linalg.norm(omega, axis=1), omega, phase, none)
        alternatives = () if self.keep else self.asteroid.spin_solutions
        solution = chosen(alternatives, self.x[:, _SOLUTION]) if alternatives else none
        period = self._alternative_periods(alternatives, solution) if alternatives else self._periods()
        omega = np.column_stack([np.zeros(n), np.zeros(n), 2.0 * np.pi / period])
        return SampledSpins(period, omega, phase, solution)

    def _alternative_periods(
        self, alternatives: tuple[SpinSolution, ...], solution: NDArray[np.int64]
    ) -> Array:
        """Periods (s) of the chosen solutions within their errors."""
        period = np.empty(len(solution))
        for k, s in enumerate(alternatives):
            u01 = self.x[solution == k, _PERIOD]
            hours = truncated_normal(u01, s.period, s.sigma, 0.2 * s.period, 5.0 * s.period)
            period[solution == k] = 3600.0 * hours
        return period

    def _periods(self) -> Array:
        """Periods (s) from the catalogue, or from the population."""
        x, population = self.x[:, _PERIOD], self.population
        if self._known("spin_period_h"):
            centre, sd = self._value("spin_period_h"), self._sigma("spin_period_sigma_h")
            return 3600.0 * truncated_normal(x, centre, sd, 0.2 * centre, 5.0 * centre)
        values = _catalogue_values()["spin_period_h"]
        if population.spin_period_h.kind == "lightcurves":
            values = periods_like(self._value("H_mag") if self.asteroid.knows("H_mag") else None)
        self.drawn.append("spin period")
        return 3600.0 * population.spin_period_h.quantile(x, values)

    def friction_angles(self) -> Array:
        """Friction angles (rad), shape (n,)."""
        return np.radians(self.population.friction_angle_deg.quantile(self.x[:, _FRICTION]))

    def cohesions(self) -> Array:
        """Cohesions (Pa), shape (n,)."""
        return self.population.cohesion_Pa.quantile(self.x[:, _COHESION])
