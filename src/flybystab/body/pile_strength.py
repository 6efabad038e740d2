"""Strength of a pile of grains: friction angle from a spin-up, cohesion from loads in tension and shear.

Stresses are those of rigid rotation, averaged over the volume of the ellipsoid with the inertia of the pile, as in the
continuum model (:func:`flybystab.core.ellipsoid.rigid_stress.rigid_stress`).
"""

from __future__ import annotations

import numpy as np

from flybystab.core.ellipsoid.rigid_stress import demand, rigid_load, rigid_stress
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.grains.clumps import moments, semi_axes, spin_of
from flybystab.core.grains.simulation import Simulation
from flybystab.core.material.surfaces import code_of
from flybystab.typing import Array

#: Increment of ``omega^2/(pi G rho)`` in a spin-up, and its duration (scaled).
INCREMENT, REST = 0.03, 4.0
#: First ``omega^2/(pi G rho)``: a sphere then mobilises 5 deg.
FIRST = 0.24
#: Relative change of c/a at which a pile counts as flowing, which ends a spin-up.
FLATTENED = 0.2
#: Strain at which a pile in tension or shear counts as failed.
FAILED = 0.02
#: Duration of a loading, in units of ``R sqrt(rho/Y)``, and the largest load, in units of the expected cohesion.
_LOADING, _LARGEST = 120.0, 4.0


def mobilised(sim: Simulation, surface: str = "mohr-coulomb") -> tuple[float, float, Array]:
    """Friction angle (deg) required for rigid rotation of the ellipsoid with the inertia and spin of a pile.

    Also ``omega^2/(pi G rho)`` and the semi-axes, scaled units. A pile in flow need not be in equilibrium.
    """
    mass, _, _, inertia, momentum = moments(sim.grains, sim.grains.mass > 0.0)
    axes, vectors = semi_axes(mass, inertia)
    spin = vectors.T @ spin_of(inertia, momentum)
    rho = 3.0 / (4.0 * np.pi * np.prod(axes))
    stress = np.empty(6)
    s = axes**2
    rigid_stress(s[0], s[1], s[2], float(rho), float(np.pi * rho), spin, np.zeros(6), stress)
    angle, _ = demand(code_of(surface), 0.0, 0.0, stress)
    return float(np.rad2deg(angle)), float(spin @ spin / (np.pi * rho)), axes


def spin_up(sim: Simulation, first: float = FIRST, sense: int = 1, surface: str = "mohr-coulomb") -> Array:
    """Spin a pile up about its short axis (z) until it flows.

    Parameters
    ----------
    sim : Simulation
        Changed.
    first : float
        First ``omega^2/(pi G rho)``.
    sense : int
        1 or -1.
    surface : str
        Yield surface that gives the angle; for a sphere, which is compressed along its spin, all agree except
        the cone through triaxial extension.

    Returns
    -------
    ndarray (m, 3)
        ``omega^2/(pi G rho)``, mobilised friction angle (deg), c/a.
    """
    course = []
    begun = None
    for w2 in np.arange(first, 4.0, INCREMENT):
        mass, _, _, inertia, momentum = moments(sim.grains, sim.grains.mass > 0.0)
        axes, _ = semi_axes(mass, inertia)
        begun = axes[2] / axes[0] if begun is None else begun
        rate = np.sqrt(w2 * np.pi * 3.0 / (4.0 * np.pi * np.prod(axes)))
        sim.add_spin(np.array([0.0, 0.0, sense * rate]) - spin_of(inertia, momentum))
        sim.advance(REST)
        angle, reached, axes = mobilised(sim, surface)
        course.append((reached, angle, axes[2] / axes[0]))
        if axes[2] / axes[0] < (1.0 - FLATTENED) * begun:
            break
    return np.array(course)


def loaded(sim: Simulation, load: Array, expected: float, slow: float = 1.0) -> tuple[Array, Array]:
    """Load a pile without gravity by an increasing tide until it fails.

    Parameters
    ----------
    sim : Simulation
        Changed; cohesive.
    load : ndarray (3,)
        Diagonal of the tide, up to its strength: ``(1, 0, 0)`` pulls, ``(1, -1, 0)`` shears.
    expected : float
        Expected bulk cohesion, scaled: sets the rate.
    slow : float
        Duration of the loading over the default.

    Returns
    -------
    stress, axes : ndarray (6,), ndarray (3,)
        Mean stress at failure along the axes of the load, positive in tension, and the semi-axes there.
    """
    members = sim.grains.mass > 0.0
    mass, _, _, inertia, _ = moments(sim.grains, members)
    a2 = 2.5 / mass * (np.trace(inertia) - 2.0 * np.diag(inertia))  # along x, y, z
    start = np.sqrt(a2)
    rho = 3.0 * mass / (4.0 * np.pi * np.prod(start))
    duration = slow * _LOADING * np.cbrt(np.prod(start)) * np.sqrt(rho / expected)
    most = _LARGEST * 5.0 * expected / (rho * a2.max())
    coefficients = np.zeros((1, 2, 6))
    coefficients[0, :, :3] = 0.5 * most * np.asarray(load)  # from zero to `most`, linear in time
    # asinh(t/tau) is t/tau to rounding
    tau = 1e6 * duration
    sim.tide = TidePanels(tau, 0.0, duration / tau, coefficients)
    sim.time = 0.0
    stress, axes = np.zeros(6), start
    while sim.time < duration:
        sim.advance(duration / 400.0, gravity=False)
        _, _, _, inertia, _ = moments(sim.grains, members)
        a2 = 2.5 / mass * (np.trace(inertia) - 2.0 * np.diag(inertia))
        axes = np.sqrt(a2)
        tide = np.zeros(6)
        tide[:3] = most * np.asarray(load) * sim.time / duration
        rigid_load(tide, np.zeros(3), (a2[0], a2[1], a2[2]), (0.0, 0.0, 0.0), stress)
        stress *= 3.0 * mass / (4.0 * np.pi * np.prod(axes)) / 5.0
        if np.abs(axes / start - 1.0).max() > FAILED:
            break
    return stress, axes


def required_cohesion(stress: Array, angle: float) -> float:
    """Cohesion required by Mohr-Coulomb for a stress at a friction angle (rad), in the unit of the stress."""
    return float(demand(code_of("mohr-coulomb"), angle, 0.0, stress)[1])
