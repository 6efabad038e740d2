"""Apophis a year after its encounter of 2029: budget of the difference from JPL's state.

Usage: ``python benchmarks/apophis_after.py``. Two states by JPL's small-body code, in January 2029 and in January 2030,
are in ``../shared/data/states_reference.csv`` (or ``$FLYBYSTAB_SHARED/data``). The first is integrated to the time of
the second. Each row of the table changes one thing: "moves" is the displacement of the final position by it, "from
JPL" the distance of the final position from JPL's.

The tesseral harmonics of the Earth are not a force of the package. Their displacement is that of the linearised
equations of motion over three days around the encounter, driven by their acceleration along the path, and propagated to
the end by a central difference of two orbits. The same method gives the displacement by J3 within 0.1 %.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import astropy.units as u
import numpy as np
from astropy.time import Time
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import BPoly

from flybystab.bench.reference_states import reference_orbits
from flybystab.constants import DAY
from flybystab.errors import MissingExtra
from flybystab.orbit.ephemeris import BELT, BODIES, Window, ephemeris
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import FORCES, model
from flybystab.orbit.ias15 import EPSILON, TIGHT, Flight
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import PLANETS, Planet

DATA = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared")) / "data"
UNIT = u.au / u.d**2
EARTH = PLANETS["earth"]
PERIGEE = 2462240.407091595
#: Half of the spacing of floating-point Julian dates in these years, s: the reference states have such dates.
HALF_UNIT = 0.5 * float(np.spacing(PERIGEE)) * DAY
#: Unnormalised C and S of the Earth by degree and order (EGM2008).
TESSERAL = {
    (2, 2): (1.5746e-6, -0.9039e-6),
    (3, 1): (2.1931e-6, 0.2681e-6),
    (3, 2): (0.3090e-6, -0.2114e-6),
    (3, 3): (0.1006e-6, 0.1972e-6),
}
#: TDB - UT1 in 2029, s; a second turns the Earth by 15".
TDB_UT1 = 69.6
Vector = NDArray[np.float64]


def pole_of_j2000(self: Planet, time: Time) -> tuple[float, float, float]:
    """The pole of J2000 at any time, in place of :meth:`Planet.pole_at`."""
    return self.pole


def pole_with_nutation(self: Planet, time: Time) -> tuple[float, float, float]:
    """The celestial intermediate pole (IAU 2006/2000A, ERFA), in place of :meth:`Planet.pole_at`."""
    import erfa

    if self.name != "earth":
        return self.pole
    x, y, _ = erfa.xys06a(time.tt.jd1, time.tt.jd2)
    return float(x), float(y), float(np.sqrt(1.0 - x * x - y * y))


@dataclass
class Budget:
    """The integration from one state to the other, and what changes it.

    Attributes
    ----------
    before : Orbit
    window : Window
    start, goal : ndarray, shape (6,)
        Barycentric states at both times, m and m/s.
    end : float
        Time of the second, s after the first.
    """

    before: Orbit
    window: Window
    start: Vector
    goal: Vector
    end: float

    @classmethod
    def of(cls, before: Orbit, after: Orbit, name: str = "de440") -> Budget:
        """The budget between two states with an ephemeris."""
        end = seconds(after.epoch, before.epoch)
        window = ephemeris(name).window(before.epoch, -DAY, end + DAY)
        there = np.concatenate([after.position.to_value(u.m), after.velocity.to_value(u.m / u.s)])
        goal = window.states(0, np.array([end]))[0] + there
        return cls(before, window, before.barycentric(window), goal, end)

    def final(
        self,
        forces: tuple[str, ...] = FORCES,
        epsilon: float = TIGHT,
        start: Vector | None = None,
        late: float = 0.0,
        pole: Callable[[Planet, Time], tuple[float, float, float]] | None = pole_of_j2000,
    ) -> Vector:
        """Final state (m, m/s); `late` is the time of the first state after its printed date, s."""
        state = self.start if start is None else start
        sun = self.window.states(0, np.array([0.0, late]))
        with mock.patch.object(Planet, "pole_at", pole or Planet.pole_at):
            forced = model(self.window, forces, self.before.nongrav)
        return Flight(forced, late, state + sun[1] - sun[0], epsilon).to(self.end)

    def off(self, final: Vector) -> float:
        """Distance from JPL's final position, km."""
        return float(np.linalg.norm(final[:3] - self.goal[:3])) / 1e3

    def best_epoch(self) -> tuple[float, Vector]:
        """Correction of the first date (s) for the least distance from JPL, and the final state with it."""
        here = self.final()
        slope = (self.final(late=HALF_UNIT) - self.final(late=-HALF_UNIT))[:3] / (2.0 * HALF_UNIT)
        late = float(slope @ (self.goal - here)[:3] / (slope @ slope))
        return late, self.final(late=late)

    def displaced(self, extra: Callable[[Vector, float], Vector], span: float = 1.5 * DAY) -> Vector:
        """Displacement (m) at the end by a small acceleration around perigee, of geocentric m and time (JD TDB)."""
        at = (PERIGEE - self.window.epoch.jd) * DAY
        with mock.patch.object(Planet, "pole_at", pole_of_j2000):
            forced = model(self.window, FORCES, self.before.nongrav)
        flight = Flight(forced, 0.0, self.start, TIGHT)
        flight.to(at - span)
        log = flight.log_to(at + span)
        path = BPoly.from_derivatives(log[:, 0], log[:, 1:].reshape(-1, 3, 3))
        pulls = [BODIES.index(name) for name in ("earth", "moon", "sun")]

        def slope(t: float, y: Vector) -> Vector:
            here, out = path(t), np.zeros(3)
            for body in pulls:
                r = here - self.window.states(body, np.array([t]))[0, :3]
                d = np.linalg.norm(r)
                out += self.window.gm[body] / d**3 * (3.0 * (r @ y[:3]) / d**2 * r - y[:3])
                if BODIES[body] == "earth":
                    out += extra(r, self.window.epoch.jd + t / DAY)
            return np.concatenate([y[3:], out])

        size = [1e-8] * 3 + [1e-13] * 3
        found = solve_ivp(
            slope, (at - span, at + span), np.zeros(6), method="DOP853", rtol=1e-9, atol=size, max_step=600.0
        )
        step = 1e3 * found.y[:, -1]
        ends = [Flight(forced, at + span, flight.state + s * step).to(self.end) for s in (1.0, -1.0)]
        return (ends[0] - ends[1])[:3] / 2e3


def gradient(potential: Callable[[NDArray[np.complex128]], np.complex128], r: Vector) -> Vector:
    """Gradient by complex steps of a millimetre: no cancellation."""
    return np.array([potential(r + 1e-3j * axis).imag / 1e-3 for axis in np.eye(3)])


def tesseral(r: Vector, jd: float) -> Vector:
    """Acceleration (m/s2) by the tesseral harmonics to degree 3 at geocentric `r` (m, ICRF axes)."""
    days = jd - TDB_UT1 / DAY - 2451545.0
    angle = 2.0 * np.pi * (0.7790572732640 + 0.00273781191135448 * days + days % 1.0)  # IAU 2000
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])

    def potential(p: NDArray[np.complex128]) -> np.complex128:
        x, y, z = p
        d = np.sqrt(x * x + y * y + z * z)
        shapes = {
            (2, 2): (3.0 * (x * x - y * y), 6.0 * x * y),
            (3, 1): (1.5 * (5.0 * z * z - d * d) * x, 1.5 * (5.0 * z * z - d * d) * y),
            (3, 2): (15.0 * z * (x * x - y * y), 30.0 * z * x * y),
            (3, 3): (15.0 * (x**3 - 3.0 * x * y * y), 15.0 * (3.0 * x * x * y - y**3)),
        }
        return sum(
            EARTH.gm * EARTH.radius**n / d ** (2 * n + 1) * (c * shapes[n, m][0] + s * shapes[n, m][1])
            for (n, m), (c, s) in TESSERAL.items()
        )

    return turn.T @ gradient(potential, turn @ r)


def third_zonal(r: Vector, jd: float) -> Vector:
    """Acceleration (m/s2) by J3 of the Earth, pole of J2000: the test of the method."""

    def potential(p: NDArray[np.complex128]) -> np.complex128:
        d = np.sqrt(np.sum(p * p))
        s = p[2] / d
        return -EARTH.gm * EARTH.j3 * EARTH.radius**3 / d**4 * 0.5 * (5.0 * s**3 - 3.0 * s)

    return gradient(potential, r)


def rows() -> list[tuple[str, float, float | None]]:
    """Label, displacement (km) and distance from JPL (km) by row."""
    states = reference_orbits(DATA / "states_reference.csv")
    orbits = states["apophis_pre"], states["apophis_post"]
    budget = Budget.of(*orbits)
    base = budget.final()

    def row(label: str, final: Vector) -> tuple[str, float, float | None]:
        return label, float(np.linalg.norm((final - base)[:3])) / 1e3, budget.off(final)

    out = [
        row("all forces, the Earth's pole of date (default)", budget.final(pole=None)),
        row("... with nutation", budget.final(pole=pole_with_nutation)),
        row("all forces, the Earth's pole of J2000: base of the rows below", base),
    ]
    late, best = budget.best_epoch()
    out += [
        row(
            f"printed date of the first state + {HALF_UNIT * 1e6:.1f} us (half of its last bit)",
            budget.final(late=HALF_UNIT),
        ),
        row(f"printed date of the first state {late * 1e6:+.1f} us (best)", best),
    ]
    digits = 0.5e-16 * np.array([u.au.to(u.m)] * 3 + [u.au.to(u.m) / DAY] * 3)
    moved = [budget.final(start=budget.start + 100.0 * step) - base for step in np.diag(digits)]
    worst = float(np.sum([np.linalg.norm(m[:3]) for m in moved])) / 1e5
    out.append(("last digit of the first state, all components together", worst, None))
    out.append(row("tolerance of the integration 1e-9 instead of 1e-11", budget.final(epsilon=EPSILON)))
    old = Budget.of(*orbits, name="de421")
    gap = (old.final() - old.goal - base + budget.goal)[:3]
    out.append(("planets of DE421 instead of DE440", float(np.linalg.norm(gap)) / 1e3, old.off(old.final())))
    groups = {
        "1PN": ["1PN"],
        "J2 of the Earth": ["earth J2"],
        "J3": ["earth J3"],
        "J4": ["earth J4"],
        "J2 of the Sun": ["sun J2"],
        "J2 of the Moon": ["moon J2"],
        "J2 of Venus, Mars and the giant planets": [
            f"{n} J2" for n in ("venus", "mars", "jupiter", "saturn", "uranus", "neptune")
        ],
        "A1, A2": ["non-gravitational"],
        "Pluto": ["pluto point mass"],
        "Ceres": ["ceres point mass"],
        "Vesta": ["vesta point mass"],
        "Pallas": ["pallas point mass"],
        "the 13 smaller asteroids": [
            f"{n} point mass" for n in BELT if n not in ("ceres", "vesta", "pallas")
        ],
    }
    for label, names in groups.items():
        out.append(row(f"without {label}", budget.final(tuple(f for f in FORCES if f not in names))))
    check = budget.displaced(third_zonal)
    direct = (base - budget.final(tuple(f for f in FORCES if f != "earth J3")))[:3]
    out.append(
        ("J3 by linearised motion less J3 by integration", float(np.linalg.norm(check - direct)) / 1e3, None)
    )
    shift = budget.displaced(tesseral)
    moved_goal = float(np.linalg.norm((base - budget.goal)[:3] + shift)) / 1e3
    out.append(
        ("with tesseral harmonics of the Earth to degree 3", float(np.linalg.norm(shift)) / 1e3, moved_goal)
    )
    return out


def main() -> None:
    try:
        table = rows()
    except MissingExtra as error:
        raise SystemExit(str(error)) from None
    print("Apophis from 2029-01-02 to 2030-01-01, from JPL's state of 2029: final position")
    print(f"{'model':72} {'moves (km)':>11} {'from JPL (km)':>14}")
    for label, moves, off in table:
        print(f"{label:72} {moves:11.3f} {'-' if off is None else f'{off:.3f}':>14}")


if __name__ == "__main__":
    main()
