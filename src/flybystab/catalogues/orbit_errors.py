"""Uncertainty of an orbit without a published covariance, from the digits of its elements and the parameter U.

The Minor Planet Center gives elements to the decimals of MPCORB, without errors. U (JPL: condition code) is a class of
the in-orbit longitude runoff per decade (https://minorplanetcenter.net/iau/info/UValue.html). Here the 1-sigma error of
the mean motion is two thirds of the runoff at the centre of its class, for an orbit whose position in the middle of the
observed arc is exact. The factor was chosen on half of the asteroids that have a later orbit by JPL: it is the smallest
of 1/3, 1/2, 2/3 and 1 for which 3 sigma cover 99 % of the errors within the sampling error. On the other half 3 sigma
cover 99 % as well (``python benchmarks/orbit_errors.py factor``). The errors have wider tails than a normal
distribution, so that 1 sigma covers more than 68 %.

For poorly determined orbits (one opposition, or U of 3 and more) from observations that are years old, U is not
reliable: 3 sigma do not cover 99 % with any of these factors. Their 1-sigma error is the whole runoff, which covers
68 %, and the covariance is marked as unreliable, so that none of their encounters is classified as determined.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from astropy.time import Time

from flybystab.constants import AU, DAY, YEAR
from flybystab.orbit.covariance import SETS, UNRELIABLE, Covariance
from flybystab.orbit.elements import GM_SUN, state_from_elements
from flybystab.orbit.kepler import two_body
from flybystab.typing import Array

#: Half a unit in the last decimal of MPCORB: a (from the mean motion, deg/d), e, i, node, peri, M (deg).
_HALF_UNITS = {"n": 5e-9, "e": 5e-8, "angle": 5e-6}
_STEP = np.log(648000.0) / 9.0
#: One sigma of the mean motion in units of the runoff; the second where U is not reliable.
FACTOR, FACTOR_UNRELIABLE = 2.0 / 3.0, 1.0
#: Age of observations (middle of the arc to epoch of the elements, s) beyond which U of a poorly determined orbit is
#: not reliable, and the largest U of a well-determined orbit.
_RECENT, _WELL_KNOWN = 4.0 * YEAR, 2


def runoff(u: int) -> float:
    """In-orbit runoff in longitude, rad/s, at the centre (of its logarithm) of a class of U, 0 to 9."""
    return float(np.radians(np.exp((u - 0.5) * _STEP) / 3600.0) / (10.0 * YEAR))


def error_of(row: Mapping[str, str], epoch: Time) -> Covariance | None:
    """Covariance from the uncertainty parameter and the printed digits of a catalogue row; None without either.

    Parameters
    ----------
    row : mapping
        A catalogue row. ``condition_code`` is U; ``observed_jd`` is the middle of the observed arc (the epoch if
        unknown); ``single_opposition`` is "Y" for an arc of one opposition. Printed digits are used only for rows from
        the MPC or the SBDB.
    epoch : Time
        Epoch of the elements.
    """
    axis, ecc = float(row["a_au"]) * AU, float(row["e"])
    if axis <= 0.0 or not 0.0 <= ecc < 1.0:
        return None
    one = np.radians(1.0)
    angles = [float(row[c]) * one for c in ("i_deg", "node_deg", "peri_deg", "M_deg")]
    elements = np.array([axis, ecc, *angles])
    middle = _state(elements)
    motion = np.sqrt(GM_SUN / axis**3)
    modes = []
    bases = []
    reliable = True
    if row.get("orbit_source", "").startswith("MPC ("):
        half = np.array([0.0, _HALF_UNITS["e"], *[_HALF_UNITS["angle"] * one] * 4])
        half[0] = 2.0 / 3.0 * axis * _HALF_UNITS["n"] * one / DAY / motion
        modes += [_state(elements + step) - middle for step in np.diag(half / np.sqrt(3.0))]
        bases.append("digits")
    elif row.get("orbit_source", "").startswith("JPL SBDB ("):
        half = printed_half_units(row)
        modes += [_state(elements + step) - middle for step in np.diag(half / np.sqrt(3.0))]
        bases.append("digits")
    if row.get("condition_code", "").isdigit():
        ago = (epoch.tdb.jd - float(row.get("observed_jd") or epoch.tdb.jd)) * DAY
        reliable = u_is_reliable(row, ago)
        drift = runoff(int(row["condition_code"])) * (FACTOR if reliable else FACTOR_UNRELIABLE)
        modes.append(_kicked(middle, axis, ago, -drift / motion) - middle)
        bases.append("U")
    if not bases:
        return None
    basis = " and ".join(bases)
    source = f"{basis} of {row.get('orbit_source') or 'the row'}"
    caveat = f"by the {basis} of its elements" if reliable else UNRELIABLE
    matrix = np.transpose(modes) @ np.array(modes)
    return Covariance(epoch, SETS["cartesian"], middle, matrix, source, False, caveat)


def u_is_reliable(row: Mapping[str, str], ago: float) -> bool:
    """Whether U covers the error of an orbit; the middle of its arc is `ago` s before the epoch."""
    poor = row.get("single_opposition") == "Y" or int(row["condition_code"]) > _WELL_KNOWN
    return not poor or ago < _RECENT


def printed_half_units(row: Mapping[str, str]) -> Array:
    """Half a unit in the last printed digit of a, e, i, node, peri, M (m, rad), shape (6,).

    All four angles are given the largest number of decimals among them, since tables omit trailing zeros.
    """
    a, e, *angles = (_decimals(row[c]) for c in ("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"))
    angle = np.radians(0.5 * 10.0 ** -max(angles))
    return np.array([0.5 * 10.0**-a * AU, 0.5 * 10.0**-e, *[angle] * 4])


def _decimals(text: str) -> int:
    mantissa, _, exponent = text.lower().partition("e")
    return len(mantissa.partition(".")[2]) - int(exponent or 0)


def _state(elements: Array) -> Array:
    """State (m, m/s; ICRF axes), shape (6,), from a, e, i, node, peri, M (m, rad)."""
    a, e, i, node, peri, mean = elements
    return np.array(state_from_elements(a * (1.0 - e), e, i, node, peri, mean * np.sqrt(a**3 / GM_SUN)))


def _kicked(state: Array, axis: float, ago: float, slower: float) -> Array:
    """State of an orbit with the same position `ago` s earlier and a mean motion smaller by the fraction `slower`."""
    then = np.array(two_body(GM_SUN, state, -ago))
    v = np.linalg.norm(then[3:])
    then[3:] *= 1.0 + slower * GM_SUN / (3.0 * axis * v * v)
    return np.array(two_body(GM_SUN, then, ago))
