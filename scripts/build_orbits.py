"""Build data/orbits.csv, semi-major axis, eccentricity, inclination and H of the known near-Earth asteroids.

python scripts/build_orbits.py [DIRECTORY of the source tables, ../shared/data by default]

Asteroids of H < 20 (about 350 m), sorted by H.
"""

import csv
import gzip
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
LIMIT = 20.0


def main() -> None:
    directory = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parents[1] / "shared" / "data"
    with gzip.open(directory / "nea_mpc_2026-02.csv.gz", "rt", encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if r["H"] and float(r["H"]) < LIMIT]
    rows.sort(key=lambda r: (float(r["H"]), r["principal_desig"]))
    out = HERE.parent / "data" / "orbits.csv"
    with out.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["designation", "a", "e", "i", "H"])
        for r in rows:
            elements = [f"{float(r[k]):.{digits}f}" for k, digits in (("a_au", 4), ("e", 4), ("i_deg", 3))]
            writer.writerow([r["number"] or r["principal_desig"], *elements, r["H"]])
    print(f"{out}: {len(rows)} asteroids of H < {LIMIT:g}")


if __name__ == "__main__":
    main()
