"""Scenario files (TOML) with a body, a material and an encounter; quantities are texts with units, keys are checked."""

from __future__ import annotations

import re
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TypeVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from scipy.spatial.transform import Rotation

from flybystab.body.body import Body, Material
from flybystab.body.shape import Shape, length_unit
from flybystab.catalogues.asteroid import Asteroid
from flybystab.encounter.attitude import periapsis_axes
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, UnknownName
from flybystab.files import DOCUMENT_LIMIT, parse_toml, read_text
from flybystab.orbit.planets import planet
from flybystab.plots.formats import FIGURES, FILMS
from flybystab.typing import Document
from flybystab.units import DATES, parsed_time, to_si

T = TypeVar("T")
D = TypeVar("D")

#: Allowed keys of each table.
KEYS: dict[str, tuple[str, ...]] = {
    "": ("title", "body", "material", "encounter", "attitude", "grains", "output"),
    "body": ("asteroid", "semi_axes", "density", "spin_period", "spin", "phase", "shape", "shape_unit"),
    "material": ("friction_angle", "cohesion", "dilatancy", "yield_surface", "brittle"),
    "encounter": (
        "planet",
        "date",
        "asteroid",
        "periapsis",
        "v_inf",
        "start_distance",
        "settle",
        "j2",
        "ephemeris",
    ),
    "attitude": ("euler_zxz", "turn"),
    "grains": ("number", "piles"),
    "output": ("figure",),
}


@dataclass(frozen=True, eq=False)
class Scenario:
    """Content of a scenario file: the arguments of :func:`flybystab.flyby`."""

    title: str
    body: Body
    encounter: Encounter
    attitude: np.ndarray
    figure: str | None = None
    grains: int | None = None
    piles: int = 8
    shape: Shape | None = None


def scenario(path: str | Path) -> Scenario:
    """Read a scenario file.

    Raises
    ------
    InvalidInput
        The file cannot be read, or a value is invalid.
    UnknownName
        A table or key is unknown; the message lists similar names.
    UnitMismatch
        A value has the wrong unit or no unit.
    """
    path = Path(path)
    content = parse_toml(read_text(path, "scenario file", DOCUMENT_LIMIT), "scenario file", path)
    _check(content, "")
    for table in (t for t in KEYS if t):
        section = content.setdefault(table, {})
        if not isinstance(section, dict):
            raise InvalidInput(table, section, f"a table: [{table}]")
        _check(section, table)
    material = _material(content["material"])
    shape = _shape(content["body"], path.parent)
    asteroid, body = _body(content["body"], material, shape)
    encounter = _encounter(content["encounter"], asteroid)
    attitude = _attitude(content["attitude"], content["body"], asteroid, encounter)
    title = _typed(content, "", "title", str, path.stem)
    figure = _typed(content["output"], "output", "figure", str, None)
    if figure is not None and Path(figure).suffix.lower() not in FIGURES + FILMS:
        raise InvalidInput("output.figure", figure, f"a file that ends in {' or '.join(FIGURES + FILMS)}")
    number = _typed(content["grains"], "grains", "number", int, 500 if content["grains"] else None)
    piles = _typed(content["grains"], "grains", "piles", int, 8)
    return Scenario(title, body, encounter, attitude, figure, number, piles, shape)


def quantity(value: object, name: str) -> Quantity:
    """A quantity from text such as ``"6 h"``, ``"2.2 R_earth"``, ``"1400, 850, 750 m"`` or ``"1400 x 850 x 750 m"``."""
    example = '"1400, 850, 750 m"' if name.endswith("axes") else '"6 h" or "1400, 850, 750 m"'
    if not isinstance(value, str):
        raise InvalidInput(name, value, f"text with a unit, for example {example}")
    text = re.sub(r"(?<=\d)\s*[x×]\s*(?=[\d.])", ", ", value.strip())
    scale: Quantity | float = 1.0
    head, mark, where = text.rpartition("R_")
    if mark:  # in radii of a planet
        text, scale = head, planet(where).radius * u.m
    try:
        if "," in text:
            *first, last = text.split(",")
            tail = last.split(None, 1)
            unit = u.Unit(tail[1]) if len(tail) > 1 else u.dimensionless_unscaled
            return np.array([float(x) for x in [*first, tail[0]]]) * unit * scale
        return Quantity(text) * scale
    except (TypeError, ValueError):
        raise InvalidInput(name, value, f"numbers and a unit, for example {example}") from None


def _check(section: Document, table: str) -> None:
    for key in section:
        if key not in KEYS[table]:
            where = f"key in [{table}]" if table else "table"
            near = get_close_matches(key, KEYS[table], cutoff=0.5)
            raise UnknownName(where, key, near, f"(known: {', '.join(KEYS[table])})")


def _need(section: Document, table: str, key: str) -> object:
    if key not in section:
        raise InvalidInput(f"{table}.{key}", "(missing)", f"a value for {key} in [{table}]")
    return section[key]


def _typed(section: Document, table: str, key: str, kind: type[T], default: D) -> T | D:
    """A value that is not a quantity; its TOML type is checked, so that the text ``"no"`` is not taken as false."""
    if key not in section:
        return default
    value: object = section[key]
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not isinstance(value, kind):
        expected: dict[type, str] = {
            bool: "true or false, without quotes",
            float: "a number, without quotes",
            int: "a whole number, without quotes",
            str: "text",
        }
        raise InvalidInput(f"{table}.{key}" if table else key, value, expected[kind])
    return value


def _material(section: Document) -> Material:
    default = Material()
    units = {
        k: quantity(v, f"material.{k}") for k, v in section.items() if k in ("friction_angle", "cohesion")
    }
    return Material(
        dilatancy=_typed(section, "material", "dilatancy", float, default.dilatancy),
        yield_surface=_typed(section, "material", "yield_surface", str, default.yield_surface),
        brittle=_typed(section, "material", "brittle", bool, default.brittle),
        **units,
    )


def _shape(section: Document, folder: Path) -> Shape | None:
    """The polyhedral shape of a scenario; its file is relative to that of the scenario."""
    name = _typed(section, "body", "shape", str, None)
    unit = _typed(section, "body", "shape_unit", str, None)
    if (name is None) != (unit is None):
        raise InvalidInput("body.shape_unit", unit, "both shape (a file) and shape_unit, such as km")
    return None if name is None else Shape.read(folder / name, unit=length_unit(unit, "body.shape_unit"))


def _body(section: Document, material: Material, shape: Shape | None) -> tuple[Asteroid | None, Body]:
    if "asteroid" in section:
        extra = sorted(set(section) - {"asteroid", "phase", "shape", "shape_unit"})
        if extra:
            raise InvalidInput(
                f"body.{extra[0]}", section[extra[0]], "no such key together with body.asteroid"
            )
        asteroid = Asteroid.from_catalogue(section["asteroid"])
        asteroid = asteroid if shape is None else asteroid.with_shape(shape)
        return asteroid, asteroid.body_with(material, phase=_phase(section))
    if "phase" in section:
        raise InvalidInput("body.phase", section["phase"], "no phase without body.asteroid")
    spin = {k: quantity(section[k], f"body.{k}") for k in ("spin_period", "spin") if k in section}
    density = quantity(_need(section, "body", "density"), "body.density")
    if shape is not None:
        if "semi_axes" in section:
            raise InvalidInput("body.semi_axes", section["semi_axes"], "no such key together with body.shape")
        return None, Body.from_shape(shape, density=density, material=material, **spin)
    return None, Body(
        semi_axes=quantity(_need(section, "body", "semi_axes"), "body.semi_axes"),
        density=density,
        material=material,
        **spin,
    )


def _phase(section: Document) -> float:
    phase = _typed(section, "body", "phase", float, 0.0)
    if not np.isfinite(phase):
        raise InvalidInput("body.phase", phase, "a finite number")
    return float(phase)


#: Keys of [encounter] for a hyperbolic encounter only, and for one on a real orbit only.
_SCRIPTED = ("periapsis", "v_inf", "j2")
_REAL = ("asteroid", "date", "ephemeris")


def _encounter(section: Document, asteroid: Asteroid | None) -> Encounter:
    where = _typed(section, "encounter", "planet", str, "earth")
    options = {
        k: quantity(section[k], f"encounter.{k}") for k in ("start_distance", "settle") if k in section
    }
    if "date" in section:
        for key in _SCRIPTED:
            if key in section:
                raise InvalidInput(
                    f"encounter.{key}", section[key], "no such key together with encounter.date"
                )
        orbiting = Asteroid.from_catalogue(section["asteroid"]) if "asteroid" in section else asteroid
        if orbiting is None:
            raise InvalidInput("encounter.date", section["date"], "an asteroid, in [body] or [encounter]")
        try:
            time = parsed_time(str(section["date"]))
        except ValueError:
            raise InvalidInput("encounter.date", section["date"], DATES) from None
        ephemeris = _typed(section, "encounter", "ephemeris", str, None)
        return Encounter.from_orbit(orbiting.orbit, where, time, ephemeris=ephemeris, **options)
    for key in _REAL:
        if key in section:
            raise InvalidInput(f"encounter.{key}", section[key], "encounter.date together with it")
    return Encounter.hyperbolic(
        where,
        periapsis=quantity(_need(section, "encounter", "periapsis"), "encounter.periapsis"),
        v_inf=quantity(_need(section, "encounter", "v_inf"), "encounter.v_inf"),
        j2=_typed(section, "encounter", "j2", bool, False),
        **options,
    )


def _attitude(
    section: Document, body: Document, asteroid: Asteroid | None, encounter: Encounter
) -> np.ndarray:
    if "euler_zxz" in section:
        if "turn" in section:
            raise InvalidInput(
                "attitude.turn", section["turn"], "no such key together with attitude.euler_zxz"
            )
        name = "attitude.euler_zxz"
        angles = to_si(quantity(section["euler_zxz"], name), u.rad, name, shape=(3,))
        return Rotation.from_euler("ZXZ", angles).as_matrix()
    if asteroid is not None and asteroid.pole is not None and encounter.frame == "ICRF":
        turn = to_si(quantity(section.get("turn", "0 deg"), "attitude.turn"), u.rad, "attitude.turn")
        return periapsis_axes(encounter) @ asteroid.attitude(turn * u.rad, phase=_phase(body))
    if "turn" in section:
        raise InvalidInput(
            "attitude.turn", section["turn"], "an asteroid with a known pole on its real orbit"
        )
    return np.eye(3)
