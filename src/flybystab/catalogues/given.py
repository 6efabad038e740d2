"""Catalogue rows from given values: orbit, body and pole, with errors and sources."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.arguments import finite
from flybystab.body.body import Body, check_body
from flybystab.body.shape import Shape
from flybystab.catalogues.readers.conversion import state_row
from flybystab.catalogues.record import SHAPE, Record
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.osculating_state import heliocentric
from flybystab.units import to_si

#: Unit, and stem of the column names, of each quantity that can have an error or a source.
QUANTITIES: Mapping[str, tuple[u.UnitBase, str]] = {
    "axes": (u.m, "semi_axes"),
    "diameter": (u.m, "diameter"),
    "density": (u.kg / u.m**3, "density"),
    "period": (u.h, "spin"),
    "pole": (u.deg, "pole"),
    "orbit": (u.dimensionless_unscaled, "orbit"),
}
#: Quantities with a column for their error.
_ERRORS = ("axes", "density", "period")


def checked_orbit(orbit: object) -> Orbit:
    """The orbit; raises InvalidInput for anything else."""
    if not isinstance(orbit, Orbit):
        raise InvalidInput("orbit", orbit, "an Orbit: Orbit.from_elements or Orbit.from_state")
    return orbit


def orbit_columns(orbit: Orbit, name: str) -> dict[str, str]:
    """Name, epoch and osculating elements (heliocentric, J2000 ecliptic) of an orbit."""
    row = state_row(float(orbit.epoch.tdb.jd), heliocentric(orbit))
    return {"name": name or orbit.name or "unnamed"} | row


def body_columns(body: Body) -> dict[str, str]:
    """Semi-axes, density and period of a body that spins about its short axis.

    Raises
    ------
    InvalidInput
        The body rotates about another axis.
    """
    check_body(body)
    axes = np.asarray(body.semi_axes.to_value(u.m), dtype=float)
    row = dict(zip(SHAPE, map(repr, axes.tolist()), strict=True))
    row["diameter_m"] = repr(float(2.0 * np.cbrt(np.prod(axes))))
    row["shape_kind"] = "measured"
    row["density_kg_m3"] = repr(float(body.density.to_value(u.kg / u.m**3)))
    x, y, z = (float(w) for w in body.omega)
    if x or y or not z:
        raise InvalidInput(
            "body.spin", body.spin, "a rotation about the short axis; for a tumbler: Asteroid.with_tumbling"
        )
    period = 2.0 * np.pi / abs(z) / 3600.0
    return row | {"spin_period_h": repr(period), "spin_state": "principal"}


def pole_columns(pole: Quantity) -> dict[str, str]:
    """Ecliptic longitude and latitude (J2000) of a pole.

    Parameters
    ----------
    pole : Quantity (2,)
        Ecliptic longitude and latitude.
    """
    longitude, latitude = to_si(pole, u.rad, "pole", shape=(2,)).tolist()
    if abs(latitude) > 0.5 * np.pi + 1e-12:
        raise InvalidInput("pole", pole, "ecliptic longitude and latitude, the latter within 90 deg")
    return {
        "pole_ecl_lon_deg": repr(float(np.degrees(longitude))),
        "pole_ecl_lat_deg": repr(float(np.degrees(latitude))),
    }


def shape_columns(record: Record, shape: Shape) -> dict[str, str]:
    """Columns of the equivalent ellipsoid of a shape; relative errors of the semi-axes are kept from the row."""
    row = {}
    for column, length in zip(SHAPE, shape.ellipsoid().value.tolist(), strict=True):
        sigma = column.removesuffix("_m") + "_sigma_m"
        if record.knows(column, sigma):
            row[sigma] = repr(record._number(sigma) / record._number(column) * length)
        row[column] = repr(length)
    row["shape_kind"] = "measured"
    row["semi_axes_source"] = f"equivalent ellipsoid of a polyhedron of {len(shape.facets)} facets"
    row["diameter_m"] = repr(2.0 * float(shape.mean_radius.value))
    row["assumed"] = ";".join(c for c in record.assumed if not c.startswith(("semi_axis", "diameter")))
    return row


def tumbling_columns(precession_period: Quantity, rotation_period: Quantity, mode: str) -> dict[str, str]:
    """Columns of a tumbling solution: periods ``P_phi`` and ``P_psi``, and the mode."""
    row = {"tumbling_mode": mode}
    for column, value in (
        ("precession_period_h", precession_period),
        ("rotation_period_h", rotation_period),
    ):
        row[column] = repr(to_si(value, u.h, column, low=0.0, open_low=True))
    return row


def inertia_columns(semi_axes: Quantity, inertia: tuple[float, float]) -> dict[str, str]:
    """Columns of the semi-axes of a homogeneous ellipsoid with given ratios of its moments of inertia.

    Parameters
    ----------
    semi_axes : Quantity (3,)
        Semi-axes whose volume is kept, m.
    inertia : (float, float)
        ``J1/J3`` and ``J2/J3``.

    Raises
    ------
    InvalidInput
        No ellipsoid has these ratios.
    """
    if np.shape(inertia) != (2,):
        raise InvalidInput("inertia", inertia, "two ratios of moments of inertia")
    first, second = (finite(x, "inertia") for x in inertia)
    if not (0.0 < first <= second <= 1.0 < first + second):
        raise InvalidInput("inertia", inertia, "0 < J1/J3 <= J2/J3 <= 1 < J1/J3 + J2/J3")
    # J1 = m (b^2 + c^2)/5 and cyclic, so that a^2 is proportional to J2 + J3 - J1.
    squares = np.array([second + 1.0 - first, first + 1.0 - second, first + second - 1.0])
    axes = np.sqrt(squares) * np.cbrt(np.prod(semi_axes.value) / np.sqrt(np.prod(squares)))
    return dict(zip(SHAPE, map(repr, axes.tolist()), strict=True))


def error_columns(sigmas: Mapping[str, Quantity]) -> dict[str, str]:
    """Columns of 1-sigma errors: ``axes`` (one value or three), ``density``, ``period``."""
    row = {}
    for key, value in sigmas.items():
        if key not in _ERRORS:
            raise UnknownName(
                "error", str(key), get_close_matches(str(key), _ERRORS), f"(known: {', '.join(_ERRORS)})"
            )
        unit = QUANTITIES[key][0]
        sigma = to_si(value, unit, f"sigmas[{key!r}]", shape=None, low=0.0)
        if key == "axes":
            for column, s in zip(SHAPE, np.broadcast_to(sigma, (3,)).tolist(), strict=True):
                row[column.removesuffix("_m") + "_sigma_m"] = repr(float(s))
        else:
            column = {"density": "density_sigma_kg_m3", "period": "spin_period_sigma_h"}[key]
            row[column] = repr(float(sigma))
    return row


def source_columns(sources: Mapping[str, str]) -> dict[str, str]:
    """Columns of sources, by the names of :data:`QUANTITIES`."""
    row = {}
    for key, text in sources.items():
        if key not in QUANTITIES:
            raise UnknownName(
                "source",
                str(key),
                get_close_matches(str(key), QUANTITIES),
                f"(known: {', '.join(QUANTITIES)})",
            )
        row[QUANTITIES[key][1] + "_source"] = str(text)
    return row
