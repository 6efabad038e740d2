"""Build data/lightcurves.csv, the trusted spin periods of near-Earth asteroids, from the LCDB summary.

python scripts/build_lightcurves.py [DIRECTORY of the source tables, ../shared/data by default]
"""

import csv
import gzip
import io
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
COLUMNS = ("number", "designation", "H_mag", "spin_period_h", "amplitude_mag", "quality", "tumbles")


def main() -> None:
    directory = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parents[1] / "shared" / "data"
    with gzip.open(directory / "lcdb_summary_nea_2021.csv.gz") as raw:
        rows = list(csv.DictReader(io.TextIOWrapper(raw, encoding="utf-8")))
    out = HERE.parent / "data" / "lightcurves.csv"
    count = 0
    with out.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for r in rows:
            # U = 2 and better: a period wrong by no more than a whole or half number of cycles (LCDB readme).
            trusted = r["U"] in ("2", "2+", "3-", "3") and r["PFlag"] == "-"
            if not trusted or float(r["19-Period"]) <= 0.0:
                continue
            number = r["Number"] if r["Number"] not in ("", "0", "-9") else ""
            amplitude = r["23-AmpMax"] if float(r["23-AmpMax"]) > 0.0 and r["AmpFlag"] in ("-", "") else ""
            h = r["10-H"] if float(r["10-H"]) > 0.0 else ""
            # T, T+, T?: tumbling, or possibly; T0: looked for and not found.
            tumbles = "Y" if r["Notes"].startswith("T") and not r["Notes"].startswith("T0") else ""
            writer.writerow([number, r["Desig"], h, r["19-Period"], amplitude, r["U"], tumbles])
            count += 1
    print(f"{count} of {len(rows)} lightcurves -> {out}")


if __name__ == "__main__":
    main()
