"""Encounters with planets other than the Earth, and tracks through flybys compared point by point, as tables.

Usage: ``python benchmarks/encounters.py [planets] [tracks]``. Reference data are read from ``../shared/data`` (or
``$FLYBYSTAB_SHARED/data``); nothing is downloaded.
"""

from __future__ import annotations

import csv
import os
import sys
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

DATA = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared")) / "data"
BODIES = {
    "Juptr": "jupiter",
    "Mars": "mars",
    "Merc": "mercury",
    "Moon": "moon",
    "Venus": "venus",
    "Earth": "earth",
}
#: Rows give their time to the minute, six of them to the day: within it and a half a row holds.
MINUTE, DATE = 90.0, 0.75 * 86400.0


def neows_orbits(folder: Path = DATA) -> dict[str, Orbit]:
    """Orbits of the objects of the list, gravity alone (its solutions have no A1, A2 that it gives)."""
    out = {}
    with (folder / "neows_orbits.csv").open() as file:
        for row in csv.DictReader(file):
            out[row["des"]] = Orbit.from_elements(
                Time(float(row["epoch_jd_tdb"]), format="jd", scale="tdb"),
                float(row["a_au"]) * u.au,
                float(row["e"]),
                *(float(row[c]) * u.deg for c in ("i_deg", "node_deg", "peri_deg", "M_deg")),
                name=row["des"],
            )
    return out


def planets(folder: Path = DATA) -> list[dict[str, object]]:
    """Approaches to Venus, Mercury, Mars, Moon and Jupiter of the NeoWs list against those found from its orbits."""
    orbits = neows_orbits(folder)
    with (folder / "neows_other_planets.csv").open() as file:
        events = list(csv.DictReader(file))
    eph = ephemeris()
    found: dict[str, object] = {}
    out = []
    for event in events:
        des, body = event["des"], BODIES[event["body"]]
        time = _time(event)
        if not eph.start_jd < time.jd < eph.stop_jd:
            continue
        if des not in found:
            days = [_time(e).jd for e in events if e["des"] == des]
            span = [Time(j, format="jd", scale="tdb") for j in (min(days) - 60, max(days) + 60)]
            names = sorted({BODIES[e["body"]] for e in events if e["des"] == des})
            found[des] = find_encounters(
                orbits[des], *span, planets=names, within=2.5 * u.au, ephemeris=eph, growth=True
            )
        table = found[des]
        rows = np.flatnonzero(np.asarray(table["planet"]) == body)
        gap = (table["time"][rows] - time).to_value(u.s)
        best = int(np.argmin(np.abs(gap)))
        row = table[int(rows[best])]
        out.append(
            {
                "des": des,
                "body": body,
                "date": event["cd_tdb"] or event["date"],
                "holds": abs(float(gap[best])) < (MINUTE if event["cd_tdb"] else DATE),
                "jd": time.jd,
                "km": float(event["dist_km"]),
                "seconds": float(gap[best]),
                "error": row["distance"].to_value(u.km) - float(event["dist_km"]),
                "speed": row["v_rel"].to_value(u.km / u.s) - float(event["v_rel_kms"]),
                "growth": float(row["growth"]),
                "years": (time - orbits[des].epoch).to_value(u.yr),
                "orbit": event["orbit_id"],
            }
        )
    print(f"\nNeoWs approaches to other bodies, against orbits of the same list, {eph.name}, no A1 A2")
    print(
        f"{'asteroid':10} {'body':8} {'rows':>5} {'hold':>5} {'median (km)':>12} {'max (km)':>12} {'median (s)':>11}"
    )
    for des, body in sorted({(r["des"], r["body"]) for r in out}, key=str):
        some = [r for r in out if (r["des"], r["body"]) == (des, body)]
        error = np.abs([r["error"] for r in some])
        late = np.abs([r["seconds"] for r in some])
        print(
            f"{des:10} {body:8} {len(some):5d} {sum(bool(r['holds']) for r in some):5d} "
            f"{np.median(error):12.3f} {error.max():12.3f} {np.median(late):11.1f}"
        )
    print("\nrows that disagree (time off by more than 90 s, or 18 h where only the date is given)")
    for r in out:
        if not r["holds"]:
            print(
                f"{r['des']:10} {r['body']:8} {r['date']:18} {r['km']:14.1f} km, ours {r['error']:+12.1f} km "
                f"{r['seconds']:+11.1f} s; {r['years']:+7.1f} yr from the epoch, growth {r['growth']:.3g}"
            )
    return out


def _time(event: dict[str, str]) -> Time:
    """Time of a row, or noon of its date where there is no time."""
    return Time(f"{event['date']} {event['cd_tdb'].partition(' ')[2] or '12:00'}", scale="tdb")


def tracks(folder: Path = DATA) -> list[tuple[str, float, float, float]]:
    """Horizons' geocentric points through three flybys against the track from a state before each.

    Returns
    -------
    list of tuple
        Asteroid, days from closest approach, distance (km), gap (km), for every point.
    """
    points: dict[str, list[dict[str, str]]] = {}
    with (folder / "horizons_geocentric_tracks.csv").open() as file:
        for row in csv.DictReader(file):
            points.setdefault(row["slug"], []).append(row)
    out = []
    print("\nHorizons geocentric tracks, from the state before each flyby (its own fit residual: max)")
    print(
        f"{'flyby':16} {'points':>7} {'days':>14} {'closest (km)':>13} {'median (km)':>12} {'p90 (km)':>9} "
        f"{'max (km)':>9} {'at closest (km)':>16} {'fit (km)':>9}"
    )
    with (folder / "preflyby_states_fitted.csv").open() as file:
        states = list(csv.DictReader(file))
    for state in states:
        orbit = Orbit.from_state(
            _jd(state["epoch_jd_tdb"]),
            [float(state[c]) for c in ("x_au_helio_icrf", "y_au", "z_au")] * u.au,
            [float(state[c]) for c in ("vx_au_d", "vy_au_d", "vz_au_d")] * u.au / u.d,
            name=state["slug"],
        )
        here = points[state["slug"]]
        gaps, sizes, times = [], [], []
        for row in here:
            time = later(Time(2451545.0, format="jd", scale="tdb"), float(row["tdb_s_past_j2000"]))
            want = np.array([float(row[c]) for c in ("x_km", "y_km", "z_km")])
            ours = orbit.at(time, "earth")[0].to_value(u.km)
            gaps.append(float(np.linalg.norm(ours - want)))
            sizes.append(float(np.linalg.norm(want)))
            times.append(seconds(time, orbit.epoch) / 86400)
        near = int(np.argmin(sizes))
        out += [(state["slug"], t - times[near], d, g) for t, d, g in zip(times, sizes, gaps, strict=True)]
        q = np.percentile(gaps, [50, 90])
        print(
            f"{state['slug']:16} {len(here):7d} {times[0] - times[near]:6.1f} to {times[-1] - times[near]:4.1f} "
            f"{sizes[near]:13.1f} {q[0]:12.4f} {q[1]:9.4f} {max(gaps):9.4f} {gaps[near]:16.4f} "
            f"{float(state['max_residual_km']):9.4f}"
        )
    return out


def _jd(text: str) -> Time:
    whole, _, rest = text.partition(".")
    return Time(float(whole), float("0." + rest), format="jd", scale="tdb")


def main(arguments: list[str]) -> int:
    """Print the requested tables, by default all."""
    known = {"planets": planets, "tracks": tracks}
    for name in arguments or list(known):
        if name not in known:
            print(f"unknown table {name!r}; known: {', '.join(known)}", file=sys.stderr)
            return 2
        known[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
