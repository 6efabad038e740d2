"""One self-contained page about one asteroid and one encounter: figures embedded, nothing loaded from elsewhere."""

from __future__ import annotations

import base64
import html
import io
import os
import platform
import sys
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import Row

from flybystab._version import __version__
from flybystab.catalogues.asteroid import Asteroid
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.spin_sample import SpinSample
from flybystab.io.text import MEANING, angle, contact, known, left_out, modelled
from flybystab.orbit.ephemeris import ephemeris
from flybystab.plots.flyby import BLUE, flyby_panels
from flybystab.plots.scene import scene_plot

#: Packages whose versions belong to the provenance of a number.
PACKAGES = ("numpy", "scipy", "numba", "astropy", "rebound", "jplephem", "skyfield-data")

_STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; color: #1a1a1a; background: #fff; margin: 0 auto;
  max-width: 54rem; padding: 1rem; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: 0.5rem 0; }
h2 { font-size: 1.15rem; margin: 2rem 0 0.5rem; border-bottom: 1px solid #bbb; }
.verdict { border-left: 0.5rem solid #0072B2; background: #eef4f8; padding: 0.75rem 1rem; }
.verdict strong { font-size: 1.3rem; }
figure { margin: 1rem 0; }
figure img { width: 100%; height: auto; display: block; }
figcaption { font-size: 0.9rem; color: #444; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: 0.95rem; }
th, td { text-align: left; vertical-align: top; padding: 0.25rem 0.75rem 0.25rem 0; border-bottom: 1px solid #ddd;
  overflow-wrap: anywhere; }
th { font-weight: 600; width: 38%; }
td.n { font-variant-numeric: tabular-nums; }
.assumed { background: #fdf3c8; padding: 0 0.3em; }
@media print { body { max-width: none; padding: 0; font-size: 10.5pt; } h2 { break-after: avoid; }
  figure, table, .verdict { break-inside: avoid; } a { color: inherit; } }
"""


def report(
    asteroid: Asteroid,
    result: FlybyResult,
    sample: SpinSample,
    path: str | Path,
    *,
    screened: Row | None = None,
    command: str = "",
) -> Path:
    """Write the page; returns its path.

    Parameters
    ----------
    asteroid : Asteroid
    result : FlybyResult
        Of its body, on its real orbit, with history.
    sample : SpinSample
        The same encounter at many attitudes.
    path : str or Path
        The file, ``.html``.
    screened : Row, optional
        Row of :func:`flybystab.screen` for the encounter, with samples of the uncertain inputs.
    command : str
        What made the page, for its provenance.
    """
    encounter = result.encounter
    when = "" if encounter.time is None else encounter.time.tdb.iso[:19] + " TDB"
    planet = encounter.planet.name.capitalize()
    title = f"{asteroid.label} passes {planet if planet != 'Earth' else 'the Earth'}, {when[:10]}"
    parts = [
        f"<h1>{_e(title)}</h1>",
        _verdict(result, sample),
        "<h2>Encounter</h2>",
        _table(_encounter_rows(result, when)),
        "<h2>Margins and error</h2>",
        _table(_margin_rows(result)),
        _figure(_history_picture(result), "History of the encounter", _HISTORY_NOTE),
        "<h2>Attitude at the encounter</h2>",
        _sample_text(sample),
        _figure(_sample_picture(sample), "Change of spin over the sample", _SAMPLE_NOTE),
        _figure(_scene_picture(result), "Path and body", "The planet and the path are to scale."),
    ]
    if screened is not None:
        parts += ["<h2>Uncertain inputs</h2>", _table(_probability_rows(screened))]
    parts += [
        "<h2>The asteroid</h2>",
        _table(_body_rows(asteroid)),
        "<h2>Modelled, and left out</h2>",
        _table(_model_rows(result)),
        "<p>A homogeneous ellipsoid has no necking, no landslides and no local failure of its surface; yield of the "
        "volume average is necessary for the yield of each point, not sufficient. Axis ratios beyond 6:1 are "
        "outside the model.</p>",
        "<h2>Provenance</h2>",
        _table(_provenance_rows(asteroid, sample, command)),
    ]
    page = (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{_e(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body>\n</html>\n"
    )
    target = Path(path)
    part = target.with_name(target.name + ".part")
    part.write_text(page, encoding="utf-8")
    os.replace(part, target)
    return target


_HISTORY_NOTE = (
    "Distance from the planet's centre; friction angle that the stress mobilises against that of the material; spin "
    "rate; semi-axes. Shaded where the body flows."
)
_SAMPLE_NOTE = "Each point is the encounter at another phase of the spin (and pole, where it is not known)."


def _e(text: object) -> str:
    return html.escape(str(text))


def _table(rows: Iterable[tuple[str, str]]) -> str:
    cells = "\n".join(f'<tr><th scope="row">{_e(a)}</th><td class="n">{b}</td></tr>' for a, b in rows)
    return f'<div class="wide"><table>\n{cells}\n</table></div>'


def _figure(picture: str, title: str, note: str) -> str:
    return f'<figure><img src="{picture}" alt="{_e(title)}"><figcaption>{_e(title)}. {_e(note)}</figcaption></figure>'


def _verdict(r: FlybyResult, s: SpinSample) -> str:
    letter = f" (class {r.verdict_class})" if r.verdict_class else ""
    agree = ""
    if r.robust is not None:
        agree = (
            f" All {len(r.verdict_by_surface)} yield surfaces agree."
            if r.robust
            else " It depends on the yield surface: "
            + "; ".join(f"{k}: {v}" for k, v in r.verdict_by_surface.items())
            + "."
        )
    same = int(np.count_nonzero(s.verdict == str(r.verdict)))
    return (
        f'<div class="verdict" id="verdict"><strong>{_e(r.verdict)}{_e(letter)}</strong><br>The body '
        f"{_e(MEANING[str(r.verdict)])}.{_e(agree)} {same} of {len(s)} sampled attitudes give the same verdict.</div>"
    )


def _encounter_rows(r: FlybyResult, when: str) -> list[tuple[str, str]]:
    e = r.encounter
    q = e.distance.to_value(u.km)
    rows = [
        ("planet", _e(e.planet.name.capitalize())),
        ("closest approach", _e(when or "scripted")),
        ("distance between the centres", f"{q:,.1f} km ({q * 1e3 / e.planet.radius:.3f} planet radii)"),
        ("speed there", f"{e.v_periapsis.to_value(u.km / u.s):.4f} km/s"),
        ("speed far away, v_inf", f"{e.v_inf.to_value(u.km / u.s):.4f} km/s"),
    ]  # fmt: skip
    if e.distance_error is not None and e.time_error is not None:
        rows.append(
            (
                "numerical error",
                f"{e.distance_error.to_value(u.km):.1g} km, {e.time_error.to_value(u.s):.1g} s; the uncertainty of the "
                "orbit itself is not in it",
            )
        )
        rows.append(("how well the encounter is known", _e(known(e))))
    if e.impact:
        rows.append(("impact", f"reaches the {_e(e.impact_level)}"))
    if r.contact is not None:
        rows.append(("contact", _e(contact(r))))
    return rows


def _margin_rows(r: FlybyResult) -> list[tuple[str, str]]:
    m = r.body.material
    rows = [
        (
            "friction angle of the material",
            f"{m.friction_angle.to_value(u.deg):g} deg (a choice, not measured)",
        ),
        ("cohesion", f"{m.cohesion.to_value(u.Pa):g} Pa"),
        ("largest friction angle mobilised", _e(angle(r.max_required_friction_angle))),
        ("margin", _e(angle(r.margin))),
        ("spin rate afterwards over before", f"{r.spin_ratio:.4f}"),
        ("change of the pole", f"{r.pole_change.to_value(u.deg):.2f} deg"),
        ("bound share of the mass", f"{r.bound_fraction:.1%}"),
        ("semi-axes afterwards", " × ".join(f"{a:.4g}" for a in r.semi_axes.to_value(u.m)) + " m"),
    ]
    if r.required_cohesion > 0 * u.Pa:
        rows.append(("cohesion that would hold the body", f"{r.required_cohesion.to_value(u.Pa):.3g} Pa"))
    if r.onset_time is not None:
        rows.append(("first yield after the start", f"{r.onset_time.to_value(u.h):.3f} h"))
    if r.error is not None:
        rows.append(
            (
                "measured numerical error",
                f"semi-axes {r.error.semi_axes:.1e}, spin {r.error.spin:.1e} (relative), friction angle "
                f"{r.error.required_friction_angle.to_value(u.deg):.1e} deg, tide {r.error.tide:.1e} (relative)",
            )
        )
    return rows


def _sample_text(s: SpinSample) -> str:
    low, mid, high = np.quantile(s.spin_ratio, [0.0, 0.5, 1.0])
    turn = np.quantile(s.pole_change.to_value(u.deg), [0.0, 0.5, 1.0])
    phi = np.quantile(s.max_required_friction_angle.to_value(u.deg), [0.0, 1.0])
    known = (
        "the catalogued pole and unknown phases" if s.pole_known else "an unknown pole (isotropic) and phase"
    )
    return (
        f"<p>{len(s)} attitudes, with {known}: the spin rate changes by a factor of {low:.2f} to {high:.2f} (median "
        f"{mid:.2f}), the pole moves by {turn[0]:.1f} to {turn[2]:.1f} deg (median {turn[1]:.1f}), and "
        f"{phi[0]:.2f} to {phi[1]:.2f} deg of friction are mobilised.</p>"
    )


def _probability_rows(row: Row) -> list[tuple[str, str]]:
    return [
        ("samples", f"{int(row['samples'])} ({int(row['samples_dynamic'])} by the dynamics, the rest by a bound)"),
        (
            "probability of yielding",
            f"{float(row['p_yield']):.3g} (95 % interval {float(row['p_yield_low']):.2g} to "
            f"{float(row['p_yield_high']):.2g}), among bodies that can exist on their own",
        ),
        ("not in equilibrium", f"{float(row['p_not_in_equilibrium']):.3g} of the samples"),
        ("drawn from distributions", _e(row["drawn"])),
        ("what the margin follows (rank correlation)", _e(row["contributors"])),
    ]  # fmt: skip


def _body_rows(a: Asteroid) -> list[tuple[str, str]]:
    assumed = a.assumed
    names = {
        "semi_axis_a_m": "long semi-axis", "semi_axis_b_m": "middle semi-axis", "semi_axis_c_m": "short semi-axis",
        "density_kg_m3": "density", "spin_period_h": "spin period", "precession_period_h": "precession period",
        "rotation_period_h": "rotation period",
    }  # fmt: skip
    rows = []
    for column, name in names.items():
        if a.knows(column):
            value = a.quantity(column)
            mark = ' <span class="assumed">assumed</span>' if column in assumed else ""
            unit = _e(value.unit).replace(" / ", "/")
            rows.append(
                (name, f"{value.value:{'.4g' if column.startswith('semi_axis') else 'g'}} {unit}{mark}")
            )
    rows += [(f"source of {k.replace('_', ' ')}", _e(v)) for k, v in a.sources.items() if k in _SHOWN]
    if a.assumptions:
        rows.append(("not measured", _e("; ".join(a.assumptions))))
    return rows


_SHOWN = ("semi_axes", "spin", "pole", "tumbling", "density", "orbit")


def _model_rows(r: FlybyResult) -> list[tuple[str, str]]:
    rows = [(name, _e(what)) for name, what in modelled(r).items()]
    return [*rows, ("left out, with the largest share", _e(left_out(r, 6)) or "nothing")]


def _provenance_rows(a: Asteroid, s: SpinSample, command: str) -> list[tuple[str, str]]:
    versions = []
    for name in PACKAGES:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            continue
    rows = [
        ("flybystab", _e(__version__)),
        ("made", datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")),
        ("orbit solution", _e(a.row.get("orbit_solution", ""))),
        ("catalogue", _e(a.file)),
        ("ephemeris", _e(ephemeris().name.upper())),
        ("seed of the attitudes", str(s.seed)),
        (
            "Python and packages",
            _e(f"Python {platform.python_version()} ({sys.platform}); " + ", ".join(versions)),
        ),
    ]
    if command:
        rows.insert(1, ("command", f"<code>{_e(command)}</code>"))
    return rows


def _embedded(figure: Any) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="svg")
    return "data:image/svg+xml;base64," + base64.b64encode(stream.getvalue()).decode()


def _blank(width: float, height: float) -> Any:
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasSVG(figure)
    return figure


def _history_picture(r: FlybyResult) -> str:
    figure = _blank(7.2, 8.0)
    flyby_panels(figure.subplots(4, 1, sharex=True), r)
    return _embedded(figure)


def _scene_picture(r: FlybyResult) -> str:
    figure = _blank(7.2, 3.2)
    scene_plot(figure.add_subplot(projection="3d"), r)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130)  # thousands of facets: smaller as pixels
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def _sample_picture(s: SpinSample) -> str:
    figure = _blank(6.4, 3.6)
    sample_plot(figure.subplots(), s)
    return _embedded(figure)


def sample_plot(axes: Any, sample: SpinSample) -> Any:
    """Change of the pole against the change of the spin rate, a point for each attitude."""
    axes.plot(
        sample.spin_ratio, sample.pole_change.to_value(u.deg), "o", ms=4, color=BLUE, mec="white", mew=0.4
    )
    axes.axvline(1.0, color="0.5", lw=0.8, ls="--")
    axes.set_xlabel("spin rate after over before")
    axes.set_ylabel("change of the pole (deg)")
    axes.set_ylim(bottom=0.0)
    return axes
