"""Make the pictures of the documentation: ``python docs/pictures.py`` (about a minute)."""

import contextlib
import os
import runpy
import shutil
import sys
import tempfile
from pathlib import Path

import astropy.units as u
import numpy as np
from matplotlib.figure import Figure

import flybystab as fs
from flybystab.cli.main import main
from flybystab.flybys.outcome_map import target_map
from flybystab.plots.outcome_map import outcome_plot, target_plot
from flybystab.plots.population import population_figure
from flybystab.plots.scene import animation, scene_plot
from flybystab.plots.shape_map import surface_history_figure
from flybystab.plots.style import figure_style

DOCS = Path(__file__).resolve().parent
IMAGES = DOCS / "images"
PILE = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


STYLE = figure_style()
STYLE.__enter__()  # for all figures of this script


def save(name, figure):
    figure.savefig(IMAGES / name, dpi=110)
    print(IMAGES / name)


main(["flyby", "Apophis", "--output", str(IMAGES / "apophis.png")])

for what in ("regions", "spin", "barrier", "failure"):
    main(["figure", what, "--output", str(IMAGES / f"{what}.png")])

figure = Figure(figsize=(6.4, 4.8), layout="constrained")
q, v = np.linspace(1.1, 3.2, 15) * fs.R_earth, np.linspace(0, 21, 8) * u.km / u.s
outcome_plot(figure.subplots(), fs.outcome_map(PILE, q, v, phases=8))
save("outcome_map.png", figure)

figure = Figure(figsize=(6.0, 6.0), layout="constrained")
target_plot(figure.subplots(), target_map(PILE, 8 * u.km / u.s, np.linspace(1.1, 3.2, 11) * fs.R_earth, 32))
save("target_map.png", figure)

figure = Figure(figsize=(7.2, 3.2), layout="constrained")
result = fs.flyby(PILE, fs.Encounter.hyperbolic("earth", 2.0 * fs.R_earth, 5 * u.km / u.s))
scene_plot(figure.add_subplot(projection="3d"), result)
save("scene.png", figure)
animation(result, IMAGES / "pile.gif", "2.0 Earth radii at 5 km/s", frames=45, rate=10)
print(IMAGES / "pile.gif")

for script, picture in (
    ("catalogue_on_the_spin_limit.py", "spin_limit.png"),
    ("survival_of_real_clones.py", "real_clones.png"),
):
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        runpy.run_path(str(DOCS.parent / "examples" / script))
        shutil.copy(Path("out") / picture, IMAGES / picture)
    print(os.fspath(IMAGES / picture))

sys.argv = ["shape_slopes.py", str(IMAGES / "shape_slopes.png")]
runpy.run_path(str(DOCS.parent / "examples" / "shape_slopes.py"))
print(IMAGES / "shape_slopes.png")

relief = fs.Shape.perturbed([225, 165, 155] * u.m, amplitude=0.06, seed=2)
body = fs.Body.from_shape(relief, density=1.29 * u.g / u.cm**3, spin_period=30.5 * u.h)
apophis_like = fs.Encounter.hyperbolic("earth", 38_012 * u.km, 5.841 * u.km / u.s)
history = fs.surface_history(body, apophis_like, shape=relief)
save("surface_history.png", surface_history_figure(history, 20 * u.deg))

orbits = fs.known_population()
planets = ("mercury", "venus", "earth", "mars")
verdicts = fs.disruption_rates(orbits, planets, diameter=None, samples=2400, seed=1)
save(
    "population.png",
    population_figure(
        verdicts, [fs.encounter_rates(orbits, name) for name in planets], orbits["designation"]
    ),
)

runpy.run_path(str(DOCS / "why_pictures.py"), run_name="__main__")
