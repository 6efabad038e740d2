"""The table of yield surfaces: a row is enough for a new surface, and an unknown code is an error."""

import os
import shutil
import subprocess
import sys
import textwrap
from importlib import resources
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


def run_with_table(tmp_path, changes, script, **environment):
    """Output of a script with a copy of the package whose table of yield surfaces is changed."""
    package = tmp_path / "flybystab"
    shutil.copytree(SOURCE, package, ignore=shutil.ignore_patterns("__pycache__"))
    if not (package / "data").exists():  # an editable install
        shutil.copytree(Path(str(resources.files("flybystab.data"))), package / "data")
    table = package / "core/material/surfaces.py"
    text = table.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    table.write_text(text)
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        env=kept | {"PYTHONPATH": str(tmp_path)} | environment,
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_row_is_enough_for_a_new_cone(tmp_path):
    """A cone half way between compression and extension, in a copy of the package with one line more."""
    row = '    YieldSurface("middle-cone", CONE, 0.0, ("DruckerPrager1952",)),\n'
    before = '    YieldSurface("mohr-coulomb"'
    script = """
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
    """
    out = run_with_table(tmp_path, [(before, row + before)], script, NUMBA_DISABLE_JIT="1")
    assert out == ["INTACT", "True"]


SCENARIO = """
[body]
semi_axes = "500, 450, 400 m"
density = "2000 kg/m3"
spin_period = "6 h"
[encounter]
planet = "earth"
periapsis = "5 R_earth"
v_inf = "5 km/s"
[material]
"""


@pytest.mark.slow
def test_stability_and_commands_use_a_new_cone(tmp_path):
    """The compression cone by another name has its energies; a cone between the two known ones has values between."""
    rows = """    YieldSurface("same-cone", CONE, 1.0, ()),
    YieldSurface("middle-cone", CONE, 0.0, ()),
"""
    before = '    YieldSurface("mohr-coulomb"'
    script = (
        """
        import contextlib, io, json
        import astropy.units as u, flybystab as fs
        from flybystab.cli.main import main
        SCENARIO = """
        + repr(SCENARIO)
        + """
        body = fs.Body([500, 450, 400] * u.m, 2 * u.g / u.cm**3, spin_period=4 * u.h)
        energy = {}
        for name in ("drucker-prager", "same-cone", "middle-cone", "drucker-prager-extension"):
            made = fs.stability(body.with_(material=fs.Material(friction_angle=30 * u.deg, yield_surface=name)))
            energy[name] = made.critical_energy.barrier.to_value(u.J)
        assert energy["same-cone"] == energy["drucker-prager"], energy
        assert energy["drucker-prager-extension"] < energy["middle-cone"] < energy["drucker-prager"], energy
        needed = {}
        for name in ("drucker-prager", "same-cone", "middle-cone", "drucker-prager-extension"):
            with open("s.toml", "w") as file:
                file.write(SCENARIO + f'yield_surface = "{name}"')
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                assert main(["scenario", "s.toml", "--json"]) == 0
            found = json.loads(out.getvalue())
            assert next(iter(found["verdict_by_surface"])) == name, found["verdict_by_surface"]
            needed[name] = found["max_required_friction_angle_deg"]
        a, same, b, c = needed.values()
        assert a == same and a < b < c, needed
        print("done")
    """
    )
    assert run_with_table(tmp_path, [(before, rows + before)], script, NUMBA_DISABLE_JIT="1") == ["done"]


#: Gauge of a section that is a cubic in 1/k: ``r cos(acos(-b sin(3 theta))/3)``, with its first two derivatives.
CUBIC = """
def {name}(sin_phi, theta):
    {coefficients}
    s3, c3 = math.sin(3 * theta), math.cos(3 * theta)
    x = -b * s3
    root2 = max(1e-300, 1 - x * x)
    third = math.acos(min(1.0, max(-1.0, x))) / 3
    first = b * c3 / math.sqrt(root2)
    second = -3 * b * s3 / math.sqrt(root2) * (1 - (b * c3) ** 2 / root2)
    c, s = math.cos(third), math.sin(third)
    return r * c, -r * s * first, r * c - r * (c * first * first + s * second)

"""

#: I1^3/I3 = const. (Lade & Duncan 1975), meeting Mohr-Coulomb in triaxial compression: A gamma^3 - gamma/2 +
#: sin(phi) sin(3 theta)/(3 sqrt6) = 0.
LADE_DUNCAN = """g = 2 * math.sqrt(6) / (3 - sin_phi)
    a = g * g / 2 - g**3 * sin_phi / (3 * math.sqrt(6))
    r = 2 / math.sqrt(6 * a)
    b = 4 * sin_phi / (3 * math.sqrt(6) * a * r**3)"""

#: Matsuoka-Nakai, as in the package.
MATSUOKA_NAKAI = """cos2 = 1 - sin_phi * sin_phi
    t2 = sin_phi * sin_phi / cos2
    eta = 9 + 8 * t2
    half = (eta - 3) / 2
    b = 1.5 * eta * math.sqrt(8 * t2) / (half * math.sqrt(half / 3)) / (3 * math.sqrt(6))
    r = 2 * math.sqrt(half / 3) * math.sqrt(cos2 / 8)"""


@pytest.mark.slow
def test_a_row_is_enough_for_another_dependence_on_the_lode_angle(tmp_path):
    """Compiled: a new surface, and a known one by its gauge alone, which has the results of its closed formulas."""
    rows = """    YieldSurface("lade-duncan", GENERAL, 0.0, (), lade_duncan),
    YieldSurface("by-gauge", GENERAL, 0.0, (), by_gauge),
"""
    gauges = CUBIC.format(name="lade_duncan", coefficients=LADE_DUNCAN)
    gauges += CUBIC.format(name="by_gauge", coefficients=MATSUOKA_NAKAI)
    script = """
        import contextlib, io, json
        import astropy.units as u, numpy as np, flybystab as fs
        from numba import config
        from scipy.optimize import brentq
        assert not config.DISABLE_JIT
        names = ("drucker-prager", "lade-duncan", "matsuoka-nakai", "by-gauge")
        pile = fs.Body([1400, 850, 750] * u.m, 2 * u.g / u.cm**3, spin_period=6 * u.h)
        dilatant = {s: fs.Material(yield_surface=s, dilatancy=1.0) for s in names}
        bodies = {s: pile.with_(material=m) for s, m in dilatant.items()}
        states = {s: fs.equilibrium(b) for s, b in bodies.items()}
        angles = {s: e.required_friction_angle.value for s, e in states.items()}
        assert angles["drucker-prager"] < angles["lade-duncan"] < angles["matsuoka-nakai"], angles
        # I1^3/I3 of the stress is that of triaxial compression at the angle
        stress = -states["lade-duncan"].stress.value
        ratio = np.trace(stress) ** 3 / np.linalg.det(stress)
        n = brentq(lambda n: (n + 2) ** 3 / n - ratio, 1, 100, xtol=1e-14)
        assert abs(np.sin(np.radians(angles["lade-duncan"])) - (n - 1) / (n + 1)) < 1e-9
        encounter = fs.Encounter.hyperbolic("earth", 2.0 * fs.R_earth, 5 * u.km / u.s)
        runs = {s: fs.flyby(b, encounter, error=False, history=False) for s, b in bodies.items()}
        axes = {s: r.semi_axes.value for s, r in runs.items()}
        assert all(len(r.events) for r in runs.values())
        assert not np.allclose(axes["lade-duncan"], axes["matsuoka-nakai"], rtol=1e-4)
        np.testing.assert_allclose(axes["by-gauge"], axes["matsuoka-nakai"], rtol=1e-7)
        stable = {s: fs.stability(b) for s, b in bodies.items()}
        energy = {s: e.critical_energy.second.to_value(u.J) for s, e in stable.items()}
        np.testing.assert_allclose(energy["by-gauge"], energy["matsuoka-nakai"], rtol=1e-7)
        from flybystab.cli.main import main
        command = ["flyby", "Apophis", "--date", "2029-04-13", "--attitudes", "2", "--json", "--surface"]
        needed = {}
        for name in names:
            text = io.StringIO()
            with contextlib.redirect_stdout(text):
                assert main([*command, name]) == 0
            found = json.loads(text.getvalue())
            assert next(iter(found["verdict_by_surface"])) == name
            needed[name] = found["max_required_friction_angle_deg"]
        assert needed["drucker-prager"] < needed["lade-duncan"] < needed["matsuoka-nakai"], needed
        assert abs(needed["by-gauge"] - needed["matsuoka-nakai"]) < 1e-6, needed
        print(runs["lade-duncan"].verdict)
    """
    changes = [
        ("from typing import NamedTuple\n", "from typing import NamedTuple\nimport math\n"),
        ("SURFACES = (\n", gauges + "\nSURFACES = (\n"),
        ('("MatsuokaNakai1974",)),\n', '("MatsuokaNakai1974",)),\n' + rows),
    ]
    out = run_with_table(tmp_path, changes, script)
    assert " ".join(out) in ("RESHAPED", "MASS LOSS", "BEYOND MODEL")
