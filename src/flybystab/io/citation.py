"""What to cite: BibTeX of the methods and data behind a result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from astropy.table import QTable

from flybystab.errors import InvalidInput
from flybystab.flybys.result import FlybyResult
from flybystab.io.document import flyby_document, table_document

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
    "DruckerPrager1952": """@article{DruckerPrager1952,
  author = {Drucker, D. C. and Prager, W.},
  title = {Soil mechanics and plastic analysis or limit design},
  journal = {Quarterly of Applied Mathematics}, volume = {10}, pages = {157}, year = {1952}
}""",
    "MatsuokaNakai1974": """@article{MatsuokaNakai1974,
  author = {Matsuoka, Hajime and Nakai, Teruo},
  title = {Stress-deformation and strength characteristics of soil under three different principal stresses},
  journal = {Proceedings of the Japan Society of Civil Engineers}, volume = {232}, pages = {59}, year = {1974}
}""",
    "Carlson1995": """@article{Carlson1995,
  author = {Carlson, B. C.},
  title = {Numerical computation of real or complex elliptic integrals},
  journal = {Numerical Algorithms}, volume = {10}, pages = {13}, year = {1995}
}""",
    "RichardsonBottkeLove1998": """@article{RichardsonBottkeLove1998,
  author = {Richardson, Derek C. and Bottke, William F. and Love, Stanley G.},
  title = {Tidal distortion and disruption of {E}arth-crossing asteroids},
  journal = {Icarus}, volume = {134}, pages = {47}, year = {1998}
}""",
    "HolsappleMichel2006": """@article{HolsappleMichel2006,
  author = {Holsapple, Keith A. and Michel, Patrick},
  title = {Tidal disruptions: {A} continuum theory for solid bodies},
  journal = {Icarus}, volume = {183}, pages = {331}, year = {2006}
}""",
    "HairerNorsettWanner1993": """@book{HairerNorsettWanner1993,
  author = {Hairer, E. and N{\\o}rsett, S. P. and Wanner, G.},
  title = {Solving Ordinary Differential Equations {I}: Nonstiff Problems}, edition = {2},
  publisher = {Springer}, year = {1993}
}""",
    "Park2021": """@article{Park2021,
  author = {Park, Ryan S. and Folkner, William M. and Williams, James G. and Boggs, Dale H.},
  title = {The {JPL} planetary and lunar ephemerides {DE440} and {DE441}},
  journal = {The Astronomical Journal}, volume = {161}, pages = {105}, year = {2021}
}""",
    "Folkner2009": """@article{Folkner2009,
  author = {Folkner, William M. and Williams, James G. and Boggs, Dale H.},
  title = {The planetary and lunar ephemeris {DE} 421},
  journal = {The Interplanetary Network Progress Report}, volume = {42-178}, pages = {1}, year = {2009}
}""",
    "Astropy2022": """@article{Astropy2022,
  author = {{Astropy Collaboration}},
  title = {The {A}stropy Project: sustaining and growing a community-oriented open-source project and the latest major
    release (v5.0) of the core package},
  journal = {The Astrophysical Journal}, volume = {935}, pages = {167}, year = {2022}
}""",
}

#: Behind every result: the equations of motion and of stability, gravity of an ellipsoid, quantities.
ALWAYS = ("Sharma2013", "SharmaJenkinsBurns2006", "Carlson1995", "Astropy2022")

#: What a word in a result stands for: ephemerides, yield surfaces, catalogues.
BY_WORD = {
    "de421": ("Folkner2009",),
    "de440": ("Park2021",),
    "drucker-prager": ("DruckerPrager1952",),
    "drucker-prager-extension": ("DruckerPrager1952",),
    "matsuoka-nakai": ("MatsuokaNakai1974",),
    "asteroids.csv": ("JPLSBDB", "WarnerHarrisPravec2009"),
}

#: What the presence of a key in a result says of the methods: a verdict of the dynamics, a search for encounters.
BY_KEY = {
    "encounter": ("Steinebach2023",),
    "verdict_class": ("RichardsonBottkeLove1998",),
    "required_friction_angle_deg": ("HolsappleMichel2006",),
    "p_disrupted": ("RichardsonBottkeLove1998", "Steinebach2023"),
    "orbit_solution": ("JPLSBDB",),
    "time_scale": ("HairerNorsettWanner1993",),
}

#: Behind an orbit that was followed through an encounter: the Sun is among its forces.
ORBIT = ("ReinLiu2012", "ReinSpiegel2015")


def cite(result: FlybyResult | QTable | Mapping[str, Any] | None = None) -> str:
    """BibTeX of the methods and data, as one text.

    Parameters
    ----------
    result : FlybyResult, QTable or mapping, optional
        What :func:`flybystab.flyby`, :func:`flybystab.screen` or :func:`flybystab.find_encounters` returned, or a
        JSON document of a command: only what it used. Everything that the package stands on by default.

    Raises
    ------
    InvalidInput
        For anything else.
    """
    return "\n\n".join(BIBTEX[key] for key in cited(result))


def cited(result: FlybyResult | QTable | Mapping[str, Any] | None = None) -> tuple[str, ...]:
    """Keys of the entries of :func:`cite`, in the order of :data:`BIBTEX`."""
    if result is None:
        return tuple(BIBTEX)
    if isinstance(result, FlybyResult):
        document: Mapping[str, Any] = flyby_document(result)
    elif isinstance(result, QTable):
        document = table_document(result)
    elif isinstance(result, Mapping):
        document = result
    else:
        raise InvalidInput("result", type(result).__name__, "a FlybyResult, a table or a JSON document")
    if "flybystab" not in document:
        raise InvalidInput("result", sorted(document)[:5], "a document of flybystab: it names its version")
    found = set(ALWAYS)
    for key, value in _entries(document):
        found.update(BY_KEY.get(key, ()))
        found.update(BY_WORD.get(key, ()))
        if isinstance(value, str):
            found.update(BY_WORD.get(value, ()))
            followed = key in ("modelled", "forces") and "orbit: sun point mass" in value
            found.update(ORBIT if followed else ())
    return tuple(key for key in BIBTEX if key in found)


def _entries(value: Any, key: str = "") -> list[tuple[str, Any]]:
    """Every key with its value, at any depth; the entries of a list have its key."""
    if isinstance(value, Mapping):
        return [e for k, v in value.items() for e in [(str(k), None), *_entries(v, str(k))]]
    if isinstance(value, list | tuple):
        return [e for v in value for e in _entries(v, key)]
    return [(key, value)]
