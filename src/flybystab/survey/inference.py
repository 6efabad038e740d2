"""What shape, spin and survived passages say about the material of a body.

For each density and cohesion there is a least friction angle that carries the body as it is (theory,
section 4) and one that carries it through a passage without yielding. The second depends on the attitude,
which nobody knew in the past: its least value over the attitudes is a bound that any attitude obeys, its
largest one makes the body safe at every attitude. A body that yielded and was moulded into its present shape
escapes the bounds from passages, and nothing here says that it did not: they hold for a body that kept its
shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity

from flybystab.aggregate.body import Body, Material
from flybystab.constants import G
from flybystab.core.passage import passage
from flybystab.core.statics import demand, rigid_stress
from flybystab.errors import InvalidInput
from flybystab.sky.encounter import Encounter
from flybystab.sky.finder import find_encounters
from flybystab.survey.attitude import attitude_matrix, isotropic_direction
from flybystab.survey.catalogue import Asteroid
from flybystab.survey.draws import identity, stream
from flybystab.units import to_si

_TOLERANCE = 1e-7


def infer(
    asteroid: Asteroid | Body,
    encounters: Sequence[Encounter] = (),
    densities: Quantity | None = None,
    cohesions: Quantity | None = None,
    *,
    attitudes: int = 32,
    seed: int = 0,
    yield_surface: str = "drucker-prager",
) -> QTable:
    """Least friction angles that are compatible with a body's shape and spin and with its passages.

    Parameters
    ----------
    asteroid : Asteroid or Body
    encounters : sequence of Encounter
        Passages that it is known to have survived.
    densities, cohesions : Quantity (n,), (m,)
        The grid; 1000 to 3500 kg/m3 and 0 to 1 kPa by default.
    attitudes : int
        Attitudes tried in every passage: the catalogue's pole where it is known, isotropic ones elsewhere.
    seed : int
        Of the attitudes.
    yield_surface : str
        As in :class:`flybystab.Material`.

    Returns
    -------
    QTable
        Rows over densities, then cohesions: ``density``, ``cohesion``, ``friction_equilibrium``, and over all
        passages ``friction_any_attitude`` (needed whatever the attitude was) and ``friction_every_attitude``
        (enough for every attitude); deg, inf where no friction is enough.

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName
    """
    rho = (
        np.linspace(1000.0, 3500.0, 11) if densities is None else _grid(densities, u.kg / u.m**3, "densities")
    )
    if np.any(rho <= 0.0):
        raise InvalidInput("densities", densities, "positive values")
    default = np.array([0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
    cohesion = default if cohesions is None else _grid(cohesions, u.Pa, "cohesions")
    if isinstance(attitudes, bool) or not isinstance(attitudes, int) or attitudes < 1:
        raise InvalidInput("attitudes", attitudes, "a whole number, 1 or more")
    code = Material(yield_surface=yield_surface).surface_code
    bodies, turns = _attitudes(asteroid, attitudes, seed)
    axes = bodies[0].axes
    s1, s2, s3 = axes**2
    stress = np.empty(6)
    rows: dict[str, list[float]] = {n: [] for n in ("density", "cohesion", "rest", "least", "most")}
    for r in rho:
        rigid_stress(s1, s2, s3, r, np.pi * G * r, bodies[0].omega, np.zeros(6), stress)
        for c in cohesion:
            rest = float(demand(code, 0.5, c, stress)[0])
            least, most = rest, rest
            for encounter in encounters:
                needs = np.array(
                    [
                        _need(body, q, encounter, float(r), float(c), code)
                        for body, q in zip(bodies, turns, strict=True)
                    ]
                )
                least, most = max(least, float(needs.min())), max(most, float(needs.max()))
            for name, value in zip(rows, (r, c, rest, least, most), strict=True):
                rows[name].append(float(value))
    table = QTable()
    table["density"] = rows["density"] * u.kg / u.m**3
    table["cohesion"] = rows["cohesion"] * u.Pa
    for name, column in (("equilibrium", "rest"), ("any_attitude", "least"), ("every_attitude", "most")):
        table[f"friction_{name}"] = np.rad2deg(rows[column]) * u.deg
    table.meta = {
        "title": "least friction angle by density and cohesion",
        "asteroid": asteroid.label if isinstance(asteroid, Asteroid) else "body",
        "semi_axes_m": [float(a) for a in axes],
        "passages": [_label(e) for e in encounters],
        "attitudes": attitudes,
        "pole": "catalogue" if isinstance(asteroid, Asteroid) and asteroid.pole is not None else "isotropic",
        "seed": seed,
        "yield_surface": yield_surface,
        "reading": "bounds from passages hold for a body that has kept its shape since",
    }
    return table


def survived(
    asteroid: Asteroid,
    start: Time,
    stop: Time,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.01 * u.au,
) -> list[Encounter]:
    """Passages of an asteroid's orbit between two dates, followed with all forces, for :func:`infer`.

    Raises
    ------
    OutOfSpan
        The span reaches beyond the ephemeris.
    """
    table = find_encounters(asteroid, start, stop, planets=list(planets), within=within)
    return [Encounter.from_orbit(asteroid.orbit, str(row["planet"]), row["time"]) for row in table]


def _grid(values: Quantity, unit: u.UnitBase, name: str) -> np.ndarray:
    grid = np.atleast_1d(to_si(values, unit, name, shape=None, low=0.0))
    if grid.ndim != 1 or not len(grid):
        raise InvalidInput(name, values, "a list of values")
    return grid


def _attitudes(asteroid: Asteroid | Body, n: int, seed: int) -> tuple[list[Body], list[np.ndarray]]:
    """Bodies (a tumbler at different phases) and their rotations to the frame of the encounter."""
    key = identity(asteroid) if isinstance(asteroid, Asteroid) else "body"
    bodies, turns = [], []
    for x in stream(seed, "infer", key).random((n, 4)):
        tumbles = isinstance(asteroid, Asteroid) and asteroid.tumbles
        if isinstance(asteroid, Body):
            body, pole = asteroid, None
        else:
            body, pole = asteroid.body_with(phase=float(x[3]) if tumbles else 0.0), asteroid.pole
        s = body.axes**2
        momentum = (s.sum() - s) * body.omega
        if not np.any(momentum):
            momentum = np.array([0.0, 0.0, 1.0])
        direction = isotropic_direction(x[:2]) if pole is None else pole
        bodies.append(body)
        turns.append(attitude_matrix(momentum, direction, 2.0 * np.pi * x[2]))
    return bodies, turns


def _need(
    body: Body, turn: np.ndarray, encounter: Encounter, rho: float, cohesion: float, code: int
) -> float:
    """Largest friction angle (rad) that the rigid body mobilises in a passage."""
    run = passage(
        body.axes,
        rho,
        body.omega,
        turn,
        encounter.t_start,
        encounter.t_stop,
        encounter.tide,
        phi=0.5,
        cohesion=cohesion,
        surface=code,
        unyielding=True,
        tolerance=_TOLERANCE,
    )
    return float(run.max_friction)


def _label(encounter: Encounter) -> str:
    when = "scripted" if encounter.time is None else encounter.time.tdb.isot[:16]
    return f"{encounter.planet.name} {when} {encounter.distance.to_value(u.km):.0f} km"


def inference_figure(table: QTable, path: str | Path) -> Path:
    """Plot the least friction angles of :func:`infer` against density, a line for each cohesion."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = [n for n in table.colnames if n.startswith("friction_")]
    figure = Figure(figsize=(4 * len(names), 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    panels: Any = figure.subplots(1, len(names), sharey=True)
    for panel, name in zip(panels, names, strict=True):
        for c in np.unique(table["cohesion"]):
            rows = table[table["cohesion"] == c]
            panel.plot(rows["density"].value, rows[name].to_value(u.deg), label=f"{c.to_value(u.Pa):g} Pa")
        panel.set(
            xlabel="density (kg/m$^3$)", title=name.removeprefix("friction_").replace("_", " "), ylim=(0, 60)
        )
    panels[0].set_ylabel("least friction angle (deg)")
    panels[-1].legend(title="cohesion", fontsize=7)
    figure.suptitle(str(table.meta.get("asteroid", "")), fontsize=9)
    figure.savefig(path, dpi=150)
    return Path(path)
