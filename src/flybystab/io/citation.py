"""BibTeX references for the methods and data used in a result."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources

from astropy.table import QTable

from flybystab.core.material.surfaces import SURFACES
from flybystab.errors import InvalidInput
from flybystab.flybys.document import flyby_document, table_document
from flybystab.flybys.result import FlybyResult


def _entries_of(text: str) -> dict[str, str]:
    """BibTeX entries by key, in the order of the file; entries are separated by a blank line."""
    entries = (entry.strip() for entry in text.split("\n\n"))
    return {entry.partition("{")[2].partition(",")[0]: entry for entry in entries}


#: Entries of ``references.bib`` by key.
BIBTEX = _entries_of(resources.files("flybystab.io").joinpath("references.bib").read_text(encoding="utf-8"))

#: Cited for every result: equations of motion and of stability, gravity of an ellipsoid, units.
ALWAYS = ("Sharma2013", "SharmaJenkinsBurns2006", "Carlson1995", "Astropy2022")

#: References by value in a result: ephemerides, yield surfaces, catalogues.
BY_WORD = {
    "de421": ("Folkner2009",),
    "de440": ("Park2021",),
    **{surface.name: surface.references for surface in SURFACES if surface.references},
    "asteroids.csv": ("JPLSBDB", "WarnerHarrisPravec2009"),
}

#: References by key in a result: methods that produce the quantity.
BY_KEY = {
    "encounter": ("Steinebach2023",),
    "verdict_class": ("RichardsonBottkeLove1998",),
    "required_friction_angle_deg": ("HolsappleMichel2006",),
    "p_disrupted": ("RichardsonBottkeLove1998", "Steinebach2023"),
    "orbit_solution": ("JPLSBDB",),
    "time_scale": ("HairerNorsettWanner1993",),
}

#: Cited if an orbit was integrated through an encounter, that is, if the Sun is among its forces.
ORBIT = ("ReinLiu2012", "ReinSpiegel2015")


def cite(result: FlybyResult | QTable | Mapping[str, object] | None = None) -> str:
    """BibTeX entries for the methods and data used, as one text.

    Parameters
    ----------
    result : FlybyResult, QTable or mapping, optional
        Result of :func:`flybystab.flyby`, :func:`flybystab.screen` or :func:`flybystab.find_encounters`, or the JSON
        document of a command. By default all entries.

    Raises
    ------
    InvalidInput
        `result` is none of these.
    """
    return "\n\n".join(BIBTEX[key] for key in cited(result))


def cited(result: FlybyResult | QTable | Mapping[str, object] | None = None) -> tuple[str, ...]:
    """Keys of the entries of :func:`cite`, in the order of :data:`BIBTEX`."""
    if result is None:
        return tuple(BIBTEX)
    if isinstance(result, FlybyResult):
        document: Mapping[str, object] = flyby_document(result)
    elif isinstance(result, QTable):
        document = table_document(result)
    elif isinstance(result, Mapping):
        document = result
    else:
        raise InvalidInput("result", type(result).__name__, "a FlybyResult, a table or a JSON document")
    if "flybystab" not in document:
        raise InvalidInput("result", sorted(document)[:5], "a document with the version of flybystab")
    found = set(ALWAYS)
    for key, value in _entries(document):
        found.update(BY_KEY.get(key, ()))
        found.update(BY_WORD.get(key, ()))
        if isinstance(value, str):
            found.update(BY_WORD.get(value, ()))
            followed = key in ("modelled", "forces") and "orbit: sun point mass" in value
            found.update(ORBIT if followed else ())
    return tuple(key for key in BIBTEX if key in found)


def _entries(value: object, key: str = "") -> list[tuple[str, object]]:
    """All keys with their values, at any depth; the items of a list have the key of the list."""
    if isinstance(value, Mapping):
        return [e for k, v in value.items() for e in [(str(k), None), *_entries(v, str(k))]]
    if isinstance(value, list | tuple):
        return [e for v in value for e in _entries(v, key)]
    return [(key, value)]
