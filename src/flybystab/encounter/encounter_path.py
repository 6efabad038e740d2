"""Path of an asteroid past a planet, and the tide along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments, vector
from flybystab.core.dynamics.ground import Ground
from flybystab.core.ellipsoid.tide import TidePanels, tensor, tide_at, tide_panels
from flybystab.orbit.epochs import later
from flybystab.orbit.observatories import geographic
from flybystab.orbit.planets import Planet
from flybystab.orbit.predictability import Predictability
from flybystab.orbit.target_plane import NORTH, checked, target_plane
from flybystab.typing import Array
from flybystab.units import brief, to_si


class Track(Protocol):
    """Motion of the asteroid relative to the planet."""

    def states(self, t: Array) -> Array:
        """Position (m) and velocity (m/s), shape (n, 6), at ``t`` s from closest approach, shape (n,)."""


@dataclass(frozen=True, eq=False)
class EncounterPath:
    """Path relative to the planet, tide, and the errors of both.

    The attributes are described in :class:`flybystab.Encounter`, which adds the constructors.
    """

    planet: Planet
    time: Time | None
    distance: Quantity
    v_inf: Quantity
    v_periapsis: Quantity
    start_distance: Quantity
    impact: bool
    impact_level: str | None
    impact_time: float | None
    frame: str
    forces: tuple[str, ...]
    left_out: tuple[tuple[str, float], ...]
    tide_error: float
    t_start: float
    t_stop: float
    tide: TidePanels = field(repr=False)
    track: Track = field(repr=False)
    t_periapsis: float = 0.0
    distance_error: Quantity | None = None
    time_error: Quantity | None = None
    displacement: Quantity | None = None
    growth: float | None = None
    neighbour: str = ""
    predictability: Predictability | None = None
    ephemeris: str | None = None

    def position(self, t: Quantity) -> Quantity:
        """Asteroid from the planet's centre.

        Parameters
        ----------
        t : Quantity, any shape
            Time from closest approach.

        Returns
        -------
        Quantity, shape of `t` + (3,)
            In `frame`, m.

        Raises
        ------
        UnitMismatch
            For a bare number or a unit that is not one of time.
        """
        return self._states(t)[..., :3] * u.m

    def velocity(self, t: Quantity) -> Quantity:
        """Velocity relative to the planet, m/s; as :meth:`position`."""
        return self._states(t)[..., 3:] * u.m / u.s

    def radius(self, t: Quantity) -> Quantity:
        """Distance from the planet's centre, m, in the shape of `t` (see :meth:`position`)."""
        return np.linalg.norm(self._states(t)[..., :3], axis=-1) * u.m

    def _states(self, t: Quantity) -> Array:
        """Position and velocity, SI, shape of `t` + (6,)."""
        times = to_si(t, u.s, "t", shape=None)
        return self.track.states(np.ravel(times)).reshape(*np.shape(times), 6)

    @check_arguments
    def positions(self, t: Array) -> Array:
        """As :meth:`position` on floats: m, shape (n, 3), at `t` s from closest approach, shape (n,)."""
        return self.track.states(np.atleast_1d(np.asarray(t, dtype=float)))[:, :3]

    @check_arguments
    def distances(self, t: Array) -> Array:
        """As :meth:`radius` on floats: m, shape (n,), at `t` s from closest approach, shape (n,)."""
        return np.sqrt(np.sum(self.positions(t) ** 2, axis=1))

    @property
    def bound(self) -> bool:
        """Whether the two-body orbit at closest approach is an ellipse: there is no ``v_inf`` and no target plane."""
        return self.v_inf.value == 0.0 and self.time is not None

    @property
    def entry_time(self) -> Time | None:
        """First contact of an impact with the top of the atmosphere, or the surface without one (TDB)."""
        return None if self.time is None or self.impact_time is None else later(self.time, self.impact_time)

    @property
    def entry_place(self) -> tuple[Quantity, Quantity] | None:
        """East longitude and geodetic latitude of the entry into the atmosphere of the Earth; None elsewhere."""
        if self.entry_time is None or self.impact_time is None or self.planet.name != "earth":
            return None
        point = self.positions(np.array([self.impact_time]))
        longitude, latitude = geographic(point, self.entry_time)[0]
        return longitude * u.deg, latitude * u.deg

    @property
    def height(self) -> float:
        """Least height of the centre above atmosphere or surface, m; minus infinity on an impact of the centre."""
        if self.impact:
            return -np.inf
        return float(self.distance.to_value(u.m)) - self.planet.impact_distance

    @cached_property
    def ground(self) -> Ground:
        """Position of the planet's ground along the path: top of the atmosphere, or the surface if there is none."""
        tide = self.tide
        end = tide.tau * float(np.sinh(tide.start + tide.width * len(tide.coefficients)))
        stop = self.t_stop if self.impact else end
        way, _ = tide_panels(self.positions, self.t_start, stop, tide.tau, width=min(tide.width, 0.5))
        return Ground(
            way.tau, way.start, way.width, self.planet.impact_distance, self.height, 1.0, way.coefficients
        )

    @check_arguments
    def tidal_tensor(self, t: float) -> Array:
        """Tidal tensor, frame of the encounter, (3, 3), 1/s2, at `t` seconds from closest approach."""
        six, panels = np.empty(6), self.tide
        tide_at(panels.tau, panels.start, panels.width, panels.coefficients, t, six)
        return tensor(six)

    @cached_property
    def periapsis_axes(self) -> Array:
        """Rotation matrix, `frame` -> periapsis frame: x to the asteroid, z along the angular momentum."""
        # A track that ends at an impact has no periapsis: that of the two-body orbit at its end is used.
        ended = self.impact and self.t_stop < 0.0
        state = self.track.states(np.array([self.t_stop if ended else 0.0]))[0]
        r, v = state[:3], state[3:]
        h = np.cross(r, v)
        x = np.cross(v, h) / self.planet.gm - r / np.linalg.norm(r) if ended else r
        x, z = x / np.linalg.norm(x), h / np.linalg.norm(h)
        return np.stack([x, np.cross(z, x), z])

    @check_arguments
    def b_plane(self, north: Sequence[float] = NORTH) -> Quantity:
        """Target-plane coordinates ``(B.T, B.R)`` of the two-body hyperbola at closest approach, shape (2,).

        Parameters
        ----------
        north : sequence of float
            The direction N in `frame` (:mod:`flybystab.orbit.target_plane`): +z, in ICRF the Earth's equator.

        Raises
        ------
        InvalidInput
            For a bound orbit, which has no target plane, or if the asymptote points north.
        """
        when = 0.0 if self.impact_time is None else min(0.0, self.impact_time)
        b, v_inf = target_plane(self.track.states(np.array([when])), self.planet.gm, vector(north, "north"))
        return (checked(b[0], float(v_inf[0]), north) * u.m).to(u.km)

    def __repr__(self) -> str:
        when = "scripted" if self.time is None else f"{self.time.tdb.iso[:16]} TDB"
        hit = f", reaches the {self.impact_level}" if self.impact_level else ""
        radii = self.distance.to_value(u.m) / self.planet.radius
        return (
            f"<Encounter {self.planet.name}, {when}: {brief(self.distance, u.km)} ({radii:.4g} radii), "
            f"v_inf {brief(self.v_inf, u.km / u.s)}{hit}>"
        )
