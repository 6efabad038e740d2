"""Encounter rates of the known near-Earth asteroids, against counts and published figures; and what encounters do.

Usage: ``python benchmarks/population.py counts|verdicts``. The MPC catalogue and CNEOS's list of close approaches are
read from ``../shared/data`` (or ``FLYBYSTAB_SHARED``).
"""

import argparse
import csv
import gzip
import os
import time
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable

import flybystab as fs

DATA = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared")) / "data"


def read(name):
    with gzip.open(DATA / name, "rt") as file:
        return list(csv.DictReader(file))


def catalogue():
    """Orbits and absolute magnitudes of all near-Earth asteroids."""
    rows = read("nea_mpc_2026-02.csv.gz")
    a, e, i, h = (np.array([float(r[k] or "nan") for r in rows]) for k in ("a_au", "e", "i_deg", "H"))
    return QTable({"a": a * u.au, "e": e, "i": i * u.deg}), h


def counts():
    orbits, h = catalogue()
    rows = read("cneos_earth_1950_2040_lt0.05au.csv.gz")
    jd = np.array([float(r["jd_tdb_rounded_min"]) for r in rows])
    distance = np.array([float(r["dist_au"]) for r in rows])
    size = np.array([float(r["H"]) if r["H"] not in ("", "n/a") else np.nan for r in rows])
    years = np.ptp(jd) / 365.25
    print(f"passages by the Earth in {years:.0f} years: counted (CNEOS, 2021) and expected (orbits of 2026)")
    print("H              within (au)  counted  expected  ratio")
    for low, high in ((0.0, 17.75), (17.75, 20.0), (20.0, 22.0)):
        of = orbits[(h >= low) & (h < high)]
        for q in (0.05, 0.02, 0.01):
            n = int(np.sum((distance < q) & (size >= low) & (size < high)))
            expected = fs.encounter_rates(of, "earth", q * u.au).total.value * years
            print(f"{low:5.2f} to {high:5.2f}  {q:11.2f}  {n:7d}  {expected:8.1f}  {n / expected:5.2f}")
    print()
    large = orbits[h < 17.75]
    print(f"the {len(large)} known with H < 17.75 (about 1 km)")
    print(
        "planet   impacts on the surface, one in (Myr)  within 5 radii, one in (kyr)  v_inf of impacts (km/s)"
    )
    for name in ("mercury", "venus", "earth", "moon", "mars", "jupiter"):
        hit = fs.encounter_rates(large, name)
        near = fs.encounter_rates(large, name, 5 * hit.planet.radius * u.m)
        met = hit.rate.value > 0.0
        speed = np.average(hit.v_inf.value[met], weights=hit.rate.value[met])
        print(f"{name:8s} {1e-6 / hit.total.value:37.3g} {1e-3 / near.total.value:29.3g} {speed:25.1f}")
    start = time.perf_counter()
    fs.encounter_rates(orbits, "venus")
    wall = time.perf_counter() - start
    print(
        f"\n{len(orbits)} orbits and one planet: {wall:.2f} s on all cores, {1e6 * wall / len(orbits):.0f} us an orbit"
    )


def verdicts():
    orbits, h = catalogue()
    large = orbits[h < 17.75]
    start = time.perf_counter()
    rates = fs.disruption_rates(large, ("mercury", "venus", "earth", "mars"), samples=2400, seed=1)
    wall = time.perf_counter() - start
    print(
        f"{rates.bodies} asteroids of H < 17.75 as bodies of {rates.diameter:.3g}, drawn properties; per million years"
    )
    print("planet   verdict          rate  +- sampling")
    for row in rates.table:
        if row["rate"].value or row["verdict"] in ("MASS LOSS", "DISRUPTED"):
            rate, error = (1e6 * row[k].to_value(1 / u.yr) for k in ("rate", "rate_error"))
            print(f"{row['planet']:8s} {row['verdict']:14s} {rate:7.3f}  {error:6.3f}")
    reshaped, beyond = (
        rates.lifetime(*v) for v in (("RESHAPED", "MASS LOSS"), ("BEYOND MODEL", "DISRUPTED"))
    )
    print(
        f"\nmean time of one asteroid until it is reshaped {reshaped:.3g}, "
        f"drawn out beyond 6:1 or disrupted {beyond:.3g}"
    )
    change = 1e6 * rates.spin_change_rate(0.1).value
    print(f"stays intact and changes its spin by more than a tenth: {change:.2f} per million years")
    print(f"{len(rates.samples)} sampled encounters in {wall:.0f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["counts", "verdicts"])
    {"counts": counts, "verdicts": verdicts}[parser.parse_args().what]()
