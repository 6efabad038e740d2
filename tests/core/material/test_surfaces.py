"""The table of yield surfaces: a row is enough for a new cone, and an unknown code is an error."""

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from flybystab.core.material import yield_surface
from flybystab.core.material.surfaces import NAMES, SURFACES

SOURCE = Path(yield_surface.__file__).resolve().parents[2]


@pytest.mark.parametrize("unknown", [-1, len(SURFACES), 99])
def test_an_unknown_code_is_an_error_in_every_kernel(unknown):
    for call in (
        lambda: yield_surface.slope(unknown, 0.5, 0.0),
        lambda: yield_surface.gauge(unknown, 0.5, 0.0),
        lambda: yield_surface.normal(unknown, 0.5, 0.0),
        lambda: yield_surface.flow_direction(unknown, 0.5, 0.0),
        lambda: yield_surface.least_slope(unknown, 0.5),
        lambda: yield_surface.required_friction(unknown, 0.0, 1.0, 1.0, 0.0),
        lambda: yield_surface.required_cohesion(unknown, 0.5, 1.0, 1.0, 0.0),
    ):
        with pytest.raises(ValueError, match="unknown code of a yield surface"):
            call()


def test_every_surface_has_a_convex_section_and_its_least_slope():
    for code in range(len(NAMES)):
        theta = np.linspace(-np.pi / 6, np.pi / 6, 401)
        gauges = np.array([yield_surface.gauge(code, 0.57, t) for t in theta])
        assert np.all(gauges[:, 2] > -1e-12), NAMES[code]
        assert 0.57 / gauges[:, 0].max() == pytest.approx(yield_surface.least_slope(code, 0.57), rel=1e-5)


def test_a_row_is_enough_for_a_new_cone(tmp_path):
    """A cone half way between compression and extension, in a copy of the package with one line more."""
    package = tmp_path / "flybystab"
    shutil.copytree(SOURCE, package, ignore=shutil.ignore_patterns("__pycache__"))
    table = package / "core/material/surfaces.py"
    text = table.read_text()
    row = '    YieldSurface("middle-cone", CONE, 0.0, ("DruckerPrager1952",)),\n'
    changed = text.replace('    YieldSurface("mohr-coulomb"', row + '    YieldSurface("mohr-coulomb"')
    assert changed != text
    table.write_text(changed)
    script = textwrap.dedent("""
        import astropy.units as u, numpy as np, flybystab as fs
        from flybystab.cli.common import SURFACES
        from flybystab.io.citation import cite
        assert "middle-cone" in SURFACES
        sphere = fs.Body([500, 500, 500] * u.m, 2 * u.g / u.cm**3, spin_period=4 * u.h)
        made = [sphere.with_(material=fs.Material(yield_surface=s, friction_angle=30 * u.deg))
                for s in ("drucker-prager", "middle-cone", "drucker-prager-extension")]
        angles = [fs.equilibrium(b).required_friction_angle.value for b in made]
        assert angles[0] < angles[1] < angles[2], angles
        # k = 2 sqrt6 sin/3: the angle that the stress needs in closed form
        stress = fs.equilibrium(made[1]).stress.value
        p = -np.trace(stress) / 3
        s = np.linalg.norm(stress + p * np.eye(3))
        assert abs(np.sin(np.radians(angles[1])) - 3 * s / (2 * np.sqrt(6) * p)) < 1e-9
        encounter = fs.Encounter.hyperbolic("earth", 5 * fs.R_earth, 5 * u.km / u.s)
        print(fs.flyby(made[1], encounter, error=False, history=False).verdict)
        print("DruckerPrager1952" in cite({"flybystab": "0", "yield_surface": "middle-cone"}))
    """)
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment |= {"PYTHONPATH": str(tmp_path), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["INTACT", "True"]
