"""Palermo and Torino scales of a possible impact.

Palermo (Chesley et al. 2002): ``log10(P / (f dt))``, the impact probability relative to that of background impacts
of at least the same energy until then, ``f = 0.03 E^-0.8`` per year with E in megatons of TNT.

Torino (Binzel 2000): integers from 0 to 10 by energy and probability. With ``e = log10(E/Mt)``, ``p = log10(P)``, the
diagram of that paper has the parallel lines ``(e - c)/3 + (p + 2)/2 = 0``, c = -1, 2 and 5. The value is 0 below
the first line and below 1 Mt. For P below 1 % the lines separate 1, 2 and 6. From 1 % to 99 % the value is 3 below
100 Mt and 7 above 100,000 Mt, and the last line separates 4 and 5. Above 99 % the values 8, 9 and 10 are separated at
100 and 100,000 Mt.
"""

from __future__ import annotations

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.constants import YEAR
from flybystab.errors import InvalidInput
from flybystab.units import to_si

#: Energy of a megaton of TNT, J.
MEGATON = 4.184e15


@check_arguments
def impact_energy(mass: Quantity, speed: Quantity) -> Quantity:
    """Kinetic energy at impact, in J.

    Parameters
    ----------
    mass : Quantity
    speed : Quantity
        Relative to the planet at its surface: ``sqrt(v_inf^2 + v_escape^2)``.
    """
    m, v = to_si(mass, u.kg, "mass", low=0.0), to_si(speed, u.m / u.s, "speed", low=0.0)
    return 0.5 * m * v * v * u.J


@check_arguments
def palermo_scale(probability: float, energy: Quantity, time: Quantity) -> float:
    """Palermo scale of one possible impact.

    Parameters
    ----------
    probability : float
        Impact probability; 0 gives minus infinity.
    energy : Quantity
        See :func:`impact_energy`.
    time : Quantity
        From now to the possible impact.

    Raises
    ------
    InvalidInput, UnitMismatch
    """
    p, megatons = _checked(probability, energy)
    years = to_si(time, u.s, "time", low=0.0, open_low=True) / YEAR
    if p == 0.0:
        return -np.inf
    return float(np.log10(p / (0.03 * megatons**-0.8 * years)))


@check_arguments
def torino_scale(probability: float, energy: Quantity) -> int:
    """Torino scale, 0 to 10, of one possible impact within a century.

    Parameters
    ----------
    probability, energy
        As of :func:`palermo_scale`.

    Raises
    ------
    InvalidInput, UnitMismatch
    """
    chance, megatons = _checked(probability, energy)
    if chance == 0.0 or megatons < 1.0:
        return 0
    e, p = np.log10(megatons), np.log10(chance)

    def above(c: float) -> bool:
        return bool((e - c) / 3.0 + (p + 2.0) / 2.0 >= 0.0)

    if chance >= 0.99:
        return 8 if e < 2.0 else 9 if e < 5.0 else 10
    if chance >= 0.01:
        if e < 2.0:
            return 3
        return 7 if e >= 5.0 else 5 if above(5.0) else 4
    if above(5.0):
        return 6
    return 2 if above(2.0) else 1 if above(-1.0) else 0


def _checked(probability: float, energy: Quantity) -> tuple[float, float]:
    """Probability and energy in Mt."""
    if not 0.0 <= probability <= 1.0:
        raise InvalidInput("probability", probability, "a number from 0 to 1")
    return float(probability), float(to_si(energy, u.J, "energy", low=0.0, open_low=True)) / MEGATON
