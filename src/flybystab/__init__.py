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
from typing import TYPE_CHECKING

from flybystab._version import __version__

_HOME = {
    "Asteroid": "catalogues.asteroid",
    "BinarySample": "flybys.binary",
    "Body": "body.body",
    "CohesionBounds": "body.limit_analysis",
    "Covariance": "orbit.covariance",
    "CriticalValues": "flybys.critical",
    "DisruptionRates": "population.verdict_rates",
    "ElasticStress": "body.elastic_stress",
    "Encounter": "encounter.encounter",
    "EncounterDistribution": "encounter.distribution",
    "EncounterRates": "population.rates",
    "Equilibrium": "body.equilibrium",
    "FlybyError": "flybys.history",
    "FlybyMargin": "flybys.margin",
    "FlybyResult": "flybys.result",
    "FlybystabError": "errors",
    "GrainsCourse": "flybys.grains_outcome",
    "GrainsOutcome": "flybys.grains_outcome",
    "GrainsRun": "flybys.grains_outcome",
    "History": "flybys.history",
    "LinearPlane": "encounter.linear_target_plane",
    "Material": "body.body",
    "Orbit": "orbit.orbit",
    "OutcomeMap": "flybys.outcome_map",
    "Pile": "body.pile",
    "PileState": "body.pile",
    "Predictability": "orbit.predictability",
    "R_earth": "units",
    "Record": "tabular",
    "RecoveryLimit": "body.recovery",
    "Requirements": "body.bounds",
    "ResultTable": "result_table",
    "RotationState": "flybys.shape_spin",
    "Shape": "body.shape",
    "ShapeSpin": "flybys.shape_spin",
    "SpinForecast": "flybys.spin_forecast",
    "SpinSample": "flybys.spin_sample",
    "SpinState": "body.spin_state",
    "Stability": "body.stability",
    "StateTransition": "orbit.state_transition",
    "Survival": "flybys.survival",
    "Tabular": "tabular",
    "Verdict": "flybys.verdict",
    "atlas": "io.atlas",
    "attitude_at_start": "encounter.attitude_at_periapsis",
    "binary_flyby": "flybys.binary",
    "bound_fraction": "flybys.verdict",
    "catalogue": "catalogues.catalogue",
    "cite": "io.citation",
    "cohesion_bounds": "body.limit_analysis",
    "critical": "flybys.critical",
    "density_intervals": "body.bounds",
    "disruption_rates": "population.disruption",
    "elastic_change": "flybys.elastic_change",
    "elastic_stress": "body.elastic_stress",
    "encounter_distribution": "encounter.distribution",
    "encounter_rates": "population.rates",
    "equilibrium": "body.equilibrium",
    "failure_distance": "body.equilibrium",
    "find_encounters": "orbit.search.encounter_finder",
    "flyby": "flybys.flyby",
    "flyby_many": "flybys.flyby_many",
    "flyby_margin": "flybys.margin",
    "fresh_fraction": "population.freshness",
    "freshness": "population.freshness",
    "infer": "screening.inference",
    "known_population": "population.model_population",
    "lobe_history": "flybys.surface_history",
    "make_pile": "body.pile",
    "outcome_map": "flybys.outcome_map",
    "periapsis_axes": "encounter.attitude",
    "plot_result": "plots.results",
    "population_figure": "plots.population",
    "push": "body.perturbation",
    "read_population": "population.model_population",
    "recovery": "body.recovery",
    "recovery_energy": "body.perturbed_motion",
    "refresh_distance": "flybys.refresh_distance",
    "requirements": "body.bounds",
    "roche_lobe": "body.roche_lobe",
    "screen": "screening.screening",
    "shape_map": "plots.shape_map",
    "shape_slopes": "body.shape_slope",
    "shape_spin": "flybys.shape_spin",
    "slope_change_figure": "plots.shape_map",
    "spin_forecast": "flybys.spin_forecast",
    "spin_limits": "body.equilibrium",
    "spin_sample": "flybys.spin_sample",
    "stability": "body.stability",
    "surface_change": "flybys.surface_change",
    "surface_history": "flybys.surface_history",
    "survival": "flybys.survival",
    "impact_energy": "encounter.hazard_scales",
    "palermo_scale": "encounter.hazard_scales",
    "torino_scale": "encounter.hazard_scales",
    "virtual_impactors": "encounter.virtual_impactors",
    "target_map": "flybys.outcome_map",
}

__all__ = ["__version__", *_HOME]

if TYPE_CHECKING:
    from flybystab.body.body import Body, Material
    from flybystab.body.bounds import Requirements, density_intervals, requirements
    from flybystab.body.elastic_stress import ElasticStress, elastic_stress
    from flybystab.body.equilibrium import Equilibrium, equilibrium, failure_distance, spin_limits
    from flybystab.body.limit_analysis import CohesionBounds, cohesion_bounds
    from flybystab.body.perturbation import push
    from flybystab.body.perturbed_motion import recovery_energy
    from flybystab.body.pile import Pile, PileState, make_pile
    from flybystab.body.recovery import RecoveryLimit, recovery
    from flybystab.body.roche_lobe import roche_lobe
    from flybystab.body.shape import Shape
    from flybystab.body.shape_slope import shape_slopes
    from flybystab.body.spin_state import SpinState
    from flybystab.body.stability import Stability, stability
    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.catalogues.catalogue import catalogue
    from flybystab.encounter.attitude import periapsis_axes
    from flybystab.encounter.attitude_at_periapsis import attitude_at_start
    from flybystab.encounter.distribution import EncounterDistribution, encounter_distribution
    from flybystab.encounter.encounter import Encounter
    from flybystab.encounter.hazard_scales import impact_energy, palermo_scale, torino_scale
    from flybystab.encounter.linear_target_plane import LinearPlane
    from flybystab.encounter.virtual_impactors import virtual_impactors
    from flybystab.errors import FlybystabError
    from flybystab.flybys.binary import BinarySample, binary_flyby
    from flybystab.flybys.critical import CriticalValues, critical
    from flybystab.flybys.elastic_change import elastic_change
    from flybystab.flybys.flyby import flyby
    from flybystab.flybys.flyby_many import flyby_many
    from flybystab.flybys.grains_outcome import GrainsCourse, GrainsOutcome, GrainsRun
    from flybystab.flybys.history import FlybyError, History
    from flybystab.flybys.margin import FlybyMargin, flyby_margin
    from flybystab.flybys.outcome_map import OutcomeMap, outcome_map, target_map
    from flybystab.flybys.refresh_distance import refresh_distance
    from flybystab.flybys.result import FlybyResult
    from flybystab.flybys.shape_spin import RotationState, ShapeSpin, shape_spin
    from flybystab.flybys.spin_forecast import SpinForecast, spin_forecast
    from flybystab.flybys.spin_sample import SpinSample, spin_sample
    from flybystab.flybys.surface_change import surface_change
    from flybystab.flybys.surface_history import lobe_history, surface_history
    from flybystab.flybys.survival import Survival, survival
    from flybystab.flybys.verdict import Verdict, bound_fraction
    from flybystab.io.atlas import atlas
    from flybystab.io.citation import cite
    from flybystab.orbit.covariance import Covariance
    from flybystab.orbit.orbit import Orbit
    from flybystab.orbit.predictability import Predictability
    from flybystab.orbit.search.encounter_finder import find_encounters
    from flybystab.orbit.state_transition import StateTransition
    from flybystab.plots.population import population_figure
    from flybystab.plots.results import plot_result
    from flybystab.plots.shape_map import shape_map, slope_change_figure
    from flybystab.population.disruption import disruption_rates
    from flybystab.population.freshness import fresh_fraction, freshness
    from flybystab.population.model_population import known_population, read_population
    from flybystab.population.rates import EncounterRates, encounter_rates
    from flybystab.population.verdict_rates import DisruptionRates
    from flybystab.result_table import ResultTable
    from flybystab.screening.inference import infer
    from flybystab.screening.screening import screen
    from flybystab.tabular import Record, Tabular
    from flybystab.units import R_earth


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'flybystab' has no attribute {name!r}")
    value = getattr(import_module(f"flybystab.{_HOME[name]}"), name)
    if "numba" in sys.modules:
        import_module("flybystab.core.numerics.compile_notice").install()
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
