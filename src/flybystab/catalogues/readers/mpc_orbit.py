"""Orbit documents of the Minor Planet Center (MPC_ORB JSON of the get-orb API), with covariances.

Fields: https://github.com/Smithsonian/mpc-public/tree/main/mpc_orb (schema 0.1 to 0.7). ``CAR`` is a heliocentric
state with ecliptic axes, ``COM`` contains q, e, i, node, argperi, peri_time (MJD); the epoch is in MJD, TT; ``covKL``
is row K, column L of the covariance in the same units. ``non_grav_units``: yarkovsky in 1e-10 au/d2, srp in m2/ton
(units of OrbFit, with which the orbits are computed), A1, A2, A3 in au/d2, DT in days; ``non_grav_model`` is their law:
``marsden``, or ``yc`` (Yeomans & Chodas 1989) with DT.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import CARTESIAN, MJD, elements_row, number
from flybystab.catalogues.readers.covariances import covariance_of
from flybystab.catalogues.readers.nongravitational import ORBFIT_AREA, nongravitational_columns
from flybystab.catalogues.readers.parameters import check_parameters
from flybystab.errors import InvalidInput
from flybystab.files import parse_json

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry
    from flybystab.typing import Array, Document

_COM = {"q": "q", "e": "e", "i": "i", "node": "node", "argperi": "peri", "peri_time": "tp"}
_CAR = {c: c for c in CARTESIAN}
#: Name and unit of the parameters.
_PARAMETERS = {
    "yarkovsky": ("A2", 1e-10),
    "yarkovski": ("A2", 1e-10),
    "srp": ("AMRAT", ORBFIT_AREA),
    "A1": ("A1", 1.0),
    "A2": ("A2", 1.0),
    "A3": ("A3", 1.0),
    "DT": ("DT", 1.0),
}
#: Models in which A1, A2, A3 follow the water-ice law of comets.
_COMET_MODELS = ("marsden", "yc")


def _is_mpc_orbit(text: str) -> bool:
    return text.lstrip()[:1] in "{[" and '"coefficient_names"' in text and '"epoch_data"' in text


@reader(
    "MPC orbit (JSON)",
    _is_mpc_orbit,
    Contents("cometary, cartesian", "full matrix", "A2, AMRAT; A1, A2, A3, DT of comets", "H"),
)
def read_mpc_orbit(text: str, file: str) -> list[Entry]:
    """Orbits of a document, or of an API answer that contains documents (``mpc_orb``, ``orb``).

    Raises
    ------
    InvalidInput
    """
    found = list(_documents(parse_json(text, "orbit file", file)))
    if not found:
        raise InvalidInput("orbit file", file, "an MPC_ORB document with CAR or COM, and epoch_data")
    return [_entry(document, file) for document in found]


def _documents(value: object) -> list[Document]:
    if isinstance(value, dict):
        if "epoch_data" in value and ("CAR" in value or "COM" in value):
            return [value]
        return [d for v in value.values() for d in _documents(v)]
    return [d for v in value for d in _documents(v)] if isinstance(value, list) else []


def _entry(document: Document, file: str) -> Entry:
    try:
        epoch, system = document["epoch_data"], document.get("system_data", {})
        scale, form = str(epoch["timesystem"]), str(epoch["timeform"])
        day = number(epoch["epoch"], "epoch", file)
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidInput("orbit file", file, f"an MPC_ORB document ({error})") from None
    if scale not in ("TDT", "TT", "TDB") or form not in ("MJD", "JD"):
        raise InvalidInput("epoch", f"{form} {scale}", f"MJD or JD in TT or TDB in {file}")
    planes = {str(system[k]) for k in ("refsys", "refplane") if system.get(k)}
    if planes - {"Ecliptic", "ecliptic"}:
        raise InvalidInput("reference plane", ", ".join(sorted(planes)), f"Ecliptic in {file}")
    jd = day + (MJD if form == "MJD" else 0.0)
    # Both sets describe the same orbit; errors of cometary elements stay closer to a normal distribution.
    kind = "COM" if document.get("COM") else "CAR"
    law = _law(document, file)
    names, values, matrix = _solution(document[kind], _COM if kind == "COM" else _CAR, law, file)
    source = f"MPC orbit ({file})"
    row = _identity(document) | {"orbit_source": source}
    if kind == "COM":
        values[names.index("tp")] += MJD - jd
    row |= elements_row(jd, names[:6], (), values[:6])
    row |= nongravitational_columns(
        dict(zip(names[6:], values[6:], strict=True)), law == "comet", file, law=law or "asteroid"
    )
    magnitude = document.get("magnitude_data") or {}
    if magnitude.get("H") is not None:
        row["H_mag"] = str(magnitude["H"])
    if matrix is None:
        return row, None
    return row, covariance_of(jd, names, values, matrix, source, file)


def _identity(document: Document) -> dict[str, str]:
    data = document.get("designation_data") or {}
    permanent = str(data.get("permid") or "").strip("() ")
    provisional = str(data.get("unpacked_primary_provisional_designation") or "").strip()
    packed = str(data.get("packed_primary_provisional_designation") or "").strip()
    label = (
        f"{permanent} ({provisional})" if permanent and provisional else permanent or provisional or packed
    )
    row = name_columns(label or "unnamed")
    row["name"] = str(data.get("iau_name") or "").strip() or row["name"]
    return row


def _law(document: Document, file: str) -> str:
    """Law of A1, A2, A3 in the model of the solution; empty if it has no such model.

    Raises
    ------
    InvalidInput
        The model is unknown, or the document does not contain its parameters.
    """
    booleans = document.get("non_grav_booleans") or {}
    used = [k for k, v in (booleans.get("non_grav_model") or {}).items() if v is True]
    names = {
        str(n) for c in ("COM", "CAR") if document.get(c) for n in document[c].get("coefficient_names", ())
    }
    known = {*_COMET_MODELS, *_PARAMETERS}
    check_parameters("MPC", [k for k in used if k not in known], file)
    if (used or booleans.get("non_gravs") is True) and not names & set(_PARAMETERS):
        raise InvalidInput(
            "non-gravitational parameters", ", ".join(used) or "non_gravs", f"their values in {file}"
        )
    return "comet" if set(used) & set(_COMET_MODELS) else ""


def _solution(
    part: Document, known: Mapping[str, str], law: str, file: str
) -> tuple[list[str], list[float], Array | None]:
    """Names, values and covariance of a part of the document; A1, A2, A3 in au/d2, DT in d, AMRAT in m2/kg.

    Raises
    ------
    InvalidInput
        Parameters other than the elements are not modelled.
    """
    try:
        theirs = [str(n) for n in part["coefficient_names"]]
        given = [number(v, n, file) for n, v in zip(theirs, part["coefficient_values"], strict=True)]
        cells = part.get("covariance") or {}
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInput(
            "orbit file", file, f"coefficient_names and coefficient_values ({error})"
        ) from None
    if sorted(theirs[:6]) != sorted(known):
        raise InvalidInput("coefficient_names", theirs[:6], f"{', '.join(known)} in {file}")
    check_parameters("MPC", theirs[6:], file)
    marsden = [n for n in theirs[6:] if n in ("A1", "A2", "A3", "DT")]
    if marsden and law != "comet":
        check_parameters("MPC", [f"{', '.join(marsden)} without a law"], file)
    extra, units = [_PARAMETERS[n][0] for n in theirs[6:]], [_PARAMETERS[n][1] for n in theirs[6:]]
    names = [known[n] for n in theirs[:6]] + extra
    values = given[:6] + [v * unit for v, unit in zip(given[6:], units, strict=True)]
    if not any(v is not None for v in cells.values()):
        return names, values, None
    n = len(names)
    matrix = np.zeros((n, n))
    for i in range(n):
        for j in range(i, n):
            matrix[i, j] = matrix[j, i] = number(cells.get(f"cov{i}{j}"), f"cov{i}{j}", file)
    scale = np.array([1.0] * 6 + units)
    return names, values, matrix * np.outer(scale, scale)
