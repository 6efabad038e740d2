"""Rows of a search for encounters, and the table made from them."""

from __future__ import annotations

from typing import Any

import astropy.units as u
import numpy as np
from astropy.time import Time
from numpy.typing import NDArray

from flybystab.constants import DAY
from flybystab.orbit.ephemeris import BODIES, Window
from flybystab.orbit.observatories import geographic
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.force_selection import NAMES
from flybystab.orbit.target_plane import target_plane
from flybystab.result_table import ResultTable
from flybystab.typing import Array

#: An encounter this close to an end of the span counts at `start` and not at `stop`, s. The margin exceeds the error of
#: the time, so that exactly one of two adjacent spans contains the encounter.
EDGE = 1.0


def in_span(raw: NDArray[Any], t_start: float, t_stop: float) -> NDArray[np.bool_]:
    """True for rows of a sorted result inside the span; each encounter once, also if the epoch of the orbit is at it.

    `raw` is an array of :data:`flybystab.orbit.search.minima.FOUND`.
    """
    keep = (raw["time"] >= t_start - EDGE) & (raw["time"] < t_stop - EDGE)
    same = (np.diff(raw["time"]) < EDGE) & (np.diff(raw["asteroid"]) == 0) & (np.diff(raw["body"]) == 0)
    keep[1:] &= ~same
    return keep


def forces_used(
    chosen: tuple[str, ...], shares: Array, least: float
) -> tuple[tuple[str, ...], dict[str, float], dict[str, float]]:
    """Forces used for at least one asteroid, their largest displacements (km) where known, and those of the others."""
    largest = {name: float(v) for name, v in zip(NAMES, shares.max(axis=0, initial=0.0), strict=True) if name}
    out = {name for name, value in largest.items() if value < least and name in chosen and len(shares)}
    kept = tuple(n for n in chosen if n not in out)
    share, left_out = ({n: largest[n] / 1e3 for n in some if n in largest} for some in (kept, sorted(out)))
    return kept, share, left_out


def encounter_table(
    rows: list[tuple[str, Orbit]],
    raw: NDArray[Any],
    contacts: Array,
    origin: Time,
    window: Window,
    meta: dict[str, Any],
) -> ResultTable:
    """Table of encounters; `contacts` holds times (s) and relative states of closest approaches or entries."""
    index = raw["asteroid"].copy()
    gm = window.gm[raw["body"]]
    hits = raw["impact"] != 0
    speed2 = raw["v_inf2"] + 2.0 * gm / raw["distance"]
    b, _ = target_plane(raw["state"], gm)
    out = ResultTable()
    out["asteroid"] = np.array([rows[i][0] for i in index], dtype=str)
    out["planet"] = np.array([BODIES[k] for k in raw["body"]], dtype=str)
    zero = origin.tdb
    out["time"] = Time(np.full(len(raw), zero.jd1), zero.jd2 + raw["time"] / DAY, format="jd", scale="tdb")
    out["distance"] = (raw["distance"] * u.m).to(u.km)
    out["v_rel"] = (np.sqrt(np.maximum(speed2, 0.0)) * u.m / u.s).to(u.km / u.s)
    out["v_inf"] = (np.sqrt(np.maximum(raw["v_inf2"], 0.0)) * u.m / u.s).to(u.km / u.s)
    out["b_t"], out["b_r"] = (b[:, 0] * u.m).to(u.km), (b[:, 1] * u.m).to(u.km)
    out["impact"] = hits
    out["index"] = index
    out["position"] = (contacts[:, 1:4] * u.m).to(u.km)
    out["velocity"] = (contacts[:, 4:] * u.m / u.s).to(u.km / u.s)
    if hits.any():
        at_earth = hits & (out["planet"] == "earth")
        places = np.full((len(raw), 2), np.nan)
        when = Time(zero.jd1, zero.jd2 + contacts[:, 0] / DAY, format="jd", scale="tdb")
        if at_earth.any():
            places[at_earth] = geographic(contacts[at_earth, 1:4], when[at_earth])
        out["entry_time"] = np.where(hits, when.isot, "")
        out["entry_longitude"], out["entry_latitude"] = places[:, 0] * u.deg, places[:, 1] * u.deg
    out.meta = meta
    return out
