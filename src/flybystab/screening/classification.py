"""Structural stability of a whole catalogue: required strength and critical perturbation of each asteroid."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.units import Quantity

from flybystab._version import __version__
from flybystab.body.body import Body, Material
from flybystab.body.stability import LEVELS
from flybystab.body.stability_regions import StabilityTable, stability_many
from flybystab.catalogues.asteroid import Asteroid
from flybystab.constants import G
from flybystab.errors import FlybystabError
from flybystab.result_table import ResultTable
from flybystab.screening.draws import nominal
from flybystab.screening.priors import Population
from flybystab.screening.result_rows import Row
from flybystab.screening.results import Column, table_of
from flybystab.screening.selection import listed

#: Friction angles at which the level is given.
ANGLES = (30.0, 35.0, 40.0)

#: Columns of the table.
COLUMNS: dict[str, Column] = {
    "asteroid": Column(str, None, "name, or designation"),
    "number": Column(int, None, "IAU number, -1 without"),
    "required_friction_angle": Column(
        float, u.deg, "mobilised without cohesion; inf if no friction suffices"
    ),
    **{
        f"level_{angle:g}": Column(int, None, f"at {angle:g} deg of friction; see `levels` in the meta data")
        for angle in ANGLES
    },
    "critical_strain": Column(
        float, None, "strain of the smallest perturbation that reaches the energy barrier"
    ),
    "critical_energy": Column(
        float, u.J, "energy barrier: least energy of a perturbation that keeps growing"
    ),
    "energy_share": Column(
        float, None, "critical energy over the binding energy of the sphere of equal volume"
    ),
    "critical_strain_second": Column(float, None, "critical strain at second order"),
    "required_cohesion": Column(
        float, u.Pa, "at the friction angle of the material; 0 where friction suffices"
    ),
    "in_tension": Column(bool, None, "mean tension: no friction angle is sufficient"),
    "mean_pressure": Column(float, u.Pa, "mean pressure; negative in tension"),
    "w2": Column(float, None, "omega^2/(pi G rho)"),
    "semi_axis_a": Column(float, u.m, "long semi-axis"),
    "semi_axis_b": Column(float, u.m, "middle semi-axis"),
    "semi_axis_c": Column(float, u.m, "short semi-axis"),
    "density": Column(float, u.kg / u.m**3, "bulk density"),
    "spin_period": Column(float, u.h, "2 pi over the spin rate"),
    "assumed": Column(str, None, "catalogue values that are assumed, not measured"),
    "drawn": Column(str, None, "quantities missing from the catalogue, set to the median of the prior"),
    "error": Column(str, None, "reason why the row could not be computed"),
}


def classification(
    asteroids: str | Path | Asteroid | Sequence[Asteroid | str | int | Path] | None = None,
    *,
    material: Material | None = None,
    dilatancy: float = 1.0,
    population: Population | None = None,
    workers: int | None = None,
    threads: int | None = None,
) -> ResultTable:
    """Structural stability of a catalogue.

    Parameters
    ----------
    asteroids : path, or sequence of asteroids, names and paths, optional
        As in :func:`flybystab.screening.screening.screen`; the embedded catalogue by default. Bodies of tables of
        orbits get their spins and shapes from the embedded tables; missing values are medians of their distributions.
    material : Material, optional
        For the critical strain and the required cohesion; 35 deg without cohesion by default. Its yield surface
        applies to all columns.
    dilatancy : float
        ``beta/min k`` of the test; 1 is associative flow.
    population : Population, optional
        Distributions of missing values.
    workers : int, optional
        Threads; one per processor by default.
    threads : int, optional
        Deprecated name of `workers`.

    Returns
    -------
    ResultTable
        :data:`COLUMNS`; a body that cannot be computed has its reason in `error`.
    """
    if threads is not None:
        warnings.warn("threads is deprecated: use workers", DeprecationWarning, stacklevel=2)
        workers = threads
    material = material or Material()
    rows, bodies = _prepared(listed(asteroids), material, population)
    _add_stability(rows, bodies, material, dilatancy, workers)
    meta = {
        "flybystab": __version__,
        "friction_angle_deg": float(material.friction_angle.to_value(u.deg)),
        "cohesion_Pa": material.c_pa,
        "yield_surface": material.yield_surface,
        "dilatancy": float(dilatancy),
        "levels": {str(i): name for i, name in enumerate(LEVELS)},
    }
    return table_of(rows, COLUMNS, meta)


def _prepared(
    asteroids: Sequence[Asteroid], material: Material, population: Population | None
) -> tuple[list[Row], dict[int, Body]]:
    """Rows with the inputs of every asteroid, and the bodies by row; a row without a body has its reason."""
    rows: list[Row] = []
    bodies: dict[int, Body] = {}
    for i, asteroid in enumerate(asteroids):
        row: Row = {"asteroid": asteroid.name, "number": asteroid.number}
        rows.append(row)
        try:
            draw = nominal(asteroid, material, population)
            body = draw.body(0, material)
        except FlybystabError as reason:
            row["error"] = str(reason)
            continue
        row["assumed"], row["drawn"] = "; ".join(asteroid.assumptions), "; ".join(draw.drawn)
        row |= dict(zip(("semi_axis_a", "semi_axis_b", "semi_axis_c"), body.axes, strict=True))
        row |= {"density": body.rho, "spin_period": draw.period[0] / 3600.0}
        row["w2"] = float(body.omega @ body.omega) * body.dynamical_time**2
        bodies[i] = body
    return rows, bodies


def _add_stability(
    rows: list[Row], bodies: Mapping[int, Body], material: Material, dilatancy: float, workers: int | None
) -> None:
    """Compute the stability of all bodies and add it to their rows."""
    own_material = list(bodies.values())
    bare = Material(yield_surface=material.yield_surface, bulk_modulus=material.bulk_modulus)
    cohesionless = [b.with_(material=bare) for b in own_material]

    def table(them: list[Body], depth: str, friction: Quantity | None = None) -> StabilityTable:
        return stability_many(
            them, friction_angle=friction, dilatancy=dilatancy, depth=depth, workers=workers
        )

    own = table(own_material, "barrier")
    required = table(cohesionless, "friction").required_friction_angle.to_value(u.deg)
    levels = {f"level_{angle:g}": table(own_material, "second", angle * u.deg).level for angle in ANGLES}
    for k, (i, body) in enumerate(bodies.items()):
        energy = float(own.energy_barrier[k].to_value(u.J))
        sphere = 0.6 * G * body.mass.value**2 / body.mean_radius.value
        rows[i] |= {
            "required_friction_angle": required[k],
            "critical_strain": own.strain_barrier[k],
            "critical_energy": energy,
            "energy_share": energy / sphere,
            "critical_strain_second": own.strain_second[k],
            "required_cohesion": own.required_cohesion[k].to_value(u.Pa),
            "mean_pressure": own.mean_pressure[k].to_value(u.Pa),
            "in_tension": bool(own.mean_pressure[k].value < 0.0),
            **{name: int(level[k]) for name, level in levels.items()},
        }


def counts(table: QTable) -> dict[str, dict[str, int]]:
    """Number of bodies at each level of stability, by friction angle."""
    good = np.asarray(table["error"]) == ""
    return {
        f"{angle:g} deg": {
            name: int(np.sum(np.asarray(table[f"level_{angle:g}"])[good] == i))
            for i, name in enumerate(LEVELS)
        }
        for angle in ANGLES
    }
