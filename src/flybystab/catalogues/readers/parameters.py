"""Estimated parameters of an orbit beside its elements: which are modelled, by publisher."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from flybystab.errors import InvalidInput

#: Parameters that are read, by publisher.
MODELLED: Mapping[str, frozenset[str]] = MappingProxyType(
    {"JPL": frozenset({"A1", "A2", "A3", "ALN", "NK", "NM", "NN", "R0"})}
)

#: Parameters that are known but not modelled, and what to do instead.
NOT_MODELLED: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "JPL": {
            "RHO": "an orbit with A2 in place of the thermal model (bulk density)",
            "AMRAT": "an orbit with A1 or A2 in place of the area-to-mass ratio",
            "DT": "a solution without the delay of the maximum of outgassing",
            "S0": "a solution without S0",
        }
    }
)


def check_parameters(agency: str, names: Iterable[str], file: str) -> None:
    """Refuse parameters that the force model does not have.

    Raises
    ------
    InvalidInput
        Names each of them, and what to use instead.
    """
    lacking = [n for n in names if n not in MODELLED[agency]]
    if lacking:
        advice = {NOT_MODELLED[agency].get(n, "a solution without this parameter") for n in lacking}
        raise InvalidInput(
            "non-gravitational parameters",
            ", ".join(lacking),
            f"parameters that are modelled ({', '.join(sorted(MODELLED[agency]))}) in {file}; "
            f"use {'; '.join(sorted(advice))}",
        )
