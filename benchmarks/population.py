"""Encounter rates of the known near-Earth asteroids compared with counts and published values, and their outcomes.

Usage: ``python benchmarks/population.py counts|search|published|answers|nbody|verdicts|convergence|scale|binaries``.
The MPC catalogue and CNEOS's list of close approaches are read from ``../shared/data`` (or ``FLYBYSTAB_SHARED``).
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
from astropy.time import Time

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
    print(
        f"encounters with the Earth in {years:.0f} years: counted (CNEOS, 2021) and expected (orbits of 2026)"
    )
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


def search(limit="17.75"):
    """Encounters from 1950 to 2050 found by the search of the package, by planet, and the expected numbers."""
    limit = float(limit)
    rows = [r for r in read("nea_mpc_2026-02.csv.gz") if float(r["H"] or "nan") < limit]
    table, h = catalogue()
    table = table[h < limit]
    orbits = [
        fs.Orbit.from_elements(
            Time(float(r["epoch_jd_tt"]), format="jd", scale="tt"),
            float(r["a_au"]) * u.au,
            float(r["e"]),
            *(float(r[k]) * u.deg for k in ("i_deg", "node_deg", "peri_deg", "M_deg")),
        )
        for r in rows
    ]
    planets = ("mercury", "venus", "earth", "mars")
    start = time.perf_counter()
    found = fs.find_encounters(
        orbits,
        Time("1950-01-01", scale="tdb"),
        Time("2050-01-01", scale="tdb"),
        planets=planets,
        within=0.05 * u.au,
    )
    wall = time.perf_counter() - start
    print(f"{len(orbits)} known asteroids of H < {limit:g}, 1950 to 2050, all forces: search in {wall:.0f} s")
    print("planet   within (au)  found  expected  ratio  (1 sigma of counting)")
    for name in planets:
        distance = found["distance"][found["planet"] == name].to_value(u.au)
        rates = fs.encounter_rates(table, name, 0.05 * u.au)
        for q in (0.05, 0.01):
            n = int(np.sum(distance < q))
            expected = 100.0 * rates.within(q * u.au).total.value
            print(
                f"{name:8s} {q:11.2f} {n:6d} {expected:9.1f} {n / expected:6.2f}  ({1 / np.sqrt(expected):.2f})"
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


def beside(published, value):
    """Relative difference of a value from a published one, or from the nearer end of a published range; as text."""
    low, high = published if isinstance(published, tuple) else (published, published)
    text = f"{low:g}" if low == high else f"{low:g}-{high:g}"
    if low <= value <= high:
        return text, "inside" if low < high else "+0 %"
    return text, f"{100 * (value / (low if value < low else high) - 1):+.0f} %"


def main_belt():
    """Mean collision probability (1/(1e18 km2 yr)) and speed (km/s) of pairs of the 16 most massive asteroids."""
    from flybystab.orbit.ephemeris import BELT, N_BODIES, SUN, ephemeris
    from flybystab.orbit.planets import Planet
    from flybystab.population.rates import elements_of

    span = 40 * 365.25 * 86400
    window = ephemeris().window(Time("2000-01-01", scale="tdb"), -span, span)
    times = np.linspace(-0.98, 0.98, 60) * span
    sun = window.states(SUN, times)
    mean = []
    for k in range(len(BELT)):
        states = window.states(N_BODIES + k, times) - sun
        mean.append(np.mean([elements_of(s[:3], s[3:]) for s in states], axis=0))
    a, e, i = np.transpose(mean)
    table = QTable({"a": a * u.m, "e": e, "i": i * u.rad})
    chance, speed = [], []
    for k, name in enumerate(BELT):
        target = Planet(name, 1e-9, 1e3, 0.0, (0.0, 0.0, 1.0), 0.0, 0, a[k])
        rates = fs.encounter_rates(table, target, 1 * u.km, planet_orbit=(a[k] * u.m, e[k], i[k] * u.rad))
        crossing = (np.arange(len(BELT)) != k) & (rates.rate.value > 0.0)
        chance += list(1e18 * rates.rate.value[crossing])
        speed += list(rates.v_inf.value[crossing])
    return np.mean(chance), np.average(speed, weights=chance)


def published():
    """Rates of the known asteroids beside published figures of the whole population."""
    orbits, h = catalogue()
    kilometre = orbits[h < 17.75]
    # H of a diameter of 420 m at an albedo of 0.14; the catalogue is nearly complete there.
    large = orbits[h < 5.0 * np.log10(1329.0 / (0.42 * np.sqrt(0.14)))]
    planets = {n: fs.encounter_rates(kilometre, n) for n in ("mercury", "venus", "earth", "mars")}
    each = {n: 1e6 * r.within(10 * r.planet.radius * u.m).rate.value for n, r in planets.items()}
    either = (each["earth"] + each["venus"]).mean()
    impact = 1e6 * planets["earth"].total.value
    deep = fs.encounter_rates(large, "earth", 5.96 * fs.R_earth).total.value
    met = sum(r.within(10 * fs.R_earth).rate.value for r in planets.values())
    wide = sum(r.within(30 * fs.R_earth).rate.value for r in planets.values())
    crossing = met > 0.0
    times = [1e-6 / np.median(x[crossing]) for x in (met, wide)]
    lines = [
        (f"Earth impact of H < 17.75 ({len(kilometre)} known), one in (Myr)", (0.5, 0.7), 1 / impact, "a"),
        (
            "  the same for the 936 of the model, one in (Myr)",
            (0.5, 0.7),
            len(kilometre) / 936 / impact,
            "a, b",
        ),
        (
            f"Earth encounter of NEAs > 420 m ({len(large)} known) in 5.96 R_E, one in (kyr)",
            (7, 8.2),
            1e-3 / deep,
            "a",
        ),
        ("Earth encounter of one NEA within 10 radii, one in (Myr)", 10, 1 / each["earth"].mean(), "a"),
        ("Venus encounter of one NEA within 10 radii, one in (Myr)", 10, 1 / each["venus"].mean(), "a"),
        ("  either of the two, one in (Myr)", 5, 1 / either, "a"),
        ("any terrestrial planet within 10 R_E, median NEA, one in (Myr)", (1, 10), times[0], "c"),
        ("any terrestrial planet within 30 R_E, median NEA, one in (Myr)", (0, 1), times[1], "c"),
        (
            "Earth impacts of one NEA of H < 28 (1/Gyr), the known H < 17.75",
            2.83,
            1e3 * impact / len(kilometre),
            "b",
        ),
    ]
    belt = main_belt()
    lines += [
        ("collisions in the main belt (1e-18/km2/yr): crossing pairs of 16 asteroids", 2.86, belt[0], "d"),
        ("  their mean speed (km/s)", 5.3, belt[1], "d"),
    ]
    print(f"{'figure':79s} {'published':>9s} {'here':>7s}  difference  source")
    for name, figure, value, source in lines:
        text, error = beside(figure, value)
        print(f"{name:79s} {text:>9s} {value:7.2f}  {error:>10s}  {source}")
    print(
        "a: rates of whole populations; b: Nesvorny et al. 2024 (936 of H < 17.75; 1.2e7 of H < 28 with 0.034"
    )
    print("impacts a year, small ones on other orbits); c: Fang & Margot 2012 (almost all binaries);")
    print(
        "d: Bottke et al. 1994, all asteroids above 50 km; a rate per square of the sum of the radii, pi included"
    )


def answers():
    """Asteroids most likely to have been reshaped, and how many have fresh surfaces."""
    from flybystab.population.freshness import fresh_fraction

    rows = read("nea_mpc_2026-02.csv.gz")
    orbits, h = catalogue()
    large = np.flatnonzero(h < 17.75)
    rates = fs.disruption_rates(orbits[large], ("mercury", "venus", "earth", "mars"), samples=4800, seed=1)
    print(f"{len(large)} known asteroids of H < 17.75 as bodies of 1 km, drawn properties")
    print(f"fraction reshaped in the last Myr: {100 * rates.changed_fraction(1 * u.Myr):.2f} %")
    print("\nlargest rates of changes of shape by encounters within 5 radii")
    print("asteroid            changes per Gyr  samples")
    for row in rates.contributors(most=8):
        one = rows[large[row["orbit"]]]
        name = " ".join(x for x in (one["number"], one["name"] or one["principal_desig"]) if x)
        print(f"{name:18s} {1e9 * row['rate'].to_value(1 / u.yr):16.1f} {row['samples']:8d}")
    print(
        "\nfraction of the asteroids with a fresh surface, by refreshing distance and weathering time (Earth, Venus)"
    )
    print("radii   0.1 Myr   1 Myr")
    for radii in (3.6, 5, 7.2, 10, 16):
        cells = [
            fresh_fraction(orbits[large], dict.fromkeys(("earth", "venus"), radii), weathering=w * u.Myr)
            for w in (0.1, 1.0)
        ]
        print(f"{radii:5.1f} {100 * cells[0]:7.1f} % {100 * cells[1]:5.1f} %")
    print("published refreshing distances: 5 radii (Nesvorny et al. 2010) to 16 radii (Binzel et al. 2010)")


def nbody(years=3000.0, particles=200, within=0.1):
    """Encounters counted in an N-body integration of known asteroids, and expected from their changing orbits."""
    import rebound

    years, particles = float(years), int(particles)
    orbits, h = catalogue()
    rows = read("nea_mpc_2026-02.csv.gz")
    rng = np.random.default_rng(3)
    near = np.flatnonzero((h < 17.75) & (orbits["a"].value * (1 - orbits["e"]) < 1.0))
    chosen = rng.choice(near, particles, replace=False)
    sim = rebound.Simulation()
    sim.units = ("day", "AU", "Msun")
    sim.add(m=1.0)
    names = ("mercury", "venus", "earth", "mars", "jupiter", "saturn", "uranus", "neptune")
    from flybystab.constants import AU
    from flybystab.orbit.elements import GM_SUN
    from flybystab.orbit.planets import planet

    for name in names:
        body = planet(name)
        angles = rng.uniform(0, 2 * np.pi, 3)
        sim.add(
            m=body.gm / GM_SUN,
            a=body.orbit_radius / AU,
            e=body.orbit_eccentricity,
            inc=body.orbit_inclination,
            Omega=angles[0],
            omega=angles[1],
            M=angles[2],
        )
    for k in chosen:
        elements = orbits[k]
        angles = [np.radians(float(rows[k][key])) for key in ("node_deg", "peri_deg", "M_deg")]
        sim.add(
            a=elements["a"].value, e=elements["e"], inc=elements["i"].to_value(u.rad), Omega=angles[0],
            omega=angles[1], M=angles[2],
        )  # fmt: skip
    sim.N_active = len(names) + 1
    sim.move_to_com()
    sim.integrator, sim.dt = "whfast", 3.0
    watched = {"venus": 2, "earth": 3, "mars": 4}
    counts = dict.fromkeys(watched, 0)
    expected = dict.fromkeys(watched, 0.0)
    steps, every = int(years * 365.25 / sim.dt), 10_000
    xyz = np.empty((sim.N, 3))

    def positions():
        sim.serialize_particle_data(xyz=xyz)
        return {name: xyz[len(names) + 1 :] - xyz[k] for name, k in watched.items()}

    start = time.perf_counter()
    before = {k: v.copy() for k, v in positions().items()}
    for step in range(steps):
        if step % every == 0:
            sun = sim.particles[0]
            orbits_now = [p.orbit(primary=sun) for p in sim.particles[len(names) + 1 :]]
            found = np.array([(o.a, o.e, np.degrees(o.inc)) for o in orbits_now])
            table = QTable(found[(found[:, 1] < 1.0) & (found[:, 0] > 0.0)], names=("a", "e", "i"))
            span = min(every, steps - step) * sim.dt / 365.25
            for name, k in watched.items():
                o = sim.particles[k].orbit(primary=sun)
                orbit = (o.a * u.au, o.e, o.inc * u.rad)
                expected[name] += (
                    fs.encounter_rates(table, name, within * u.au, planet_orbit=orbit).total.value * span
                )
        sim.steps(1)
        now = positions()
        for name, d1 in now.items():
            d0 = before[name]
            change = d1 - d0
            s = -np.sum(d0 * change, axis=1) / np.sum(change * change, axis=1)
            least = d0 + s[:, None] * change
            counts[name] += int(np.sum((s > 0) & (s <= 1) & (np.sum(least * least, axis=1) < within**2)))
            before[name] = d1.copy()
    wall = time.perf_counter() - start
    print(
        f"{particles} known asteroids (H < 17.75, q < 1 au) with the planets, {years:g} years by WHFast: {wall:.0f} s"
    )
    print(f"planet  encounters within {within:g} au: counted  expected  ratio  (1 sigma of counting)")
    for name in watched:
        n, m = counts[name], expected[name]
        print(f"{name:8s} {n:32d}  {m:8.0f}  {n / m:5.3f}  ({1 / np.sqrt(m):.3f})")


def convergence():
    """Rates of the Earth against the number of samples; each row with another seed."""
    orbits, h = catalogue()
    large = orbits[h < 17.75]
    print("samples   RESHAPED (1/Myr)  +- sampling   BEYOND MODEL (1/Myr)  +- sampling   time (s)")
    for k, samples in enumerate((100, 400, 1600, 6400)):
        start = time.perf_counter()
        rates = fs.disruption_rates(large, ["earth"], samples=samples, seed=20 + k)
        wall = time.perf_counter() - start
        cells = []
        for verdict in ("RESHAPED", "BEYOND MODEL"):
            row = rates.table[rates.table["verdict"] == verdict][0]
            cells += [1e6 * row["rate"].to_value(1 / u.yr), 1e6 * row["rate_error"].to_value(1 / u.yr)]
        print(
            f"{samples:7d} {cells[0]:18.3f} {cells[1]:12.3f} {cells[2]:22.3f} {cells[3]:12.3f} {wall:10.1f}"
        )


def scale():
    """Time and memory of 1e5 orbits, five planets and 1,000 samples each."""
    import resource

    rng = np.random.default_rng(0)
    n = 100_000
    orbits = QTable(
        {
            "a": rng.uniform(0.6, 3.5, n) * u.au,
            "e": rng.uniform(0.1, 0.9, n),
            "i": rng.rayleigh(12, n) * u.deg,
        }
    )
    start = time.perf_counter()
    for name in ("mercury", "venus", "earth", "mars", "jupiter"):
        fs.encounter_rates(orbits, name)
    middle = time.perf_counter()
    planets = ("mercury", "venus", "earth", "mars", "jupiter")
    rates = fs.disruption_rates(orbits, planets, samples=1000, seed=1)
    end = time.perf_counter()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{n} orbits x {len(planets)} planets: encounter rates {middle - start:.1f} s")
    print(
        f"with verdicts of {len(rates.samples)} sampled encounters: {end - middle:.0f} s, peak memory {peak:.0f} MB"
    )


def binaries():
    """Fate of binaries like 1991 VH by periapsis distance at the Earth, 10 km/s, over 200 phases."""
    print(
        "1991 VH: primary 1.30 x 1.25 x 1.18 km, 1630 kg/m3, companion 0.66 x 0.49 x 0.44 km in synchronous"
    )
    print("rotation, a = 3.26 km, e = 0; v_inf 10 km/s, 200 phases; spin of those that stay bound")
    primary = fs.Body([650, 625, 518] * u.m, 1630 * u.kg / u.m**3, 2.62 * u.h)
    companion = fs.Body([330, 245, 220] * u.m, 1630 * u.kg / u.m**3, 32 * u.h)
    print("q (R_E)  bound  escape  collision  median e  median |da|/a  median wobble (deg)  wobble > 10 deg")
    for q in (2, 3, 4, 6, 8, 10, 12.5, 15, 20, 30, 60):
        passage = fs.Encounter.hyperbolic(
            "earth", q * fs.R_earth, 10 * u.km / u.s, start_distance=200 * fs.R_earth
        )
        out = fs.binary_flyby(
            primary, passage, 3.26 * u.km, companion=companion, oblate=True, samples=200, seed=1
        )
        bound = out.fate == "bound"
        e, wobble = np.median(out.eccentricity[bound]), out.wobble[bound].to_value(u.deg)
        change = np.median(np.abs(out.semi_major_axis[bound].to_value(u.km) / 3.26 - 1.0))
        shares = [out.probability(f) for f in ("bound", "escape", "collision")]
        print(
            f"{q:7g} {shares[0]:6.3f} {shares[1]:7.3f} {shares[2]:10.3f} {e:9.3f} {change:14.3f}"
            f" {np.median(wobble):20.1f} {np.mean(wobble > 10.0):16.3f}"
        )
    print(
        "published: an encounter within about 80,000 km, 12.5 R_E, explains its tumbling companion (Meyer et al. 2024)"
    )


if __name__ == "__main__":
    commands = (counts, search, published, answers, nbody, verdicts, convergence, scale, binaries)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=[c.__name__ for c in commands])
    parser.add_argument(
        "arguments",
        nargs="*",
        help="search: limit of the absolute magnitude (17.75); nbody: years and number of particles",
    )
    options = parser.parse_args()
    {c.__name__: c for c in commands}[options.what](*options.arguments)
