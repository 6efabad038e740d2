"""Record of an asteroid: the values of a catalogue row with their units and sources.

Values that were not measured are flagged as assumed. The columns are explained in ``data/README.md``.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import DENSITY_RANGE
from flybystab.errors import InvalidInput
from flybystab.units import allowed

_LENGTH = ("semi_axis_a_m", "semi_axis_b_m", "semi_axis_c_m", "diameter_m")
_HOURS = ("spin_period_h", "precession_period_h", "rotation_period_h")
_ANGLES = ("i_deg", "node_deg", "peri_deg", "M_deg")

#: Unit of every numeric column.
UNITS: Mapping[str, u.UnitBase] = MappingProxyType(
    dict.fromkeys(_LENGTH, u.m)
    | {c[:-2] + "_sigma_m": u.m for c in _LENGTH}
    | dict.fromkeys(_HOURS, u.h)
    | {c[:-2] + "_sigma_h": u.h for c in _HOURS}
    | {"density_kg_m3": u.kg / u.m**3, "density_sigma_kg_m3": u.kg / u.m**3}
    | dict.fromkeys(("pole_ecl_lon_deg", "pole_ecl_lat_deg", *_ANGLES), u.deg)
    | {"sigma_" + c: u.deg for c in _ANGLES}
    | {"H_mag": u.mag, "amplitude_mag": u.mag, "epoch_jd_tdb": u.d, "a_au": u.au, "sigma_a_au": u.au}
    | {"q_au": u.au, "tp_jd_tdb": u.d}
    | dict.fromkeys(("A1_au_d2", "A2_au_d2", "A3_au_d2"), u.au / u.d**2)
    | {"DT_d": u.d, "AMRAT_m2_kg": u.m**2 / u.kg}
    | dict.fromkeys(
        ("e", "sigma_e", "inertia_a_over_c", "inertia_b_over_c", "condition_code"), u.dimensionless_unscaled
    )
)

#: Text columns.
TEXTS = (
    *(
        "number",
        "name",
        "designation",
        "aliases",
        "orbit_class",
        "pha",
        "taxonomic_class",
        "taxonomic_source",
    ),
    *(
        "binary",
        "shape_kind",
        "semi_axes_source",
        "diameter_source",
        "spin_state",
        "spin_source",
        "spin_solutions",
    ),
    *("amplitude_source", "pole_source", "tumbling_mode", "tumbling_source", "density_assumed"),
    *("density_source", "frame", "sigma_source", "nongrav_source", "nongrav_law", "orbit_solution"),
    *("condition_code_source", "orbit_source", "assumed", "unchecked", "notes"),
)

#: Epoch and elements, and the factors of the elements to SI.
ORBIT = ("epoch_jd_tdb", "a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg")
ORBIT_SI = np.array([UNITS[c].si.scale for c in ORBIT[1:]])
#: Perihelion distance and time of perihelion, in place of a and M for parabolas.
PERIHELION = ("q_au", "tp_jd_tdb")
#: Columns of an orbit, which are kept when a row is completed from another.
ORBITAL = frozenset(
    {
        *ORBIT,
        *PERIHELION,
        "A1_au_d2",
        "A2_au_d2",
        "A3_au_d2",
        "DT_d",
        "AMRAT_m2_kg",
        "frame",
        "sigma_source",
        "nongrav_source",
        "nongrav_law",
    }
    | {"sigma_" + c for c in ORBIT[1:]}
    | {"orbit_solution", "orbit_source", "condition_code", "condition_code_source"}
)
#: Columns of size, shape and spin, which are taken together from the completing row to remain consistent.
BODILY = frozenset(
    c for c in (*UNITS, *TEXTS) if c.startswith(("semi_axis", "semi_axes", "diameter", "spin_"))
)
#: Semi-axes.
SHAPE = ("semi_axis_a_m", "semi_axis_b_m", "semi_axis_c_m")


#: Smallest and largest valid value of each column; values outside usually have the wrong unit.
LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    dict.fromkeys(_LENGTH, (0.05, 5e6))
    | dict.fromkeys(_HOURS, (1e-4, 1e5))
    | {c: (0.0, np.inf) for c in UNITS if "sigma" in c}
    | {"density_kg_m3": DENSITY_RANGE, "e": (0.0, np.inf), "amplitude_mag": (0.0, 5.0)}
    | {"i_deg": (0.0, 180.0), "pole_ecl_lat_deg": (-90.0, 90.0)}
    | {"H_mag": (-5.0, 45.0), "a_au": (-1e6, 1e6), "epoch_jd_tdb": (1e6, 1e7)}
    | {"q_au": (0.0, 1e4), "tp_jd_tdb": (-1e7, 1e7)}
    # A third of the Sun's gravity at 1 au; the largest accelerations of comets are 1e-6 au/d2.
    | dict.fromkeys(("A1_au_d2", "A2_au_d2", "A3_au_d2"), (-1e-4, 1e-4))
    # The largest delays of comets are about 100 d; thin plates of space debris reach 100 m2/kg.
    | {"DT_d": (-1e4, 1e4), "AMRAT_m2_kg": (0.0, 1e3)}
)


def key_of(name: object) -> str:
    """Normalised name for comparisons: no case, accents, spaces, brackets, apostrophes; all dashes are hyphens."""
    text = unicodedata.normalize("NFKD", str(name).casefold())
    kept = (
        c for c in text if not unicodedata.combining(c) and not c.isspace() and c not in "()_'`\u2019\u02bb"
    )
    return "".join("-" if unicodedata.category(c) == "Pd" else c for c in kept)


class Record:
    """A row of a catalogue, with units for its numbers.

    Attributes
    ----------
    row : mapping of str to str
        The unchanged row of the file.
    file : str
        File from which the row was read.
    """

    row: Mapping[str, str]
    file: str

    @property
    def name(self) -> str:
        """Name; for unnamed asteroids the designation."""
        return self.row.get("name") or self.row.get("designation") or self.row.get("number") or "unnamed"

    @property
    def number(self) -> int | None:
        """IAU number."""
        text = self.row.get("number", "")
        return int(text) if text.isdigit() else None

    @property
    def designation(self) -> str:
        """Principal designation."""
        return self.row.get("designation", "")

    @property
    def label(self) -> str:
        """Number in brackets and name, as ``(99942) Apophis``."""
        return self.name if self.number is None else f"({self.number}) {self.name}"

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All names by which the asteroid can be found."""
        row = self.row
        found = [row.get("name", ""), row.get("number", ""), row.get("designation", "")]
        found += row.get("aliases", "").split(";")
        found += [
            f"{self.number} {n}" for n in (row.get("name"), row.get("designation")) if self.number and n
        ]
        return tuple(dict.fromkeys(n.strip() for n in found if n and n.strip()))

    @cached_property
    def assumed(self) -> tuple[str, ...]:
        """Columns whose values are assumed, not measured."""
        return tuple(c for c in self.row.get("assumed", "").split(";") if c)

    @cached_property
    def measured(self) -> tuple[str, ...]:
        """Numeric columns with a measured value."""
        return tuple(c for c in UNITS if self.row.get(c) and c not in self.assumed)

    @cached_property
    def sources(self) -> Mapping[str, str]:
        """Source of each group of values, e.g. ``sources["density"]``."""
        found = {c.removesuffix("_source"): v for c, v in self.row.items() if c.endswith("_source") and v}
        return MappingProxyType(found)

    @cached_property
    def record(self) -> Mapping[str, Quantity | str | None]:
        """All columns of the row: a Quantity for numeric columns (None where unknown), text for the others."""
        return MappingProxyType(
            {
                c: (self.quantity(c) if self.row.get(c) else None) if c in UNITS else self.row.get(c, "")
                for c in (*TEXTS, *UNITS)
            }
        )

    def quantity(self, column: str) -> Quantity:
        """Value of a numeric column with its unit.

        Raises
        ------
        InvalidInput
            The cell is empty, not a finite number, or outside its :data:`LIMITS`.
        """
        if not isinstance(column, str) or column not in UNITS:
            raise InvalidInput("column", column, "the name of a numeric column")
        return self._number(column) * UNITS[column]

    def _number(self, column: str) -> float:
        text = self.row.get(column, "")
        if not text:
            raise InvalidInput(column, "(empty)", f"a value for {self.label} in {self.file}")
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        low, high = LIMITS.get(column, (-np.inf, np.inf))
        if not np.isfinite(value):
            raise InvalidInput(column, text, f"a finite number for {self.label} in {self.file}")
        if not low <= value <= high:
            raise InvalidInput(column, text, f"{allowed(low, high)} for {self.label} in {self.file}")
        return value

    def knows(self, *columns: str) -> bool:
        """Whether all these columns have a value."""
        return all(self.row.get(c) for c in columns)
