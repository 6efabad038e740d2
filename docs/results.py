"""Make docs/results.md and its figures: ``python docs/results.py [--jobs N] [--data DIRECTORY] [--keep]``.

Three screenings, whose tables stay in ``out/results``: the embedded catalogue and, where the source tables are
(``../shared/data`` by default), JPL's full-precision orbits of 4,056 asteroids until 2050, and the past. ``--keep``
reads finished tables and only writes the page again.
"""

import argparse
import csv
import gzip
import sys
import time
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.catalogues.asteroid import Asteroid
from flybystab.catalogues.catalogue import catalogue, find
from flybystab.catalogues.completion import with_physical_data
from flybystab.plots.screening import inference_figure, results_figure
from flybystab.screening.columns import YIELDED
from flybystab.screening.executors import open_executor
from flybystab.screening.inference import infer, strongest_encounter, survived
from flybystab.screening.priors import Population
from flybystab.screening.progress import ProgressBar
from flybystab.screening.results import read_results
from flybystab.screening.screening import Screening
from flybystab.screening.selection import listed
from flybystab.screening.settings import settings
from flybystab.screening.summary import summary

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "out" / "results"
NEW, OLD = "nea_sbdb_fullprec_2026-07.csv.gz", "nea_sbdb_fullprec_2020-09.csv.gz"
MPC = "nea_mpc_2026-02.csv.gz"
SAMPLES = 100
#: Slowly rotating piles without cohesion, on which the tide has the largest effect.
WEAK = {"cohesion_Pa": 0, "spin_period_h": {"kind": "uniform", "low": 4, "high": 12}, "replace_assumed": True}
#: Name: catalogue (None: embedded), dates, largest distance (au), population.
RUNS = {
    "embedded": (None, "2026-01-01", "2050-01-01", 0.05, {}),
    "full": (NEW, "2026-01-01", "2050-01-01", 0.05, {}),
    "past": (None, "1950-01-01", "2026-01-01", 0.05, {}),
    "deep": (OLD, "2000-01-01", "2021-01-01", 0.001, {}),
    "others": (None, "2002-01-01", "2020-01-01", 0.05, {}),
    "weak": (OLD, "2000-01-01", "2021-01-01", 0.001, WEAK),
}
#: Asteroids of well-known encounters that the other screenings do not contain, by table.
OTHERS = {MPC: ("2002 MN", "2008 TC3", "2019 OK"), NEW: ("2014 HQ124",)}
#: Encounters that a reader may look for: name and month.
FAMOUS = [
    ("Apophis", "2029-04"),
    ("Toutatis", "2004-09"),
    ("Duende", "2013-02"),
    ("YORP", "2005-07"),
    ("2005 YU55", "2011-11"),
    ("2002 MN", "2002-06"),
    ("2008 TC3", "2008-10"),
    ("2012 TC4", "2017-10"),
    ("2019 OK", "2019-07"),
    ("Florence", "2017-09"),
    ("2014 HQ124", "2014-06"),
    ("1999 AN10", "2027-08"),
    ("1997 XF11", "2028-10"),
    ("2001 WN5", "2028-06"),
]


def run(name, data, jobs, keep):
    """The table of one screening, and its time in s (nan if it was read from a file)."""
    file, start, stop, within, population = RUNS[name]
    path = OUT / f"{name}.ecsv"
    if keep and path.exists():
        return read_results(path), np.nan
    if name == "others":
        chosen = [find(catalogue(data / f), n, f) for f, names in OTHERS.items() for n in names]
        chosen = with_physical_data(chosen)
    elif name == "weak":  # without the periods of the LCDB, so that all rotate slowly
        chosen = catalogue(data / file)
    else:
        chosen = listed(None if file is None else data / file)
    screening = Screening(
        chosen,
        settings(
            start,
            stop,
            within=within * u.au,
            samples=SAMPLES,
            population=Population.from_mapping(population),
        ),
    )
    began = time.monotonic()
    with open_executor(jobs) as pool:
        screening.run(path, overwrite=True, executor=pool, progress=ProgressBar())
    seconds = time.monotonic() - began
    (OUT / f"{name}.seconds").write_text(f"{seconds:.1f} {jobs}\n")
    return read_results(path), seconds


def counts(table):
    s = summary(table)
    words = ", ".join(f"{n} {v}" for v, n in s.verdicts.items())
    return (
        f"{s.rows} encounters: {words}"
        + (f"; {s.failed} not computed" if s.failed else "")
        + f". {s.samples} "
        f"samples, {s.samples_dynamic} of them ({100 * s.dynamic_share:.2g} %) integrated."
    )


def passages(table, order):
    """A table of encounters in Markdown."""
    head = (
        "| asteroid | date (TDB) | distance (km) | v_inf (km/s) | verdict | margin (deg) | encounter adds (deg) "
        "| P(yield), 95 % | sensitive to |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
    )
    rows = []
    for k in order:
        r = table[int(k)]
        p = f"{r['p_yield']:.2g} ({r['p_yield_low']:.2g}-{r['p_yield_high']:.2g})"
        adds = number(r["friction_rise"].to_value(u.deg), 3).replace("-0.000", "0.000")
        adds = "< 0.010" if r["decided_by"] == "bound" and adds != "-" else adds
        rows.append(
            f"| {r['asteroid']} | {r['time_tdb'][:16].replace('T', ' ')} | {r['distance'].to_value(u.km):,.0f} "
            f"| {r['v_inf'].to_value(u.km / u.s):.2f} | {r['verdict']} | {number(r['margin'].to_value(u.deg))} "
            f"| {adds} | {p if np.isfinite(r['p_yield']) else '-'} "
            f"| {r['contributors'] or '-'} |"
        )
    return head + "\n".join(rows) + "\n"


def number(x, digits=2):
    if np.isnan(x):
        return "-"
    return f"{x:.{digits}f}" if np.isfinite(x) else "infinite" if x > 0 else "no friction angle suffices"


def standing(table):
    return (table["verdict"] != "NOT IN EQUILIBRIUM") & (table["verdict"] != "")


def closest(table, n=10):
    """Encounters of bodies in equilibrium, closest to failure first: by the probability of yield, then the margin."""
    p = np.nan_to_num(np.asarray(table["p_yield"], dtype=float))
    order = np.lexsort((table["margin"].value, -p))
    return [k for k in order if standing(table)[k]][:n]


def loaded(table, n=10):
    """Encounters that add most; only integrated ones, not upper bounds."""
    rise = np.nan_to_num(table["friction_rise"].to_value(u.deg), nan=-1.0, posinf=1e9)
    computed = standing(table) & (table["decided_by"] == "dynamics")
    return [k for k in np.argsort(-rise, kind="stable") if computed[k]][:n]


def reshaped(table):
    p = np.nan_to_num(np.asarray(table["p_yield"], dtype=float))
    touched = standing(table) & (np.isin(table["verdict"], YIELDED) | (p > 0.0))
    return [k for k in closest(table, len(table)) if touched[k]]


def famous(*tables):
    """The well-known encounters, each from the first table that contains it."""
    text = ""
    for name, month in FAMOUS:
        for table in tables:
            same = [
                k
                for k in range(len(table))
                if table["asteroid"][k] == name and table["time_tdb"][k].startswith(month)
            ]
            if same:
                body = passages(table, same).split("\n")
                text += "\n".join(body[:3] if not text else body[2:3]) + "\n"
                break
        else:
            sys.exit(f"no encounter of {name} in {month}")
    return text


def against_cneos(table, data):
    """Distances on the elements of the MPC beside those that CNEOS gave with its own solutions."""
    known = {}
    for file, column, unit in (
        ("cneos_earth_1950_2040_lt0.05au.csv.gz", "dist_au", "au"),
        ("cneos_earth_even_years_lt10LD_km.csv.gz", "dist_km", "km"),
    ):
        with gzip.open(data / file, "rt", encoding="utf-8") as stream:
            known |= {(r["des"], r["cd_tdb"][:4]): f"{r[column]} {unit}" for r in csv.DictReader(stream)}
    months = dict(FAMOUS)
    words = []
    for row in table:
        name = str(row["asteroid"])
        if name not in OTHERS[MPC] or not row["time_tdb"].startswith(months[name]):
            continue
        if row["p_impact"] > 0.0:
            words.append(f"{name} hits the Earth, as it did, in every sample that is in equilibrium")
        else:
            theirs = known[name, row["time_tdb"][:4]]
            words.append(f"{name} at {row['distance'].to_value(u.km):.0f} km (CNEOS: {theirs})")
    return "; ".join(words)


def bounds():
    """Bounds from the survived encounters of four bodies, with a figure of each."""
    text = ""
    for name in ("Anteros", "Toutatis", "Duende", "Geographos"):
        asteroid = Asteroid.from_catalogue(name)

        found = survived(asteroid, Time("1950-01-01", scale="tdb"), Time("2026-01-01", scale="tdb"))
        table = infer(asteroid, found)
        inference_figure(table, ROOT / "docs" / "images" / f"infer_{name.lower()}.png")
        strongest = strongest_encounter(table)
        at = table[(table["cohesion"] == 0 * u.Pa) & (table["density"] == 2000 * u.kg / u.m**3)][0]
        rest, any_, every = (
            number(at[f"friction_{n}"].to_value(u.deg))
            for n in ("equilibrium", "any_attitude", "every_attitude")
        )
        what = (
            "no encounter within 0.05 au since 1950"
            if strongest is None
            else f"{strongest['passage']}: adds {strongest['adds_at_worst_attitude_deg']:.2f} deg at the worst "
            f"attitude, {strongest['adds_at_any_attitude_deg']:.2f} deg at the most favourable one"
        )
        text += f"| {asteroid.label} | {rest} | {any_} | {every} | {what} |\n"
    head = (
        "| body | required at rest | required at any attitude | sufficient at every attitude | strongest encounter |"
        "\n| --- | --- | --- | --- | --- |\n"
    )
    return head + text


def wall(name):
    seconds, jobs = (OUT / f"{name}.seconds").read_text().split()
    return f"{float(seconds):.0f} s on {jobs} worker{'s' if jobs != '1' else ''}"


def laws():
    """The priors of the population, one line each, by their keys in a TOML file."""
    rows = "\n".join(f"| `{key}` | {law} |" for key, law in Population().stated().items())
    return f"| input | law |\n| --- | --- |\n{rows}"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--keep", action="store_true")
    args = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    tables = {name: run(name, args.data, args.jobs, args.keep)[0] for name in RUNS}
    for name in ("full", "weak"):
        results_figure(tables[name], ROOT / "docs" / "images" / f"results_{name}.png")
    embedded, full, past, deep, others, weak = (tables[n] for n in RUNS)
    touched = reshaped(full)
    spun = [k for k in range(len(full)) if full["verdict"][k] == "NOT IN EQUILIBRIUM"]
    hit = reshaped(weak)
    page = f"""# Results

Made by `python docs/results.py` on orbits of {full["catalogue"][0].rsplit("/")[-1]} (JPL, epoch mostly
JD 2461200.5) and the embedded catalogue, ephemeris {full["ephemeris"][0]}. Each row
is an encounter of the catalogue body with 35 deg of friction, no cohesion and the yield surface
{full["yield_surface"][0]}, and {SAMPLES} samples of the uncertain inputs, seed 0. In the tables:

- *margin*: friction angle minus the largest mobilised one;
- *encounter adds*: increase of the mobilised angle by the encounter; this and the margin are bounds where the
  yield bound is conclusive;
- *P(yield)*: fraction of the samples in equilibrium that yield or reach the planet, with its Wilson interval;
- *sensitive to*: inputs to which the margin is most sensitive, with Spearman's rank correlation.

Unmeasured inputs have these priors ([sampled inputs](screening.md#sampled-inputs)):

{laws()}

## Embedded catalogue, 2026 to 2050

`flybystab screen --from 2026-01-01 --to 2050-01-01 --samples {SAMPLES} --jobs 2`: {wall("embedded")}.
{counts(embedded)}

{passages(embedded, closest(embedded))}
## Full-precision catalogue, 2026 to 2050: closest to failure

4,056 asteroids, Earth, within 0.05 au: {wall("full")}. {counts(full)}

{passages(full, closest(full))}
Encounters that add more than 0.010 deg, at most ten:

{passages(full, [k for k in loaded(full) if full["friction_rise"][k] > 0.01 * u.deg])}
Bodies that are reshaped at any sampled attitude: {len(touched) or "none"}.
{passages(full, touched[:20]) if touched else ""}
Not in equilibrium without cohesion, even without an encounter: {len(spun)} encounters of
{len({full["asteroid"][k] for k in spun})} bodies, which rotate too fast for a cohesionless pile.

![Full-precision catalogue](images/results_full.png)

## Well-known encounters

{famous(embedded, past, full, deep, others)}
2002 MN, 2008 TC3 and 2019 OK are in no table of full precision; their orbits are the seven-digit elements of the MPC
({MPC}): {against_cneos(others, args.data)}.

Of the embedded catalogue since 1950 ({counts(past)[:-1].lower()}), these encounters added most:

{passages(past, [k for k in loaded(past) if past["friction_rise"][k] > 0.01 * u.deg])}
## Deep encounters, 2000 to 2020

{len(deep)} encounters within 0.001 au (150,000 km) in JPL's catalogue of September 2020, mostly of bodies of a few to
tens of metres whose shape, spin and density are sampled: {wall("deep")}. {counts(deep)}
Bodies of that size rotate in minutes and need cohesion to be in equilibrium;
those samples that have enough, up to 100 Pa, never yield.

The largest effect of the tide is that on slowly rotating piles without cohesion, with periods distributed uniformly
from {WEAK["spin_period_h"]["low"]} to {WEAK["spin_period_h"]["high"]} h:
{counts(weak)} Encounters in which any sample yields ({len(hit)}), worst first:

{passages(weak, hit[:20])}
![Slowly rotating piles without cohesion in deep encounters](images/results_weak.png)

## Bounds from survived encounters

Least friction angle (deg) without cohesion at 2000 kg/m3 (`flybystab infer NAME --output FILE`); the figures show it
against density and cohesion.

{bounds()}
![Anteros](images/infer_anteros.png)
![Duende](images/infer_duende.png)
![Geographos](images/infer_geographos.png)
![Toutatis](images/infer_toutatis.png)
"""
    (ROOT / "docs" / "results.md").write_text("\n".join(line.rstrip() for line in page.splitlines()) + "\n")
    print(ROOT / "docs" / "results.md")


if __name__ == "__main__":
    main()
