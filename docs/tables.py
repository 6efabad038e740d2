"""Make the tables of the documentation: ``python docs/tables.py [NAME ...]``, all of them without a name.

Each is the output of a command, kept with the command in ``docs/tables/NAME.txt`` and shown by a page. Those with
times in them want a quiet machine. A new table is one new entry.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TABLES = {
    "apophis": "python benchmarks/sky.py apophis",
    "apophis_after": "python benchmarks/apophis_after.py",
    "attacks": "python benchmarks/attack.py table",
    "completeness": "python benchmarks/completeness.py out/whole.ecsv",
    "coverage": "python benchmarks/campaign.py coverage",
    "edges": "python benchmarks/edges.py",
    "extremes": "python benchmarks/campaign.py extremes",
    "flyby": "flybystab bench flyby --output docs/images/precision.png",
    "forecast": "python examples/apophis_forecast.py",
    "grains": "python benchmarks/piles.py grains",
    "grains_agreement": "python benchmarks/grains_agreement.py compare docs/tables/grains_runs.csv "
    "--figure docs/images/grains_agreement.png",
    "grains_bench": "flybystab bench grains",
    "grains_cases": "python benchmarks/grains_ellipsoid.py cases --cases 1600 --jobs 2",
    "grains_flybys": "python benchmarks/grains_references.py flybys --cases 26",
    "grains_flybys_2": "python benchmarks/grains_references.py flybys --first 26 --seeds 2",
    "grains_packing": "python benchmarks/grains_packing.py",
    "grains_map": "python benchmarks/grains_ellipsoid.py map --grains 150",
    "honesty": "python benchmarks/honesty.py scripted --encounters 300",
    "honesty_real": "python benchmarks/honesty.py real --every 4",
    "honesty_surfaces": "python benchmarks/honesty.py surfaces --encounters 100 --bodies 20",
    "impacts": "python benchmarks/impacts.py",
    "integrators": "python benchmarks/campaign.py integrators",
    "many": "flybystab bench many",
    "memory": "python benchmarks/screen.py memory",
    "orbit_coverage": "python benchmarks/orbit_errors.py coverage",
    "orbit_factor": "python benchmarks/orbit_errors.py factor",
    "orbit_errors": "python benchmarks/orbit_errors.py runoff digits impacts",
    "other_planets": "python benchmarks/encounters.py planets",
    "outcomes": "python benchmarks/piles.py map",
    "samples": "python benchmarks/screen.py samples",
    "screen": "flybystab bench screen",
    "kappa": "python benchmarks/stability.py kappa",
    "margin": "python benchmarks/margin.py",
    "minima": "python benchmarks/stability.py minima",
    "population_answers": "python benchmarks/population.py answers",
    "population_binaries": "python benchmarks/population.py binaries",
    "population_convergence": "python benchmarks/population.py convergence",
    "population_counts": "python benchmarks/population.py counts",
    "population_nbody": "python benchmarks/population.py nbody",
    "population_nbody_long": "python benchmarks/population.py nbody 10000 60",
    "population_published": "python benchmarks/population.py published",
    "population_scale": "python benchmarks/population.py scale",
    "population_search": "python benchmarks/population.py search 20",
    "population_verdicts": "python benchmarks/population.py verdicts",
    "push": "python benchmarks/stability.py push",
    "sky": "flybystab bench sky",
    "sky_routes": "python benchmarks/sky.py routes",
    "sky_forces": "python benchmarks/sky.py forces",
    "stages": "python benchmarks/completeness.py stages",
    "tolerances": "python benchmarks/campaign.py tolerances",
    "shortcut_distant": "python benchmarks/shortcuts.py distant",
    "shortcut_planar": "python benchmarks/shortcuts.py planar",
    "shapes": "python benchmarks/shapes.py",
    "shapes_freshness": "python benchmarks/shapes.py freshness",
    "shapes_published": "python benchmarks/shapes.py published",
    "shapes_stress": "python benchmarks/shapes.py stress",
    "shapes_timing": "python benchmarks/shapes.py timing",
    "stability": "python benchmarks/stability.py",
    "stress": "python benchmarks/campaign.py stress",
    "versions": "python benchmarks/versions.py out/before",
    "versions_lanes": "python benchmarks/versions.py search out/before_lanes",
    "versions_search": "python benchmarks/versions.py search out/before",
    "verdicts": "python benchmarks/campaign.py verdicts 20000",
    "throughput": "python benchmarks/screen.py throughput",
    "tracks": "python benchmarks/encounters.py tracks",
}


def table(name):
    command = TABLES[name]
    program, *words = command.split()
    here = Path(sys.executable).parent
    done = subprocess.run([here / program, *words], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command} ended with {done.returncode}:\n{done.stderr}")
    path = ROOT / "docs" / "tables" / f"{name}.txt"
    lines = [line.rstrip() for line in done.stdout.strip().splitlines()]
    path.write_text("\n".join([f"$ {command}", *lines]) + "\n")
    print(path)


if __name__ == "__main__":
    unknown = [name for name in sys.argv[1:] if name not in TABLES]
    if unknown:
        sys.exit(f"no table {', '.join(unknown)}; there are {', '.join(TABLES)}")
    for name in sys.argv[1:] or TABLES:
        table(name)
