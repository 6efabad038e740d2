"""flybystab: do rubble-pile asteroids survive their close planetary encounters?

>>> import astropy.units as u, flybystab as fs
>>> pile = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2 * u.g / u.cm**3, spin_period=6 * u.h)
>>> passage = fs.Encounter.hyperbolic("earth", periapsis=2.0 * fs.R_earth, v_inf=5 * u.km / u.s)
>>> print(fs.flyby(pile, passage).verdict)
RESHAPED

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "Asteroid": "survey.asteroid",
    "Body": "aggregate.body",
    "Encounter": "sky.encounter",
    "FlybyResult": "flyby_results",
    "FlybystabError": "errors",
    "Material": "aggregate.body",
    "Orbit": "sky.orbit",
    "R_earth": "units",
    "Verdict": "outcome",
    "catalogue": "survey.catalogue",
    "encounter_distribution": "sky.distribution",
    "cite": "face.cite",
    "equilibrium": "aggregate.equilibrium",
    "find_encounters": "sky.finder",
    "flyby": "flybys",
    "flyby_many": "many",
    "flyby_margin": "margins",
    "infer": "survey.inference",
    "periapsis_axes": "attitudes",
    "screen": "survey.screening",
    "spin_sample": "spin",
    "stability": "aggregate.stability",
    "surface_change": "surfaces",
    "survival": "odds",
}

__all__ = ["__version__", *_HOME]

if TYPE_CHECKING:
    from flybystab.aggregate.body import Body, Material
    from flybystab.aggregate.equilibrium import equilibrium
    from flybystab.aggregate.stability import stability
    from flybystab.attitudes import periapsis_axes
    from flybystab.errors import FlybystabError
    from flybystab.face.cite import cite
    from flybystab.flyby_results import FlybyResult
    from flybystab.flybys import flyby
    from flybystab.many import flyby_many
    from flybystab.margins import flyby_margin
    from flybystab.odds import survival
    from flybystab.outcome import Verdict
    from flybystab.sky.distribution import encounter_distribution
    from flybystab.sky.encounter import Encounter
    from flybystab.sky.finder import find_encounters
    from flybystab.sky.orbit import Orbit
    from flybystab.spin import spin_sample
    from flybystab.surfaces import surface_change
    from flybystab.survey.asteroid import Asteroid
    from flybystab.survey.catalogue import catalogue
    from flybystab.survey.inference import infer
    from flybystab.survey.screening import screen
    from flybystab.units import R_earth


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'flybystab' has no attribute {name!r}")
    value = getattr(import_module(f"flybystab.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
