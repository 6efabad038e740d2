"""Rows of a screening: one an encounter, for the catalogue body and its samples, and one a sample."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flybystab import __version__
from flybystab.constants import AU
from flybystab.errors import FlybystabError
from flybystab.outcome import Verdict
from flybystab.sky.ephemeris import ephemeris
from flybystab.survey.catalogue import Asteroid
from flybystab.survey.columns import VERDICTS, YIELDED, share_of
from flybystab.survey.draws import Attitudes, Draws, draws, nominal
from flybystab.survey.judging import Judged, contributors, inputs, judge, judge_each, wilson
from flybystab.survey.passages import Finder, Passage, passages
from flybystab.survey.settings import Settings
from flybystab.survey.spread import Spread, spread

Array = NDArray[np.float64]

#: The margin of the catalogue body is computed, not bounded, where the bound is this far from rest, rad.
SHARP = float(np.radians(0.01))


def screen_passage(passage: Passage, settings: Settings) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Row of one encounter, and the rows of its samples if they are kept."""
    asteroid, material = passage.asteroid, settings.material
    where = (passage.planet, f"{passage.time.tdb.jd:.1f}")
    row = _head(asteroid, settings) | {
        "planet": passage.planet,
        "time_tdb": passage.time.tdb.isot,
        "jd_tdb": float(passage.time.tdb.jd),
        "distance": passage.distance / AU,
        "v_inf": passage.v_inf / 1000.0,
    }
    try:
        known = nominal(asteroid, material, settings.population)
        attitude = Attitudes.at(asteroid, known, settings.seed, "nominal", *where)
        main = judge(
            passage, known, attitude, material, tolerance=settings.tolerance, sharp=SHARP, measure=True
        )
    except FlybystabError as error:
        return row | {"error": f"{type(error).__name__}: {error}"}, []
    row |= {
        "verdict": main.verdict[0],
        "margin": float(np.rad2deg(main.margin[0])),
        "decided_by": "dynamics" if main.dynamic[0] else "bound",
        "required_friction_at_rest": float(np.rad2deg(main.rest[0])),
        "friction_rise": float(np.rad2deg(_rise(known.phi[0] - main.margin[0], main.rest[0]))),
        "numerical_error": main.numerical,
        "error": main.error[0],
        "assumed": "; ".join(
            (*asteroid.assumptions, *(d for d in known.drawn if d.split(" (")[0] not in asteroid.assumptions))
        ),
        "forces": "; ".join(passage.encounter.forces)
        if passage.encounter
        else "bound on the tide of all bodies",
        **{f"semi_axis_{x}": float(a) for x, a in zip("abc", known.axes[0], strict=True)},
        "density": float(known.rho[0]),
        "spin_period": float(known.period[0]) / 3600.0,
        "samples": 0,
        "samples_dynamic": 0,
    }
    if settings.samples <= 1:
        return row, []
    draw = draws(asteroid, settings.samples, settings.seed, settings.population)
    attitudes = Attitudes.at(asteroid, draw, settings.seed, *where)
    orbits = spread(passage, settings.samples, settings.seed)
    if orbits.passages is None:
        result = judge(passage, draw, attitudes, material, tolerance=settings.tolerance)
    else:
        result = judge_each(orbits.passages, draw, attitudes, material, tolerance=settings.tolerance)
    distances = _distances(passage, orbits, settings.samples)
    counts = Counter(result.verdict)
    judged = settings.samples - counts[""]
    stands = judged - counts[Verdict.NOT_IN_EQUILIBRIUM]
    yielded = sum(counts[v] for v in YIELDED)
    low, high = wilson(yielded, stands)
    row |= {
        "samples": judged,
        "samples_dynamic": int(result.dynamic.sum()),
        **{share_of(v): counts[v] / judged if judged else np.nan for v in VERDICTS},
        "p_yield": yielded / stands if stands else np.nan,
        "p_yield_low": low,
        "p_yield_high": high,
        "distance_sigma": orbits.sigma / 1000.0,
        "contributors": contributors(inputs(draw) | {"distance": distances}, result.margin),
        "drawn": "; ".join((*draw.drawn, *(("orbit",) if orbits.passages else ()))),
        "assumed": "; ".join(filter(None, (row["assumed"], orbits.note))),
    }
    failures = [e for e in result.error if e]
    if failures and not row["error"]:
        row["error"] = f"{len(failures)} samples: {failures[0]}"
    if not settings.keep_samples:
        return row, []
    return row, list(_samples(passage, distances, draw, attitudes, result))


def _distances(passage: Passage, orbits: Spread, samples: int) -> Array:
    """Distance of each sample's passage, m."""
    if orbits.passages is None:
        return np.full(samples, passage.distance)
    return np.array([p.distance for p in orbits.passages])


def _rise(most: float, rest: float) -> float:
    """What a passage adds to the mobilised friction; inf beyond any friction, nan if rest needs that, too."""
    return most - rest if np.isfinite(rest) else np.nan


def _samples(
    passage: Passage, distances: Array, draw: Draws, attitudes: Attitudes, result: Judged
) -> Iterator[dict[str, Any]]:
    for i in range(len(draw.rho)):
        pole = attitudes.pole(i)
        yield {
            "asteroid": passage.asteroid.name,
            "planet": passage.planet,
            "jd_tdb": float(passage.time.tdb.jd),
            "sample": i,
            "distance": float(distances[i]) / AU,
            **{f"semi_axis_{x}": float(a) for x, a in zip("abc", draw.axes[i], strict=True)},
            "density": float(draw.rho[i]),
            "spin_period": float(draw.period[i]) / 3600.0,
            "friction_angle": float(np.rad2deg(draw.phi[i])),
            "cohesion": float(draw.cohesion[i]),
            **{f"pole_{x}": float(n) for x, n in zip("xyz", pole, strict=True)},
            "angle": 360.0 * float(attitudes.uniform[i, 2]),
            "phase": float(draw.phase[i]),
            "verdict": str(result.verdict[i]),
            "margin": float(np.rad2deg(result.margin[i])),
            "decided_by": "dynamics" if result.dynamic[i] else "bound",
            "error": result.error[i],
        }


def _head(asteroid: Asteroid, settings: Settings) -> dict[str, Any]:
    return {
        "asteroid": asteroid.name,
        "number": -1 if asteroid.number is None else asteroid.number,
        "friction_angle": float(np.rad2deg(settings.material.phi)),
        "cohesion": settings.material.c_pa,
        "yield_surface": settings.material.yield_surface,
        "seed": settings.seed,
        "orbit": asteroid.row.get("orbit_solution", ""),
        "catalogue": asteroid.file,
        "ephemeris": ephemeris().name,
        "version": __version__,
    }


def screen_asteroid(
    asteroid: Asteroid, settings: Settings, finder: Finder = passages
) -> dict[str, list[dict[str, Any]]]:
    """All rows of one asteroid: the unit of work. What fails is a row that says why."""
    try:
        found = finder(asteroid, settings)
    except FlybystabError as error:
        return {
            "rows": [_head(asteroid, settings) | {"error": f"{type(error).__name__}: {error}"}],
            "samples": [],
        }
    rows, samples = [], []
    for passage in found:
        row, more = screen_passage(passage, settings)
        rows.append(row)
        samples += more
    return {"rows": rows, "samples": samples}


def _work(
    asteroids: list[Asteroid], settings: Settings, finder: Finder
) -> list[dict[str, list[dict[str, Any]]]]:
    return [screen_asteroid(a, settings, finder) for a in asteroids]
