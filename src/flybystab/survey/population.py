"""Bodies drawn from what is known: catalogue values within their errors, distributions for the rest.

A draw is fixed by the seed, the asteroid and the number of the sample alone: sample 17 of Apophis is the same
whatever else is screened, in any order, by any number of workers, and for any number of samples. The same
draw of a body meets every planet; its attitude is drawn anew for every encounter.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from flybystab.aggregate.body import Body, Material
from flybystab.errors import InvalidInput, UnknownName
from flybystab.survey.attitude import attitude_matrix, free_spin, isotropic_direction
from flybystab.survey.catalogue import Asteroid, catalogue

Array = NDArray[np.float64]

#: Elongation from the lightcurve amplitude: log10(a/b) = 0.4 x 0.5 x amplitude +- 0.10 (data/README.md).
AMPLITUDE_TO_LOG_ELONGATION, LOG_ELONGATION_SIGMA = 0.2, 0.10
_KINDS = {
    "fixed": ("value",),
    "uniform": ("low", "high"),
    "loguniform": ("low", "high"),
    "normal": ("mean", "sd"),
    "lognormal": ("median", "sigma"),
    "catalogue": (),
}


@dataclass(frozen=True)
class Distribution:
    """A distribution of one number.

    Parameters
    ----------
    kind : str
        "fixed" (value), "uniform" or "loguniform" (low, high), "normal" (mean, sd), "lognormal" (median,
        sigma of the natural logarithm), or "catalogue": the values of the embedded catalogue, each as likely.
    low, high : float, optional
        Truncate "normal" and "lognormal".
    """

    kind: str
    value: float | None = None
    low: float | None = None
    high: float | None = None
    mean: float | None = None
    sd: float | None = None
    median: float | None = None
    sigma: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise UnknownName(
                "distribution",
                str(self.kind),
                get_close_matches(str(self.kind), _KINDS),
                f"(known: {list(_KINDS)})",
            )
        for f in fields(self)[1:]:
            x = getattr(self, f.name)
            if x is not None and (
                isinstance(x, bool) or not isinstance(x, int | float) or not np.isfinite(x)
            ):
                raise InvalidInput(f.name, x, "a finite number")
        for name in _KINDS[self.kind]:
            if getattr(self, name) is None:
                raise InvalidInput(name, "(missing)", f"a value: the distribution {self.kind!r} needs it")
        if self.low is not None and self.high is not None and not self.low <= self.high:
            raise InvalidInput("low", self.low, f"at most high = {self.high}")
        positive = {"loguniform": self.low, "lognormal": self.median}.get(self.kind, 1.0)
        spread = {"normal": self.sd, "lognormal": self.sigma}.get(self.kind, 0.0)
        if not (positive is not None and positive > 0.0 and spread is not None and spread >= 0.0):
            raise InvalidInput("distribution", self, "a positive scale and a spread of zero or more")

    def quantile(self, x: Array, values: Array | None = None) -> Array:
        """Values at cumulative probabilities `x` in (0, 1); `values` serves the kind "catalogue"."""
        x = np.asarray(x, dtype=float)
        if self.kind == "fixed":
            return np.full(x.shape, self.value)
        if self.kind == "uniform":
            assert self.low is not None and self.high is not None  # noqa: PT018
            return self.low + (self.high - self.low) * x
        if self.kind == "loguniform":
            assert self.low is not None and self.high is not None  # noqa: PT018
            return self.low * (self.high / self.low) ** x
        if self.kind == "catalogue":
            if values is None or not len(values):
                raise InvalidInput("distribution", self.kind, "one that the catalogue has values for")
            return np.sort(values)[np.minimum((x * len(values)).astype(int), len(values) - 1)]
        logarithmic = self.kind == "lognormal"
        centre, sd = (self.median, self.sigma) if logarithmic else (self.mean, self.sd)
        assert centre is not None and sd is not None  # noqa: PT018
        low, high = (-np.inf if self.low is None else self.low), (np.inf if self.high is None else self.high)
        if logarithmic:
            centre = np.log(centre)
            low, high = np.log(max(low, 1e-300)), np.log(high)
        found = truncated_normal(x, centre, sd, low, high)
        return np.exp(found) if logarithmic else found

    def __str__(self) -> str:
        values = ", ".join(
            f"{f.name} {getattr(self, f.name):g}"
            for f in fields(self)[1:]
            if getattr(self, f.name) is not None
        )
        return f"{self.kind} ({values})" if values else self.kind


def truncated_normal(x: Array, mean: float, sd: float, low: float = -np.inf, high: float = np.inf) -> Array:
    """Quantile of a normal distribution cut to [low, high]."""
    if sd == 0.0:
        return np.full(np.shape(x), min(max(mean, low), high))
    a, b = ndtr((low - mean) / sd), ndtr((high - mean) / sd)
    return np.clip(mean + sd * ndtri(a + x * (b - a)), low, high)


@dataclass(frozen=True)
class Population:
    """What is drawn where the catalogue is silent, and the material, which no catalogue knows.

    Every field is a :class:`Distribution`; units are in the names. `friction_angle_deg` and `cohesion_Pa`
    apply to every body, the others only where the catalogue has no value, or also to its assumed values
    with `replace_assumed`.
    """

    friction_angle_deg: Distribution = Distribution("uniform", low=25.0, high=45.0)
    cohesion_Pa: Distribution = Distribution("uniform", low=0.0, high=100.0)
    density_kg_m3: Distribution = Distribution("normal", mean=2000.0, sd=700.0, low=800.0, high=4000.0)
    elongation: Distribution = Distribution("catalogue")
    flattening: Distribution = Distribution("normal", mean=0.9, sd=0.1, low=0.4, high=1.0)
    spin_period_h: Distribution = Distribution("catalogue")
    albedo: Distribution = Distribution("lognormal", median=0.14, sigma=0.8, low=0.02, high=0.6)
    replace_assumed: bool = False

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> Population:
        """From a mapping such as a TOML table: ``{"cohesion_Pa": {"kind": "fixed", "value": 0}}``.

        Raises
        ------
        UnknownName, InvalidInput
        """
        known = {f.name for f in fields(cls)}
        made: dict[str, Any] = {}
        for key, value in data.items():
            if key not in known:
                near = get_close_matches(key, known)
                raise UnknownName("population key", key, near, f"(known: {sorted(known)})")
            if key == "replace_assumed":
                if not isinstance(value, bool):
                    raise InvalidInput(key, value, "true or false")
                made[key] = value
                continue
            if isinstance(value, int | float) and not isinstance(value, bool):
                value = {"kind": "fixed", "value": float(value)}
            if not isinstance(value, Mapping) or "kind" not in value:
                raise InvalidInput(key, value, 'a number or a table with a "kind"')
            allowed = {f.name for f in fields(Distribution)}
            for inner in value:
                if inner not in allowed:
                    raise UnknownName(f"key of {key}", inner, get_close_matches(inner, allowed))
            made[key] = Distribution(**value)
        return cls(**made)

    @classmethod
    def from_file(cls, path: str | Path) -> Population:
        """From a TOML file."""
        try:
            data = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise InvalidInput("population file", path, f"a readable TOML file ({error})") from None
        return cls.from_mapping(data)

    def stated(self) -> dict[str, str]:
        """The distributions in words."""
        return {f.name: str(getattr(self, f.name)) for f in fields(self)}


@lru_cache(maxsize=1)
def _catalogue_values() -> dict[str, Array]:
    """Spin periods (h) and elongations a/b of the embedded catalogue, tumblers left out."""
    bodies = [a for a in catalogue() if a.row["spin_state"] == "principal"]
    periods = np.array([a.quantity("spin_period_h").value for a in bodies])
    axes = np.array([a.semi_axes.value for a in bodies])
    return {"spin_period_h": np.sort(periods), "elongation": np.sort(axes[:, 0] / axes[:, 1])}


def stream(seed: int, *names: object) -> np.random.Generator:
    """Random numbers that depend on the seed and the names only."""
    digest = hashlib.sha256("|".join(str(n) for n in names).encode()).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *words])))


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
        What came from a distribution rather than from the catalogue.
    """

    axes: Array
    rho: Array
    period: Array
    phi: Array
    cohesion: Array
    omega: Array
    phase: Array
    drawn: tuple[str, ...]

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
_SIZE, _SHAPE, _FLAT, _THIRD, _DENSITY, _PERIOD, _FRICTION, _COHESION, _PHASE, _ALBEDO = range(10)
_WIDTH = 12


def identity(asteroid: Asteroid) -> str:
    """What names an asteroid in the random streams and in a journal."""
    return str(asteroid.number) if asteroid.number is not None else asteroid.designation or asteroid.name


def _tumbling_rates(asteroid: Asteroid, phase: Array) -> Array:
    moments, momentum, j = asteroid._tumbling
    return free_spin(moments, momentum, j, phase)[0]


def nominal(asteroid: Asteroid, material: Material, population: Population | None = None) -> Draws:
    """The catalogue's values as a draw of one; what is missing is the median of its distribution.

    Raises
    ------
    InvalidInput
        The row has neither a size nor an absolute magnitude, or a value that is no number.
    """
    middle = np.full((1, _WIDTH), 0.5)
    draw = _draws(asteroid, middle, population or Population(), keep=True)
    return draw._replace(phi=np.array([material.phi]), cohesion=np.array([material.c_pa]))


def draws(asteroid: Asteroid, samples: int, seed: int, population: Population | None = None) -> Draws:
    """Samples of an asteroid (arguments as in :func:`nominal`)."""
    uniform = stream(seed, "body", identity(asteroid)).random((samples, _WIDTH))
    return _draws(asteroid, uniform, population or Population(), keep=False)


def _draws(asteroid: Asteroid, x: Array, population: Population, *, keep: bool) -> Draws:
    """`keep` leaves known values as they are: without their errors, and without `replace_assumed`."""
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
        size = 1.329e6 / np.sqrt(albedo) * 10.0 ** (-value("H_mag") / 5.0)
        drawn.append("diameter (from H and albedo)")
    else:
        raise InvalidInput(
            "diameter_m", "(empty)", f"a size or H_mag for {asteroid.label} in {asteroid.file}"
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
            centre = AMPLITUDE_TO_LOG_ELONGATION * value("amplitude_mag")
            elongation = 10.0 ** truncated_normal(
                x[:, _SHAPE], centre, LOG_ELONGATION_SIGMA, 0.0, np.log10(4.0)
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
        rho = truncated_normal(x[:, _DENSITY], centre, sd, 0.25 * centre, 4.0 * centre)
        if "density_kg_m3" in asteroid.assumed:
            drawn.append("density (from the class)" if asteroid.row.get("taxonomic_class") else "density")
    else:
        rho = population.density_kg_m3.quantile(x[:, _DENSITY])
        drawn.append("density")

    # Spin
    phase = x[:, _PHASE] if not keep else np.zeros(n)
    if tumbles:
        omega = _tumbling_rates(asteroid, phase)
        period = 2.0 * np.pi / np.linalg.norm(omega, axis=1)
    else:
        if known("spin_period_h"):
            has_sigma = asteroid.knows("spin_period_sigma_h") and not keep
            centre, sd = value("spin_period_h"), value("spin_period_sigma_h") if has_sigma else 0.0
            period = 3600.0 * truncated_normal(x[:, _PERIOD], centre, sd, 0.2 * centre, 5.0 * centre)
        else:
            period = 3600.0 * population.spin_period_h.quantile(
                x[:, _PERIOD], _catalogue_values()["spin_period_h"]
            )
            drawn.append("spin period")
        omega = np.column_stack([np.zeros(n), np.zeros(n), 2.0 * np.pi / period])

    phi = np.radians(population.friction_angle_deg.quantile(x[:, _FRICTION]))
    cohesion = population.cohesion_Pa.quantile(x[:, _COHESION])
    return Draws(axes, rho, period, phi, cohesion, omega, phase, tuple(drawn))


@dataclass(frozen=True)
class Attitudes:
    """Attitudes of an asteroid's samples at one encounter, made one by one when they are asked for."""

    asteroid: Asteroid
    draws: Draws
    uniform: Array = field(repr=False)

    @classmethod
    def at(cls, asteroid: Asteroid, draws: Draws, seed: int, *encounter: object) -> Attitudes:
        """Attitudes that depend on the seed, the asteroid and the encounter only."""
        numbers = stream(seed, "attitude", identity(asteroid), *encounter).random((len(draws.rho), 3))
        return cls(asteroid, draws, numbers)

    def pole(self, i: int) -> Array:
        """Direction of the angular momentum of sample `i`, ICRF."""
        known = self.asteroid.pole
        return isotropic_direction(self.uniform[i, :2]) if known is None else known

    def matrix(self, i: int) -> Array:
        """Rotation of sample `i`, body axes -> ICRF."""
        s = self.draws.axes[i] ** 2
        momentum = (s.sum() - s) * self.draws.omega[i]
        return attitude_matrix(momentum, self.pole(i), 2.0 * np.pi * float(self.uniform[i, 2]))
