"""Parameters of orbit solutions other than the six elements, by publisher, and which of them are modelled.

Every reader passes the additional parameters in its file to :func:`check_parameters`. A parameter that is not modelled
is an error that names it, since the orbit without it would differ from the published one.
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
        # Parameters 1 and 2 of model 1 (LSP and NGR lines of OrbFit): area-to-mass ratio and Yarkovsky A2.
        "OrbFit": frozenset({"A2", "AMRAT"}),
        # non_grav_coefficients and non_grav_units of https://github.com/Smithsonian/mpc-public/tree/main/mpc_orb.
        "MPC": frozenset({"yarkovsky", "yarkovski", "srp", "A1", "A2", "A3", "DT"}),
        # The web service gives neither the law nor the units of the parameters.
        "MPC service": frozenset(),
        # A2 alone: Yarkovsky model; AMR: radiation pressure; A1, A2, A3, T0 (the delay): comet model. A1, A2 and
        # A1, A2, A3 belong to one of two laws, and the file does not state which.
        "find_orb": frozenset({"A1", "A2", "A3", "T0", "AMR"}),
        # Non-gravitational terms of layup have other constants of g(r) (https://github.com/Smithsonian/layup).
        "FORMAT": frozenset(),
        # Element tables of MPC and JPL have no columns for parameters.
        "table": frozenset(),
    }
)

_WITHOUT = "a solution without this parameter"
#: Parameters that are known but not modelled, and the alternative.
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

#: Form of the names of force-model parameters: capitals and digits, such as A4, DT, AMRAT, RHO.
_PARAMETER = re.compile(r"[A-Z][A-Z0-9]{1,7}$")


def looks_like_parameter(name: str) -> bool:
    """Whether the name of a column or key has the form of a force-model parameter, such as A4, DT, AMRAT."""
    return bool(_PARAMETER.match(name))


def named_parameters(text: str) -> list[str]:
    """Names of the parameters that are given a value in a text, such as ``A2 = -1e-14``."""
    return re.findall(r"\b([A-Z][A-Z0-9]{1,7}) *= *[-+.\d]", text)


def check_parameters(agency: str, names: Iterable[str], file: str) -> None:
    """Raise InvalidInput for parameters that are not in the force model.

    Raises
    ------
    InvalidInput
        The message names each parameter and an alternative.
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
