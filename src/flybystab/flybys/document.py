"""Results as JSON documents: units in the keys, numbers or null.

A value that is infinite or undefined is null, with its reason in a further key with the suffix ``_reason``; a number is
never replaced by text. Each kind of document has a JSON schema, named under ``schema``.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time

from flybystab._version import __version__
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.grains_document import grains_document
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.spin_sample import SpinSample
from flybystab.flybys.verdict_margins import VerdictMargins
from flybystab.saving import DOCUMENT_UNITS, with_unit
from flybystab.typing import Array, Document


def plain(value: object, name: str = "") -> Any:
    """Convert to types of JSON; infinities and nan become null, in a dictionary with their reason."""
    if isinstance(value, dict):
        out: dict[str, object] = {}
        for key, entry in value.items():
            out[str(key)] = plain(entry, str(key))
            if isinstance(entry, float | np.floating) and not np.isfinite(entry):
                out[f"{key}_reason"] = _reason(f"{name} {key}", float(entry))
        return out
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Time):
        return value.tdb.isot
    return value


def _reason(key: str, value: float) -> str:
    """Why a number is infinite or undefined."""
    if math.isnan(value):
        return next((text for part, text in _UNKNOWN.items() if part in key), "not defined or not computed")
    return next((text for part, text in _INFINITE.items() if part in key), "infinite")


#: Reasons for undefined values, by part of the key.
_UNKNOWN = {
    "required_cohesion": "the body yields in the encounter: flybystab.critical finds the cohesion that prevents it",
}

#: Reasons for infinite values, by part of the key.
_INFINITE = {
    "friction": "no friction angle suffices",
    "margin": "no friction angle suffices",
    "cohesion": "no cohesion suffices",
    "strain": "stable to perturbations of any size",
    "energy": "stable to perturbations of any size",
    "displacement": "no encounter on the displaced orbit",
    "growth": "no encounter on the displaced orbit",
}


def encounter_document(encounter: Encounter) -> dict[str, object]:
    """Document of an encounter."""
    place = encounter.entry_place
    return {
        "planet": encounter.planet.name,
        "time_tdb": encounter.time,
        "distance_km": encounter.distance.to_value(u.km),
        "entry_time_tdb": encounter.entry_time,
        "entry_longitude_deg": None if place is None else place[0].to_value(u.deg),
        "entry_latitude_deg": None if place is None else place[1].to_value(u.deg),
        "bound": encounter.bound,
        "v_inf_km_s": encounter.v_inf.to_value(u.km / u.s),
        "v_periapsis_km_s": encounter.v_periapsis.to_value(u.km / u.s),
        "impact": encounter.impact_level if encounter.impact else None,
        "frame": encounter.frame,
        "ephemeris": encounter.ephemeris,
        "tide_error_relative": encounter.tide_error,
        "displacement_km": None if encounter.displacement is None else encounter.displacement.to_value(u.km),
        "displaced_by": encounter.neighbour or None,
        "growth": encounter.growth,
        "predictability": None if encounter.predictability is None else str(encounter.predictability),
    }


def flyby_document(
    result: FlybyResult, sample: SpinSample | None = None, **about: object
) -> dict[str, object]:
    """Document of a flyby; `about` holds further entries, such as the asteroid, and comes first."""
    error = result.error
    seconds = [
        None if t is None else t.to_value(u.s)
        for t in (result.onset_time, result.arrest_time, result.end_time)
    ]
    document = {
        "schema": "flyby/1",
        "flybystab": __version__,
        **about,
        "encounter": encounter_document(result.encounter),
        "verdict": str(result.verdict),
        "rung": result.rung,
        "verdict_class": result.verdict_class,
        "verdict_by_surface": {k: str(v) for k, v in result.verdict_by_surface.items()},
        "robust": result.robust,
        "contact": result.contact,
        "friction_angle_deg": result.body.material.friction_angle.to_value(u.deg),
        "max_required_friction_angle_deg": result.max_required_friction_angle.to_value(u.deg),
        "margin_deg": result.margin.to_value(u.deg),
        "required_cohesion_Pa": result.required_cohesion.to_value(u.Pa),
        "lode_angle_at_yield_deg": None if result.lode_angle is None else result.lode_angle.to_value(u.deg),
        "bound_fraction": result.bound_fraction,
        "settled": result.settled,
        "energy_J": result.energy.to_value(u.J),
        "margins": margins_document(result.margins),
        "semi_axes_m": result.semi_axes.to_value(u.m),
        "spin_rad_s": result.spin.to_value(u.rad / u.s),
        "spin_ratio": result.spin_ratio,
        "pole_change_deg": result.pole_change.to_value(u.deg),
        "onset_time_s": seconds[0],
        "arrest_time_s": seconds[1],
        "end_time_s": seconds[2],
        "events": [{"event": name, "time_s": t.to_value(u.s)} for name, t in result.events],
        "error": None
        if error is None
        else {
            "semi_axes_relative": error.semi_axes,
            "spin_relative": error.spin,
            "bound_fraction": error.bound_fraction,
            "required_friction_angle_deg": error.required_friction_angle.to_value(u.deg),
            "event_times_s": error.event_times.to_value(u.s),
            "verdict_agrees": error.verdict_agrees,
        },
        "grains": grains_document(result.grains),
        "modelled": result.modelled,
        "left_out": [{"what": name, "share": share} for name, share in result.left_out],
    }
    if sample is not None:
        document["attitudes"] = sample_document(sample)
    return plain(document)


def margins_document(margins: VerdictMargins) -> dict[str, object]:
    """Margins of a verdict, and the known properties of a body that has left the range of the model."""
    edge, distance = margins.nearest
    return {
        "axis_ratio": margins.axis_ratio,
        "axis_ratio_limit": margins.limit,
        "strain": margins.strain,
        "bound_fraction_upper": margins.bound_fraction_upper,
        "nearest_edge": edge,
        "nearest_relative": distance,
    }


def sample_document(sample: SpinSample) -> dict[str, object]:
    """Quantiles over a sample of attitudes."""
    levels = (0.0, 0.05, 0.5, 0.95, 1.0)
    verdicts, counts = np.unique(sample.verdict, return_counts=True)

    def quantiles(x: Array) -> dict[str, float]:
        # linear interpolation next to an infinite value would give nan
        method: Literal["linear", "inverted_cdf"] = "linear" if np.isfinite(x).all() else "inverted_cdf"
        values = np.quantile(x, levels, method=method)
        return {f"q{round(100 * p)}": float(v) for p, v in zip(levels, values, strict=True)}

    needed = sample.max_required_friction_angle.to_value(u.deg)
    return {
        "n": len(sample),
        "seed": sample.seed,
        "pole": "catalogue" if sample.pole_known else "isotropic",
        "spin_ratio": quantiles(sample.spin_ratio),
        "pole_change_deg": quantiles(sample.pole_change.to_value(u.deg)),
        "max_required_friction_angle_deg": quantiles(needed),
        "verdicts": dict(zip(verdicts.tolist(), counts.tolist(), strict=True)),
    }


def table_document(table: QTable) -> Document:
    """Document of a table, row by row; a column with a unit is named ``name_unit``, such as ``v_inf_km_s``."""
    rows = []
    for row in table:
        out = {}
        for name in table.colnames:
            value = row[name]
            if isinstance(value, u.Quantity):
                unit = DOCUMENT_UNITS.get(name, value.unit)
                out[with_unit(name, unit)] = value.to_value(unit)
            else:
                out[f"{name}_tdb" if isinstance(value, Time) else name] = value
        rows.append(out)
    return plain({"schema": "table/1", "flybystab": __version__, "meta": dict(table.meta), "rows": rows})
