"""Non-gravitational parameters of orbit files as columns of a catalogue.

A1, A2, A3 (au/d2) and DT (d) of Marsden et al. (1973) and Yeomans & Chodas (1989), with the constants of their law of
distance, and AMRAT, the illuminated area over mass (m2/kg) of radiation pressure on an absorbing body. OrbFit states
A/M in m2/ton for a solar constant of 1370 W/m2 (its module ``non_grav``, subroutine ``radpast``); Find_Orb in m2/kg
for 1361 W/m2 (``constant.h``), the value of :mod:`flybystab.orbit.forces`.
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
#: Constants of the laws of distance, as JPL lists them: R0 in au. NN has no effect where NK is zero.
LAWS: Mapping[str, Mapping[str, float]] = {
    "asteroid": {"ALN": 1.0, "NK": 0.0, "NM": 2.0, "R0": 1.0},
    "comet": {"ALN": 0.1112620426, "NK": 4.6142, "NM": 2.15, "NN": 5.093, "R0": 2.808},
}
_CONSTANTS = ("ALN", "R0", "NM", "NN", "NK")
#: m2/kg of 1 m2/ton of OrbFit and the MPC, which fits orbits with it, with the solar constant of this package.
ORBFIT_AREA = 1e-3 * 1370.0 / 1361.0


def nongravitational_columns(
    values: Mapping[str, object], comet: bool, file: str, *, law: str = ""
) -> dict[str, str]:
    """Columns of the parameters of a solution.

    Parameters
    ----------
    values : mapping
        Parameters by the names of JPL, in au/d2, d, m2/kg and, of the law, au; others are ignored.
    comet : bool
        Whether A1, A2, A3 without constants follow the law of comets.
    law : str, optional
        Law of a publisher that does not list its constants.

    Raises
    ------
    InvalidInput
        A value is not a finite number, the law is not known, or DT is given without A1, A2, A3.
    """
    given = {n: number(v, n, file) for n, v in values.items() if n in COLUMN_OF_PARAMETER}
    given = {n: v for n, v in given.items() if v != 0.0}
    row = {COLUMN_OF_PARAMETER[n]: repr(v) for n, v in given.items()}
    if not any(n in given for n in ACCELERATIONS):
        return {c: v for c, v in row.items() if c != COLUMN_OF_PARAMETER["DT"]}
    return row | {"nongrav_law": law or law_of(values, comet, file)}


def law_of(values: Mapping[str, object], comet: bool, file: str) -> str:
    """Name of the law of distance of A1, A2, A3, or its five constants ALN, R0, NM, NN, NK.

    Raises
    ------
    InvalidInput
        An asteroid without constants, or constants that agree with neither named law.
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
        "all of the constants ALN, R0, NM, NN, NK, or those of the law 1/r2 or of the water law of comets",
    )
