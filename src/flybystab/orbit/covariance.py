"""Covariance of the elements of an orbit, and samples drawn from it.

The epoch of the elements of a covariance can differ from that of the orbit (at JPL by years). Only deviations from the
mean of the covariance are used. They are added to the orbit's state at that epoch without
linearisation, so that the clones are centred on the orbit.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import astropy.units as u
import numpy as np
from astropy.time import Time
from numpy.typing import NDArray

from flybystab.arguments import check_arguments, check_kinds
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.elements import ecliptic_to_icrf, gm_of, state_in_plane
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array
from flybystab.units import checked_time, to_si, whole

#: The sets of elements: cometary (JPL), Keplerian (NEOCC and catalogues), equinoctial (NEODyS), or a state. ``tp`` is
#: the time of perihelion less the epoch; ``h, k = e sin, e cos`` of the longitude of perihelion, ``P, Q = tan(i/2)
#: sin, cos`` of the node, ``L`` the mean longitude (Broucke & Cefola 1972, where they are p and q).
SETS: Mapping[str, tuple[str, ...]] = {
    "cometary": ("e", "q", "tp", "node", "peri", "i"),
    "keplerian": ("a", "e", "i", "node", "peri", "M"),
    "equinoctial": ("a", "h", "k", "P", "Q", "L"),
    "cartesian": ("x", "y", "z", "vx", "vy", "vz"),
}
#: Non-gravitational parameters that can be estimated with the elements.
NONGRAV_PARAMETERS = ("A1", "A2", "A3", "DT", "AMRAT")
_SI: Mapping[str, u.UnitBase] = (
    dict.fromkeys(("a", "q", "x", "y", "z"), u.m)
    | dict.fromkeys(("vx", "vy", "vz"), u.m / u.s)
    | dict.fromkeys(("i", "node", "peri", "M", "L"), u.rad)
    | dict.fromkeys(("h", "k", "P", "Q"), u.dimensionless_unscaled)
    | dict.fromkeys(NONGRAV_PARAMETERS[:3], u.m / u.s**2)
    | {"e": u.dimensionless_unscaled, "tp": u.s, "DT": u.s, "AMRAT": u.m**2 / u.kg}
)
#: Caveat of a covariance from the rounding of printed elements, which is unrelated to the error of the orbit itself.
DIGITS = "by the digits of its elements"
#: Caveat of a covariance from the uncertainty parameter of few old observations, whose error distribution is unknown.
UNRELIABLE = "by the digits and U of its elements, not reliable for a weak orbit from old observations"
#: Largest negative eigenvalue of the correlation matrix that is attributed to rounding of the published digits.
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class Covariance:
    """Mean and covariance of the elements of an orbit, SI units; by default heliocentric.

    Attributes
    ----------
    epoch : Time
        Epoch of the elements, TDB.
    names : tuple of str
        The parameters: one of the sets of :data:`SETS`, in any order, and the estimated ones of
        :data:`NONGRAV_PARAMETERS`.
    values : ndarray, shape (n,)
        Mean; m, s, rad, m/s, m/s2, m2/kg.
    matrix : ndarray, shape (n, n)
        Covariance of `values`.
    source : str
        Publisher and solution.
    correlated : bool
        False where only the 1-sigmas are known. The matrix is then diagonal, and the uncertainty of an encounter can
        be wrong by a large factor, mostly too large.
    caveat : str
        Note on a covariance that is not a published one; "without correlations" by default.
    frame : {"ecliptic", "ICRF"}
        Plane of the elements, or axes of the state, J2000. Elements refer to the ecliptic by default, a state to the
        ICRF.
    centre : str
        ``"sun"``, ``"ssb"`` or a body of the ephemeris: that of the elements.
    """

    epoch: Time
    names: tuple[str, ...]
    values: Array
    matrix: Array
    source: str = ""
    correlated: bool = True
    caveat: str = ""
    frame: str = ""
    centre: str = "sun"

    def __post_init__(self) -> None:
        check_kinds(self, "epoch", "values", "matrix", "source", "correlated", "caveat", "frame", "centre")
        if not isinstance(self.names, tuple | list) or not all(isinstance(name, str) for name in self.names):
            raise InvalidInput("names", self.names, "a sequence of names")
        for name in ("values", "matrix"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
        if not self.frame:
            object.__setattr__(self, "frame", "ICRF" if "x" in self.names else "ecliptic")
        if self.frame not in ("ecliptic", "ICRF"):
            raise UnknownName("frame", self.frame, [], known="(known: ICRF, ecliptic)")
        if self.centre != "ssb" and self.centre not in PLANETS:
            raise UnknownName("centre", self.centre, [], known=f"(known: ssb, {', '.join(PLANETS)})")
        if not (self.correlated or self.caveat):
            object.__setattr__(self, "caveat", "without correlations")
        n = len(self.names)
        orbital = {name for name in self.names if name not in NONGRAV_PARAMETERS}
        if len(set(self.names)) != n or not any(orbital == set(s) for s in SETS.values()):
            raise InvalidInput(
                "names", self.names, f"one of {[*SETS.values()]}, and any of {NONGRAV_PARAMETERS}, each once"
            )
        if self.values.shape != (n,) or self.matrix.shape != (n, n):
            raise InvalidInput("covariance", self.matrix.shape, f"{n} values and a matrix ({n}, {n})")
        if not (np.isfinite(self.values).all() and np.isfinite(self.matrix).all()):
            raise InvalidInput("covariance", self.matrix, "finite numbers")
        if np.any(np.diag(self.matrix) < 0.0):
            raise InvalidInput("covariance", np.diag(self.matrix), "variances of zero or more")
        scale = np.outer(self.sigma, self.sigma)
        if np.any(np.abs(self.matrix - self.matrix.T) > 1e-8 * scale):
            raise InvalidInput("covariance", self.matrix, "a symmetric matrix")
        lowest = float(self._spectrum[0].min())
        if lowest < -_ROUNDING:
            raise InvalidInput(
                "covariance", f"an eigenvalue of {lowest:.3g} of the correlations", "none below 0"
            )
        if not self._possible(self.values[None, :])[0]:
            raise InvalidInput(
                "elements", self.values, "those of a conic: q > 0, e >= 0, a > 0 exactly if e < 1"
            )

    @classmethod
    @check_arguments
    def in_units(
        cls,
        epoch: Time,
        names: Sequence[str],
        values: Sequence[float],
        matrix: Array,
        units: Sequence[u.UnitBase],
        source: str = "",
        correlated: bool = True,
        frame: str = "",
        centre: str = "sun",
    ) -> Covariance:
        """From numbers in the units of a publication, one unit a parameter (``tp``: time less the epoch).

        Frame and centre as in the attributes.

        Raises
        ------
        InvalidInput, UnitMismatch
            No covariance, or a unit that does not fit its parameter.
        """
        checked_time(epoch, "epoch")
        for name in names:
            if name not in _SI:
                raise InvalidInput("names", name, f"parameters out of {[*_SI]}")
        if len(units) != len(names):
            raise InvalidInput("units", len(units), f"one a parameter, {len(names)}")
        numbers = np.asarray(values), np.asarray(matrix)
        if numbers[0].shape != (len(names),) or numbers[1].shape != 2 * (len(names),):
            raise InvalidInput(
                "covariance",
                numbers[1].shape,
                f"{len(names)} values and a matrix ({len(names)}, {len(names)})",
            )
        factor = np.array([to_si(1.0 * x, _SI[n], n) for n, x in zip(names, units, strict=True)])
        return cls(
            epoch.tdb,
            tuple(names),
            np.asarray(values, dtype=float) * factor,
            np.asarray(matrix, dtype=float) * np.outer(factor, factor),
            source,
            correlated,
            frame=frame,
            centre=centre,
        )

    @property
    def sigma(self) -> Array:
        """1-sigma of each parameter, SI, shape (n,)."""
        return np.sqrt(np.diag(self.matrix))

    @property
    def digits_alone(self) -> bool:
        """True if the covariance contains only the rounding of printed elements, not the error of the orbit."""
        return self.caveat == DIGITS

    @property
    def reliable(self) -> bool:
        """True if the covariance is known to cover the error of the orbit; required for a determined encounter."""
        return self.caveat not in (DIGITS, UNRELIABLE)

    @property
    def elements(self) -> str:
        """Name of the set of elements."""
        return next(k for k, s in SETS.items() if set(s) <= set(self.names))

    @cached_property
    def _spectrum(self) -> tuple[Array, Array]:
        """Eigenvalues and eigenvectors of the correlation matrix; the covariances span 20 decades."""
        sigma = np.where(self.sigma > 0.0, self.sigma, 1.0)
        correlation = self.matrix / np.outer(sigma, sigma)
        values, vectors = np.linalg.eigh(0.5 * (correlation + correlation.T))
        return values, vectors

    @cached_property
    def factor(self) -> Array:
        """Matrix F with F F^T = covariance, SI, shape (n, n): a column is a deviation of one sigma."""
        values, vectors = self._spectrum
        return np.asarray(self.sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))

    @check_arguments
    def samples(self, n: int, seed: int) -> tuple[Array, int]:
        """Parameters drawn from the normal distribution, shape (n, len(names)), SI; number drawn again.

        Row k depends on the seed and k alone. Draws that are not a conic (negative perihelion distance or
        eccentricity, Keplerian elements with a > 0 and e > 1) are rejected and redrawn; cometary elements and states
        can change from ellipse to hyperbola.

        Raises
        ------
        InvalidInput
            If a row was rejected 100 times: the elements are not normally distributed.
        """
        n, seed = whole(n, "n", 0), whole(seed, "seed", 0)
        z = np.random.default_rng(seed).standard_normal((n, len(self.names)))
        out = self.values + z @ self.factor.T
        again = 0
        for k in np.flatnonzero(~self._possible(out)):
            other = np.random.default_rng([seed, int(k)])
            for _ in range(100):
                again += 1
                out[k] = self.values + self.factor @ other.standard_normal(len(self.names))
                if self._possible(out[k : k + 1])[0]:
                    break
            else:
                raise InvalidInput(
                    "covariance", self.source, f"a spread for which {self.elements} elements are normal"
                )
        return out, again

    def _column(self, parameters: Array, name: str) -> Array:
        return np.asarray(parameters[:, self.names.index(name)])

    def _possible(self, parameters: Array) -> NDArray[np.bool_]:
        """True for each row that describes a conic."""
        kind = self.elements
        if kind == "cartesian":
            return np.ones(len(parameters), dtype=bool)
        if kind == "equinoctial":
            a, h, k = (self._column(parameters, n) for n in ("a", "h", "k"))
            return np.asarray((a > 0.0) & (h * h + k * k < 1.0))
        e = self._column(parameters, "e")
        if kind == "cometary":
            return np.asarray((e >= 0.0) & (self._column(parameters, "q") > 0.0))
        a = self._column(parameters, "a")
        return np.asarray(((a > 0.0) & (e >= 0.0) & (e < 1.0)) | ((a < 0.0) & (e > 1.0)))

    @check_arguments
    def states(self, parameters: Array) -> Array:
        """States, shape (m, 6), m and m/s, ICRF axes, relative to the centre, of parameters (m, n)."""
        states = self._in_frame(self._rows(parameters))
        if self.frame == "ICRF":
            return states
        turn = ecliptic_to_icrf()
        return np.array([np.concatenate([turn @ x[:3], turn @ x[3:]]) for x in states])

    def _rows(self, parameters: Array) -> Array:
        found = np.asarray(parameters, dtype=float)
        if found.ndim != 2 or found.shape[1] != len(self.names):
            raise InvalidInput("parameters", parameters, f"rows of {len(self.names)} parameters")
        return found

    def _in_frame(self, parameters: Array) -> Array:
        """States in the frame of the covariance, shape (m, 6)."""
        if self.elements == "cartesian":
            order = [self.names.index(n) for n in SETS["cartesian"]]
            return np.array(parameters[:, order])
        gm = gm_of(self.centre)
        if self.elements == "equinoctial":
            e, i, node, peri, mean = keplerian_angles(
                *(self._column(parameters, n) for n in ("h", "k", "P", "Q", "L"))
            )
        else:
            e, i, node, peri = (self._column(parameters, n) for n in ("e", "i", "node", "peri"))
            mean = self._column(parameters, "M") if self.elements == "keplerian" else np.zeros(len(e))
        if self.elements == "cometary":
            q, since = self._column(parameters, "q"), -self._column(parameters, "tp")
        else:
            a = self._column(parameters, "a")
            q = a * (1.0 - e)
            since = mean * np.sqrt(np.abs(a) ** 3 / gm)
        rows = zip(q, e, i, node, peri, since, strict=True)
        return np.array([state_in_plane(p, x, y, z, w, t, gm) for p, x, y, z, w, t in rows])

    def as_state(self) -> Covariance:
        """The covariance of the state with ICRF axes relative to the same centre, to first order.

        The Jacobian is that of central differences over a hundredth of a sigma. The heliocentric state has the same
        covariance: the position of a centre has no error here.
        """
        n = len(self.names)
        extra = tuple(name for name in NONGRAV_PARAMETERS if name in self.names)
        step = np.maximum(1e-2 * self.sigma, 1e-7 * np.abs(self.values))
        step[step == 0.0] = 1e-9
        ways = np.diag(step)
        difference = self.states(self.values + ways) - self.states(self.values - ways)
        jacobian = np.zeros((6 + len(extra), n))
        jacobian[:6] = (difference / (2.0 * step[:, None])).T
        for k, name in enumerate(extra):
            jacobian[6 + k, self.names.index(name)] = 1.0
        matrix = jacobian @ self.matrix @ jacobian.T
        mean = np.concatenate([self.states(self.values[None, :])[0], jacobian[6:] @ self.values])
        return replace(
            self,
            names=(*SETS["cartesian"], *extra),
            values=mean,
            matrix=0.5 * (matrix + matrix.T),
            frame="ICRF",
        )

    @check_arguments
    def nongrav_deviations(self, parameters: Array) -> Array:
        """A1, A2, A3 (m/s2), DT (s), AMRAT (m2/kg) less their means, shape (m, 5); zero if not estimated."""
        parameters = self._rows(parameters)
        out = np.zeros((len(parameters), len(NONGRAV_PARAMETERS)))
        for j, name in enumerate(NONGRAV_PARAMETERS):
            if name in self.names:
                at = self.names.index(name)
                out[:, j] = parameters[:, at] - self.values[at]
        return out

    def pushes(self, parameters: Array) -> Array:
        """Deprecated name of :meth:`nongrav_deviations`."""
        warnings.warn("Covariance.pushes is deprecated: use nongrav_deviations", DeprecationWarning, 2)
        return self.nongrav_deviations(parameters)

    @check_arguments
    def deviations(self, parameters: Array) -> tuple[Array, Array]:
        """States and non-gravitational parameters less those of the mean, shapes (m, 6) and (m, 5)."""
        return self.states(parameters) - self.states(self.values[None, :]), self.nongrav_deviations(
            parameters
        )

    def __repr__(self) -> str:
        kind = f", {self.caveat}" if self.caveat else ""
        when = f"{self.epoch.tdb.iso[:10]} TDB"
        return f"<Covariance of {', '.join(self.names)} at {when}, {self.source or 'no source'}{kind}>"


def keplerian_angles(
    h: Array, k: Array, p: Array, q: Array, longitude: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Eccentricity, inclination, node, argument of perihelion and mean anomaly (rad) of equinoctial elements."""
    node = np.arctan2(p, q)
    perihelion = np.arctan2(h, k)
    return np.hypot(h, k), 2.0 * np.arctan(np.hypot(p, q)), node, perihelion - node, longitude - perihelion
