"""Orbit of a catalogue row: elements, non-gravitational parameters and covariance."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.catalogues.covariance_files import embedded_covariance
from flybystab.catalogues.record import ORBIT, ORBIT_SI, PERIHELION, Record
from flybystab.constants import AU, DAY
from flybystab.typing import Array

if TYPE_CHECKING:
    from flybystab.orbit.covariance import Covariance
    from flybystab.orbit.forces import NonGravitational
    from flybystab.orbit.orbit import Orbit


@lru_cache(maxsize=64)
def _day(jd: float) -> Time:
    """Time (TDB) from a Julian date; cached, since most rows of a catalogue have the same epoch."""
    whole = np.floor(jd)
    return Time(whole, jd - whole, format="jd", scale="tdb")


def epoch_of(record: Record) -> Time:
    """Epoch of the elements of a row, TDB."""
    return _day(record._number("epoch_jd_tdb"))


def catalogued_orbit(record: Record, published: Covariance | None = None) -> Orbit:
    """The orbit of a row: elements a, e, i, node, peri, M, or q and the time of perihelion in place of a and M.

    Parameters
    ----------
    record : Record
        Row with the elements; A1, A2, A3, DT and AMRAT are zero if unknown.
    published : Covariance, optional
        Covariance of the orbit, if a file gives one; otherwise see :func:`catalogued_covariance`.

    Raises
    ------
    InvalidInput, UnknownName
        A value is missing or invalid, or the law of the non-gravitational acceleration is unknown.
    """
    from flybystab.orbit.orbit import Orbit

    epoch, nongrav = epoch_of(record), _nongravitational(record)
    if record.knows(*PERIHELION) and not record.knows("a_au", "M_deg"):
        state = _state_by_perihelion(record)
        r, v = state[:3] * u.m, state[3:] * u.m / u.s
        return Orbit(epoch, r, v, nongrav=nongrav, name=record.name, covariance=published)
    elements = [record._number(c) * unit for c, unit in zip(ORBIT[1:], ORBIT_SI.tolist(), strict=True)]
    covariance = catalogued_covariance(record) if published is None else published
    return Orbit._from_si_elements(epoch, elements, nongrav, record.name, covariance)


def _nongravitational(record: Record) -> NonGravitational:
    """A1, A2, A3, their law, DT and AMRAT of a row; zero if unknown."""
    from flybystab.orbit.forces import NonGravitational, au_per_day2

    def value(column: str) -> float:
        return record._number(column) if record.row.get(column) else 0.0

    a1, a2, a3 = (au_per_day2(value(c)) for c in ("A1_au_d2", "A2_au_d2", "A3_au_d2"))
    law = record.row.get("nongrav_law") or "asteroid"
    out = NonGravitational((a1, a2, a3), law, value("DT_d") * DAY, value("AMRAT_m2_kg"))
    _ = out.constants  # raises for an unknown law
    return out


def _state_by_perihelion(record: Record) -> Array:
    """Heliocentric state (m, m/s), shape (6,), from perihelion distance and time, for any conic."""
    from flybystab.orbit.elements import state_from_elements

    i, node, peri = (float(np.radians(record._number(c))) for c in ("i_deg", "node_deg", "peri_deg"))
    since = (record._number("epoch_jd_tdb") - record._number("tp_jd_tdb")) * DAY
    return state_from_elements(record._number("q_au") * AU, record._number("e"), i, node, peri, since)


def catalogued_covariance(record: Record) -> Covariance | None:
    """Covariance of the elements a, e, i, node, peri, M of a row.

    It is that included in the package for rows of the embedded catalogue, otherwise a diagonal matrix from the 1-sigmas
    of the row, otherwise an estimate from printed digits and U (:mod:`flybystab.catalogues.orbit_errors`), or None.
    """
    if record.file.startswith("embedded") and (known := embedded_covariance(record.row.get("number", ""))):
        return known
    sigmas = tuple("sigma_" + c for c in ORBIT[1:])
    # Sigmas that are all zero denote unknown errors.
    if not record.knows(*sigmas) or not any(record._number(c) for c in sigmas):
        from flybystab.catalogues.orbit_errors import error_of

        return error_of(record.row, epoch_of(record))
    from flybystab.orbit.covariance import SETS, Covariance

    sigma = np.array([record._number(c) for c in sigmas]) * ORBIT_SI
    source = record.row.get("sigma_source") or record.row.get("orbit_source") or record.file
    return Covariance(
        epoch_of(record),
        SETS["keplerian"],
        np.array([record._number(c) for c in ORBIT[1:]]) * ORBIT_SI,
        np.diag(sigma**2),
        f"1-sigmas without correlations, {source}",
        correlated=False,
    )
