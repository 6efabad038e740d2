"""flybystab: do rubble-pile asteroids survive their close planetary encounters?

>>> import astropy.units as u, flybystab as fs
>>> pile = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2 * u.g / u.cm**3, spin_period=6 * u.h)
>>> passage = fs.Encounter.hyperbolic("earth", periapsis=2.2 * fs.R_earth, v_inf=5 * u.km / u.s)
>>> print(fs.flyby(pile, passage).verdict)
RESHAPED

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from flybystab._version import __version__

_HOME = {
    "Asteroid": "catalogues.asteroid",
    "Body": "body.body",
    "Encounter": "encounter.encounter",
    "FlybyResult": "flybys.result",
    "FlybystabError": "errors",
    "Material": "body.body",
    "Orbit": "orbit.orbit",
    "Pile": "body.pile",
    "R_earth": "units",
    "Shape": "body.shape",
    "Verdict": "flybys.verdict",
    "atlas": "io.atlas",
    "binary_flyby": "flybys.binary",
    "attitude_at_start": "encounter.attitude_at_periapsis",
    "critical": "flybys.critical",
    "outcome_map": "flybys.outcome_map",
    "catalogue": "catalogues.catalogue",
    "encounter_distribution": "encounter.distribution",
    "cite": "io.citation",
    "disruption_rates": "population.disruption",
    "encounter_rates": "population.rates",
    "equilibrium": "body.equilibrium",
    "find_encounters": "orbit.search.encounter_finder",
    "flyby": "flybys.flyby",
    "flyby_many": "flybys.flyby_many",
    "flyby_margin": "flybys.margin",
    "infer": "screening.inference",
    "known_population": "population.model_population",
    "periapsis_axes": "encounter.attitude",
    "read_population": "population.model_population",
    "recovery": "body.recovery",
    "screen": "screening.screening",
    "shape_spin": "flybys.shape_spin",
    "spin_sample": "flybys.spin_sample",
    "stability": "body.stability",
    "surface_change": "flybys.surface_change",
    "surface_history": "flybys.surface_history",
    "survival": "flybys.survival",
}

__all__ = ["__version__", *_HOME]

if TYPE_CHECKING:
    from flybystab.body.body import Body, Material
    from flybystab.body.equilibrium import equilibrium
    from flybystab.body.pile import Pile
    from flybystab.body.recovery import recovery
    from flybystab.body.shape import Shape
    from flybystab.body.stability import stability
    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.catalogues.catalogue import catalogue
    from flybystab.encounter.attitude import periapsis_axes
    from flybystab.encounter.attitude_at_periapsis import attitude_at_start
    from flybystab.encounter.distribution import encounter_distribution
    from flybystab.encounter.encounter import Encounter
    from flybystab.errors import FlybystabError
    from flybystab.flybys.binary import binary_flyby
    from flybystab.flybys.critical import critical
    from flybystab.flybys.flyby import flyby
    from flybystab.flybys.flyby_many import flyby_many
    from flybystab.flybys.margin import flyby_margin
    from flybystab.flybys.outcome_map import outcome_map
    from flybystab.flybys.result import FlybyResult
    from flybystab.flybys.shape_spin import shape_spin
    from flybystab.flybys.spin_sample import spin_sample
    from flybystab.flybys.surface_change import surface_change
    from flybystab.flybys.surface_history import surface_history
    from flybystab.flybys.survival import survival
    from flybystab.flybys.verdict import Verdict
    from flybystab.io.atlas import atlas
    from flybystab.io.citation import cite
    from flybystab.orbit.orbit import Orbit
    from flybystab.orbit.search.encounter_finder import find_encounters
    from flybystab.population.disruption import disruption_rates
    from flybystab.population.model_population import known_population, read_population
    from flybystab.population.rates import encounter_rates
    from flybystab.screening.inference import infer
    from flybystab.screening.screening import screen
    from flybystab.units import R_earth


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'flybystab' has no attribute {name!r}")
    value = getattr(import_module(f"flybystab.{_HOME[name]}"), name)
    if "numba" in sys.modules:
        import_module("flybystab.core.numerics.compile_notice").install()
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
