"""Forecast of the rotation of Apophis after 13 April 2029 for alternative spin solutions, as a table (ECSV).

Observations of 2012-2013 and 2020-2021 are fitted by several pairs of precession and rotation period. For each pair,
the table gives the 5th, 50th and 95th percentile of the periods after the encounter over the unknown rotation phase,
the pole, and the fraction of phases that end in the short-axis mode. Further rows vary the moments of inertia and the
pole; the last line printed varies the distance. For a rigid body the forecast does not depend on density, size or
strength. A measurement of the attitude in 2028 would reduce each distribution to one value.
"""

from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time

import flybystab as fs
from flybystab.flybys.spin_forecast import spin_forecast

PHASES = 128
apophis = fs.Asteroid.from_catalogue("Apophis")
encounter = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
nearer = fs.Encounter.hyperbolic("earth", encounter.distance - 3.3 * u.km, encounter.v_inf)
nominal = fs.Encounter.hyperbolic("earth", encounter.distance, encounter.v_inf)

LEE, PRAVEC, BEST = (27.38547, 264.178), (27.38, 263.0), (27.374, 262.2)
CASES = (
    ("Lee et al. 2022", LEE, None, 0.0),
    ("Pravec et al. 2014", PRAVEC, None, 0.0),
    ("arXiv:2604.24566, best fit", BEST, None, 0.0),
    ("Lee et al. 2022, inertia of Pravec et al. 2014", LEE, (0.61, 0.965), 0.0),
    ("Lee et al. 2022, pole turned by 5 deg", LEE, None, 5.0),
)

forecasts, rows = {}, []
for name, (precession, rotation), inertia, turned in CASES:
    tumbler = apophis.with_tumbling(precession * u.h, rotation * u.h, inertia=inertia)
    found = spin_forecast(tumbler, encounter, n=PHASES, turned=turned * u.deg)
    forecasts[name] = found
    latitude = found.ecliptic[1]
    row = {"solution": name, "precession_before": precession * u.h, "rotation_before": rotation * u.h}
    for column in ("precession_period", "rotation_period", "effective_period", "pole_change"):
        for level, value in zip((5, 50, 95), found.quantiles(column), strict=True):
            row[f"{column}_{level}"] = value
    row["pole_latitude_5"], row["pole_latitude_95"] = np.quantile(latitude, [0.05, 0.95])
    row["fraction_sam"] = np.mean(found.mode == "SAM")
    rows.append(row)

table = QTable(rows)
table.meta = {
    "asteroid": apophis.label,
    "encounter": f"Earth, {encounter.time.tdb.iso[:19]} TDB, {encounter.distance.to_value(u.km):.1f} km",
    "orbit": apophis.row["orbit_solution"],
    "pole": apophis.row["pole_source"],
    "phases": PHASES,
    "flybystab": fs.__version__,
}
Path("out").mkdir(exist_ok=True)
table.write("out/apophis_forecast.ecsv", overwrite=True)

print(f"{'solution':47} precession (h)          rotation (h)           pole moves (deg)  SAM")
for row in table:
    low, mid, high = (row[f"precession_period_{k}"].value for k in (5, 50, 95))
    slow, turn, fast = (row[f"rotation_period_{k}"].value for k in (5, 50, 95))
    near, moved, far = (row[f"pole_change_{k}"].value for k in (5, 50, 95))
    print(
        f"{row['solution']:47} {mid:5.1f} ({low:5.1f} to {high:5.1f})  {turn:6.1f} ({slow:5.1f} to {fast:6.1f})"
        f"  {moved:4.1f} ({near:3.1f} to {far:4.1f})  {row['fraction_sam']:.0%}"
    )

body = apophis.body
shift = fs.flyby(body, nearer).spin_ratio / fs.flyby(body, nominal).spin_ratio - 1.0
print(f"3.3 km (3 sigma) nearer: effective spin rate x {1 + shift:.5f}")
