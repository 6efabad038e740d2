"""Escalation of a flyby from the ellipsoid to grains, where the ellipsoid is inadequate or on request."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import astropy.units as u
import numpy as np

from flybystab.body.body import DENSITY_RANGE, Body
from flybystab.body.pile import Pile, check_grains
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.grains_flyby import SEEDS, grains_flyby, seeds_of
from flybystab.flybys.grains_outcome import GrainsRun
from flybystab.flybys.remnant import final_attitude
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.verdict import Verdict, letter_of
from flybystab.progress import Progressing
from flybystab.typing import Array

#: Verdicts after which the encounter is computed with grains, since the ellipsoid does not determine the outcome.
ESCALATED = (Verdict.BEYOND_MODEL, Verdict.MASS_LOSS, Verdict.DISRUPTED)
#: Number of grains where it is not given.
GRAINS = 500


class Request(NamedTuple):
    """Checked arguments ``grains=``, ``seeds=`` and ``model=`` of ``flyby``."""

    grains: int  #: number of grains; 0 for never
    always: bool
    seeds: list[int]


def request(
    grains: int | str | None, seeds: int | Sequence[int] | None, model: str | None, pile: Pile | None = None
) -> Request:
    """Check ``grains=``, ``seeds=`` and ``model=``; a pile is always simulated as grains, by default with its own seed.

    Raises
    ------
    InvalidInput
    """
    if model not in (None, "ellipsoid", "grains"):
        raise InvalidInput("model", model, "'ellipsoid', 'grains', or None for the first that can answer")
    if pile is not None:
        if grains is not None:
            raise InvalidInput("grains", grains, "None with a Pile, which has its own number of grains")
        if model == "ellipsoid":
            raise InvalidInput("model", model, "'grains' or None for a Pile; pile.body is the ellipsoid")
        if seeds is None:
            return Request(pile.grains, True, [pile.seed])
        numbered = isinstance(seeds, int | np.integer)
        return Request(pile.grains, True, [k + pile.seed if numbered else k for k in seeds_of(seeds)])
    chosen = seeds_of(SEEDS if seeds is None else seeds)
    if grains is None and model != "grains":
        return Request(0, False, chosen)
    if model == "ellipsoid":
        raise InvalidInput("model", model, "no grains= together with model='ellipsoid'")
    if isinstance(grains, str) and grains != "always":
        raise InvalidInput("grains", grains, "a number of grains, or 'always'")
    count = GRAINS if grains is None or isinstance(grains, str) else grains
    return Request(count, model == "grains" or grains == "always", chosen)


def escalated(
    result: FlybyResult,
    body: Body,
    encounter: Encounter,
    rotation: Array,
    asked: Request,
    pile: Pile | None = None,
    progress: Progressing = None,
) -> FlybyResult:
    """The result of the ellipsoid, or that of grains where they are required or requested.

    They are required beyond the largest axis ratio of the ellipsoid, for a loss of mass, and where the material of the
    ellipsoid is out of contact at the end. They are not simulated where the centre of the body reaches the ground.
    """
    if asked.grains == 0:
        return result
    check_grains(body, asked.grains)
    contacts = [name for name, _ in result.events if name in ("contact", "loss of contact")]
    apart = contacts[-1:] == ["loss of contact"]
    needed = result.verdict in ESCALATED or (apart and result.verdict != Verdict.IMPACT)
    if encounter.impact or not (asked.always or needed):
        return result
    outcome = grains_flyby(
        body, encounter, rotation, grains=asked.grains, seeds=asked.seeds, pile=pile, progress=progress
    )
    run, verdict = outcome.median, outcome.verdict
    return result.with_(
        verdict=verdict,
        verdict_class=letter_of(verdict, outcome.largest_fraction),
        bound_fraction=outcome.bound_fraction,
        semi_axes=run.semi_axes,
        spin=run.spin,
        spin_vector=run.spin_vector,
        end_time=run.end_time - encounter.t_start * u.s,
        spin_ratio=run.spin_ratio,
        pole_change=run.pole_change,
        attitude=_attitude(body, run),
        body=_remnant(body, run),
        modelled=outcome.modelled,
        rung="grains",
        grains=outcome,
    )


def _attitude(body: Body, run: GrainsRun) -> Array:
    """Principal axes of the largest clump, as :attr:`FlybyResult.attitude`."""
    vectors = run.axes_directions
    if not np.isfinite(vectors).all():
        return vectors
    shape = vectors @ np.diag(run.semi_axes.to_value(u.m) ** 2) @ vectors.T
    return final_attitude(shape, run.spin_vector.to_value(u.rad / u.s), float(body.omega[2]))


def _remnant(body: Body, run: GrainsRun) -> Body:
    """The largest clump as a body."""
    axes = run.semi_axes.to_value(u.m)
    rho = float(run.largest_fraction * body.rho * np.prod(body.axes) / np.prod(axes))
    return Body(
        semi_axes=run.semi_axes,
        density=rho * u.kg / u.m**3,
        spin=_attitude(body, run).T @ run.spin_vector,
        material=body.material,
        dispersed=not DENSITY_RANGE[0] <= rho <= DENSITY_RANGE[1],
    )
