"""Rows of a screening: one per encounter, for the catalogue body and its samples, and one per sample."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flybystab._version import __version__
from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import AU
from flybystab.errors import FlybystabError
from flybystab.flybys.verdict import Verdict
from flybystab.orbit.ephemeris import ephemeris
from flybystab.screening.clones import OrbitSampling
from flybystab.screening.columns import VERDICTS, YIELDED, share_of
from flybystab.screening.draws import Attitudes, Draws, free_rotation, nominal
from flybystab.screening.encounters import CloseApproach
from flybystab.screening.sample_verdicts import (
    SampleVerdicts,
    Tally,
    contributors,
    friction_at_rest,
    inputs,
    sample_verdicts,
    wilson,
)
from flybystab.screening.settings import Settings
from flybystab.typing import Document

#: Values by column; omitted columns are empty.
Row = Document

#: The catalogue body is integrated if the bound on its friction angle exceeds the value at rest by more than this, rad.
SHARP = float(np.radians(0.01))


def failed_row(asteroid: Asteroid, settings: Settings, error: Exception) -> Row:
    """Row of an asteroid that could not be computed."""
    return _head(asteroid, settings) | {"error": f"{type(error).__name__}: {error}"}


def body_row(approach: CloseApproach, settings: Settings) -> Row:
    """Row of an encounter for the catalogue body; without a verdict where it could not be computed."""
    asteroid, material = approach.asteroid, settings.material
    row = _head(asteroid, settings) | {
        "planet": approach.planet,
        "time_tdb": approach.time.tdb.isot,
        "jd_tdb": float(approach.time.tdb.jd),
        "distance": approach.distance / AU,
        "v_inf": approach.v_inf / 1000.0,
    }
    try:
        attitude = catalogue_body(approach, settings)
        known = attitude.draws
        rest = float(friction_at_rest(free_rotation(asteroid, known), material).max())
        main = sample_verdicts(
            approach, known, attitude, material, tolerance=settings.tolerance, sharp=SHARP, measure=True
        )
    except FlybystabError as error:
        return row | {"error": f"{type(error).__name__}: {error}"}
    return row | {
        "verdict": main.verdict[0],
        "margin": float(np.rad2deg(main.margin[0])),
        "decided_by": "dynamics" if main.dynamic[0] else "bound",
        "required_friction_at_rest": float(np.rad2deg(rest)),
        "friction_rise": float(np.rad2deg(_rise(known.phi[0] - main.margin[0], rest))),
        "numerical_error": main.numerical,
        "error": main.error[0],
        "assumed": "; ".join(
            (*asteroid.assumptions, *(d for d in known.drawn if d.split(" (")[0] not in asteroid.assumptions))
        ),
        "forces": "; ".join(approach.encounter.forces)
        if approach.encounter
        else "bound on the tide of all bodies",
        **{f"semi_axis_{x}": float(a) for x, a in zip("abc", known.axes[0], strict=True)},
        "density": float(known.rho[0]),
        "spin_period": float(known.period[0]) / 3600.0,
        "samples": 0,
        "samples_dynamic": 0,
        "samples_grains": 0,
    }


def catalogue_body(approach: CloseApproach, settings: Settings) -> Attitudes:
    """The catalogue body with its attitude."""
    asteroid = approach.asteroid
    known = nominal(asteroid, settings.material, settings.population)
    return Attitudes.at(asteroid, known, settings.seed, "nominal", *approach.key)


def sampled_row(row: Row, orbits: OrbitSampling, tally: Tally, draw: Draws, result: SampleVerdicts) -> Row:
    """The row of the catalogue body completed by the statistics of the samples.

    Parameters
    ----------
    row : dict
    orbits : OrbitSampling
    tally : Tally
        Of all samples.
    draw : Draws
        The first samples, `RANKED` at most.
    result : SampleVerdicts
        Verdicts on at least these samples, and on all samples where each has its own orbit.
    """
    counts = tally.verdicts
    judged = tally.samples - counts[""]
    stands = judged - counts[Verdict.NOT_IN_EQUILIBRIUM]
    yielded = sum(counts[v] for v in YIELDED)
    low, high = wilson(yielded, stands)
    sigma = orbits.sigma
    ranked = len(draw.rho)
    if orbits.clones is not None and np.isnan(sigma):
        sigma = orbits.clones.sigma(result.distance)
    row = row | {
        "samples": judged,
        "samples_dynamic": tally.dynamic,
        "samples_grains": tally.grains,
        **{share_of(v): counts[v] / judged if judged else np.nan for v in VERDICTS},
        "p_yield": yielded / stands if stands else np.nan,
        "p_yield_low": low,
        "p_yield_high": high,
        "distance_sigma": sigma / 1000.0,
        "contributors": contributors(
            inputs(draw) | {"distance": result.distance[:ranked]}, result.margin[:ranked]
        ),
        "drawn": "; ".join((*draw.drawn, *(("orbit",) if orbits.clones else ()))),
        "assumed": "; ".join(filter(None, (row["assumed"], orbits.note))),
    }
    if tally.error and not row["error"]:
        row["error"] = f"{tally.failed} samples: {tally.error}"
    return row


def _rise(most: float, rest: float) -> float:
    """Mobilised friction added by an encounter; inf if no friction suffices, nan if none suffices at rest either."""
    return max(most - rest, 0.0) if np.isfinite(rest) else np.nan


def sample_rows(approach: CloseApproach, attitudes: Attitudes, result: SampleVerdicts) -> Iterator[Row]:
    """Rows of the samples of one encounter."""
    draw, poles = attitudes.draws, attitudes.poles
    for i in range(len(draw.rho)):
        pole = poles[i]
        yield {
            "asteroid": approach.asteroid.name,
            "planet": approach.planet,
            "jd_tdb": float(approach.time.tdb.jd),
            "sample": i,
            "distance": float(result.distance[i]) / AU,
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
            "decided_by": "grains" if result.grains[i] else "dynamics" if result.dynamic[i] else "bound",
            "largest_fraction": float(result.largest[i]),
            "error": result.error[i],
        }


def _head(asteroid: Asteroid, settings: Settings) -> Row:
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
