"""How well an orbit is known where no covariance is published: the digits of its elements, and its parameter U.

The Minor Planet Center prints elements to the decimals of MPCORB and no errors. What it says of them is U, a class
of the runoff in longitude after ten years (https://minorplanetcenter.net/iau/info/UValue.html), which it does not
offer as a predictor for near-Earth asteroids. Here a third of the runoff in the middle of its class (three being the
factor by which the MPC widens formal errors) counts as one sigma of the mean motion, with no error of longitude where
the asteroid was observed. Held against later orbits that is about what it is called: 82 % of JPL's orbits of 2020
were within one sigma and 91 % within two, and so were 50 to 90 and 76 to 97 % of the MPC's orbits, by U and date
(``python benchmarks/orbit_errors.py``).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from astropy.time import Time

from flybystab.constants import AU, DAY, YEAR
from flybystab.sky.covariance import SETS, Covariance
from flybystab.sky.elements import GM_SUN

#: Half a unit in the last decimal of MPCORB: a (by way of the mean motion, deg/d), e, i, node, peri, M (deg).
_HALF_UNITS = {"n": 5e-9, "e": 5e-8, "angle": 5e-6}
_STEP = np.log(648000.0) / 9.0


def runoff(u: int) -> float:
    """In-orbit runoff in longitude, rad/s, in the middle (by its logarithm) of a class of U, 0 to 9."""
    return float(np.radians(np.exp((u - 0.5) * _STEP) / 3600.0) / (10.0 * YEAR))


def error_of(row: Mapping[str, str], epoch: Time) -> Covariance | None:
    """A covariance from what a catalogue row says of its orbit otherwise; None if it says nothing.

    Parameters
    ----------
    row : mapping
        A catalogue row. ``condition_code`` is U; ``observed_jd`` the middle of the observed arc (else the epoch);
        digits count where the row comes from the MPC.
    epoch : Time
        Of its elements.
    """
    axis, angle = float(row["a_au"]) * AU, np.radians(1.0)
    values = [
        axis,
        float(row["e"]),
        *(float(row[c]) * angle for c in ("i_deg", "node_deg", "peri_deg", "M_deg")),
    ]
    if axis <= 0.0:
        return None
    motion = np.sqrt(GM_SUN / axis**3)
    matrix = np.zeros((6, 6))
    said = []
    if row.get("orbit_source", "").startswith("MPC ("):
        half = np.array([0.0, _HALF_UNITS["e"], *[_HALF_UNITS["angle"] * angle] * 4])
        half[0] = 2.0 / 3.0 * axis * _HALF_UNITS["n"] * angle / DAY / motion
        matrix += np.diag(half**2 / 3.0)
        said.append("digits")
    if row.get("condition_code", "").isdigit():
        drift = runoff(int(row["condition_code"])) / 3.0
        since = (epoch.tdb.jd - float(row.get("observed_jd") or epoch.tdb.jd)) * DAY
        way = np.array([-2.0 / 3.0 * axis * drift / motion, 0.0, 0.0, 0.0, 0.0, drift * since])
        matrix += np.outer(way, way)
        said.append("U")
    if not said:
        return None
    source = f"{' and '.join(said)} of {row.get('orbit_source') or 'the row'}"
    return Covariance(
        epoch,
        SETS["keplerian"],
        np.array(values),
        matrix,
        source,
        False,
        f"by the {' and '.join(said)} of its elements",
    )
