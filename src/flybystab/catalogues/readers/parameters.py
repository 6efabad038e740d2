"""Parameters of orbit solutions other than the six elements, and which of them are modelled, by publisher.

Every reader passes the further parameters of its file to :func:`check_parameters`. A parameter that is not modelled
raises an error that names it: without it the orbit would not be that of its publisher.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from flybystab.errors import InvalidInput

#: Parameters that are read, by publisher.
MODELLED: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        # https://ssd-api.jpl.nasa.gov/doc/sbdb.html (model_pars)
        "JPL": frozenset({"A1", "A2", "A3", "DT", "AMRAT", "ALN", "NK", "NM", "NN", "R0"}),
        # Parameters 1 and 2 of model 1 in the LSP and NGR lines of OrbFit: area-to-mass ratio and Yarkovsky A2.
        "OrbFit": frozenset({"A2", "AMRAT"}),
        # non_grav_coefficients and non_grav_units of https://github.com/Smithsonian/mpc-public/tree/main/mpc_orb.
        "MPC": frozenset({"yarkovsky", "yarkovski", "srp", "A1", "A2", "A3", "DT"}),
        # Its web service gives neither the law nor the unit of its parameters.
        "MPC service": frozenset(),
        # A2 alone is its Yarkovsky model, AMR its radiation pressure; A1, A2, A3, T0 (the delay) are its comet model.
        # A1, A2 and A1, A2, A3 belong to one of two laws, which the file does not name.
        "find_orb": frozenset({"A1", "A2", "A3", "T0", "AMR"}),
        # Non-gravitational terms of layup have constants g(r) of their own (https://github.com/Smithsonian/layup).
        "FORMAT": frozenset(),
        # Element tables of MPC and JPL have no columns for parameters.
        "table": frozenset(),
    }
)

_WITHOUT = "a solution without this parameter"
#: Parameters that are known but not modelled, and what to do instead.
NOT_MODELLED: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "JPL": {
            "RHO": "an orbit with A2 in place of the thermal model (bulk density)",
            "S0": "a solution without S0",
        },
        "OrbFit": {},
        "MPC": {
            "yabushita": "JPL's orbit (SBDB), which lists the constants of its law",
            "A1, A2, A3 without a law": "JPL's orbit (SBDB), which names the law",
        },
        "MPC service": dict.fromkeys(("A1", "A2", "A3", "DT"), "JPL's orbit (SBDB), which names the law"),
        "find_orb": dict.fromkeys(
            ("A1, A2 without a law", "A1, A2, A3 without a law"),
            'fs.Orbit.from_elements(..., A1, A2, A3, law="comet") or law="asteroid", by the model of the fit',
        ),
        "FORMAT": dict.fromkeys(("A1", "A2", "A3"), "fs.Orbit.from_elements or from_state with A1, A2, A3"),
        "table": {},
    }
)

#: Names by which agencies write parameters of a force model: capitals and digits, as A4, DT, AMRAT, RHO.
_PARAMETER = re.compile(r"[A-Z][A-Z0-9]{1,7}$")


def looks_like_parameter(name: str) -> bool:
    """Whether the name of a column or key has the form of a parameter of a force model, such as A4, DT, AMRAT."""
    return bool(_PARAMETER.match(name))


def named_parameters(text: str) -> list[str]:
    """Names of the parameters to which a text assigns a value, as in ``A2 = -1e-14``."""
    return re.findall(r"\b([A-Z][A-Z0-9]{1,7}) *= *[-+.\d]", text)


def check_parameters(agency: str, names: Iterable[str], file: str) -> None:
    """Raise InvalidInput for parameters that the force model does not have.

    Raises
    ------
    InvalidInput
        The message names each of them and an alternative.
    """
    lacking = [n for n in names if n not in MODELLED[agency]]
    if lacking:
        advice = {NOT_MODELLED[agency].get(n, _WITHOUT) for n in lacking}
        raise InvalidInput(
            "non-gravitational parameters",
            ", ".join(lacking),
            f"parameters that are modelled ({', '.join(sorted(MODELLED[agency])) or 'none'}) in {file}; "
            f"use {'; '.join(sorted(advice))}",
        )
