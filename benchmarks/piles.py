"""The model against discrete elements and over a grid of encounters.

python benchmarks/piles.py grains     table: verdict, shape and spin against discrete elements
python benchmarks/piles.py map        outcome over periapsis and v_inf: prograde, no spin, retrograde
"""

from __future__ import annotations

import sys

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.body.body import YIELD_SURFACES

# Discrete elements (Yade, 541 grains; see docs): periapsis (R_E), largest clump, a2/a1, a3/a1, period (h).
GRAINS = (
    (1.9, 0.56, 0.25, 0.22, np.nan),
    (2.1, 0.967, 0.22, 0.17, 11.7),
    (2.3, 1.0, 0.412, 0.360, 5.25),
    (2.6, 1.0, 0.585, 0.513, 4.50),
    (5.96, 1.0, 0.603, 0.531, 5.591),
)
ANGLES = (25.0, 28.0, 30.0, 35.0, 40.0)
LETTERS = {
    "INTACT": ".",
    "RESHAPED": "r",
    "MASS LOSS": "m",
    "DISRUPTED": "S",
    "BEYOND MODEL": ">",
    "NOT IN EQUILIBRIUM": "x",
    "FAILED": "?",
}


def earth(q: float, v_inf: float) -> fs.Encounter:
    return fs.Encounter.hyperbolic(
        "earth", periapsis=q * fs.R_earth, v_inf=v_inf * u.km / u.s, start_distance=10 * fs.R_earth
    )


def grains() -> None:
    """Table of the model on every surface and friction angle, with the misfit of the final shape."""
    pile = fs.Body(semi_axes=[1408, 850, 748] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)
    print(
        "entries: a2/a1 a3/a1 period (h), or > where the axis ratio passed 6:1; misfit: rms of ln(a1) at q >= 2.1"
    )
    header = "  ".join(f"q = {q:<14g}" for q, *_ in GRAINS)
    print(f"{'surface':26s} {'phi':>4s}  {header}  misfit")
    truth = "  ".join(f"{b:.3f} {c:.3f} {p:6.2f}  " for _, _, b, c, p in GRAINS)
    print(f"{'discrete elements':26s} {'':4s}  {truth}")
    for surface in YIELD_SURFACES:
        for phi in ANGLES:
            body = pile.with_(material=fs.Material(friction_angle=phi * u.deg, yield_surface=surface))
            n = len(GRAINS)
            table = fs.flyby_many([body] * n, [earth(q, 5.0) for q, *_ in GRAINS])
            a = table.semi_axes.to_value(u.m)
            cells, misfit = [], []
            for i, (q, _, b, c, _) in enumerate(GRAINS):
                period = 2.0 * np.pi / table.spin[i].to_value(u.rad / u.h)
                beyond = table.verdict[i] == "BEYOND MODEL"
                cells.append(
                    f"{'>':18s}"
                    if beyond
                    else f"{a[i, 1] / a[i, 0]:.3f} {a[i, 2] / a[i, 0]:.3f} {period:6.2f}  "
                )
                if q >= 2.1:  # equal volumes: ln a1 = -ln(ratios)/3; 6:1 is used for larger ratios
                    misfit.append(np.log(b * c) / 3.0 - np.log(a[i, 1] * a[i, 2] / a[i, 0] ** 2) / 3.0)
            print(f"{surface:26s} {phi:4.0f}  {'  '.join(cells)}  {np.sqrt(np.mean(np.square(misfit))):.3f}")


def outcome_map() -> None:
    """Worst outcome over six phases of the spin, for three spins."""
    phases = [Rotation.from_euler("z", 30 * k, degrees=True).as_matrix() for k in range(6)]
    order = list(LETTERS)
    q_grid = np.arange(1.1, 3.01, 0.1)
    print("worst of six spin phases:", ", ".join(f"{v} {k}" for k, v in LETTERS.items()))
    for name, period in (("prograde 6 h", 6 * u.h), ("no spin", None), ("retrograde 6 h", -6 * u.h)):
        body = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=period)
        print(f"\n{name}\nv_inf (km/s)  q (R_E): {q_grid[0]:.1f} to {q_grid[-1]:.1f} in steps of 0.1")
        for v in (0, 2, 5, 8, 12, 16, 20):
            n = len(q_grid) * len(phases)
            encounters = [e for q in q_grid for e in [earth(q, float(v))] * len(phases)]
            table = fs.flyby_many([body] * n, encounters, phases * len(q_grid), tolerance=1e-6)
            verdicts = table.verdict.reshape(len(q_grid), len(phases))
            worst = [max(row, key=lambda x: order.index(str(x))) for row in verdicts]
            print(f"{v:12d}  {''.join(LETTERS[str(x)] for x in worst)}")


if __name__ == "__main__":
    commands = {"grains": grains, "map": outcome_map}
    if len(sys.argv) != 2 or sys.argv[1] not in commands:
        raise SystemExit(__doc__)
    commands[sys.argv[1]]()
