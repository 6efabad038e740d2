"""HTML report of one encounter: a self-contained page with embedded figures (template ``templates/report.html``)."""

from __future__ import annotations

import platform
import sys
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

import astropy.units as u
import jinja2
import numpy as np
from astropy.table import Row

from flybystab._version import __version__
from flybystab.body.surface_history import SurfaceHistory
from flybystab.catalogues.asteroid import Asteroid
from flybystab.files import replace_file
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.spin_sample import SpinSample
from flybystab.io.grains_text import grains_lines
from flybystab.io.report_figures import (
    grains_picture,
    grains_scene_picture,
    history_picture,
    sample_picture,
    sample_plot,
    scene_picture,
    surface_picture,
)
from flybystab.io.surface_text import surface_rows
from flybystab.io.text import (
    MEANING,
    angle,
    contact,
    entry,
    extent,
    friction_extent,
    known,
    left_out,
    median,
    modelled,
    spin_change,
)
from flybystab.orbit.ephemeris import ephemeris
from flybystab.plots.style import styled

__all__ = ["report", "sample_plot"]

#: Rows of a table: label and text.
Rows = list[tuple[str, str]]

#: Packages whose versions are listed under Provenance.
PACKAGES = ("numpy", "scipy", "numba", "astropy", "rebound", "jplephem", "skyfield-data")


@styled
def report(
    asteroid: Asteroid,
    result: FlybyResult,
    sample: SpinSample,
    path: str | Path,
    *,
    screened: Row | None = None,
    command: str = "",
    surface: SurfaceHistory | None = None,
) -> Path:
    """Write the report; returns its path.

    Parameters
    ----------
    asteroid : Asteroid
    result : FlybyResult
        Flyby of the asteroid on its real orbit, with history.
    sample : SpinSample
        The same encounter at sampled attitudes.
    path : str or Path
        File to write, ``.html``.
    screened : Row, optional
        Row of :func:`flybystab.screen` for the same encounter, with sampled inputs.
    command : str
        Command line that produced the report, shown under Provenance.
    surface : SurfaceHistory, optional
        Slopes on the shape through the encounter (:func:`flybystab.surface_history`).
    """
    encounter = result.encounter
    when = "" if encounter.time is None else encounter.time.tdb.iso[:19] + " TDB"
    planet = encounter.planet.name.capitalize()
    page = _template().render(
        title=f"{asteroid.label} passes {planet if planet != 'Earth' else 'the Earth'}, {when[:10]}",
        verdict=str(result.verdict) + (f" (class {result.verdict_class})" if result.verdict_class else ""),
        verdict_text=_verdict(result, sample),
        encounter=_encounter_rows(result, when),
        margins=_margin_rows(result, sample),
        sample_text=_sample_text(sample),
        probabilities=None if screened is None else _probability_rows(screened),
        surface=None if surface is None else surface_rows(surface),
        grains=grains_lines(result, most=12),
        body=_body_rows(asteroid),
        assumed={_INPUTS[column] for column in asteroid.assumed if column in _INPUTS},
        model=_model_rows(result),
        provenance=_provenance_rows(asteroid, sample, command),
        pictures={
            "history": history_picture(result),
            "sample": sample_picture(sample),
            "scene": scene_picture(result),
            "surface": None if surface is None else surface_picture(surface),
            "grains": None if result.grains is None else grains_picture(result),
            "grains_scene": None if result.grains is None else grains_scene_picture(result),
        },
    )
    return replace_file(path, page.encode())


def _template() -> jinja2.Template:
    """Template of the page, with autoescaping."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("flybystab.io"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    return environment.get_template("report.html")


def _verdict(r: FlybyResult, s: SpinSample) -> str:
    agree = ""
    if r.robust is not None:
        agree = (
            f" All {len(r.verdict_by_surface)} yield surfaces agree."
            if r.robust
            else " It depends on the yield surface: "
            + "; ".join(f"{k}: {v}" for k, v in r.verdict_by_surface.items())
            + "."
        )
    same = int(np.count_nonzero(s.verdict == str(r.verdict)))
    return f"The body {MEANING[str(r.verdict)]}.{agree} {same} of {len(s)} sampled attitudes give the same verdict."


def _encounter_rows(r: FlybyResult, when: str) -> Rows:
    e = r.encounter
    q = e.distance.to_value(u.km)
    rows = [
        ("planet", e.planet.name.capitalize()),
        ("closest approach", when or "hyperbolic encounter without a date"),
        ("distance between the centres", f"{q:,.1f} km ({q * 1e3 / e.planet.radius:.3f} planet radii)"),
        ("speed at closest approach", f"{e.v_periapsis.to_value(u.km / u.s):.4f} km/s"),
        (
            "hyperbolic excess speed",
            "none: bound to the planet" if e.bound else f"{e.v_inf.to_value(u.km / u.s):.4f} km/s",
        ),
    ]
    if e.distance_error is not None and e.time_error is not None:
        rows.append(
            (
                "numerical error",
                f"{e.distance_error.to_value(u.km):.1g} km, {e.time_error.to_value(u.s):.1g} s "
                "(excludes the orbit uncertainty)",
            )
        )
        rows.append(("orbit quality", known(e)))
    if e.impact:
        rows.append(("impact", f"reaches the {e.impact_level}{entry(e)}"))
    if r.contact is not None:
        rows.append(("contact", contact(r)))
    return rows


def _margin_rows(r: FlybyResult, s: SpinSample) -> Rows:
    """Nominal values; those that depend on the attitude with their range over the sampled attitudes."""
    m = r.body.material
    phi = m.friction_angle.to_value(u.deg)
    needed, none = s.max_required_friction_angle.to_value(u.deg), "no friction angle suffices"
    ratio = f"{r.spin_ratio:.4f}" if np.isfinite(r.spin_ratio) else spin_change(r)
    turn = f"{r.pole_change.to_value(u.deg):.2f} deg" if np.isfinite(r.pole_change) else "not defined"
    rows = [
        ("friction angle of the material", f"{phi:g} deg (chosen, not measured)"),
        ("cohesion", f"{m.cohesion.to_value(u.Pa):g} Pa"),
        (
            "largest friction angle mobilised",
            _nominal(angle(r.max_required_friction_angle), extent(needed, 2, "deg", none)),
        ),
        ("margin", _nominal(angle(r.margin), extent(phi - needed, 2, "deg", none))),
        ("spin rate after / before", _nominal(ratio, extent(s.spin_ratio, 2))),
        (
            "rotation of the spin axis",
            _nominal(turn, extent(s.pole_change.to_value(u.deg), 1, "deg")),
        ),
        ("bound mass fraction", f"{r.bound_fraction:.1%}"),
        ("semi-axes after", " × ".join(f"{a:.4g}" for a in r.semi_axes.to_value(u.m)) + " m"),
    ]
    if r.required_cohesion > 0 * u.Pa:
        rows.append(("cohesion needed", f"{r.required_cohesion.to_value(u.Pa):.3g} Pa"))
    if r.onset_time is not None:
        rows.append(("onset of yield", f"{r.onset_time.to_value(u.h):.3f} h after the start"))
    if r.error is not None:
        rows.append(
            (
                "numerical error (measured)",
                f"semi-axes {r.error.semi_axes:.1e}, spin {r.error.spin:.1e} (relative), friction angle "
                f"{r.error.required_friction_angle.to_value(u.deg):.1e} deg, tide {r.error.tide:.1e} (relative)",
            )
        )
    return rows


def _nominal(value: str, extent: str) -> str:
    return f"{value} at the nominal attitude; {extent} over the sampled attitudes"


def _sample_text(s: SpinSample) -> str:
    turn = s.pole_change.to_value(u.deg)
    known = (
        "the catalogued pole and random rotation phases"
        if s.pole_known
        else "an isotropic pole (unknown) and random rotation phases"
    )
    if not np.any(s.verdict != "NOT IN EQUILIBRIUM"):
        return f"{len(s)} attitudes with {known}: {friction_extent(s)}."
    ratio = extent(s.spin_ratio, 2, missing="not defined (no spin before)")
    return (
        f"{len(s)} attitudes with {known}: spin rate after over before {ratio}{median(s.spin_ratio, 2)}; rotation of "
        f"the pole {extent(turn, 1, 'deg')}{median(turn, 1)}; {friction_extent(s)}."
    )


def _probability_rows(row: Row) -> Rows:
    return [
        (
            "samples",
            f"{int(row['samples'])} ({int(row['samples_dynamic'])} integrated, the others decided by the bound)",
        ),
        (
            "probability of yielding",
            f"{float(row['p_yield']):.3g} (95 % interval {float(row['p_yield_low']):.2g} to "
            f"{float(row['p_yield_high']):.2g}), among bodies in equilibrium before the encounter",
        ),
        ("not in equilibrium", f"{float(row['p_not_in_equilibrium']):.3g} of the samples"),
        *([("drawn from distributions", str(row["drawn"]))] if row["drawn"] else []),
        *(("not drawn", t) for t in str(row["assumed"]).split("; ") if t.startswith("orbit without errors")),
        *(
            [("margin most sensitive to (Spearman rho)", str(row["contributors"]))]
            if row["contributors"]
            else []
        ),
    ]


#: Catalogue columns shown on the page.
_INPUTS = {
    "semi_axis_a_m": "long semi-axis",
    "semi_axis_b_m": "intermediate semi-axis",
    "semi_axis_c_m": "short semi-axis",
    "density_kg_m3": "density",
    "spin_period_h": "spin period",
    "precession_period_h": "precession period",
    "rotation_period_h": "rotation period",
}


def _body_rows(a: Asteroid) -> Rows:
    rows = []
    for column, name in _INPUTS.items():
        if a.knows(column):
            value = a.quantity(column)
            digits = ".4g" if column.startswith("semi_axis") else "g"
            rows.append((name, f"{value.value:{digits}} {value.unit}".replace(" / ", "/")))
    rows += [(f"source of {k.replace('_', ' ')}", v) for k, v in a.sources.items() if k in _SHOWN]
    if a.assumptions:
        rows.append(("not measured", "; ".join(a.assumptions)))
    return rows


_SHOWN = ("semi_axes", "spin", "pole", "tumbling", "density", "orbit")


def _model_rows(r: FlybyResult) -> Rows:
    return [*modelled(r).items(), ("neglected (largest relative effect)", left_out(r, 6) or "nothing")]


def _provenance_rows(a: Asteroid, s: SpinSample, command: str) -> Rows:
    versions = []
    for name in PACKAGES:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            continue
    rows = [
        ("flybystab", __version__),
        ("created", datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")),
        ("orbit solution", str(a.row.get("orbit_solution", ""))),
        ("catalogue", str(a.file)),
        ("ephemeris", ephemeris().name.upper()),
        ("seed of the attitudes", str(s.seed)),
        (
            "Python and packages",
            f"Python {platform.python_version()} ({sys.platform}); " + ", ".join(versions),
        ),
    ]
    if command:
        rows.insert(1, ("command", command))
    return rows
