"""Encounters of the embedded catalogue within 0.02 au of the Earth before 2050, with nominal verdicts."""

import astropy.units as u
import numpy as np

import flybystab as fs
from flybystab.screening.summary import summary

# the default ephemeris ends in 2050 (that of the extra `jpl` in 2650)
table = fs.screen(None, "2026-01-01", "2049-12-01", within=0.02 * u.au)
print(summary(table, closest=5).text())
nearest = table[int(np.argmin(table["distance"]))]
name, date = str(nearest["asteroid"]), str(nearest["time_tdb"])[:10]
intact = int(np.count_nonzero(table["verdict"] == "INTACT"))
print(f"nearest: {name} on {date}, {nearest['distance'].to(u.km):.0f}, {nearest['verdict']}")
