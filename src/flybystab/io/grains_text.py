"""Outcomes of grains as text for the terminal."""

from __future__ import annotations

import astropy.units as u
import numpy as np

from flybystab.flybys.grains_outcome import piles_of
from flybystab.flybys.result import FlybyResult


def grains_lines(r: FlybyResult, most: int = 6) -> list[str]:
    """Outcomes of the piles, and the fragments of the median pile; empty for a result without grains."""
    if r.grains is None:
        return []
    low, high = r.grains.largest_range
    out = [
        f"grains     {piles_of(len(r.grains.runs))}: "
        + ", ".join(f"{v} {p:.0%} ({a:.0%} to {b:.0%})" for v, (p, a, b) in r.grains.probabilities().items()),
        f"           largest clump {r.largest_fraction:.1%} of the mass ({low:.1%} to {high:.1%}); "
        f"computed in {r.grains.wall_time.to_value(u.s):.1f} s",
    ]
    run, errors = r.grains.median, r.grains.resolution_errors
    stretch = (
        ""
        if np.isnan(errors.stretch)
        else f", of the stretch {run.stretch:.2f} of its long axis {errors.stretch:.2f}"
    )
    out.append(
        f"           error from the number of grains ({len(run.radius)}): of the largest clump "
        f"{errors.largest_fraction:.1%} of the mass{stretch}"
    )
    for k, row in enumerate(run.fragments[:most]):
        a = row["semi_axes"].to_value(u.m)
        rate = float(np.linalg.norm(row["spin"].to_value(u.rad / u.h)))
        orbit = ""
        if k:
            orbit = ", escapes"
            if row["bound_to"] >= 0:
                orbit = (
                    f", bound to {row['bound_to'] + 1}: a {row['a'].to_value(u.km):.3g} km, e {row['e']:.2f}"
                )
        head = f"pile {run.seed}" if k == 0 else ""
        period = f"{2.0 * np.pi / rate:.3g} h" if rate > 0.0 else "no spin"
        out.append(
            f"{head:10s} {k + 1}: {row['mass_fraction']:.1%}, {a[0]:.4g} x {a[1]:.4g} x {a[2]:.4g} m, {period}{orbit}"
        )
    if len(run.fragments) > most:
        out.append(f"           and {len(run.fragments) - most} smaller ones")
    return out
