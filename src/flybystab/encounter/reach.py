"""Extent of an encounter in space and time."""

from __future__ import annotations

from flybystab.constants import AU, HOUR
from flybystab.orbit.planets import PLANETS, Planet

#: Time after the end of the encounter that is covered by the tide, s, so that a flowing body can be followed.
TAIL = 100.0 * HOUR
#: Default time to settle after an encounter, s.
SETTLE = 4.0 * HOUR


def far_enough(body: Planet) -> float:
    """Largest distance of an encounter, m."""
    return min(20.0 * hill_radius(body), AU)


def hill_radius(body: Planet) -> float:
    """Hill radius ``d (GM / 3 GM_primary)^(1/3)``, m; the Moon's primary is the Earth."""
    if body.name == "moon":
        return float(3.844e8 * (body.gm / (3.0 * PLANETS["earth"].gm)) ** (1.0 / 3.0))
    return float(body.orbit_radius * (body.gm / (3.0 * PLANETS["sun"].gm)) ** (1.0 / 3.0))


def usual_start(body: Planet, q: float) -> float:
    """Distance, m, at which an encounter with closest distance `q` (m) on a real orbit starts and ends."""
    return max(10.0 * body.radius, 1.5 * q, min(10.0 * q, hill_radius(body)))
