"""Scripted encounters from TOML files: every quantity is a text with its unit, every key is checked."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity
from scipy.spatial.transform import Rotation

from flybystab.aggregate.body import Body, Material
from flybystab.errors import InvalidInput, UnknownName
from flybystab.flybys import periapsis_axes
from flybystab.sky.encounter import Encounter
from flybystab.survey.asteroid import Asteroid
from flybystab.units import R_earth

#: Allowed keys of each table.
KEYS: dict[str, tuple[str, ...]] = {
    "": ("title", "body", "material", "encounter", "attitude"),
    "body": ("asteroid", "semi_axes", "density", "spin_period", "spin", "phase"),
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
}


@dataclass(frozen=True, eq=False)
class Scenario:
    """What a scenario file describes, ready for :func:`flybystab.flyby`."""

    title: str
    body: Body
    encounter: Encounter
    attitude: np.ndarray


def scenario(path: str | Path) -> Scenario:
    """Read a scenario file.

    Raises
    ------
    InvalidInput
        The file cannot be read or a value is wrong.
    UnknownName
        A table or key is not known; near ones are offered.
    UnitMismatch
        A value has the wrong unit, or none.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as reason:
        raise InvalidInput("scenario file", path, f"a readable file ({reason})") from None
    except tomllib.TOMLDecodeError as reason:
        raise InvalidInput("scenario file", path, f"valid TOML ({reason})") from None
    _check(content, "")
    for table in ("body", "material", "encounter", "attitude"):
        section = content.setdefault(table, {})
        if not isinstance(section, dict):
            raise InvalidInput(table, section, f"a table: [{table}]")
        _check(section, table)
    material = _material(content["material"])
    asteroid, body = _body(content["body"], material)
    encounter = _encounter(content["encounter"], asteroid)
    attitude = _attitude(content["attitude"], content["body"], asteroid, encounter)
    return Scenario(str(content.get("title", path.stem)), body, encounter, attitude)


def quantity(value: Any, name: str) -> Quantity:
    """A quantity from text such as ``"6 h"``, ``"2.2 R_earth"`` or ``"1400, 850, 750 m"``."""
    if not isinstance(value, str):
        raise InvalidInput(name, value, 'text with a unit, for example "6 h"')
    text = value.strip()
    scale: Any = 1.0
    if text.endswith("R_earth"):
        text, scale = text.removesuffix("R_earth"), R_earth
    try:
        if "," in text:
            *first, last = text.split(",")
            tail = last.split(None, 1)
            unit = u.Unit(tail[1]) if len(tail) > 1 else u.dimensionless_unscaled
            return np.array([float(x) for x in [*first, tail[0]]]) * unit * scale
        return Quantity(text) * scale
    except (TypeError, ValueError):
        raise InvalidInput(
            name, value, 'numbers and a unit, for example "6 h" or "1400, 850, 750 m"'
        ) from None


def _check(section: dict[str, Any], table: str) -> None:
    for key in section:
        if key not in KEYS[table]:
            where = f"key in [{table}]" if table else "table"
            near = get_close_matches(key, KEYS[table], cutoff=0.5)
            raise UnknownName(where, key, near, f"(known: {', '.join(KEYS[table])})")


def _need(section: dict[str, Any], table: str, key: str) -> Any:
    if key not in section:
        raise InvalidInput(f"{table}.{key}", "(missing)", f"a value for {key} in [{table}]")
    return section[key]


def _material(section: dict[str, Any]) -> Material:
    plain = {k: v for k, v in section.items() if k in ("dilatancy", "yield_surface", "brittle")}
    units = {
        k: quantity(v, f"material.{k}") for k, v in section.items() if k in ("friction_angle", "cohesion")
    }
    return Material(**plain, **units)


def _body(section: dict[str, Any], material: Material) -> tuple[Asteroid | None, Body]:
    if "asteroid" in section:
        extra = sorted(set(section) - {"asteroid", "phase"})
        if extra:
            raise InvalidInput(f"body.{extra[0]}", section[extra[0]], "no such key beside body.asteroid")
        asteroid = Asteroid.from_catalogue(section["asteroid"])
        return asteroid, asteroid.body_with(material, phase=float(section.get("phase", 0.0)))
    spin = {k: quantity(section[k], f"body.{k}") for k in ("spin_period", "spin") if k in section}
    return None, Body(
        semi_axes=quantity(_need(section, "body", "semi_axes"), "body.semi_axes"),
        density=quantity(_need(section, "body", "density"), "body.density"),
        material=material,
        **spin,
    )


def _encounter(section: dict[str, Any], asteroid: Asteroid | None) -> Encounter:
    planet = section.get("planet", "earth")
    if "date" in section:
        orbiting = Asteroid.from_catalogue(section["asteroid"]) if "asteroid" in section else asteroid
        if orbiting is None:
            raise InvalidInput("encounter.date", section["date"], "an asteroid whose orbit leads there")
        try:
            time = Time(str(section["date"]), scale="tdb")
        except ValueError:
            raise InvalidInput("encounter.date", section["date"], "a date such as 2029-04-13") from None
        return Encounter.from_orbit(orbiting.orbit, planet, time, ephemeris=section.get("ephemeris"))
    options = {
        k: quantity(section[k], f"encounter.{k}") for k in ("start_distance", "settle") if k in section
    }
    return Encounter.hyperbolic(
        planet,
        periapsis=quantity(_need(section, "encounter", "periapsis"), "encounter.periapsis"),
        v_inf=quantity(_need(section, "encounter", "v_inf"), "encounter.v_inf"),
        j2=bool(section.get("j2", False)),
        **options,
    )


def _attitude(
    section: dict[str, Any], body: dict[str, Any], asteroid: Asteroid | None, encounter: Encounter
) -> np.ndarray:
    if "euler_zxz" in section:
        angles = quantity(section["euler_zxz"], "attitude.euler_zxz")
        if angles.shape != (3,):
            raise InvalidInput("attitude.euler_zxz", section["euler_zxz"], 'three angles, "30, 40, 70 deg"')
        return Rotation.from_euler("ZXZ", angles.to_value(u.rad)).as_matrix()
    if asteroid is not None and asteroid.pole is not None and encounter.frame == "ICRF":
        turn = quantity(section.get("turn", "0 deg"), "attitude.turn")
        return periapsis_axes(encounter) @ asteroid.attitude(turn, phase=float(body.get("phase", 0.0)))
    if "turn" in section:
        raise InvalidInput(
            "attitude.turn", section["turn"], "an asteroid with a known pole on its real orbit"
        )
    return np.eye(3)
