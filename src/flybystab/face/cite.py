"""What to cite: BibTeX of the methods and data behind a result."""

from __future__ import annotations

BIBTEX = {
    "Sharma2013": """@article{Sharma2013,
  author = {Sharma, Ishan},
  title = {Structural stability of rubble-pile asteroids},
  journal = {Icarus}, volume = {223}, pages = {367}, year = {2013}
}""",
    "SharmaJenkinsBurns2006": """@article{SharmaJenkinsBurns2006,
  author = {Sharma, Ishan and Jenkins, James T. and Burns, Joseph A.},
  title = {Tidal encounters of ellipsoidal granular asteroids with planets},
  journal = {Icarus}, volume = {183}, pages = {312}, year = {2006}
}""",
    "ReinLiu2012": """@article{ReinLiu2012,
  author = {Rein, Hanno and Liu, Shang-Fei},
  title = {{REBOUND}: an open-source multi-purpose {N}-body code for collisional dynamics},
  journal = {Astronomy and Astrophysics}, volume = {537}, pages = {A128}, year = {2012}
}""",
    "ReinSpiegel2015": """@article{ReinSpiegel2015,
  author = {Rein, Hanno and Spiegel, David S.},
  title = {{IAS15}: a fast, adaptive, high-order integrator for gravitational dynamics},
  journal = {Monthly Notices of the Royal Astronomical Society}, volume = {446}, pages = {1424}, year = {2015}
}""",
    "Steinebach2023": """@article{Steinebach2023,
  author = {Steinebach, Gerd},
  title = {Construction of {Rosenbrock-Wanner} method {Rodas5P} and numerical benchmarks},
  journal = {BIT Numerical Mathematics}, volume = {63}, pages = {27}, year = {2023}
}""",
    "WarnerHarrisPravec2009": """@article{WarnerHarrisPravec2009,
  author = {Warner, Brian D. and Harris, Alan W. and Pravec, Petr},
  title = {The asteroid lightcurve database},
  journal = {Icarus}, volume = {202}, pages = {134}, year = {2009}
}""",
    "JPLSBDB": """@misc{JPLSBDB,
  author = {{JPL Solar System Dynamics}},
  title = {Small-Body Database}, howpublished = {https://ssd.jpl.nasa.gov/tools/sbdb_query.html}
}""",
}


def cite() -> str:
    """Every entry, as one text."""
    return "\n\n".join(BIBTEX.values())
