"""Rates of encounters of a population with a planet within a periapsis distance."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import astropy.units as u
import numpy as np
from astropy.table import QTable, Table
from astropy.units import Quantity
from scipy.special import ellipe, ellipkm1

from flybystab.arguments import check_arguments
from flybystab.catalogues.asteroid import Asteroid
from flybystab.constants import AU
from flybystab.core.numerics.threads import in_order, worker_count
from flybystab.errors import InvalidInput
from flybystab.orbit.elements import GM_SUN, elements_from_state
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import Planet, planet
from flybystab.population.wetherill import NODES_R, NODES_S, rate_and_moments, rate_at_speeds, speed_sums
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import to_si, whole

#: Orbits of one task of a thread.
BLOCK = 20_000
#: Inclination, rad, that replaces a smaller one; the rate does not depend on such angles (:func:`smoothing`).
_LEAST_INCLINATION = 1e-7
#: Orbits of a population: a table with columns ``a``, ``e`` and ``i``, orbits, or asteroids.
Orbits: TypeAlias = Table | Orbit | Asteroid | Iterable[Orbit | Asteroid]


@dataclass(frozen=True, eq=False)
class EncounterRates(Tabular):
    """Mean rates of encounters of orbits with one planet.

    Attributes
    ----------
    planet : Planet
    periapsis : Quantity
        Encounters have a smaller periapsis distance, including gravitational focusing.
    rate : Quantity, shape (n,)
        1/yr, of one asteroid on each orbit; zero for an orbit that does not reach the planet's.
    v_inf : Quantity, shape (n,)
        Mean hyperbolic excess speed of these encounters, km/s; nan without encounters.
    v_inf_dispersion : Quantity, shape (n,)
        Its standard deviation.
    weight : ndarray (n,)
        Number of asteroids on each orbit.
    """

    planet: Planet
    periapsis: Quantity
    rate: Quantity
    v_inf: Quantity
    v_inf_dispersion: Quantity
    weight: Array
    _elements: Array
    _orbit: Array
    _sums: Array

    @property
    def total(self) -> Quantity:
        """Rate of all asteroids together, 1/yr."""
        return (self.weight * self.rate).sum()

    def within(self, periapsis: Quantity) -> EncounterRates:
        """The rates within another periapsis distance, without repeating the integration."""
        limit = to_si(periapsis, u.m, "periapsis", low=0.0, open_low=True)
        return _rates(self.planet, limit, self.weight, self._elements, self._orbit, self._sums)

    def sample(self, count: int, seed: int, *, above: Quantity | None = None) -> QTable:
        """Encounters drawn from the population in proportion to their rates.

        Parameters
        ----------
        count : int
        seed : int
        above : Quantity, optional
            Least periapsis distance, below :attr:`periapsis`; zero by default.

        Returns
        -------
        QTable
            ``orbit`` (row number), ``v_inf`` (km/s) and ``periapsis`` (km). The periapsis follows the focused
            cross-section ``q^2 + 2 GM q/v_inf^2``: those below the planet's radius are impacts.
        """
        rng = np.random.default_rng(whole(seed, "seed", 0))
        high, gm = self.periapsis.to_value(u.m), self.planet.gm
        low = 0.0 if above is None else to_si(above, u.m, "above", low=0.0, high=high, open_high=True)
        rate = self.weight * self.rate.value
        if low > 0.0:
            rate = rate - self.weight * self.within(low * u.m).rate.value
        if not rate.sum() > 0.0:
            raise InvalidInput("count", count, "orbits that reach the planet: none does")
        chosen = rng.choice(len(rate), size=whole(count, "count", 1), p=rate / rate.sum())
        speed = np.empty(len(chosen))
        speeds, weights = np.empty(4 * NODES_R * NODES_S), np.empty(4 * NODES_R * NODES_S)
        order = np.argsort(chosen, kind="stable")
        rows, starts = np.unique(chosen[order], return_index=True)
        for row, block in zip(rows, np.split(order, starts[1:]), strict=True):
            a, e, i = self._elements[row]
            m = rate_at_speeds(
                a, e, np.sin(i), np.cos(i), self._orbit[0], self._orbit[1], np.sin(self._orbit[2]), GM_SUN,
                speeds, weights,
            )  # fmt: skip
            u2 = speeds[:m] ** 2
            share = weights[:m] * (high * (high + 2.0 * gm / u2) - low * (low + 2.0 * gm / u2))
            speed[block] = rng.choice(speeds[:m], size=len(block), p=share / share.sum())
        # q^2 + 2 f q = x is uniform between its values at the two limits, f = GM/U^2
        f = gm / speed**2
        x = low * (low + 2.0 * f) + rng.random(len(chosen)) * (high - low) * (high + low + 2.0 * f)
        q = x / (f + np.sqrt(f * f + x))
        return QTable({"orbit": chosen, "v_inf": speed / 1e3 * u.km / u.s, "periapsis": q / 1e3 * u.km})

    def __repr__(self) -> str:
        return (
            f"<EncounterRates {len(self.rate)} orbits, {self.planet.name} within {self.periapsis:.6g}: "
            f"{self.total.value:.4g} per year>"
        )


@check_arguments
def encounter_rates(
    orbits: Orbits,
    planet_name: str | Planet = "earth",
    periapsis: Quantity | None = None,
    *,
    planet_orbit: tuple[Quantity, float, Quantity] | None = None,
    workers: int | None = None,
) -> EncounterRates:
    """Mean rate of encounters with a planet within a periapsis distance, on the time scale of precession.

    Parameters
    ----------
    orbits : table, sequence of Orbit or of Asteroid, or one of them
        A table has columns ``a``, ``e`` and ``i`` (with units; without: au and deg), and optionally ``weight``, the
        number of asteroids that a row represents.
    planet_name : str or Planet
    periapsis : Quantity, optional
        Largest distance from the planet's centre; its radius by default (impacts on the surface).
    planet_orbit : (Quantity, float, Quantity), optional
        Semi-major axis, eccentricity and inclination; its mean orbit by default.
    workers : int, optional
        Threads; one per core by default.

    Returns
    -------
    EncounterRates

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName

    Notes
    -----
    Angles are taken to circulate uniformly (:mod:`flybystab.population.wetherill`): resonances, correlated returns and
    the evolution of ``a``, ``e`` and ``i`` are neglected. For a single asteroid the rate over the next centuries can
    differ arbitrarily; for a population the mean rate agrees with counted encounters (tests/population). The density of
    orbits of low inclination is averaged over the target disc of a planet in the reference plane (:func:`smoothing`).
    """
    body = planet(planet_name)
    distance = body.radius * u.m if periapsis is None else periapsis
    limit = to_si(distance, u.m, "periapsis", low=0.0, open_low=True)
    elements, weight = _elements(orbits), _weight(orbits)
    elements[:, 2] = np.clip(elements[:, 2], _LEAST_INCLINATION, np.pi - _LEAST_INCLINATION)
    if planet_orbit is None:
        target = _mean_orbit(body)
    else:
        if not isinstance(planet_orbit, tuple | list) or len(planet_orbit) != 3:
            raise InvalidInput("planet_orbit", planet_orbit, "semi-major axis, eccentricity and inclination")
        a, e, i = planet_orbit
        target = np.array(
            [
                to_si(a, u.m, "planet_orbit[0]", low=0.0, open_low=True),
                to_si(e, u.dimensionless_unscaled, "planet_orbit[1]", low=0.0, high=1.0, open_high=True),
                to_si(i, u.rad, "planet_orbit[2]", low=0.0, high=np.pi),
            ]
        )
    threads = worker_count(workers)
    sums = np.empty((len(elements), 5))

    def part(first: int) -> None:
        block = slice(first, first + BLOCK)
        speed_sums(elements[block], target, GM_SUN, sums[block])

    list(in_order(part, range(0, len(elements), BLOCK), threads))
    return _rates(body, limit, np.ones(len(elements)) if weight is None else weight, elements, target, sums)


def _mean_orbit(body: Planet) -> Array:
    """Semi-major axis (m), eccentricity and inclination (rad) of today's mean orbit of a planet.

    Over a million years eccentricities and inclinations vary, those of the Earth up to about 0.06 and 4 deg.
    """
    if not body.orbit_radius > 0.0:
        raise InvalidInput("planet", body.name, "a body that orbits the Sun")
    return np.array([body.orbit_radius, body.orbit_eccentricity, body.orbit_inclination])


def _rates(
    body: Planet, limit: float, weight: Array, elements: Array, target: Array, sums: Array
) -> EncounterRates:
    rate, mean, square = rate_and_moments(sums, body.gm, limit)
    if target[2] == 0.0:
        rate = rate * smoothing(np.sin(elements[:, 2]), limit / target[0])
    dispersion = np.sqrt(np.maximum(0.0, square - mean**2))
    return EncounterRates(
        body,
        (limit * u.m).to(u.km),
        (rate / u.s).to(1 / u.yr),
        mean / 1e3 * u.km / u.s,
        dispersion / 1e3 * u.km / u.s,
        weight,
        elements,
        target,
        sums,
    )


def smoothing(sin_i: Array, width: float) -> Array:
    """Mean density of an orbit over the target disc of a planet in the reference plane, over that at its centre.

    The density ``1/(pi sqrt(sin^2 i - s^2))`` in the sine ``s`` of the latitude diverges as the inclination goes to
    zero. Its mean over a disc is finite: normal to the plane, as the relative velocities of such orbits are in it. For
    ``i = 0`` the rate is that of two coplanar orbits.

    Parameters
    ----------
    sin_i : ndarray (n,)
        Above zero.
    width : float
        Radius of the disc over the distance from the Sun.
    """
    k2 = np.minimum((width / sin_i) ** 2, 1.0)
    m = np.clip(k2, 1e-4, 1.0 - 1e-12)
    thin = np.where(k2 < m, np.pi / 4.0 * (1.0 + k2 / 8.0), (ellipe(m) - (1.0 - m) * ellipkm1(1.0 - m)) / m)
    thick = sin_i / width * ellipe(np.minimum((sin_i / width) ** 2, 1.0))
    return np.asarray(4.0 / np.pi * np.where(sin_i > width, thin, thick))


def elements_table(orbits: Orbits) -> QTable:
    """Orbits as a table of ``a``, ``e`` and ``i``, which :func:`encounter_rates` does not convert again.

    Columns ``weight`` and ``H`` of a table, and absolute magnitudes of asteroids, are kept.
    """
    a, e, i = _elements(orbits).T
    table = QTable({"a": a * u.m, "e": e, "i": i * u.rad})
    weight = _weight(orbits)
    if weight is not None:
        table["weight"] = weight
    if isinstance(orbits, Table):
        if "H" in orbits.colnames:
            column = orbits["H"]
            table["H"] = np.asarray(getattr(column, "value", column), dtype=float)
    elif isinstance(orbits, Iterable):
        table["H"] = [
            float(o.row["H_mag"]) if isinstance(o, Asteroid) and o.knows("H_mag") else np.nan for o in orbits
        ]
    return table


def _weight(orbits: Orbits) -> Array | None:
    """Number of asteroids of each row of a table; None without the column."""
    if not isinstance(orbits, Table) or "weight" not in orbits.colnames:
        return None
    column = orbits["weight"]
    weight = np.asarray(getattr(column, "value", column), dtype=float)
    if not (np.isfinite(weight) & (weight >= 0.0)).all():
        raise InvalidInput("orbits", "weight", "finite weights of zero or more")
    return weight


def _elements(orbits: Orbits) -> Array:
    """Semi-major axis (m), eccentricity and inclination (rad) of each orbit, ``(n, 3)``."""
    if isinstance(orbits, Table):
        columns = []
        for name, unit, factor in (
            ("a", u.m, AU),
            ("e", u.dimensionless_unscaled, 1.0),
            ("i", u.rad, np.pi / 180),
        ):
            if name not in orbits.colnames:
                raise InvalidInput("orbits", orbits.colnames, "columns a, e and i")
            column = orbits[name]
            given = getattr(column, "unit", None) not in (None, u.dimensionless_unscaled)
            columns.append(
                Quantity(column).to_value(unit) if given else np.asarray(column, dtype=float) * factor
            )
        out = np.column_stack(columns)
    else:
        many = orbits if isinstance(orbits, Iterable) and not isinstance(orbits, str) else [orbits]
        out = np.array([_of_orbit(getattr(o, "orbit", o), k) for k, o in enumerate(many)]).reshape(-1, 3)
    bad = ~(
        np.isfinite(out).all(axis=1) & (out[:, 0] > 0) & (out[:, 1] >= 0) & (out[:, 1] < 1) & (out[:, 2] >= 0)
        & (out[:, 2] <= np.pi)
    )  # fmt: skip
    if np.any(bad):
        k = int(np.flatnonzero(bad)[0])
        a, e, i = out[k]
        raise InvalidInput(
            f"orbits[{k}]",
            f"a = {a / AU:g} au, e = {e:g}, i = {np.degrees(i):g} deg",
            "an elliptic orbit: a above 0, e in [0, 1), i in [0, 180] deg",
        )
    return np.ascontiguousarray(out)


def _of_orbit(orbit: object, number: int) -> tuple[float, float, float]:
    if not isinstance(orbit, Orbit):
        raise InvalidInput(
            f"orbits[{number}]", orbit, "an Orbit, an Asteroid with one, or a table with a, e, i"
        )
    from flybystab.orbit.osculating_state import heliocentric

    state = heliocentric(orbit)
    return elements_of(state[:3], state[3:])


def elements_of(position: Array, velocity: Array) -> tuple[float, float, float]:
    """Semi-major axis (m), eccentricity and ecliptic inclination (rad) of a heliocentric ICRF state (m, m/s)."""
    q, e, i, *_ = elements_from_state(np.concatenate([position, velocity]))
    return (q / (1.0 - e) if e != 1.0 else np.inf), e, i
