"""Build data/asteroids.csv from tables of JPL, MPC and LCDB and from literature values.

    python scripts/build_catalogue.py [--source DIRECTORY] [--output FILE]

The source directory (default ``../shared/data``) holds the tables; the literature values are in
``literature.csv`` next to this script. The same sources give the same file, byte for byte. Every column
is explained in data/README.md. A value that nobody measured is listed in the column ``assumed``.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import io
import json
import math
import sys
from collections import Counter
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
G = 6.6743e-11
#: Of the Sun in DE440/441, the one behind JPL's osculating elements, au3/d2.
GM_SUN = 132712440041.279419 * 86400.0**2 / 149597870.7**3
OBLIQUITY = math.radians(84381.448 / 3600)

#: Elongation from a lightcurve amplitude dm (mag): a/b = 10^(0.4 f dm). Most amplitudes of the LCDB are the
#: largest seen, often at large solar phase, where amplitude grows; f = 0.5 is the best fit to the bodies of
#: this table that have both an amplitude and a measured shape (the summary prints the fit and its scatter).
AMPLITUDE_FACTOR = 0.5
#: 1-sigma of log10(a/b) for that rule: the scatter of the same fit.
ELONGATION_SCATTER = 0.1
#: c/b where it is not known, with its 1-sigma: mean and scatter of the measured shapes of this table.
FLATTENING, FLATTENING_SIGMA = 0.9, 0.1
#: Largest a/b that the rule may give (Geographos, the most elongated measured shape of the table, has 2.6).
ELONGATION_MAX = 3.0
#: Bulk density where it is not known, kg/m3: mean and spread of the measured NEAs of this table by complex.
DENSITY = {"S": (2300.0, 500.0), "C": (1300.0, 300.0), "X": (2000.0, 700.0), "?": (2000.0, 700.0)}
#: Taxonomic letter -> complex. Q, V, K, L, A, O are stony and take the S value.
COMPLEX = dict.fromkeys("SQVKLAOR", "S") | dict.fromkeys("CBFGDT", "C") | dict.fromkeys("XEMP", "X")

COLUMNS = [
    "number",
    "name",
    "designation",
    "aliases",
    "orbit_class",
    "pha",
    "H_mag",
    "taxonomic_class",
    "taxonomic_source",
    "binary",
    "shape_kind",
    "semi_axis_a_m",
    "semi_axis_a_sigma_m",
    "semi_axis_b_m",
    "semi_axis_b_sigma_m",
    "semi_axis_c_m",
    "semi_axis_c_sigma_m",
    "semi_axes_source",
    "diameter_m",
    "diameter_sigma_m",
    "diameter_source",
    "spin_state",
    "spin_period_h",
    "spin_period_sigma_h",
    "spin_source",
    "amplitude_mag",
    "amplitude_source",
    "pole_ecl_lon_deg",
    "pole_ecl_lat_deg",
    "pole_source",
    "tumbling_mode",
    "precession_period_h",
    "precession_period_sigma_h",
    "rotation_period_h",
    "rotation_period_sigma_h",
    "inertia_a_over_c",
    "inertia_b_over_c",
    "tumbling_source",
    "density_kg_m3",
    "density_sigma_kg_m3",
    "density_assumed",
    "density_source",
    "frame",
    "epoch_jd_tdb",
    "a_au",
    "e",
    "i_deg",
    "node_deg",
    "peri_deg",
    "M_deg",
    "sigma_a_au",
    "sigma_e",
    "sigma_i_deg",
    "sigma_node_deg",
    "sigma_peri_deg",
    "sigma_M_deg",
    "sigma_source",
    "A1_au_d2",
    "A2_au_d2",
    "A3_au_d2",
    "nongrav_source",
    "orbit_solution",
    "condition_code",
    "condition_code_source",
    "orbit_source",
    "assumed",
    "unchecked",
    "notes",
]

ELEMENTS = {"a_au": "a", "e": "e", "i_deg": "i", "node_deg": "om", "peri_deg": "w", "M_deg": "ma"}


def rows(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file, plain or gzipped."""
    raw = path.read_bytes()
    data = gzip.decompress(raw) if path.suffix == ".gz" else raw
    return [dict(r) for r in csv.DictReader(io.StringIO(data.decode(), newline=""))]


def number(text: str | None) -> float:
    """A float, nan where the cell is empty or says that it is."""
    if not text or text in ("-", "-9.99"):
        return math.nan
    return float(text)


def text(value: float | str | None, digits: int = 6) -> str:
    """A cell: empty for nan, else `digits` significant digits."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    return value if isinstance(value, str) else f"{value:.{digits}g}"


def last_digit(value: str) -> float:
    """One unit in the last decimal place of a printed number: a stand-in for an unpublished sigma."""
    return 10.0 ** -len(value.partition(".")[2])


def ecliptic(ra: float, dec: float) -> tuple[float, float]:
    """Ecliptic longitude and latitude (deg) of an equatorial direction (deg), J2000."""
    a, d = math.radians(ra), math.radians(dec)
    x, y, z = math.cos(a) * math.cos(d), math.sin(a) * math.cos(d), math.sin(d)
    c, s = math.cos(OBLIQUITY), math.sin(OBLIQUITY)
    y, z = c * y + s * z, c * z - s * y
    return math.degrees(math.atan2(y, x)) % 360, math.degrees(math.asin(z))


def elements_of_state(r: np.ndarray, v: np.ndarray) -> dict[str, str]:
    """Osculating elliptic elements of a heliocentric ICRF state (au, au/d), J2000 ecliptic."""
    c, s = math.cos(OBLIQUITY), math.sin(OBLIQUITY)
    turn = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    r, v = turn @ r, turn @ v
    h = np.cross(r, v)
    distance = float(np.linalg.norm(r))
    ev = np.cross(v, h) / GM_SUN - r / distance
    e = float(np.linalg.norm(ev))
    a = 1 / (2 / distance - float(v @ v) / GM_SUN)
    node = math.atan2(h[0], -h[1])
    inclination = math.atan2(math.hypot(h[0], h[1]), h[2])
    n = np.array([math.cos(node), math.sin(node), 0.0])
    m = np.cross(h / np.linalg.norm(h), n)
    peri = math.atan2(float(ev @ m), float(ev @ n))
    sin_e, cos_e = float(r @ v) / math.sqrt(GM_SUN * a), 1 - distance / a
    ecc = math.atan2(sin_e, cos_e)
    values = (
        a,
        e,
        *(math.degrees(x) for x in (inclination, node % math.tau, peri % math.tau, (ecc - sin_e) % math.tau)),
    )
    return dict(zip(ELEMENTS, (f"{x:.16g}" for x in values), strict=True))


class Sources:
    """The tables, keyed by number or, for an unnumbered body, by designation."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.new = {r["pdes"]: r for r in rows(directory / "nea_sbdb_fullprec_2026-07.csv.gz")}
        self.old = {
            r["pdes"]: r
            for r in rows(directory / "nea_sbdb_fullprec_2020-09.csv.gz")
            if r["class"] in ("APO", "AMO", "ATE", "IEO")
        }
        self.phys = {r["pdes"]: r for r in rows(directory / "nea_sbdb_numbered_2023_phys.csv.gz")}
        self.mpc = {
            r["number"] or r["principal_desig"]: r for r in rows(directory / "nea_mpc_2026-02.csv.gz")
        }
        self.lcdb = {}
        for r in rows(directory / "lcdb_summary_nea_2021.csv.gz"):
            self.lcdb[r["Number"] if r["Number"] not in ("", "0", "-9") else r["Desig"]] = r
        self.apophis = json.loads((directory / "apophis_sbdb_jpl220.json").read_text())
        self.states = {r["des"]: r for r in rows(directory / "preflyby_states_fitted.csv")}
        self.literature = {r["key"]: r for r in rows(HERE / "literature.csv")}

    def selection(self) -> list[str]:
        """Bodies with a measured size, a trusted period and a full-precision orbit, and the famous ones."""
        chosen = set(self.literature)
        for key, r in self.lcdb.items():
            trusted = r["U"] in ("2+", "3-", "3") and r["PFlag"] == "-"
            amplitude = number(r["23-AmpMax"]) > 0 and r["AmpFlag"] in ("-", "")
            has_orbit = key in self.new or (
                key in self.old and int(self.old[key]["condition_code"] or 9) <= 2
            )
            if trusted and amplitude and has_orbit and not math.isnan(self.diameter(key)[0]):
                chosen.add(key)
        return sorted(chosen, key=lambda k: (0, int(k), "") if k.isdigit() else (1, 0, k))

    def diameter(self, key: str) -> tuple[float, float, str]:
        """Diameter and its 1-sigma (km; nan where not given) and source, from the newest SBDB table."""
        sigma = number(self.old.get(key, {}).get("diameter_sigma"))
        for table, label in ((self.new, "2026-07"), (self.phys, "2023"), (self.old, "2020-09")):
            d = number(table.get(key, {}).get("diameter"))
            if not math.isnan(d):
                # A sigma belongs to the value it was published with.
                same = abs(d - number(self.old.get(key, {}).get("diameter"))) < 1e-9
                return d, sigma if same else math.nan, f"JPL SBDB {label}"
        return math.nan, math.nan, ""


def names(key: str, s: Sources) -> dict[str, str]:
    """Number, name, designation and other names."""
    mpc, lit = s.mpc.get(key, {}), s.literature.get(key, {})
    full = (s.old.get(key) or s.phys.get(key) or {}).get("full_name", "")
    designation = (
        full.partition("(")[2].rstrip(") ")
        or mpc.get("principal_desig", "")
        or ("" if key.isdigit() else key)
    )
    name = ""
    for candidate in (
        lit.get("name"),
        s.new.get(key, {}).get("name"),
        s.old.get(key, {}).get("name"),
        mpc.get("name"),
    ):
        if candidate:
            name = candidate
            break
    others = [mpc.get("principal_desig", ""), *mpc.get("other_desigs", "").replace("|", ";").split(";")]
    others += lit.get("aliases", "").split(";")
    aliases = sorted({o.strip() for o in others if o.strip()} - {designation, name})
    return {
        "number": key if key.isdigit() else "",
        "name": name or designation,
        "designation": designation,
        "aliases": ";".join(aliases),
    }


def orbit(key: str, s: Sources) -> dict[str, str]:
    """Elements as printed in the source, their 1-sigmas, forces, solution and quality."""
    old, new, phys, mpc = (t.get(key, {}) for t in (s.old, s.new, s.phys, s.mpc))
    out = {"frame": "heliocentric, ecliptic J2000 (obliquity 84381.448 arcsec), TDB"}
    if key == "99942":
        o = s.apophis["orbit"]
        el = {x["name"]: x for x in o["elements"]}
        out |= {k: el[v]["value"] for k, v in ELEMENTS.items()}
        out |= {"sigma_" + k: el[v]["sigma"] for k, v in ELEMENTS.items()}
        pars = {x["name"]: x["value"] for x in o["model_pars"]}
        return out | {
            "epoch_jd_tdb": o["epoch"],
            "A1_au_d2": pars["A1"],
            "A2_au_d2": pars["A2"],
            "sigma_source": f"JPL SBDB, solution JPL {o['orbit_id']}",
            "nongrav_source": f"JPL SBDB, solution JPL {o['orbit_id']} (A1 = 5e-13 set, A2 estimated; 1/r^2)",
            "orbit_solution": f"JPL {o['orbit_id']}",
            "condition_code": o["condition_code"],
            "condition_code_source": f"JPL SBDB, solution JPL {o['orbit_id']}",
            "orbit_source": f"JPL SBDB ({o['producer']}, {o['soln_date'][:10]})",
        }
    if key in s.states and not new and not old:
        st = s.states[key]
        r = np.array([float(st[c + "_au_helio_icrf" if c == "x" else c + "_au"]) for c in "xyz"])
        v = np.array([float(st[f"v{c}_au_d"]) for c in "xyz"])
        out |= elements_of_state(r, v) | {
            "epoch_jd_tdb": st["epoch_jd_tdb"],
            "orbit_solution": f"state fitted to Horizons, JPL {st['jpl_orbit_id']}",
            "orbit_source": "osculating elements of a state fitted to JPL Horizons geocentric positions "
            f"(largest residual {float(st['max_residual_km']) * 1000:.0f} m)",
        }
    elif new:
        out |= {k: new[v] for k, v in ELEMENTS.items()} | {
            "epoch_jd_tdb": new["epoch"],
            "orbit_solution": "not stated (SBDB 2026-07)",
            "orbit_source": "JPL SBDB, full precision, 2026-07",
        }
    else:
        out |= {k: old[v] for k, v in ELEMENTS.items()} | {
            "epoch_jd_tdb": old["epoch"],
            "orbit_solution": old["orbit_id"],
            "orbit_source": f"JPL SBDB, full precision, 2020-09 ({old['producer']})",
        }
    if old:
        out |= {"sigma_" + k: old["sigma_" + v] for k, v in ELEMENTS.items()}
        out["sigma_source"] = f"JPL SBDB 2020-09, solution {old['orbit_id']} at JD {old['epoch']}"
        if new:
            out["sigma_source"] += " (older than the elements)"
    for table, label in ((phys, "JPL SBDB 2023"), (old, "JPL SBDB 2020-09")):
        if any(table.get(a) for a in ("A1", "A2", "A3")):
            out |= {f"{a}_au_d2": table[a] for a in ("A1", "A2", "A3") if table.get(a)}
            out["nongrav_source"] = label + (
                "" if out["orbit_source"].startswith(label) else " (older than the elements)"
            )
            break
    if mpc.get("U", "").isdigit():
        out |= {"condition_code": mpc["U"], "condition_code_source": "MPC 2026-02 (U)"}
    elif old.get("condition_code"):
        out |= {
            "condition_code": old["condition_code"],
            "condition_code_source": f"JPL SBDB 2020-09, {old['orbit_id']}",
        }
    return out


def taxonomy(key: str, s: Sources) -> tuple[str, str, str]:
    """Class, source and complex (S, C, X or ?)."""
    old, lit = s.old.get(key, {}), s.literature.get(key, {})
    if key == "99942":
        cls, source = "Sq", "Binzel et al. 2009 (JPL SBDB)"
    elif old.get("spec_B"):
        cls, source = old["spec_B"], "SMASSII (JPL SBDB 2020-09)"
    elif old.get("spec_T"):
        cls, source = old["spec_T"], "Tholen (JPL SBDB 2020-09)"
    elif lit.get("taxonomy"):
        cls, source = lit["taxonomy"], "literature"
    else:
        return "", "", "?"
    return cls, source, COMPLEX.get(cls[0], "?")


def spin(key: str, s: Sources) -> tuple[dict[str, str], list[str]]:
    """Period, state, amplitude and pole, and the columns of it that are assumed."""
    lit, lc = s.literature.get(key, {}), s.lcdb.get(key, {})
    out: dict[str, str] = {}
    assumed = []
    if lit.get("period_h"):
        out |= {"spin_period_h": lit["period_h"], "spin_source": lit["spin_source"]}
        sigma = lit["period_sigma_h"]
    elif number(lc.get("19-Period")) > 0 and lc["U"] in ("2", "2+", "3-", "3"):
        out |= {"spin_period_h": lc["19-Period"], "spin_source": f"LCDB 2021 (U = {lc['U']})"}
        sigma = ""
    else:
        period = next(t[key]["rot_per"] for t in (s.phys, s.old) if t.get(key, {}).get("rot_per"))
        out |= {"spin_period_h": period, "spin_source": "JPL SBDB"}
        sigma = ""
    if not sigma:
        sigma = text(last_digit(out["spin_period_h"]), 3)
        assumed.append("spin_period_sigma_h")
    out["spin_period_sigma_h"] = sigma
    if lit.get("amplitude_mag"):
        out |= {"amplitude_mag": lit["amplitude_mag"], "amplitude_source": "literature"}
    elif number(lc.get("23-AmpMax")) > 0:
        out |= {"amplitude_mag": lc["23-AmpMax"], "amplitude_source": "LCDB 2021, largest seen"}
    notes = lc.get("Notes", "")
    if lit.get("spin_state"):
        out["spin_state"] = lit["spin_state"]
    elif "T" in notes and "T0" not in notes:
        out["spin_state"] = "possibly tumbling" if "T?" in notes else "tumbling"
    else:
        out["spin_state"] = "principal"
        if "T0" not in notes:
            assumed.append("spin_state")
    if lit.get("pole_deg"):
        lon, lat = (float(x) for x in lit["pole_deg"].split())
        source = lit["pole_source"]
        if lit["pole_frame"] == "equatorial":
            lon, lat = ecliptic(lon, lat)
            source += ", converted from RA and Dec"
        out |= {"pole_ecl_lon_deg": text(lon), "pole_ecl_lat_deg": text(lat), "pole_source": source}
    return out, assumed


#: Tumbling solutions. Inertia ratios are moments about the long (a), middle (b) and short (c) axes.
TUMBLING = {
    "99942": {
        "tumbling_mode": "SAM",
        "precession_period_h": "27.38547",
        "precession_period_sigma_h": "0.003",
        "rotation_period_h": "264.178",
        "rotation_period_sigma_h": "0.3",
        "inertia_a_over_c": "0.64",
        "inertia_b_over_c": "0.97",
        "tumbling_source": "Lee et al. 2022 (P_phi, P_psi, Ia : Ib : Ic = 0.64 : 0.97 : 1)",
    },
    "4179": {
        "tumbling_mode": "LAM",
        "precession_period_h": "176.4",
        "precession_period_sigma_h": "1.2",
        "rotation_period_h": "129.84",
        "rotation_period_sigma_h": "1.2",
        "inertia_a_over_c": "0.3106",
        "inertia_b_over_c": "0.9596",
        "tumbling_source": "Hudson & Ostro 1995: long axis precesses in 7.35 d, rotation about it 5.41 d; "
        "Ostro et al. 1999: Ic/Ia = 3.22, Ib/Ia = 3.09",
    },
}


def shape(key: str, s: Sources, amplitude: float) -> tuple[dict[str, str], list[str]]:
    """Semi-axes (m), how they are known, and the columns of it that are assumed."""
    lit = s.literature.get(key, {})
    out: dict[str, str] = {}
    assumed = []
    d, sd, d_source = s.diameter(key)
    if lit.get("diameter_km"):
        d, sd, d_source = float(lit["diameter_km"]), number(lit["diameter_sigma_km"]), lit["diameter_source"]
    if lit.get("axes_km"):
        # Sorted: some sources give the extents along body axes that are not in order of length.
        pairs = sorted(
            zip(map(float, lit["axes_km"].split()), map(float, lit["axes_sigma_km"].split()), strict=True),
            reverse=True,
        )
        axes, sigmas = np.array(pairs).T * 500.0
        source = lit["axes_source"]
        kind = "measured"
        mean = 2 * float(np.prod(axes)) ** (1 / 3)
        if lit["rescale"]:
            factor = d * 1000 / mean
            axes, sigmas = axes * factor, sigmas * factor
            source += f"; scaled by {factor:.4f} to the volume of the equivalent diameter"
        else:
            d, sd = mean / 1000, mean / 1000 * float(np.linalg.norm(sigmas / axes)) / 3
            d_source = "from the semi-axes"
    elif key == "99942":
        t = TUMBLING[key]
        ja, jb = float(t["inertia_a_over_c"]), float(t["inertia_b_over_c"])
        # J = (m/5)(b2 + c2, a2 + c2, a2 + b2)
        squares = np.array([jb + 1 - ja, ja + 1 - jb, ja + jb - 1]) / 2
        axes = np.sqrt(squares / np.prod(squares) ** (1 / 3)) * d * 500
        sigmas = axes * sd / d
        kind = "measured"
        source = (
            "homogeneous ellipsoid with the inertia ratios of Lee et al. 2022 (0.64 : 0.97 : 1) and the "
            "volume of the equivalent diameter 340 +- 40 m of Brozovic et al. 2018; the uncertainty is "
            "that of the diameter"
        )
    else:
        kind = "size+elongation"
        if math.isnan(sd):
            sd = 0.15 * d
            assumed.append("diameter_sigma_m")
        ratio = min(10 ** (0.4 * AMPLITUDE_FACTOR * amplitude), ELONGATION_MAX)
        a = d * 500 * (ratio**2 / FLATTENING) ** (1 / 3)  # a b c = r3, b = a/ratio, c = FLATTENING b
        axes = np.array([a, a / ratio, FLATTENING * a / ratio])
        # Relative errors: the size (all three alike), the elongation and the flattening.
        de = ELONGATION_SCATTER * math.log(10)
        df = FLATTENING_SIGMA / FLATTENING
        size = sd / d
        sigmas = axes * np.array(
            [
                math.hypot(size, 2 / 3 * de, df / 3),
                math.hypot(size, de / 3, df / 3),
                math.hypot(size, de / 3, 2 / 3 * df),
            ]
        )
        source = (
            f"diameter and a/b = 10^(0.4 x {AMPLITUDE_FACTOR} x amplitude), at most {ELONGATION_MAX:g}; "
            f"c/b = {FLATTENING} +- {FLATTENING_SIGMA}"
        )
        assumed += [f"semi_axis_{x}{y}_m" for x in "abc" for y in ("", "_sigma")]
    out |= {"shape_kind": kind, "semi_axes_source": source, "diameter_source": d_source}
    for x, value, sigma in zip("abc", axes, sigmas, strict=True):
        out[f"semi_axis_{x}_m"], out[f"semi_axis_{x}_sigma_m"] = text(float(value)), text(float(sigma), 3)
    out["diameter_m"], out["diameter_sigma_m"] = text(d * 1000), text(sd * 1000, 3)
    return out, assumed


def density(key: str, s: Sources, complex_: str) -> tuple[dict[str, str], list[str]]:
    """Bulk density, measured or assumed from the taxonomic complex."""
    lit = s.literature.get(key, {})
    if lit.get("density_g_cm3"):
        return {
            "density_kg_m3": text(float(lit["density_g_cm3"]) * 1000),
            "density_sigma_kg_m3": text(float(lit["density_sigma_g_cm3"]) * 1000),
            "density_assumed": "false",
            "density_source": lit["density_source"],
        }, []
    if key == "99942":
        value, sigma, source = 2600.0, 500.0, "assumed: the value usual in the literature on Apophis"
    elif key == "1866":
        value, sigma, source = 1600.0, 500.0, "assumed: estimate in the literature, not a measurement"
    else:
        value, sigma = DENSITY[complex_]
        what = f"complex {complex_}" if complex_ != "?" else "unknown complex"
        source = f"assumed from the taxonomic class ({what}); see data/README.md"
    return {
        "density_kg_m3": text(value),
        "density_sigma_kg_m3": text(sigma),
        "density_assumed": "true",
        "density_source": source,
    }, ["density_kg_m3", "density_sigma_kg_m3"]


def record(key: str, s: Sources) -> dict[str, str]:
    """One row of the catalogue."""
    old, new, phys, lc = (t.get(key, {}) for t in (s.old, s.new, s.phys, s.lcdb))
    lit = s.literature.get(key, {})
    cls, cls_source, complex_ = taxonomy(key, s)
    out = names(key, s) | orbit(key, s)
    out |= {
        "orbit_class": new.get("class") or old.get("class") or phys.get("class") or "",
        "pha": {"True": "Y", "False": "N"}.get(new.get("pha", ""), old.get("pha", "")),
        "H_mag": new.get("H") or old.get("H") or phys.get("H") or s.mpc.get(key, {}).get("H", ""),
        "taxonomic_class": cls,
        "taxonomic_source": cls_source,
        "binary": {"B": "binary", "M": "multiple", "?": "suspected"}.get(lc.get("IsBinary", "-"), ""),
        "unchecked": lit.get("unchecked", ""),
        "notes": lit.get("notes", ""),
    }
    turning, assumed = spin(key, s)
    out |= turning | TUMBLING.get(key, {})
    form, more = shape(key, s, number(turning.get("amplitude_mag")))
    rho, yet_more = density(key, s, complex_)
    out |= form | rho
    out["assumed"] = ";".join([*assumed, *more, *yet_more])
    return {c: out.get(c, "") for c in COLUMNS}


def summary(table: list[dict[str, str]]) -> None:
    """Counts, and the measurements behind the assumed values."""
    print(f"{len(table)} asteroids")
    for column in ("shape_kind", "spin_state", "density_assumed", "taxonomic_class", "orbit_source"):
        print(f"  {column}: {dict(Counter(r[column] for r in table).most_common(8))}")
    measured = [r for r in table if r["shape_kind"] == "measured"]
    axes = {r["name"]: [float(r[f"semi_axis_{x}_m"]) for x in "abc"] for r in measured}
    cb = np.array([c / b for _, b, c in axes.values()])
    print(f"  measured shapes: c/b mean {cb.mean():.3f}, sd {cb.std(ddof=1):.3f} of {len(cb)}")
    seen = [r for r in measured if r["amplitude_source"].startswith("LCDB")]
    dm = np.array([float(r["amplitude_mag"]) for r in seen])
    ab = np.array([axes[r["name"]][0] / axes[r["name"]][1] for r in seen])
    f = float(dm @ np.log10(ab) / (0.4 * dm @ dm))
    residual = np.log10(ab) - 0.4 * AMPLITUDE_FACTOR * dm
    print(
        f"  a/b against amplitude: best factor {f:.3f}; rms residual of log10(a/b) {residual.std():.3f}"
        f" of {len(dm)}"
    )
    for group in "SC":
        rho = [
            float(r["density_kg_m3"])
            for r in table
            if r["density_assumed"] == "false" and COMPLEX.get(r["taxonomic_class"][:1]) == group
        ]
        print(
            f"  measured densities, complex {group}: {np.mean(rho):.0f} +- {np.std(rho, ddof=1):.0f} kg/m3"
            f" of {len(rho)}"
        )


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--source", type=Path, default=HERE.parent.parent / "shared" / "data")
    parser.add_argument("--output", type=Path, default=HERE.parent / "data" / "asteroids.csv")
    args = parser.parse_args(argv)
    if not args.source.is_dir():
        print(f"{args.source} is not a directory: name the one that holds the source tables", file=sys.stderr)
        return 1
    sources = Sources(args.source)
    table = [record(key, sources) for key in sources.selection()]
    with args.output.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    summary(table)
    print(f"wrote {args.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
