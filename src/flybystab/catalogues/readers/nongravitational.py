"""Conversion of non-gravitational parameters in orbit files to catalogue columns.

Parameters are A1, A2, A3 (au/d2) of Marsden et al. (1973) and DT (d) of Yeomans & Chodas (1989), with the constants of
the law g(r), and AMRAT, the area-to-mass ratio (m2/kg) for radiation pressure on an absorbing body. OrbFit gives A/M in
m2/ton for a solar constant of 1370 W/m2 (module ``non_grav``, subroutine ``radpast``), Find_Orb in m2/kg for 1361 W/m2
(``constant.h``), the value in :mod:`flybystab.orbit.forces`.
"""

from __future__ import annotations

from collections.abc import Mapping

from flybystab.catalogues.readers.conversion import number
from flybystab.errors import InvalidInput

#: Column of each parameter.
COLUMN_OF_PARAMETER: Mapping[str, str] = {
    "A1": "A1_au_d2",
    "A2": "A2_au_d2",
    "A3": "A3_au_d2",
    "DT": "DT_d",
    "AMRAT": "AMRAT_m2_kg",
}
ACCELERATIONS = ("A1", "A2", "A3")
#: Constants of the laws g(r) as listed by JPL, R0 in au. NN has no effect if NK is zero.
LAWS: Mapping[str, Mapping[str, float]] = {
    "asteroid": {"ALN": 1.0, "NK": 0.0, "NM": 2.0, "R0": 1.0},
    "comet": {"ALN": 0.1112620426, "NK": 4.6142, "NM": 2.15, "NN": 5.093, "R0": 2.808},
}
_CONSTANTS = ("ALN", "R0", "NM", "NN", "NK")
#: Factor from m2/ton of OrbFit, with which the MPC fits orbits, to m2/kg for the solar constant of this package.
ORBFIT_AREA = 1e-3 * 1370.0 / 1361.0


def nongravitational_columns(
    values: Mapping[str, object], comet: bool, file: str, *, law: str = ""
) -> dict[str, str]:
    """Columns of the parameters of a solution.

    Parameters
    ----------
    values : mapping
        Parameters and constants by JPL's names, in au/d2, d, m2/kg and au (R0); other entries are ignored.
    comet : bool
        Whether A1, A2, A3 follow the law of comets if the constants are not given.
    law : str, optional
        Name of the law, for publishers that do not list its constants.

    Raises
    ------
    InvalidInput
        A value is not a finite number, or the law is unknown.
    """
    given = {n: number(v, n, file) for n, v in values.items() if n in COLUMN_OF_PARAMETER}
    given = {n: v for n, v in given.items() if v != 0.0}
    row = {COLUMN_OF_PARAMETER[n]: repr(v) for n, v in given.items()}
    if not any(n in given for n in ACCELERATIONS):
        return {c: v for c, v in row.items() if c != COLUMN_OF_PARAMETER["DT"]}
    return row | {"nongrav_law": law or law_of(values, comet, file)}


def law_of(values: Mapping[str, object], comet: bool, file: str) -> str:
    """Name of the law g(r) of A1, A2, A3, or its five constants ALN, R0, NM, NN, NK.

    Raises
    ------
    InvalidInput
        The constants are missing for an asteroid, or incomplete and not those of a named law.
    """
    given = {n: number(values[n], n, file) for n in _CONSTANTS if values.get(n) is not None}
    if not given and comet:
        return "comet"
    for name, law in LAWS.items():
        if given and all(given.get(n) == x for n, x in law.items()):
            return name
    if len(given) == len(_CONSTANTS):
        return " ".join(repr(given[n]) for n in _CONSTANTS)
    raise InvalidInput(
        "A1, A2, A3",
        f"with the law {given or 'not given'} in {file}",
        "all of the constants ALN, R0, NM, NN, NK, or those of the law 1/r2 or of the water-ice law of comets",
    )
