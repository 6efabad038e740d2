"""Slopes of a shape, at rest and through an encounter, as text and as parts of documents."""

from __future__ import annotations

import astropy.units as u
import numpy as np

from flybystab.body.surface_history import SurfaceHistory
from flybystab.body.surface_slope import SurfaceSlopes
from flybystab.typing import Document

#: Angle of repose for which area fractions are given.
REPOSE = 35 * u.deg
#: Increases of the slope (deg) for which area fractions are given.
RISES = (0.5, 1.0, 2.0)


def surface_rows(surface: SurfaceHistory) -> list[tuple[str, str]]:
    """Labels and values for the slopes of a surface through an encounter."""
    before = surface.slope[0].to_value(u.deg)
    pressing = -surface.outward.value
    shape = surface.shape
    least = pressing.min(axis=1)[[0, surface.closest, -1]]
    rises = ", ".join(f"{x:g} deg {_percent(surface.share_refreshed(rise=x * u.deg))}" for x in RISES)
    angle = f"{REPOSE.value:g} deg"
    return [
        ("shape", f"{len(shape.facets)} facets, mean radius {shape.mean_radius.value:.4g} m"),
        ("slopes before", _slopes(before, shape.facet_area.value)),
        (
            "largest change of slope",
            f"+{surface.rise.max().value:.2f} deg, -{surface.fall.max().value:.2f} deg",
        ),
        ("area whose slope rises by more than", rises),
        (
            f"area steeper than {angle}",
            f"{_percent(surface.share_past(REPOSE)[0])} before, {_percent(surface.share_past(REPOSE).max())} at most; "
            f"{_percent(surface.share_refreshed(repose=REPOSE))} exceeds it for the first time",
        ),
        (
            "least normal acceleration",
            f"{least[0]:.3g} m/s2 before, {least[1]:.3g} at closest approach, {least[2]:.3g} after",
        ),
        ("area lifted off", _percent(surface.share_lifted.max())),
    ]


def surface_lines(surface: SurfaceHistory) -> list[str]:
    """The same for the printed result of a flyby."""
    rows = dict(surface_rows(surface))
    return [
        f"shape      {rows.pop('shape')}",
        *(f"surface    {name}: {value}" for name, value in rows.items()),
    ]


def surface_document(surface: SurfaceHistory) -> Document:
    """The same for a JSON document."""
    past = surface.share_past(REPOSE)
    return {
        "facets": len(surface.shape.facets),
        "volume_m3": float(surface.shape.volume.value),
        "slope_before_deg": _quantiles(surface.slope[0].value, surface.shape.facet_area.value),
        "largest_rise_deg": float(surface.rise.max().value),
        "largest_fall_deg": float(surface.fall.max().value),
        "share_rising_by_deg": {f"{x:g}": surface.share_refreshed(rise=x * u.deg) for x in RISES},
        "repose_deg": float(REPOSE.value),
        "share_past_repose": {"before": past[0], "most": past.max(), "after": past[-1]},
        "share_first_past_repose": surface.share_refreshed(repose=REPOSE),
        "share_lifted": float(surface.share_lifted.max()),
        "least_normal_acceleration_m_s2": float((-surface.outward.value).min()),
    }


def extra(surface: SurfaceHistory | None) -> Document:
    """Entries for the surface in the document of a flyby; empty without a surface."""
    return {} if surface is None else {"surface": surface_document(surface)}


def slopes_text(slopes: SurfaceSlopes) -> str:
    """Slopes at one instant as text."""
    past = _percent(slopes.share_above(REPOSE))
    lifted = _percent(slopes.share_above(90 * u.deg))
    return (
        f"{_slopes(slopes.slope.value, slopes.area.value)}; {past} of the area above {REPOSE.value:g} deg, "
        f"{lifted} lifted off"
    )


def slopes_document(slopes: SurfaceSlopes) -> Document:
    """Slopes at one instant for a JSON document."""
    return {
        "facets": len(slopes.slope),
        "slope_deg": _quantiles(slopes.slope.value, slopes.area.value),
        "repose_deg": float(REPOSE.value),
        "share_past_repose": slopes.share_above(REPOSE),
        "share_lifted": slopes.share_above(90 * u.deg),
    }


def _quantiles(slope: np.ndarray, area: np.ndarray) -> dict[str, float]:
    """Area-weighted median and maximum of the slope."""
    order = np.argsort(slope)
    fraction = np.cumsum(area[order]) / area.sum()
    return {"median": float(slope[order][np.searchsorted(fraction, 0.5)]), "most": float(slope.max())}


def _slopes(slope: np.ndarray, area: np.ndarray) -> str:
    found = _quantiles(slope, area)
    return f"median {found['median']:.1f} deg, at most {found['most']:.1f} deg"


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.2g} %"
