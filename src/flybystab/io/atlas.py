"""Atlas of a screening: a static web site with a list of all encounters and a page for each.

The site can be opened from disk: style sheet and script are files beside the pages, and nothing is loaded from the
network. Without scripts the list is complete; the script adds search, filters and sorting. Templates:
``templates/atlas``.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import unicodedata
from importlib import resources
from pathlib import Path

import astropy.units as u
import jinja2
import numpy as np
from astropy.table import QTable, Row
from astropy.time import Time

from flybystab._version import __version__
from flybystab.arguments import check_arguments
from flybystab.errors import InvalidInput
from flybystab.flybys.document import plain, table_document
from flybystab.flybys.verdict import Verdict
from flybystab.io.text import MEANING
from flybystab.progress import Progressing, progress_bar
from flybystab.saving import csv_text
from flybystab.screening.columns import VERDICTS, share_of
from flybystab.screening.results import read_results
from flybystab.screening.tables import write_table
from flybystab.typing import Document
from flybystab.units import number_of

#: Columns of the list, and whether they are numeric.
COLUMNS = (
    ("Asteroid", False),
    ("Date (TDB)", False),
    ("Planet", False),
    ("Distance (km)", True),
    ("v_inf (km/s)", True),
    ("P(intact)", True),
    ("Verdict", False),
    ("P(yield)", True),
    ("Margin (deg)", True),
)
#: Colour of each verdict (Okabe & Ito); verdicts are also printed as text.
COLOURS = {
    Verdict.INTACT: "#009E73",
    Verdict.RESHAPED: "#F0E442",
    Verdict.MASS_LOSS: "#E69F00",
    Verdict.DISRUPTED: "#D55E00",
    Verdict.IMPACT: "#000000",
    Verdict.BEYOND_MODEL: "#CC79A7",
    Verdict.NOT_IN_EQUILIBRIUM: "#999999",
}
#: File that identifies a folder as an atlas, which may be replaced.
MARK = "encounters.json"
_FILES = ("atlas.css", "atlas.js")


@check_arguments
def atlas(
    results: QTable | str | Path,
    folder: str | Path,
    *,
    title: str = "",
    overwrite: bool = False,
    progress: Progressing = None,
) -> Path:
    """Write the atlas of a screening into a folder; returns the path of its ``index.html``.

    Parameters
    ----------
    results : QTable, str or Path
        Table of encounters of :func:`flybystab.screen`, or its file.
    folder : str or Path
        New or empty folder.
    title : str, optional
        Heading of the list.
    overwrite : bool
        Replace an existing atlas.
    progress : bool or function, optional
        Progress bar (:mod:`flybystab.progress`); by default after two seconds on a terminal.

    Raises
    ------
    InvalidInput
        The folder contains other files, the file cannot be read, or the table is not a table of encounters or is
        empty.
    """
    table = results if isinstance(results, QTable) else read_results(results)
    missing = [
        name
        for name in ("asteroid", "planet", "time_tdb", "verdict", "p_yield")
        if name not in table.colnames
    ]
    if missing:
        raise InvalidInput(
            "results", ", ".join(table.colnames[:5]), f"a table of encounters with {', '.join(missing)}"
        )
    if not len(table):
        raise InvalidInput("results", "no encounters", "a table with at least one row")
    table = table[np.argsort(np.nan_to_num(table["jd_tdb"].to_value(u.d), nan=np.inf), kind="stable")]
    place = _empty_folder(Path(folder), overwrite)
    entries = [_entry(table[k], k) for k in range(len(table))]
    by_name: dict[str, list[Document]] = {}
    for entry in entries:
        by_name.setdefault(entry["label"], []).append(entry)
    document = table_document(table)
    pages = _templates()
    (place / "encounters").mkdir()
    page = pages.get_template("encounter.html")
    with progress_bar(progress, len(entries), "pages", "atlas") as tick:
        for number, (entry, row) in enumerate(zip(entries, document["rows"], strict=True)):
            own = by_name[entry["label"]]
            k = own.index(entry)
            text = page.render(
                e=entry,
                earlier=own[k - 1] if k else None,
                later=own[k + 1] if k + 1 < len(own) else None,
                others=[o for o in own if o is not entry],
            )
            (place / "encounters" / entry["file"]).write_text(text, encoding="utf-8")
            one = {**document, "rows": [row]}
            (place / "encounters" / entry["data"]).write_text(json.dumps(one, indent=1), encoding="utf-8")
            tick(number + 1)
    (place / "index.html").write_text(_index(pages, table, entries, title), encoding="utf-8")
    for name in _FILES:
        shutil.copyfile(
            str(resources.files("flybystab.io").joinpath("templates", "atlas", name)), place / name
        )
    (place / "encounters.csv").write_text(_csv(document["rows"]), encoding="utf-8", newline="")
    write_table(table, place / "encounters.ecsv")
    (place / MARK).write_text(json.dumps(document), encoding="utf-8")
    return place / "index.html"


def check_folder(place: Path, overwrite: bool) -> None:
    """Check, before any computation, that an atlas can be written into a folder.

    Raises
    ------
    InvalidInput
        The path is not a folder, or the folder contains other files or an atlas that must not be replaced.
    """
    if place.is_symlink() or (place.exists() and not place.is_dir()):
        raise InvalidInput("folder", str(place), "a folder")
    if place.exists() and any(place.iterdir()):
        if not (place / MARK).is_file() or not (place / "index.html").is_file():
            raise InvalidInput("folder", str(place), "a new or empty folder: this one contains other files")
        if not overwrite:
            raise InvalidInput(
                "folder", str(place), "a new folder; overwrite=True (--overwrite) replaces this atlas"
            )


def _empty_folder(place: Path, overwrite: bool) -> Path:
    """The folder, created or emptied."""
    check_folder(place, overwrite)
    shutil.rmtree(place / "encounters", ignore_errors=True)
    for name in ("index.html", MARK, "encounters.csv", "encounters.ecsv", *_FILES):
        (place / name).unlink(missing_ok=True)
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("folder", str(place), f"a folder that can be written ({error.strerror})") from None
    return place


def _templates() -> jinja2.Environment:
    """Environment of the templates, with autoescaping."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("flybystab.io", "templates/atlas"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )


def _index(pages: jinja2.Environment, table: QTable, entries: list[Document], title: str) -> str:
    dates = [e["date"] for e in entries if e["date"]]
    asteroids = len({e["label"] for e in entries})
    settings = table.meta.get("settings", {})
    settings = settings if isinstance(settings, dict) else {}
    span = _span(settings, dates)
    summary = (
        f"{number_of(len(entries), 'encounter')} of {number_of(asteroids, 'asteroid')}, {span}. P(intact) is the "
        "fraction of INTACT among all samples of the uncertain inputs, P(yield) the fraction that yields or reaches "
        "the planet among the samples in equilibrium before the encounter. The verdict applies to the catalogue values "
        "and the chosen material."
    )
    return pages.get_template("index.html").render(
        title=title or f"Encounters of asteroids, {span}",
        summary=summary,
        planets=sorted({e["planet"] for e in entries}),
        verdicts=[str(v) for v in VERDICTS if any(e["verdict"] == str(v) for e in entries)],
        first=dates[0] if dates else "",
        last=dates[-1] if dates else "",
        columns=COLUMNS,
        entries=entries,
        provenance=[
            ("flybystab", str(settings.get("flybystab", __version__))),
            *((k.replace("_", " "), _plain_text(settings[k])) for k in settings if k != "flybystab"),
            *(
                (name.replace("_", " "), _plain_text(table.meta[name]))
                for name in ("catalogue", "ephemeris", "time_scale", "frame", "nominal")
                if name in table.meta
            ),
        ],
    )


def _span(settings: Document, dates: list[str]) -> str:
    """Interval that was screened, or else that of the encounters."""
    try:
        first, last = (
            str(Time(float(settings[f"{end}_jd_tdb"]), format="jd", scale="tdb").iso[:10])
            for end in ("start", "stop")
        )
    except (KeyError, TypeError, ValueError):
        return f"{dates[0]} to {dates[-1]}" if dates else "no dates"
    return f"{first} to {last}"


def _plain_text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(plain(value), ensure_ascii=False)


def _entry(row: Row, position: int) -> Document:
    """All values of one encounter shown on the pages."""
    name, verdict = str(row["asteroid"]), str(row["verdict"])
    when = str(row["time_tdb"])[:16].replace("T", " ")
    planet = str(row["planet"]).capitalize()
    distance, speed = _number(row["distance"], u.km), _number(row["v_inf"], u.km / u.s)
    margin, probability = _number(row["margin"], u.deg), _number(row["p_yield"])
    intact = _number(row[share_of(Verdict.INTACT)])
    slug = re.sub(
        r"[^a-z0-9]+", "-", unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    )
    file = f"{position:05d}-{slug.strip('-')[:40] or 'asteroid'}-{when[:10] or 'undated'}"
    number = int(row["number"]) if "number" in row.colnames else -1
    shares = [(str(v), float(row[share_of(v)]), COLOURS[v]) for v in VERDICTS if _number(row[share_of(v)])]
    entry: Document = {
        "label": name,
        "text": f"{name} {number if number >= 0 else ''} {planet} {verdict}".lower(),
        "planet": planet,
        "verdict": verdict,
        "colour": COLOURS.get(Verdict(verdict), "#888") if verdict else "#888",
        "date": when[:10],
        "when": when or "unknown",
        "short": f"{when[:10]}, {planet}",
        "jd": _number(row["jd_tdb"], u.d) or "",
        "distance_km": distance,
        "distance_text": "" if distance is None else f"{distance:,.0f}",
        "v_inf": speed,
        "v_inf_text": "" if speed is None else f"{speed:.2f}",
        "intact": intact,
        "intact_text": "" if intact is None else f"{intact:.3g}",
        "probability": probability,
        "probability_text": "" if probability is None else f"{probability:.3g}",
        "margin": margin,
        "margin_text": _margin_text(row, margin, verdict),
        "page": f"encounters/{file}.html",
        "file": f"{file}.html",
        "data": f"{file}.json",
        "title": f"{name} passes {planet if planet != 'Earth' else 'the Earth'}, {when[:10] or 'date unknown'}",
        "shares": shares,
        "shares_text": ", ".join(f"{v}: {share:.3g}" for v, share, _ in shares),
    }
    entry["headline"], entry["explanation"] = _headline(row, verdict, probability)
    entry["sections"] = _sections(row, distance, speed)
    return entry


def _number(value: u.Quantity | float, unit: u.UnitBase | None = None) -> float | None:
    """A finite number in a unit; None otherwise."""
    number = (
        float(value.to_value(unit)) if unit is not None and isinstance(value, u.Quantity) else float(value)
    )
    return number if math.isfinite(number) else None


def _margin_text(row: Row, margin: float | None, verdict: str) -> str:
    if margin is None:
        return "none suffices" if verdict and float(row["margin"].value) == -np.inf else ""
    if verdict == Verdict.NOT_IN_EQUILIBRIUM:  # a margin is not defined
        return ""
    return ("≥ " if str(row["decided_by"]) == "bound" else "") + f"{margin:.2f}"


def _headline(row: Row, verdict: str, probability: float | None) -> tuple[str, str]:
    """Headline and explanation: the probability of yielding if inputs were sampled, and the nominal verdict."""
    if not verdict:
        return "not computed", str(row["error"])
    nominal = f"With the catalogue values and the chosen material the body {MEANING[verdict]}."
    assumed = str(row["assumed"])
    if assumed:
        nominal += f" Assumed, not measured: {assumed}."
    if probability is None:
        return verdict, nominal
    low, high = float(row["p_yield_low"]), float(row["p_yield_high"])
    value = f"{probability:.3g}" if probability > 0.0 else f"below {high:.2g}"
    return (
        f"probability of yielding {value}",
        f"95 % interval {low:.2g} to {high:.2g}, from {int(row['samples'])} samples of the uncertain inputs, among "
        f"bodies in equilibrium before the encounter. Nominal verdict: {verdict}. {nominal}",
    )


def _sections(
    row: Row, distance: float | None, speed: float | None
) -> list[tuple[str, list[tuple[str, str]]]]:
    """Facts by heading; unknown values are omitted."""

    def text(column: str, unit: u.UnitBase | None = None, form: str = ".4g", suffix: str = "") -> str:
        number = _number(row[column], unit)
        return "" if number is None else f"{number:{form}}{suffix}"

    axes = [text(f"semi_axis_{x}", u.m) for x in "abc"]
    encounter = [
        ("distance of the centres", "" if distance is None else f"{distance:,.1f} km"),
        ("1-sigma of the distance", text("distance_sigma", u.km, ".3g", " km")),
        ("hyperbolic excess speed", "" if speed is None else f"{speed:.3f} km/s"),
        ("closest approach", str(row["time_tdb"]) + (" TDB" if str(row["time_tdb"]) else "")),
        ("orbit solution", str(row["orbit"])),
        *_forces(str(row["forces"])),
    ]
    body = [
        ("semi-axes", " × ".join(axes) + " m" if all(axes) else ""),
        ("bulk density", text("density", u.kg / u.m**3, ".4g", " kg/m³")),
        ("spin period", text("spin_period", u.h, ".4g", " h")),
        ("friction angle", text("friction_angle", u.deg, "g", " deg")),
        ("cohesion", text("cohesion", u.Pa, "g", " Pa")),
        ("yield surface", str(row["yield_surface"])),
        ("assumed, not measured", str(row["assumed"])),
        ("drawn from priors in the samples", str(row["drawn"])),
    ]
    stability = [
        ("decided by", str(row["decided_by"])),
        ("margin", _margin_text(row, _number(row["margin"], u.deg), str(row["verdict"])) + " deg"),
        ("mobilised friction at rest", text("required_friction_at_rest", u.deg, ".2f", " deg")),
        ("increase by the encounter", text("friction_rise", u.deg, ".3g", " deg")),
        ("numerical error of the angle", text("numerical_error", u.deg, ".1e", " deg")),
        ("margin most sensitive to (Spearman rho)", str(row["contributors"])),
    ]
    sections = [("Encounter", encounter), ("Body", body), ("Stability", stability if row["verdict"] else [])]
    return [(name, [f for f in facts if f[1].strip(" deg,")]) for name, facts in sections if facts]


def _forces(text: str) -> list[tuple[str, str]]:
    """Forces on the orbit and sources of the tide, each as one entry."""
    groups: dict[str, list[str]] = {}
    for part in filter(None, text.split("; ")):
        kind, _, name = part.rpartition(": ")
        groups.setdefault(kind, []).append(name.removesuffix(" point mass"))
    labels = {"orbit": "forces on the orbit", "tide": "sources of the tide", "": "forces"}
    return [(labels.get(kind, kind), ", ".join(names)) for kind, names in groups.items()]


def _csv(rows: list[Document]) -> str:
    """Rows as CSV, with empty cells for missing values."""
    names = list(dict.fromkeys(k for row in rows for k in row))
    cells = ([row.get(k) for k in names] for row in rows)
    return csv_text(names, (["" if x is None else x for x in values] for values in cells))
