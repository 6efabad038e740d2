"""The slide of a body that a passing tide drives beyond its friction, along one direction of strain.

Newmark's sliding block (1965), made for dams under earthquakes: the body stays what it was, and a rate of strain ``e``
along a fixed direction ``D`` follows

    M edot = P1(t) while e > 0, or P1 > 0;    M = tr(L I L^T),    P1 = -V (sigma* - sigma(t)):D

with the stress ``sigma(t)`` that rigidity would need at that instant and the flow stress ``sigma*`` (theory,
section 5). The tide and the changed spin do the work ``int e V (sigma(t) - sigma_0):D dt`` on it, ``sigma_0`` being
the stress of the free body: that energy is what a barrier, friction and gained potential, has to be held against.
Units as in :mod:`flybystab.core.energy.potential`.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.ellipsoid.rigid_stress import overload, rigid_stress
from flybystab.core.energy.perturbation import LONGEST, direction
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

#: Steps between two instants.
STEPS = 24


@kernel
def driving_stress(
    s: Array,
    spin: Array,
    tide: Array,
    code: int,
    phi: float,
    cohesion: float,
    deviator: Array,
    pressure: Array,
    excess: Array,
) -> None:
    """Write the stress of rigidity at ``spin[n, 3]``, ``tide[n, 6]``: ``deviator[n, 5]``, pressure, overload."""
    stress = np.empty(6)
    for i in range(spin.shape[0]):
        rigid_stress(s[0], s[1], s[2], 1.0, 1.0, spin[i], tide[i], stress)
        direction(stress, deviator[i])
        pressure[i] = -(stress[0] + stress[1] + stress[2]) / 3.0
        excess[i] = overload(code, phi, cohesion, stress)


@kernel
def slide(time: Array, power: Array, drive: Array, mass: float) -> tuple[float, float, float, float]:
    """Energy given, largest kinetic energy, strain and duration of the slide.

    ``power[n]`` is ``P1`` and ``drive[n]`` the work rate of tide and spin at unit rate of strain, at ``time[n]``;
    both are linear in between. Ends where the strain passes `LONGEST`: the body has long left its shape by then.
    """
    rate = 0.0
    strain = 0.0
    work = 0.0
    given = 0.0
    kinetic = 0.0
    moving = 0.0
    for i in range(time.size - 1):
        if rate == 0.0 and power[i] <= 0.0 and power[i + 1] <= 0.0:
            continue
        h = (time[i + 1] - time[i]) / STEPS
        for j in range(STEPS):
            x = (j + 0.5) / STEPS
            p = power[i] + x * (power[i + 1] - power[i])
            new = max(0.0, rate + h * p / mass)
            mean = 0.5 * (rate + new)
            if mean > 0.0:
                strain += mean * h
                work += mean * h * (drive[i] + x * (drive[i + 1] - drive[i]))
                moving += h
            rate = new
            given = max(given, work)
            kinetic = max(kinetic, 0.5 * mass * rate * rate)
            if strain > LONGEST:
                return given, kinetic, strain, moving
    return given, kinetic, strain, moving
