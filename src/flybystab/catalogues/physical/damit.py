"""Spin files of DAMIT (``spin.txt``), the database of asteroid models from lightcurve inversion.

First line: ecliptic longitude and latitude of the pole (deg, J2000) and sidereal rotation period (h); second line:
epoch (JD) and rotation angle at that epoch (deg); the following YORP acceleration or scattering parameters are not used
(https://astro.troja.mff.cuni.cz/projects/damit/pages/documentation; Durech et al. 2010, A&A 513, A46). For model 101,
(2) Pallas, the first line is ``35 -12 7.81323``; ``IAUspin.txt`` gives the same pole as right ascension 37, declination
2, with 1105.816672 deg/d, so that the first number is the longitude. ``IAUspin.txt`` is not accepted. A file does not
name its asteroid. The files of two mirror poles are alternative solutions with equal weights.
"""

from __future__ import annotations

import re

from flybystab.catalogues.physical import PhysicalData, physical_reader
from flybystab.catalogues.spin_solutions import SpinSolution
from flybystab.errors import InvalidInput

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
#: Start of a file; the Julian date in the second line is one of 1858 to 2132 (24xxxxx).
_FIRST = re.compile(
    rf"\s*({_NUMBER})[ \t]+({_NUMBER})[ \t]+({_NUMBER})[ \t]*\n\s*24[0-9]{{5}}\.?\d*[ \t]+{_NUMBER}[ \t]*(?:\n|\Z)"
)


@physical_reader("DAMIT spin", lambda text: bool(_FIRST.match(text)), "none", "period and pole")
def read_spin(text: str, file: str) -> list[PhysicalData]:
    """The spin solution in a file.

    Raises
    ------
    InvalidInput
        The period is not positive, the latitude is beyond 90 degrees, or the file is ``IAUspin.txt``.
    """
    found = _FIRST.match(text)
    assert found is not None
    longitude, latitude, period = (float(x) for x in found.groups())
    if float(text.split()[3]) == 2451545.0 and period > 100.0:
        raise InvalidInput(
            "spin file",
            found[0].splitlines()[0].strip(),
            f"spin.txt of DAMIT in {file}, not IAUspin.txt (deg/d)",
        )
    return [PhysicalData((), {}, (SpinSolution(period, 0.0, (longitude, latitude), 1.0, f"DAMIT ({file})"),))]
