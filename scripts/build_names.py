"""Build data/names.csv, names and designations of numbered near-Earth asteroids, from tables of the MPC and JPL.

python scripts/build_names.py [DIRECTORY of the source tables, ../shared/data by default]
"""

import csv
import gzip
import io
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def rows(path: Path) -> list[dict[str, str]]:
    with gzip.open(path) as raw:
        return list(csv.DictReader(io.TextIOWrapper(raw, encoding="utf-8")))


def main() -> None:
    directory = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parents[1] / "shared" / "data"
    found: dict[int, tuple[str, str]] = {}
    for file in ("nea_sbdb_fullprec_2020-09.csv.gz", "nea_sbdb_numbered_2023_phys.csv.gz"):
        for r in rows(directory / file):
            if r["pdes"].strip().isdigit() and "(" in r["full_name"]:
                designation = r["full_name"].partition("(")[2].rstrip(") ")
                found[int(r["pdes"])] = r["name"].strip(), designation
    for r in rows(directory / "nea_mpc_2026-02.csv.gz"):  # the latest names
        if r["number"]:
            found[int(r["number"])] = r["name"].strip(), r["principal_desig"].strip()
    out = HERE.parent / "data" / "names.csv"
    with out.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("number", "name", "designation"))
        writer.writerows((number, *pair) for number, pair in sorted(found.items()))
    print(f"{len(found)} names -> {out}")


if __name__ == "__main__":
    main()
