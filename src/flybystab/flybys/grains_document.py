"""Outcomes of grains as plain JSON."""

from __future__ import annotations

import astropy.units as u

from flybystab.flybys.grains_outcome import GrainsOutcome


def grains_document(outcome: GrainsOutcome | None) -> dict[str, object] | None:
    """The distribution, the runs and the fragments."""
    if outcome is None:
        return None
    errors = outcome.resolution_errors
    return {
        "verdict": str(outcome.verdict),
        "probabilities": {
            str(v): {"share": p, "low": a, "high": b} for v, (p, a, b) in outcome.probabilities().items()
        },
        "largest_fraction": outcome.largest_fraction,
        "bound_fraction": outcome.bound_fraction,
        "resolution_errors": {
            "largest_fraction": errors.largest_fraction,
            "stretch": errors.stretch,
        },
        "runs": [
            {
                "seed": r.seed,
                "verdict": str(r.verdict),
                "largest_fraction": r.largest_fraction,
                "bound_fraction": r.bound_fraction,
                "ground_fraction": r.ground_fraction,
                "semi_axes_m": r.semi_axes.to_value(u.m),
                "spin_rad_s": r.spin.to_value(u.rad / u.s),
                "settled": r.settled,
                "end_time_from_periapsis_s": r.end_time.to_value(u.s),
                "wall_time_s": r.wall_time.to_value(u.s),
            }
            for r in outcome.runs
        ],
        "fragments": [
            {
                "seed": row["seed"],
                "mass_fraction": row["mass_fraction"],
                "semi_axes_m": row["semi_axes"].to_value(u.m),
                "spin_rad_s": row["spin"].to_value(u.rad / u.s),
                "position_m": row["position"].to_value(u.m),
                "velocity_m_s": row["velocity"].to_value(u.m / u.s),
                "bound_to": row["bound_to"],
                "a_m": row["a"].to_value(u.m),
                "e": row["e"],
            }
            for row in outcome.fragments
        ],
        "wall_time_s": outcome.wall_time.to_value(u.s),
    }
