"""Orbit files in the format OEF2.0 of OrbFit (ESA NEOCC)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from flybystab.catalogues.designations import names_of
from flybystab.catalogues.readers import FRAME, reader
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    import astropy.units as u

    from flybystab.catalogues.readers import Entry
    from flybystab.orbit.covariance import Covariance


@reader("OEF2.0", lambda text: bool(re.match(r"\s*(format\s*=.*OEF2|(KEP|EQU|CAR) )", text)))
def read_oef(text: str, file: str) -> list[Entry]:
    """The orbit of an OEF2.0 file."""
    return [from_neocc(text, file)]


def from_neocc(text: str, file: str) -> tuple[dict[str, str], Covariance | None]:
    """An orbit file of ESA's NEO Coordination Centre (OEF2, Keplerian elements, ``.ke0`` and ``.ke1``).

    Returns
    -------
    dict
        A catalogue row.
    Covariance or None
        Upper triangle of its ``COV`` lines: au, degrees, and 1e-10 au/d2 for A2, as the ``RMS`` line shows.

    Raises
    ------
    InvalidInput
        The file is not one, or its covariance is not that of the parameters that it lists.
    """
    lines = [line.strip() for line in text.splitlines()]
    try:
        body = lines[lines.index("END_OF_HEADER") + 1 :]
        if "ECLM J2000" not in text:
            raise ValueError
        designation = next(line for line in body if line and not line.startswith("!"))
        words = {line.split()[0]: line.split()[1:] for line in body if line and not line.startswith("!")}
        kep = words["KEP"]
        day, scale = float(words["MJD"][0]), words["MJD"][1]
        if len(kep) != 6 or scale not in ("TDT", "TT", "TDB"):
            raise ValueError
    except (ValueError, KeyError, IndexError, StopIteration):
        raise InvalidInput("orbit file", file, "an OEF2.0 file with Keplerian elements, ECLM J2000") from None
    out = dict(zip(("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"), kep, strict=True))
    if designation.isdigit():
        out["number"] = designation
        name, out["designation"] = names_of(designation)
    else:
        name, out["designation"] = "", f"{designation[:4]} {designation[4:]}".strip()
    out["name"] = name or out["designation"] or designation
    # TT and TDB differ by less than 2 ms.
    out["epoch_jd_tdb"] = repr(day + 2400000.5)
    if "MAG" in words:
        out["H_mag"] = words["MAG"][0]
    if len(words.get("NGR", [])) == 2:
        out["A2_au_d2"] = repr(float(words["NGR"][1]) * 1e-10)
        if float(words["NGR"][0]) != 0.0:
            out["notes"] = f"solar radiation pressure is left out (area-to-mass ratio {words['NGR'][0]} m2/t)"
    out |= {"frame": FRAME, "orbit_source": f"ESA NEOCC ({file})", "orbit_solution": "NEOCC OEF2"}
    return out, _neocc_covariance(body, words, out, file)


def _neocc_covariance(
    body: Sequence[str], words: Mapping[str, Sequence[str]], row: Mapping[str, str], file: str
) -> Covariance | None:
    import astropy.units as u
    import numpy as np
    from astropy.time import Time

    from flybystab.orbit.covariance import Covariance

    cells = [c for line in body if line.startswith("COV") for c in line.split()[1:]]
    if not cells:
        return None
    names = ["a", "e", "i", "node", "peri", "M"]
    units: list[u.UnitBase] = [u.au, u.dimensionless_unscaled, *[u.deg] * 4]
    try:
        upper = [float(c) for c in cells]
        # LSP: model, number of parameters, dimension, list of those solved for (2: Yarkovsky).
        solved = words.get("LSP", [])[3:]
        n = 6 + len(solved)
        if len(upper) != n * (n + 1) // 2 or any(s not in ("1", "2") for s in solved):
            raise ValueError
        matrix = np.zeros((n, n))
        matrix[np.triu_indices(n)] = upper
        matrix += np.triu(matrix, 1).T
        values = [float(row[c]) for c in ("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg")]
        keep = list(range(6))
        if "2" in solved:  # the area-to-mass ratio is marginalised: solar radiation is not modelled
            keep.append(6 + solved.index("2"))
            names.append("A2")
            units.append(1e-10 * u.au / u.d**2)
            values.append(float(words["NGR"][1]))
        rms = [float(c) for c in words.get("RMS", [])] or np.sqrt(np.diag(matrix))
        if len(rms) != n or not np.allclose(np.sqrt(np.diag(matrix)), rms, rtol=1e-4):
            raise ValueError
    except (ValueError, IndexError):
        raise InvalidInput(
            "orbit file",
            file,
            "COV lines that agree with the LSP and RMS lines, A2 at most beside the elements",
        ) from None
    epoch = Time(float(row["epoch_jd_tdb"]), format="jd", scale="tdb")
    return Covariance.in_units(epoch, names, values, matrix[np.ix_(keep, keep)], units, f"ESA NEOCC ({file})")
