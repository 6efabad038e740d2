"""Impact probabilities along the line of variations against published ones.

Usage: ``python benchmarks/impacts.py [yr4 | bennu | apophis]``, all of them without a name. Reference data are read
from ``../shared`` (or ``$FLYBYSTAB_SHARED``): the orbit of 2024 YR4 by ESA, of Bennu by JPL (solution 118, Farnocchia
et al. 2021) and of Apophis by JPL (solution 220).

JPL's solution for Bennu has a thermal model with the parameters RHO (bulk density) and AMRAT. Here A2 takes its place:
-4.557e-14 au/d2, which gives the published drift of the semi-major axis in 2011 of -284.6 m a year, with an error in
proportion to that of RHO. The radial part of the thermal recoil is an A1 with which the orbit of January 2011 leads to
JPL's place of January 2024 (Horizons, along the orbit).
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.time import Time

import flybystab as fs
from flybystab.orbit.covariance import Covariance
from flybystab.orbit.elements import ecliptic_to_icrf
from flybystab.result_table import ResultTable

SHARED = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared"))
UNIT = u.au / u.d**2
AREA = u.m**2 / u.kg
#: Published drift of Bennu's semi-major axis at 2011.0 (Farnocchia et al. 2021).
DRIFT = -284.6 * u.m / u.yr
#: JPL's Bennu on 2024-01-01 (TDB), heliocentric, ecliptic of J2000, au and au/d (Horizons, OSIRIS-REx trajectory).
PLACE = (-0.8949052809876745, 0.5353223139378872, 0.05982667219505702)
SPEED = (-0.01167459005576071, -0.01287494949256736, -0.001317155627348354)


def bennu() -> fs.Orbit:
    """JPL 118 with A1, A2 and AMRAT in place of its thermal model."""
    record = json.loads((SHARED / "cases/02_bennu_rho_amrat/bennu_cov.json").read_text())["orbit"]
    el = {item["name"]: float(item["value"]) for item in record["elements"]}
    par = {item["name"]: float(item["value"]) for item in record["model_pars"]}
    known = record["covariance"]
    epoch = Time(float(record["epoch"]), format="jd", scale="tdb")
    motion = np.radians(el["n"]) / u.d
    # mean over an orbit of a transverse acceleration A2 (1 au/r)^2 (Gauss)
    a2 = (DRIFT * motion * (el["a"] * u.au) ** 2 * (1.0 - el["e"] ** 2) / (2.0 * u.au**2)).to(UNIT)
    values = {
        "e": el["e"],
        "q": el["q"],
        "tp": el["tp"] - epoch.jd,
        "node": el["om"],
        "peri": el["w"],
        "i": el["i"],
        "RHO": a2.value,
        "AMRAT": par["AMRAT"],
    }
    matrix = np.array([[float(x) for x in row] for row in known["data"]])
    change = np.ones(len(matrix))
    change[known["labels"].index("RHO")] = -a2.value / par["RHO"]  # A2 is in proportion to 1/RHO
    units = {"q": u.au, "tp": u.d, "node": u.deg, "peri": u.deg, "i": u.deg, "RHO": UNIT, "AMRAT": AREA}
    covariance = Covariance.in_units(
        epoch,
        ["A2" if n == "RHO" else n for n in known["labels"]],
        [values[n] for n in known["labels"]],
        matrix * np.outer(change, change),
        [units.get(n, u.one) for n in known["labels"]],
        "JPL 118, A2 in place of RHO",
    )

    def orbit(a1: float) -> fs.Orbit:
        angles = (el[n] * u.deg for n in ("i", "om", "w", "ma"))
        return fs.Orbit.from_elements(
            epoch, el["a"] * u.au, el["e"], *angles, a1 * UNIT, a2,
            AMRAT=par["AMRAT"] * AREA, name="Bennu", covariance=covariance,
        )  # fmt: skip

    there, speed = ecliptic_to_icrf() @ PLACE, ecliptic_to_icrf() @ SPEED
    along = speed / np.linalg.norm(speed)

    def ahead(a1: float) -> float:
        place, _ = orbit(a1).at(Time("2024-01-01", scale="tdb"))
        return float((place.to_value(u.au) - there) @ along)

    zero, one = ahead(0.0), ahead(1e-13)
    return orbit(1e-13 * zero / (zero - one))


def apophis() -> fs.Orbit:
    """JPL 220, from the file of SBDB."""
    return fs.catalogue(SHARED / "data/apophis_sbdb_jpl220.json")[0].orbit


def yr4() -> fs.Orbit:
    """ESA's orbit of 2024 YR4."""
    return fs.catalogue(SHARED / "data/neocc/2024YR4.ke1")[0].orbit


CASES: dict[str, tuple[Any, str, str, str, int, str]] = {
    "yr4": (yr4, "moon", "2032-12-15", "2032-12-30", 101, "2032-12-22: 0.043 (CNEOS, June 2025)"),
    "bennu": (
        bennu,
        "earth",
        "2182-01-01",
        "2183-01-01",
        2001,
        "2182-09-24: 3.7e-4 (Farnocchia et al. 2021)",
    ),
    "apophis": (
        apophis,
        "earth",
        "2068-01-01",
        "2069-01-01",
        2001,
        "2068-04-12: 6.7e-6 (2020), none since 2021",
    ),
}


def search(name: str) -> tuple[ResultTable, float]:
    """Virtual impactors of a case, and the processor time of the search, s."""
    make, planet, start, stop, n, _ = CASES[name]
    orbit = make()
    begin = time.process_time()
    found = fs.virtual_impactors(orbit, start, stop, planet, n=n)
    return found, time.process_time() - begin


def main(arguments: list[str]) -> None:
    print("Impact probabilities along the line of variations")
    head = ("date (TDB)", "sigma", "stretching (km)", "width (km)", "probability", "at sigma 0")
    for name in arguments or CASES:
        found, used = search(name)
        _, planet, start, stop, n, published = CASES[name]
        print(f"\n{name}, {planet}, {start} to {stop}, {n} orbits, {used:.0f} s of processor time")
        print(f"published {published}")
        print(f"{head[0]:17} {head[1]:>8} {head[2]:>15} {head[3]:>10} {head[4]:>11} {head[5]:>10}")
        for row in found:
            # the same part of the line at the centre of the distribution
            highest = row["probability"] * np.exp(0.5 * row["sigma"] ** 2)
            print(
                f"{row['time'].iso[:16]:17} {row['sigma']:8.3f} {row['stretching'].to_value(u.km):15.3g} "
                f"{row['width'].to_value(u.km):10.3g} {row['probability']:11.2e} {highest:10.2e}"
            )
        if not len(found):
            print("none")


if __name__ == "__main__":
    main(sys.argv[1:])
