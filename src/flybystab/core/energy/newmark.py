"""Deformation of a body by a tide that exceeds its friction for some time, along one direction of strain.

Newmark's sliding block (1965), developed for dams in earthquakes, is applied to the path of one direction of strain
``D``. The strain ``e`` obeys

    (1/2 M edot^2)' = edot [F(t, e) - y(e)]    while edot > 0 or F > y,    M = tr(L S L^T) m/5

with the loss ``y`` of the free body along its path (:mod:`flybystab.core.energy.perturbation`: potential at fixed
angular momentum and power of the stress with its reaction pressure) and the force ``F`` of tide and torque,

    F = (m/5) K_t:(L S) - [y(e; H(t), K_t) - y(e; H_0, 0)].

Shape, pressure and potential are those of the deformed body; attitude and angular momentum ``H(t)`` are those of the
rigid motion, and the direction of strain is constant. The work ``int F de`` is the energy to be compared with a
barrier. Units as in :mod:`flybystab.core.energy.potential`.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.ellipsoid.rigid_stress import overload, rigid_stress
from flybystab.core.energy.flow_work import growth_at, power, volume_at
from flybystab.core.energy.perturbation import (
    LARGER_AXIS_RATIO2,
    LARGEST_AXIS_RATIO,
    LONGEST,
    NO_TIDE,
    Ellipsoid,
    Path,
    direction,
    mobility,
    path_along,
)
from flybystab.core.energy.potential import MASS, energy_along
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import unpack
from flybystab.typing import Array

#: Steps between two instants.
STEPS = 6


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
    """Write the stress of rigid rotation at ``spin[n, 3]``, ``tide[n, 6]``: ``deviator[n, 5]``, pressure, overload."""
    stress = np.empty(6)
    for i in range(spin.shape[0]):
        rigid_stress(s[0], s[1], s[2], 1.0, 1.0, spin[i], tide[i], stress)
        direction(stress, deviator[i])
        pressure[i] = -(stress[0] + stress[1] + stress[2]) / 3.0
        excess[i] = overload(code, phi, cohesion, stress)


@kernel
def tidal_power(gradient: Array, growth: float, shape: Array, tide: Array) -> float:
    """``(M/5) K:(L S)`` per unit rate of strain: the power of a tidal tensor ``tide[6]`` on a deformation.

    ``gradient[3, 3]`` is the traceless part of ``L``, `growth` the trace of ``L``; ``shape[6]`` is ``S``.
    """
    s = np.empty((3, 3))
    k = np.empty((3, 3))
    unpack(shape, s)
    unpack(tide, k)
    total = 0.0
    for i in range(3):
        for j in range(3):
            flow = growth / 3.0 * s[i, j]
            for n in range(3):
                flow += gradient[i, n] * s[n, j]
            total += k[i, j] * flow
    return MASS / 5.0 * total


@kernel
def forces_at(
    b: Ellipsoid, path: Path, strain: float, momentum: Array, tide: Array
) -> tuple[float, float, float, float]:
    """Rate of loss of the free body, force of tide and torque, mobility and squared axis ratio at a strain."""
    flow = path.flow
    volume = volume_at(flow.trace, strain)
    growth = growth_at(flow.trace, volume)
    _, slope, _ = energy_along(path.rates, path.frame, b.momentum, strain, volume, growth, path.axes)
    free = slope + power(flow, volume, path.gradient, path.axes, NO_TIDE)[0]
    _, slope, ratio2 = energy_along(path.rates, path.frame, momentum, strain, volume, growth, path.axes)
    now = slope + power(flow, volume, path.gradient, path.axes, tide)[0]
    drive = free - now + tidal_power(path.gradient, growth, path.axes.shape, tide)
    return free, drive, mobility(path, strain, volume, growth), ratio2


@kernel
def slide(
    b: Ellipsoid, x: Array, time: Array, momentum: Array, tide: Array
) -> tuple[float, float, float, float]:
    """Work of ``F``, largest kinetic energy, strain and duration of the deformation along the path of ``x[5]``.

    ``momentum[n, 3]`` and ``tide[n, 6]`` are those of the rigid motion at ``time[n]``, body axes, interpolated
    linearly. The deformation ends at the largest axis ratio of the homogeneous model, or at the strain `LONGEST`.
    """
    path = path_along(b, x)
    edge = max(LARGEST_AXIS_RATIO * LARGEST_AXIS_RATIO, LARGER_AXIS_RATIO2 * (np.max(b.s) / np.min(b.s)))
    h = np.empty(3)
    k = np.empty(6)
    rate = strain = work = given = kinetic = moving = 0.0
    for i in range(time.size - 1):
        if rate == 0.0:
            free, drive, m, _ = forces_at(b, path, strain, momentum[i], tide[i])
            ahead, more, _, _ = forces_at(b, path, strain, momentum[i + 1], tide[i + 1])
            if drive <= free and more <= ahead:
                continue
        dt = (time[i + 1] - time[i]) / STEPS
        for j in range(STEPS):
            y = (j + 0.5) / STEPS
            for n in range(3):
                h[n] = momentum[i, n] + y * (momentum[i + 1, n] - momentum[i, n])
            for n in range(6):
                k[n] = tide[i, n] + y * (tide[i + 1, n] - tide[i, n])
            middle = strain + 0.5 * rate * dt
            free, drive, m, ratio2 = forces_at(b, path, middle, h, k)
            if not free < np.inf:
                rate = 0.0
                continue
            new = max(0.0, rate + dt * (drive - free) / m)
            mean = 0.5 * (rate + new)
            if mean > 0.0:
                work += mean * dt * drive
                strain += mean * dt
                moving += dt
                volume = volume_at(path.flow.trace, strain)
                later = mobility(path, strain, volume, growth_at(path.flow.trace, volume))
                volume = volume_at(path.flow.trace, strain - mean * dt)
                m = mobility(path, strain - mean * dt, volume, growth_at(path.flow.trace, volume))
                new *= np.sqrt(m / later)
                kinetic = max(kinetic, 0.5 * later * new * new)
            rate = new
            given = max(given, work)
            if ratio2 > edge or strain > LONGEST:
                return given, kinetic, strain, moving
    return given, kinetic, strain, moving
