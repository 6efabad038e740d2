"""Inputs of a flyby."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.body.body import Body
from flybystab.encounter.encounter import Encounter
from flybystab.errors import NotConverged
from flybystab.flybys.batch import FlybyRun, RowInputs, flyby_run
from flybystab.typing import Array


class FlybyInputs(NamedTuple):
    """Body, encounter and settings of a flyby, checked."""

    body: Body
    encounter: Encounter
    rotation: Array  #: at the start, body axes -> frame of the encounter, (3, 3)
    tolerance: float
    max_axis_ratio: float

    def run(self, *, keep: int = 0, required: bool = False, row: RowInputs | None = None) -> FlybyRun:
        """Follow the body.

        Parameters
        ----------
        keep : int
            Rows of history at most.
        required : bool
            Whether to follow a body that yields once more as a rigid one, for the friction angle that it requires.
        row : RowInputs, optional
            ``one_row(body, encounter, rotation)``, if it has been computed already.

        Raises
        ------
        NotConverged
        """
        found = flyby_run(
            self.body, self.encounter, self.rotation, self.tolerance, self.max_axis_ratio, keep, required, row
        )
        if found.failure:
            raise NotConverged(found.failure)
        return found


def modelled(body: Body) -> tuple[str, ...]:
    """Description of the body model."""
    m = body.material
    if m.dilatancy == 0.0:
        flow = "volume-preserving flow"
    elif m.dilatancy == 1.0:
        flow = "associative flow, its dilation fading out before V/V0 = 1.5"
    else:
        flow = f"dilatancy {m.dilatancy:g} of the largest, fading out before V/V0 = 1.5"
    brittle = " (brittle)" if m.brittle and m.c_pa > 0.0 else ""
    return (
        "homogeneous ellipsoid, self-gravity",
        f"{m.yield_surface}, friction {np.rad2deg(m.phi):g} deg, cohesion {m.c_pa:g} Pa{brittle}",
        flow,
    )
