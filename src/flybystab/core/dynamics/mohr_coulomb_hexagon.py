"""Where on the hexagon of Mohr-Coulomb the stress of an associative flow is: on a face, or at a corner."""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import FLOWING, PAST, PLACE, W_N
from flybystab.core.dynamics.workspace import Workspace
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.flow_rule import dilatancy, dilation, flow_stress, isotropic
from flybystab.core.material.parameters import (
    BESIDE,
    COMPRESSION_CORNER,
    EXTENSION_CORNER,
    FACE,
    NORMAL,
    PART,
    SIN_PHI,
    SMOOTH,
    SURFACE,
)
from flybystab.core.material.yield_surface import corner, is_hexagon, onto_face
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import determinant, deviator, pack
from flybystab.typing import Array

#: Lode angle, rad, by which `D` may be past the fan of a corner, and share of a face that counts as its end: the switch
#: is located no better, and it is far below any other error.
SLACK = 1e-9


@kernel
def choose_part(t: float, y: Array, par: Array, tide: TidePanels, near: float, ws: Workspace) -> None:
    """Find the part of the yield section for a flow: a face if `D` is normal to one and can stay so, or a corner.

    `D` within the Lode angle `near` of the normal of the face counts as normal to it. A corner then keeps the
    stress while `D` is in its fan, or no further out of it than now and `SLACK`.
    """
    par[PART] = SMOOTH
    if par[NORMAL] == 0.0 or not is_hexagon(int(par[SURFACE])):
        return
    par[PART] = FACE
    rate(FLOWING, t, y, ws.spare[:15], par, tide, ws.work)
    place, past = ws.work.s[PLACE], ws.work.s[PAST]
    if abs(past) <= near:
        # A stress at the very end of the face belongs to the corner: it may have just come there along the face, and
        # chosen again the face would end in a step of no length.
        if SLACK <= place <= 1.0 - SLACK:
            return
        compression = place > 0.5
    else:
        compression = past > 0.0
    par[PART] = COMPRESSION_CORNER if compression else EXTENSION_CORNER
    par[BESIDE] = SLACK + max(0.0, -past if compression else past)


@kernel
def settle(y: Array, par: Array, slack: float, ws: Workspace) -> bool:
    """Undo what the errors of the steps have left of ``D`` against the flow rule; whether there was anything.

    ``tr D`` becomes that of the rule where it is off by more than `slack`, and on a face ``D`` becomes normal to it.
    Both are kept by the motion as they are, and ``|D'|`` falls to nothing.
    """
    unit, n = ws.stress, ws.work.m[W_N]
    turned = int(par[PART]) == FACE and abs(ws.work.s[PAST]) > SLACK
    if turned:
        _, size, det = deviator(y[6:12], unit)
        a, b, det = onto_face(par[SIN_PHI], det)
        isotropic(a, b, unit, n)
        pack(n, unit)
        _, _, support, _, _ = corner(par[SIN_PHI], det, False)
    else:
        size, _, support, _ = flow_stress(y[6:12], par, unit, n)
    beta, _ = dilatancy(np.sqrt(determinant(y[0:6])), par)
    trace = dilation(beta, size, support, par)
    if not turned and abs(y[6] + y[7] + y[8] - trace) <= slack:
        return False
    for i in range(6):
        y[6 + i] = size * unit[i] + (trace / 3.0 if i < 3 else 0.0)
    return True
