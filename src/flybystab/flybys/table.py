"""Results of many encounters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import counted


@dataclass(frozen=True, eq=False)
class FlybyTable(Tabular):
    """Results of many encounters as arrays; attributes as in :class:`FlybyResult`, first dimension n.

    A row that could not be computed has the verdict "FAILED", its reason in `failure` and nan elsewhere; `contact` is
    empty where nothing reaches the ground.
    """

    verdict: NDArray[np.str_]
    bound_fraction: Array
    semi_axes: Quantity
    spin: Quantity
    max_required_friction_angle: Quantity
    margin: Quantity
    spin_ratio: Array
    pole_change: Quantity
    contact: NDArray[np.str_]
    failure: NDArray[np.str_]

    _shown: ClassVar[tuple[str, ...]] = (
        "verdict",
        "margin",
        "max_required_friction_angle",
        "bound_fraction",
        "semi_axes",
        "spin",
        "spin_ratio",
        "pole_change",
        "failure",
    )

    def __len__(self) -> int:
        return len(self.verdict)

    def __repr__(self) -> str:
        return f"<FlybyTable {len(self)} rows: {counted(self.verdict)}>"
