"""Error against time of a screening: the bound, and the dynamics by tolerance, at several distances.

The same samples of the uncertain inputs encounter the Earth on hyperbolas at 6 km/s. The reference is the integration
of every sample at a step tolerance of 1e-11; errors are those of the margin, where both values are finite and neither
is a bound.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.body.body import Material
from flybystab.catalogues.asteroid import Asteroid
from flybystab.encounter.encounter import Encounter
from flybystab.plots.style import save
from flybystab.screening.draws import Attitudes, draws
from flybystab.screening.encounters import CloseApproach
from flybystab.screening.sample_verdicts import SampleVerdicts, sample_verdicts
from flybystab.typing import Document
from flybystab.units import R_earth

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Periapsis distances, Earth radii.
DISTANCES = (20.0, 6.0, 3.0, 2.0)
#: Step tolerances of the dynamics; the screening's own is 1e-7.
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


def rows(figure: str | Path | None = None, samples: int = 200) -> list[Document]:
    """Rows of distance, setting, fraction decided by the bound, errors, differing verdicts, and time per sample."""
    asteroid = Asteroid.from_catalogue("Anteros")
    draw = draws(asteroid, samples, 1)
    attitudes = Attitudes.at(asteroid, draw, 1, "bench")
    out: list[Document] = []
    for distance in DISTANCES:
        e = Encounter.hyperbolic("earth", periapsis=distance * R_earth, v_inf=6 * u.km / u.s)
        q = e.distance.to_value(u.m)
        approach = CloseApproach(asteroid, "earth", Time(2462000.5, format="jd", scale="tdb"), q, 6000.0, e)

        def run(tolerance: float, quick: bool, approach: CloseApproach = approach) -> SampleVerdicts:
            return sample_verdicts(approach, draw, attitudes, Material(), tolerance=tolerance, quick=quick)

        truth = run(1e-11, False)
        for tolerance, quick in ((1e-7, True), *((t, False) for t in TOLERANCES)):
            start = time.perf_counter()
            found = run(tolerance, quick)
            wall = time.perf_counter() - start
            both = found.dynamic & np.isfinite(found.margin) & np.isfinite(truth.margin)
            error = np.rad2deg(np.abs(found.margin[both] - truth.margin[both]))
            out.append(
                {
                    "periapsis_R_earth": distance,
                    "setting": f"bound, else tol {tolerance:.0e}"
                    if quick
                    else f"dynamics, tol {tolerance:.0e}",
                    "decided_by_bound": 1.0 - float(found.dynamic.mean()),
                    "margin_error_median_deg": float(np.median(error)) if error.size else 0.0,
                    "margin_error_largest_deg": float(error.max()) if error.size else 0.0,
                    "verdicts_that_differ": sum(
                        a != b for a, b in zip(found.verdict, truth.verdict, strict=True)
                    ),
                    "samples": samples,
                    "wall_s_per_sample": wall / samples,
                }
            )
    if figure is not None:
        _plot(out, figure)
    return out


def lines(rows: list[Document]) -> list[str]:
    """The table as text."""
    head = (
        f"{'q (R_E)':>7s}  {'setting':24s} {'by bound':>8s} {'median (deg)':>12s} {'largest (deg)':>13s} "
        f"{'verdicts differ':>15s} {'us/sample':>10s}"
    )
    return [f"{rows[0]['samples']} samples per row; errors of the margin", head] + [
        f"{r['periapsis_R_earth']:7g}  {r['setting']:24s} {r['decided_by_bound']:8.1%} "
        f"{r['margin_error_median_deg']:12.1e} {r['margin_error_largest_deg']:13.1e} "
        f"{r['verdicts_that_differ']:15d} {1e6 * r['wall_s_per_sample']:10.0f}"
        for r in rows
    ]


def _plot(rows: list[Document], path: str | Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    panel: Axes = figure.subplots()
    for distance, marker in zip(DISTANCES, "oxs^", strict=True):
        points = [
            (1e3 * r["wall_s_per_sample"], max(r["margin_error_largest_deg"], 1e-12))
            for r in rows
            if r["periapsis_R_earth"] == distance and "bound" not in r["setting"]
        ]
        panel.loglog(*zip(*points, strict=True), marker=marker, label=f"{distance:g} Earth radii")
    panel.set(xlabel="time per sample (ms)", ylabel="largest error of the margin (deg)", title="Screening")
    panel.legend(frameon=False)
    save(figure, path)
