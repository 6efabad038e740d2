"""Orbits of Find_Orb: ``total.json``, ``elements.json`` (elements with sigmas), ``covar.json`` (state, covariance).

Keys: ``elements_in_json_format`` and ``covar.json`` in https://github.com/Bill-Gray/find_orb (``elem_out.cpp``
and ``orb_func.cpp``).
Epochs are Julian dates (TT); a state is heliocentric with axes of the J2000 ecliptic, in au and au/d. Non-gravitational
models are described in ``nongravs.txt``. The comet model has the constants of water ice, unless the user has changed
them in ``environ.dat``; the files do not list them.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import CARTESIAN, elements_row, number
from flybystab.catalogues.readers.covariances import covariance_of, sigmas_of
from flybystab.catalogues.readers.nongravitational import nongravitational_columns
from flybystab.catalogues.readers.parameters import check_parameters, looks_like_parameter
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.typing import Document

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry

_ELEMENTS = {"a": "a", "e": "e", "i": "i", "asc_node": "node", "arg_per": "peri", "M": "M"}
_COMETARY = {"q": "q", "e": "e", "i": "i", "asc_node": "node", "arg_per": "peri", "Tp": "tp"}
#: Sets of parameters that occur in a single model (``FORCE_MODEL_...`` of ``mpc_obs.h``), and its law: Yarkovsky A2
#: (au/d2), area-to-mass ratio (m2/kg), and the comet model with a delay (d), which ``elem_out.cpp`` writes as T0.
#: A1, A2 and A1, A2, A3 occur both with the law of comets and with 1/r2.
_MODELS: Mapping[frozenset[str], str] = {
    frozenset({"A2"}): "asteroid",
    frozenset({"AMR"}): "asteroid",
    frozenset({"A1", "A2", "A3", "T0"}): "comet",
}
#: Names of these parameters here.
_PARAMETERS = {"A1": "A1", "A2": "A2", "A3": "A3", "T0": "DT", "AMR": "AMRAT"}
#: Keys in capitals that are not parameters of the force model.
_OTHER = frozenset({"H", "G", "U", "P", "Q", "M", "MOIDs", "Tp", "Tp_iso", "p_NEO", "p_HZ"})


def _is_elements(text: str) -> bool:
    return text.lstrip().startswith("{") and '"objects"' in text and '"central body"' in text


def _is_covariance(text: str) -> bool:
    return text.lstrip().startswith("{") and '"covar"' in text and '"state_vect"' in text


@reader(
    "Find_Orb elements",
    _is_elements,
    Contents(
        "a and M, or q and Tp",
        "1-sigmas",
        "A2 or AMRAT; A1, A2, A3 with DT",
        "H",
        files="`total.json`, `elements.json`",
    ),
)
def read_elements(text: str, file: str) -> list[Entry]:
    """Orbits of ``total.json`` or ``elements.json``.

    Raises
    ------
    InvalidInput
        The elements refer to another centre or frame, or there are parameters that are not modelled.
    """
    document = parse_json(text, "orbit file", file)
    try:
        objects = document["objects"]
        found = list(objects.items()) if isinstance(objects, Mapping) else [(o["object"], o) for o in objects]
        return [_entry(str(name), thing["elements"], file) for name, thing in found]
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidInput("orbit file", file, f"objects with elements ({error})") from None


def _entry(name: str, elements: Document, file: str) -> Entry:
    if elements.get("central body") != "Sun" or not str(elements.get("frame", "")).startswith("J2000 ecl"):
        given = f"{elements.get('central body')}, {elements.get('frame')}"
        raise InvalidInput("central body, frame", given, f"Sun, J2000 ecliptic in {file}")
    parameters = sorted(k for k in elements if _is_parameter(k))
    law = _MODELS.get(frozenset(parameters), "")
    if parameters and not law:
        check_parameters("find_orb", [k for k in parameters if k not in _PARAMETERS], file)
        check_parameters("find_orb", [f"{', '.join(parameters)} without a law"], file)
    jd = number(elements["epoch"], "epoch", file)
    names = _ELEMENTS if all(k in elements for k in _ELEMENTS) else _COMETARY
    values = [number(elements[k], k, file) for k in names]
    source = f"Find_Orb ({file})"
    row = name_columns(name) | {"orbit_source": source}
    labels = list(names.values())
    if names is _COMETARY:
        values[5] -= jd
    row |= elements_row(jd, labels, [str(elements[k]) for k in names], values)
    if elements.get("H") is not None:
        row["H_mag"] = str(elements["H"])
    keys = list(names)
    pushes = {mine: elements[k] for k, mine in _PARAMETERS.items() if k in elements}
    row |= nongravitational_columns(pushes, law == "comet", file, law=law)
    sigmas = [elements.get(f"{k} sigma") for k in keys]
    if any(s is None for s in sigmas):
        return row, None
    found = sigmas_of(sigmas, keys, file)
    if found is None:
        return row, None
    sigma = found.tolist()
    for k, mine in _PARAMETERS.items():
        if k in elements and elements.get(f"sigma_{k}") is not None:
            sigmas_of([elements[f"sigma_{k}"]], [k], file)
            labels, values = [*labels, mine], [*values, number(elements[k], k, file)]
            sigma.append(number(elements[f"sigma_{k}"], f"sigma_{k}", file))
    matrix = np.diag(np.square(sigma))
    return row, covariance_of(
        jd, labels, values, matrix, f"1-sigmas without correlations, {source}", file, correlated=False
    )


def _is_parameter(key: str) -> bool:
    if key in ("dx", "dy", "dz", "T0"):  # an impulsive change of velocity
        return True
    return looks_like_parameter(key) and key not in _OTHER


@reader(
    "Find_Orb covariance",
    _is_covariance,
    Contents("cartesian", "full matrix", "none", "none", files="`covar.json`"),
)
def read_covariance(text: str, file: str) -> list[Entry]:
    """The orbit in ``covar.json``, named after the file since it contains no name.

    Raises
    ------
    InvalidInput
        The covariance has more than six parameters, since the file does not name the additional ones.
    """
    document = parse_json(text, "orbit file", file)
    try:
        jd = number(document["epoch"], "epoch", file)
        values = [number(v, "state_vect", file) for v in document["state_vect"]]
        matrix = np.array([[number(v, "covar", file) for v in line] for line in document["covar"]])
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInput("orbit file", file, f"covar, state_vect and epoch ({error})") from None
    if len(values) > 6 or len(matrix) > 6:
        extra = [f"parameter {k + 1} of covar" for k in range(6, max(len(values), len(matrix)))]
        check_parameters("find_orb", extra, file)
    if len(values) != 6:
        raise InvalidInput("state_vect", len(values), f"6 numbers in {file}")
    source = f"Find_Orb ({file})"
    row = name_columns(Path(file).name.partition(".")[0]) | {"orbit_source": source}
    row |= elements_row(jd, CARTESIAN, (), values)
    return [(row, covariance_of(jd, CARTESIAN, values, matrix, source, file))]
