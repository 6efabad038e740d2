"""JSON of the Minor Planet Center: ``mpcorb_extended.json`` and related files, and answers of its web service.

Fields of the extended files (``Epoch`` is a Julian date, TT):
https://minorplanetcenter.net/Extended_Files/Extended_MPCORB_Data_Format_Manual.pdf; of the web service, also used by
``MPC.query_object`` of astroquery: https://minorplanetcenter.net/web_service/. Answers with non-gravitational
parameters raise InvalidInput, since the web service does not state their law.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import COMETARY, number, perihelion_row
from flybystab.catalogues.readers.covariances import printed_covariance
from flybystab.catalogues.readers.mpc import from_mpc
from flybystab.catalogues.readers.parameters import check_parameters, looks_like_parameter
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.typing import Document

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry

_EXTENDED = {
    "H": "H", "Epoch": "epoch_jd_tt", "M": "M_deg", "Peri": "peri_deg", "Node": "node_deg", "i": "i_deg",
    "e": "e", "n": "n_deg_d", "a": "a_au", "U": "U", "Last_obs": "last_obs", "Orbit_type": "orbit_type",
    "Name": "name", "Principal_desig": "principal_desig",
}  # fmt: skip
_SERVICE = {
    "absolute_magnitude": "H", "epoch_jd": "epoch_jd_tt", "mean_anomaly": "M_deg",
    "argument_of_perihelion": "peri_deg", "ascending_node": "node_deg", "inclination": "i_deg",
    "eccentricity": "e", "mean_daily_motion": "n_deg_d", "semimajor_axis": "a_au",
    "orbit_uncertainty": "U", "last_observation_date_used": "last_obs", "name": "name",
    "first_observation_date_used": "first_obs",
    "designation": "principal_desig", "number": "number",
}  # fmt: skip
_PERIHELION = (
    "perihelion_distance",
    "eccentricity",
    "inclination",
    "ascending_node",
    "argument_of_perihelion",
)
#: Keys in capitals that are not parameters of the force model.
_OTHER = frozenset({"H", "G", "U", "M", "NEO"})


def _is_extended(text: str) -> bool:
    return text.lstrip()[:1] in ("[", "{") and all(
        f'"{c}"' in text[:20000] for c in ("Epoch", "Peri", "Node")
    )


def _is_service(text: str) -> bool:
    return text.lstrip()[:1] in ("[", "{") and '"argument_of_perihelion"' in text and '"epoch_jd"' in text


@reader(
    "MPC table (JSON)",
    _is_extended,
    Contents(
        "a, e, i, node, peri, M",
        "printed digits and U",
        "none",
        "H",
        files="`mpcorb_extended.json`, `nea_extended.json`",
    ),
)
def read_extended(text: str, file: str) -> list[Entry]:
    """Rows of an extended file.

    Raises
    ------
    InvalidInput
    """
    return [_extended(row, file) for row in _rows(text, file)]


@reader(
    "MPC web service (JSON)",
    _is_service,
    Contents("a and M, or q and Tp", "printed digits and U", "none", "H"),
)
def read_service(text: str, file: str) -> list[Entry]:
    """Rows of an answer of the web service.

    Raises
    ------
    InvalidInput
        A row has non-gravitational parameters.
    """
    return [_service(row, file) for row in _rows(text, file)]


def _rows(text: str, file: str) -> list[Document]:
    rows = parse_json(text, "catalogue file", file)
    rows = [rows] if isinstance(rows, Mapping) else rows
    if not all(isinstance(row, dict) for row in rows):
        raise InvalidInput("catalogue file", file, "a list of objects")
    return list(rows)


def _renamed(row: Document, names: Mapping[str, str], file: str) -> dict[str, str]:
    out = {mine: str(row[theirs]) for theirs, mine in names.items() if row.get(theirs) is not None}
    missing = [t for t, m in names.items() if m.endswith(("_deg", "_tt")) and m not in out]
    if missing or "e" not in out or not ("a_au" in out or "n_deg_d" in out):
        raise InvalidInput(
            "row", row.get("Name") or row.get("name"), f"{', '.join(missing) or 'a, e'} in {file}"
        )
    return out


def _extended(row: Document, file: str) -> Entry:
    check_parameters("table", [k for k in row if looks_like_parameter(k) and k not in _OTHER], file)
    out = _renamed(row, _EXTENDED, file)
    out["number"] = str(row.get("Number") or "").strip("() ")
    out.setdefault("principal_desig", "")
    out["other_desigs"] = ";".join(row.get("Other_desigs") or [])
    years, days = row.get("Arc_years"), row.get("Arc_length")
    out["arc"] = str(years) if years else f"{days} d" if days else ""
    out["pha_flag"] = str(row.get("PHA_flag") or "0")
    return from_mpc(out, file), None


def _service(row: Document, file: str) -> Entry:
    given = [k for k in row if k.startswith("non_grav_a") and row[k] not in (None, "", "0", 0)]
    given += [k for k in row if looks_like_parameter(k) and k not in _OTHER]
    check_parameters("MPC service", [k.removeprefix("non_grav_").upper() for k in given], file)
    if row.get("semimajor_axis") is None or row.get("mean_anomaly") is None:
        return _by_perihelion(row, file)
    out = _renamed(row, _SERVICE, file)
    out.setdefault("principal_desig", "")
    out["last_obs"] = out.get("last_obs", "").split(".")[0]
    return from_mpc(out, file), None


def _by_perihelion(row: Document, file: str) -> Entry:
    """A comet: perihelion distance and date in place of a and M."""
    label = f"{row.get('designation') or row.get('number')} ({row.get('name') or ''})".replace(" ()", "")
    jd = number(row.get("epoch_jd"), "epoch_jd", file)
    tp = number(row.get("perihelion_date_jd"), "perihelion_date_jd", file)
    texts = [str(row.get(c)) for c in _PERIHELION]
    elements = [number(t, n, file) for t, n in zip(texts, _PERIHELION, strict=True)]
    source = f"MPC comets ({file})"
    out = name_columns(label) | {"orbit_source": source} | perihelion_row(jd, elements, jd - tp)
    whole, _, fraction = str(row["perihelion_date_jd"]).partition(".")
    return out, printed_covariance(jd, COMETARY, [*texts, "0." + fraction], jd - float(whole), source)
