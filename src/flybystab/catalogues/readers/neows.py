"""NASA's web service for near-Earth objects (NeoWs): one object, or a list of them (JSON).

Fields: https://api.nasa.gov (Asteroids - NeoWs); ``orbital_data`` are elements of the JPL Small-Body Database with
all digits, without errors. Estimated diameters are not read, since they are derived from H with an assumed albedo.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flybystab.catalogues.designations import is_comet, name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.arcs import arc_columns
from flybystab.catalogues.readers.conversion import COLUMN_OF, KEPLERIAN, number, perihelion_row
from flybystab.catalogues.readers.covariances import printed_covariance
from flybystab.catalogues.readers.parameters import check_parameters, looks_like_parameter
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.typing import Document

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry

_COLUMNS = {
    "semi_major_axis": COLUMN_OF["a"],
    "eccentricity": COLUMN_OF["e"],
    "inclination": COLUMN_OF["i"],
    "ascending_node_longitude": COLUMN_OF["node"],
    "perihelion_argument": COLUMN_OF["peri"],
    "mean_anomaly": COLUMN_OF["M"],
}
_COMETARY = (
    "perihelion_distance",
    "eccentricity",
    "inclination",
    "ascending_node_longitude",
    "perihelion_argument",
)


def _is_neows(text: str) -> bool:
    return text.lstrip()[:1] in "{[" and '"orbital_data"' in text and '"epoch_osculation"' in text


@reader("NASA NeoWs", _is_neows, Contents("a and M, or q and Tp", "printed digits and U", "none", "H"))
def read_neows(text: str, file: str) -> list[Entry]:
    """Orbits of an answer.

    Raises
    ------
    InvalidInput
        An object has no elements, or has parameters that are not modelled.
    """
    return [_entry(thing, file) for thing in _objects(parse_json(text, "orbit file", file))]


def _objects(value: object) -> list[Document]:
    """All objects with ``orbital_data`` in an answer: one object, a list, or a mapping of lists by date."""
    if isinstance(value, dict):
        if "orbital_data" in value:
            return [value]
        return [x for v in value.values() for x in _objects(v)]
    return [x for v in value for x in _objects(v)] if isinstance(value, list) else []


def _entry(thing: Document, file: str) -> Entry:
    data = thing["orbital_data"] or {}
    check_parameters("table", [k for k in data if looks_like_parameter(k)], file)
    label = str(thing.get("name") or thing.get("designation") or thing.get("id") or "unnamed")
    source = f"NASA NeoWs ({file})"
    row = name_columns(label) | {"orbit_source": source}
    orbit_class = data.get("orbit_class") or {}
    row |= {
        "orbit_solution": str(data.get("orbit_id") or ""),
        "orbit_class": str(orbit_class.get("orbit_class_type") or ""),
        "pha": {True: "Y", False: "N"}.get(bool(thing.get("is_potentially_hazardous_asteroid")), ""),
    }
    if thing.get("absolute_magnitude_h") is not None:
        row["H_mag"] = str(thing["absolute_magnitude_h"])
    code = str(data.get("orbit_uncertainty") or "")
    row |= arc_columns(data.get("first_observation_date"), data.get("last_observation_date"))
    row["condition_code"] = code if code.isdigit() and not is_comet(row["designation"]) else ""
    if str(data.get("equinox", "J2000")) != "J2000":
        raise InvalidInput("equinox", data["equinox"], f"J2000 in {file}")
    jd = number(data.get("epoch_osculation", ""), "epoch_osculation", file)
    texts = [str(data.get(c) or "") for c in _COLUMNS]
    if all(texts):
        for c, t in zip(_COLUMNS, texts, strict=True):
            number(t, c, file)
        row |= {"epoch_jd_tdb": str(data["epoch_osculation"])} | dict(
            zip(_COLUMNS.values(), texts, strict=True)
        )
        return row, printed_covariance(jd, KEPLERIAN, texts, 0.0, source)
    elements = [number(data.get(c, ""), c, file) for c in _COMETARY]
    since = jd - number(data.get("perihelion_time", ""), "perihelion_time", file)
    return row | perihelion_row(jd, elements, since), None
