"""Priors of a screening: distributions of the quantities that are not measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from flybystab.body.body import DENSITY_RANGE
from flybystab.errors import InvalidInput, UnknownName
from flybystab.files import DOCUMENT_LIMIT, parse_toml, read_text
from flybystab.screening.distributions import Distribution, distribution_of
from flybystab.typing import Document

#: Admissible range of each quantity.
_LIMITS = {
    "friction_angle_deg": (0.0, 89.0),
    "cohesion_Pa": (0.0, np.inf),
    "density_kg_m3": DENSITY_RANGE,
    "elongation": (1.0, 20.0),
    "flattening": (0.05, 1.0),
    "spin_period_h": (1e-3, np.inf),
    "albedo": (1e-3, 1.0),
}


_FRICTION = Distribution("uniform", low=25.0, high=45.0)
_COHESION = Distribution("uniform", low=0.0, high=100.0)
_DENSITY = Distribution("normal", mean=2000.0, sd=700.0, low=800.0, high=4000.0)
_ELONGATION = Distribution("catalogue")
_FLATTENING = Distribution("normal", mean=0.9, sd=0.1, low=0.4, high=1.0)
_PERIOD = Distribution("lightcurves")
_ALBEDO = Distribution("lognormal", median=0.14, sigma=0.8, low=0.02, high=0.6)
#: Density by taxonomic letter where it is not measured: mean and scatter of measured bodies (data/README.md).
_STONY = Distribution("normal", mean=2300.0, sd=500.0, low=575.0, high=9200.0)
_CARBONACEOUS = Distribution("normal", mean=1300.0, sd=300.0, low=325.0, high=5200.0)


@dataclass(frozen=True)
class Population:
    """Distributions of the material and of the quantities that a catalogue lacks.

    Units are in the names. `friction_angle_deg` and `cohesion_Pa` apply to every body, the others only where the
    catalogue has no value, or also to its assumed values with `replace_assumed`. `density_by_class_kg_m3` takes
    precedence over `density_kg_m3` where the first letter of the taxonomic class is among its keys. Where a lightcurve
    amplitude is known, ``log10(a/b)`` is normal with mean `log_elongation_per_mag` times the amplitude and
    `log_elongation_sigma`, truncated to 1 <= a/b <= 4; otherwise `elongation` is used. `flattening` is c/b.
    """

    friction_angle_deg: Distribution = _FRICTION
    cohesion_Pa: Distribution = _COHESION
    density_kg_m3: Distribution = _DENSITY
    density_by_class_kg_m3: Mapping[str, Distribution] = field(
        default_factory=lambda: {"SQVKLAOR": _STONY, "CBFGDT": _CARBONACEOUS}
    )
    elongation: Distribution = _ELONGATION
    log_elongation_per_mag: float = 0.2
    log_elongation_sigma: float = 0.10
    flattening: Distribution = _FLATTENING
    spin_period_h: Distribution = _PERIOD
    albedo: Distribution = _ALBEDO
    replace_assumed: bool = False

    def __post_init__(self) -> None:
        for name, distribution in self._distributions():
            empirical = {"elongation": ("catalogue",), "spin_period_h": ("catalogue", "lightcurves")}
            if distribution.kind in ("catalogue", "lightcurves"):
                if distribution.kind not in empirical.get(name, ()):
                    raise InvalidInput(name, distribution.kind, "a distribution with numbers of its own")
                continue
            low, high = _LIMITS[name.partition(".")[0].replace("_by_class", "")]
            ends = distribution.quantile(np.array([1e-9, 1.0 - 1e-9]))
            if ends[0] < low or ends[1] > high:
                raise InvalidInput(
                    name, distribution, f"values within [{low:g}, {high:g}]: low and high truncate it"
                )
        for name in ("log_elongation_per_mag", "log_elongation_sigma"):
            x = getattr(self, name)
            if isinstance(x, bool) or not isinstance(x, int | float) or not 0.0 <= x <= 1.0:
                raise InvalidInput(name, x, "a number from 0 to 1")

    def _distributions(self) -> Iterator[tuple[str, Distribution]]:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, Distribution):
                yield f.name, value
            elif isinstance(value, Mapping):
                yield from ((f"{f.name}.{letters}", d) for letters, d in value.items())

    def density_of(self, taxonomic_class: str) -> tuple[Distribution, str]:
        """Density distribution of a taxonomic class, and its label."""
        for letters, distribution in self.density_by_class_kg_m3.items():
            if taxonomic_class[:1] and taxonomic_class[0] in letters:
                return distribution, "density (from the class)"
        return self.density_kg_m3, "density"

    @classmethod
    def from_mapping(cls, data: Mapping[str, object]) -> Population:
        """From a mapping such as a TOML table: ``{"cohesion_Pa": {"kind": "fixed", "value": 0}}``.

        A `density_kg_m3` without `density_by_class_kg_m3` applies to every class.

        Raises
        ------
        UnknownName, InvalidInput
        """
        known = {f.name for f in fields(cls)}
        made: Document = {"density_by_class_kg_m3": {}} if "density_kg_m3" in data else {}
        for key, value in data.items():
            if key not in known:
                near = get_close_matches(key, known)
                raise UnknownName("population key", key, near, f"(known: {', '.join(sorted(known))})")
            if key == "replace_assumed":
                if not isinstance(value, bool):
                    raise InvalidInput(key, value, "true or false")
                made[key] = value
            elif key.startswith("log_"):
                made[key] = value
            elif key == "density_by_class_kg_m3":
                if not isinstance(value, Mapping) or not all(k.isalpha() and k.isupper() for k in value):
                    raise InvalidInput(key, value, "a table with a distribution by first letters, such as SQ")
                made[key] = {k: distribution_of(f"{key}.{k}", v) for k, v in value.items()}
            else:
                made[key] = distribution_of(key, value)
        return cls(**made)

    @classmethod
    def from_file(cls, path: str | Path) -> Population:
        """From a TOML file as written by :meth:`toml`; omitted keys keep their defaults."""
        what = "population file"
        return cls.from_mapping(parse_toml(read_text(path, what, DOCUMENT_LIMIT), what, path))

    def toml(self) -> str:
        """The population as a TOML file."""
        lines = [
            "# Priors of a screening. Kinds: fixed (value), uniform or loguniform (low, high), normal (mean, sd),",
            "# lognormal (median, sigma of the natural logarithm), the last two optionally truncated by low and high;",
            "# catalogue: values of the embedded catalogue; lightcurves: LCDB periods of bodies of similar size.",
            "# friction_angle_deg and cohesion_Pa apply to every body, the others where the catalogue has no value.",
        ]
        tables: list[str] = []
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, Distribution):
                lines.append(f"{f.name} = {value.toml()}")
            elif isinstance(value, Mapping):
                tables += ["", f"[{f.name}]  # by first letter of the taxonomic class"]
                tables += [f"{letters} = {d.toml()}" for letters, d in value.items()]
            else:
                lines.append(f"{f.name} = {str(value).lower()}")
        return "\n".join([*lines, *tables]) + "\n"

    def stated(self) -> dict[str, str]:
        """Descriptions of the distributions."""
        fixed = {"pole": "the catalogue's, else isotropic", "angle_and_phase": "uniform"}
        return (
            fixed
            | {name: str(d) for name, d in self._distributions()}
            | {
                f.name: str(getattr(self, f.name))
                for f in fields(self)
                if not isinstance(getattr(self, f.name), Distribution | Mapping)
            }
        )
