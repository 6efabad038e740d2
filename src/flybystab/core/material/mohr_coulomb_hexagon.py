"""Associative flow on the Mohr-Coulomb hexagon, where the stress lies on a face or at a corner."""

from __future__ import annotations

from flybystab.core.material.flow_rule import dilatancy, dilation, flow_stress, isotropic
from flybystab.core.material.parameters import (
    COMPRESSION_CORNER,
    EXTENSION_CORNER,
    FACE,
    MaterialParameters,
    on_part,
)
from flybystab.core.material.yield_surface import corner, is_hexagon, onto_face
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import deviator, pack
from flybystab.typing import Array

#: Lode angle, rad, by which ``D`` may lie outside the fan of a corner, and fraction of a face that counts as its end.
#: Switches are located to about this accuracy; other errors are much larger.
SLACK = 1e-9


@kernel
def on_hexagon(material: MaterialParameters) -> bool:
    """True for associative flow on a hexagon, whose stress lies on a face or at a corner."""
    return material.normal and is_hexagon(material.surface)


@kernel
def part_of_flow(
    beyond: float, place: float, angle_tolerance: float, material: MaterialParameters
) -> MaterialParameters:
    """The material with the stress on the part of the hexagon (face or corner) where the flow rule puts it.

    Parameters
    ----------
    beyond : float
        Lode angle of ``D`` beyond the normal of the face, rad.
    place : float
        Position on the face, from 0 (extension corner) to 1, of the stress that keeps ``D`` normal to it.
    angle_tolerance : float
        Lode angle, rad, within which ``D`` counts as normal to the face.
    """
    if abs(beyond) <= angle_tolerance:
        # A stress within SLACK of the end of the face counts as at the corner: after a switch from the face to the
        # corner, the face would otherwise be chosen again and end after a step of zero length.
        if SLACK <= place <= 1.0 - SLACK:
            return on_part(material, FACE, material.fan_limit)
        compression = place > 0.5
    else:
        compression = beyond > 0.0
    # The stress stays at a corner while D is outside its fan by at most the present angle plus SLACK.
    fan_limit = SLACK + max(0.0, -beyond if compression else beyond)
    return on_part(material, COMPRESSION_CORNER if compression else EXTENSION_CORNER, fan_limit)


@kernel
def restore_flow_rule(
    d: Array,
    volume: float,
    beyond: float,
    material: MaterialParameters,
    slack: float,
    unit: Array,
    n: Array,
) -> bool:
    """Remove the deviation from the flow rule that integration errors leave in a rate of strain ``d[6]``.

    ``tr D`` is reset where its error exceeds `slack`, and on a face ``D'`` is rotated onto the normal: the equations of
    motion keep both errors constant, so that relative to ``|D'|`` they would grow towards rest. Returns True if `d` was
    changed; ``unit[6]`` and ``n[3, 3]`` are scratch.
    """
    turned = material.part == FACE and abs(beyond) > SLACK
    if turned:
        _, size, det = deviator(d, unit)
        a, b, det = onto_face(material.sin_phi, det)
        isotropic(a, b, unit, n)
        pack(n, unit)
        _, _, support, _, _ = corner(material.sin_phi, det, False)
    else:
        size, _, support, _ = flow_stress(d, material, unit, n)
    beta, _ = dilatancy(volume, material)
    trace = dilation(beta, size, support, material)
    if not turned and abs(d[0] + d[1] + d[2] - trace) <= slack:
        return False
    for i in range(6):
        d[i] = size * unit[i] + (trace / 3.0 if i < 3 else 0.0)
    return True
