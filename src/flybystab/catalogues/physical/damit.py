"""Spin files of DAMIT (``spin.txt``), the database of asteroid models from lightcurve inversion.

First line: ecliptic longitude and latitude of the pole (deg, J2000) and sidereal rotation period (h); second line:
epoch (JD) and rotation angle at it (deg); then a YORP change or parameters of the light scattering, which are not used
(https://damit.cuni.cz, "Documentation"; Durech et al. 2010, A&A 513, A46). A file does not name its asteroid. The
files of two mirror poles are rival solutions of the same weight.
"""

from __future__ import annotations

import re

from flybystab.catalogues.physical import PhysicalData, physical_reader
from flybystab.catalogues.spin_solutions import SpinSolution

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
#: A Julian date of the second line stands between 1880 and 2100.
_FIRST = re.compile(
    rf"\s*({_NUMBER})[ \t]+({_NUMBER})[ \t]+({_NUMBER})[ \t]*\n\s*24[0-9]{{5}}\.?\d*[ \t]+{_NUMBER}[ \t]*(?:\n|\Z)"
)


@physical_reader("DAMIT spin", lambda text: bool(_FIRST.match(text)), "none", "period and pole")
def read_spin(text: str, file: str) -> list[PhysicalData]:
    """The solution of a file.

    Raises
    ------
    InvalidInput
        The period is not positive, or the latitude is beyond 90 degrees.
    """
    found = _FIRST.match(text)
    assert found is not None
    longitude, latitude, period = (float(x) for x in found.groups())
    return [PhysicalData((), {}, (SpinSolution(period, 0.0, (longitude, latitude), 1.0, f"DAMIT ({file})"),))]
