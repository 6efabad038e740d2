"""Columns of a table of encounters with statistics of the clones of an orbit."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.encounter.distribution import EncounterDistribution
from flybystab.encounter.linear_target_plane import ellipse
from flybystab.typing import Array


def add_clones(table: QTable, found: Sequence[EncounterDistribution | None]) -> None:
    """Add statistics of clones to a table of encounters, from one distribution per row (None without a covariance).

    Columns: ``clones`` (number), ``clones_found`` (with an encounter near this time), ``distance_sigma``,
    ``distance_low``, ``distance_high`` (99.73 % of those found; km), ``time_sigma`` (s), ``b_major``, ``b_minor`` (km)
    and ``b_angle`` (deg from +T to +R) of the one-sigma ellipse, ``p_impact`` with its 95 % interval ``p_impact_low``,
    ``p_impact_high``, and ``p_impact_linear``. nan where fewer than two clones have the encounter.
    """

    def column(value: Callable[[EncounterDistribution], float], least: int = 2) -> Array:
        return np.array(
            [value(d) if d is not None and d.found.sum() >= least else np.nan for d in found], dtype=float
        )

    table["clones"] = np.array([0 if d is None else len(d) for d in found], dtype=int)
    table["clones_found"] = np.array([0 if d is None else d.found.sum() for d in found], dtype=int)
    table["distance_sigma"] = column(lambda d: d.distance_sigma.to_value(u.km)) * u.km
    table["distance_low"] = column(lambda d: d.distance_interval()[0].to_value(u.km)) * u.km
    table["distance_high"] = column(lambda d: d.distance_interval()[1].to_value(u.km)) * u.km
    table["time_sigma"] = column(lambda d: d.time_sigma.to_value(u.s)) * u.s
    table["b_major"] = column(lambda d: ellipse(d.b_covariance)[0].to_value(u.km)) * u.km
    table["b_minor"] = column(lambda d: ellipse(d.b_covariance)[1].to_value(u.km)) * u.km
    table["b_angle"] = column(lambda d: ellipse(d.b_covariance)[2].to_value(u.deg)) * u.deg
    table["p_impact"] = column(lambda d: d.impact_probability, 0)
    table["p_impact_low"] = column(lambda d: d.impact_interval()[0], 0)
    table["p_impact_high"] = column(lambda d: d.impact_interval()[1], 0)
    table["p_impact_linear"] = column(lambda d: d.linear.impact_probability if d.linear else np.nan, 0)
    table.meta["covariances"] = sorted({d.source for d in found if d is not None})
