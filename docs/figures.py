# ruff: noqa: E501
"""Make the page "Figures", with the figure of every plot: ``python docs/figures.py [NAME ...]`` (some minutes).

Each figure is made by the code that the page shows beside it. With names only those figures are drawn anew.
"""

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt

from flybystab.plots.style import figure_style

DOCS = Path(__file__).resolve().parent
FOLDER = DOCS / "images" / "figures"

SETUP = """\
import astropy.units as u
import numpy as np
import flybystab as fs
from flybystab.constants import GM_EARTH
from flybystab.plots import figures, flyby, grains, outcome_map, population
from flybystab.plots import scene, screening, shape_map, stability

body = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, spin_period=6 * u.h)


def at(radii):
    return fs.Encounter.hyperbolic("earth", radii * fs.R_earth, 5 * u.km / u.s)


near, far = at(2.0), at(3.0)
radii, speeds = np.linspace(1.2, 3.2, 9) * fs.R_earth, np.linspace(0, 20, 6) * u.km / u.s
result = fs.flyby(body, near)
piles = fs.flyby(body, at(1.5), grains=300, seeds=6, model="grains")
shape = fs.Shape.perturbed([1400, 850, 750] * u.m, amplitude=0.05, seed=2)
solid = fs.Body.from_shape(shape, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)
slopes = fs.surface_history(solid, far, shape=shape)
apophis, anteros = (fs.Asteroid.from_catalogue(name) for name in ("Apophis", "Anteros"))
yr4 = fs.catalogue("examples/2024YR4.ke1")[0].orbit
april = fs.Encounter.from_orbit(apophis.orbit, "earth", "2029-04-13")
clones = fs.encounter_distribution(apophis, "earth", "2029-04-13", n=300, seed=1)
orbits = fs.known_population()
rates = [fs.encounter_rates(orbits, name) for name in ("venus", "earth", "mars")]
verdicts = fs.disruption_rates(orbits, ["venus", "earth", "mars"], samples=1200, seed=1)
of_any_size = fs.disruption_rates(orbits, ["venus", "earth", "mars"], samples=1200, seed=1, diameter=None)
"""

#: Name, what it shows and the code, by section. `axes` are matplotlib axes, `solid_axes` those with three dimensions.
SECTIONS = {
    "One flyby": [
        ("flyby_result", "`FlybyResult`: distance, mobilised friction angle, spin rate and semi-axes", "result.plot()"),
        ("history", "`History`: semi-axes; `what=\"spin\"` and `what=\"friction angle\"` are the panels below", "result.history.plot(axes)"),
        ("distance_plot", "Distance from the planet", "flyby.distance_plot(axes, result.history, near)"),
        ("friction_plot", "Mobilised friction angle", "flyby.friction_plot(axes, result.history, 35 * u.deg)"),
        ("spin_plot", "Spin rate", "flyby.spin_plot(axes, result.history)"),
        ("axes_plot", "Semi-axes", "flyby.axes_plot(axes, result.history)"),
        ("scene_plot", "Planet, path and body", "scene.scene_plot(solid_axes, result)"),
        ("body_plot", "The body at the end", "scene.body_plot(solid_axes, result.history, -1)"),
    ],
    "Many flybys": [
        ("outcome_map", "`OutcomeMap`: most severe verdict over periapsis and speed", "fs.outcome_map(body, radii, speeds, phases=6).plot(axes)"),
        ("target_map", "`TargetMap`: verdicts over the target plane", "fs.target_map(body, 8 * u.km / u.s, np.linspace(1.2, 3.2, 7) * fs.R_earth, 24).plot(axes)"),
        ("flyby_table", "`FlybyTable`: number of each verdict", "fs.flyby_many([body] * 30, [at(q) for q in np.linspace(1.1, 3.5, 30)]).plot(axes)"),
        ("spin_sample", "`SpinSample`: change of the spin over attitudes", "fs.spin_sample(apophis, april, n=200).plot(axes)"),
        ("spin_forecast", "`SpinForecast`: periods after an encounter over rotation phases", "fs.spin_forecast(body, far, n=48).plot(axes)"),
        ("critical", "`CriticalValues`: least value for an outcome at each phase", 'fs.critical(body, at(2.2), "friction_angle", phases=12).plot(axes)'),
        ("binary", "`BinarySample`: mutual orbits after an encounter", "fs.binary_flyby(body, at(4.0), 4 * u.km, samples=200).plot(axes)"),
    ],
    "Grains": [
        ("grains_outcome", "`GrainsOutcome`: largest clump of each pile", "piles.grains.plot(axes)"),
        ("grains_run", "`GrainsRun`: the pile at the end", "piles.grains.median.plot(axes)"),
        ("grains_course", "`GrainsCourse`: largest clump against time", "piles.grains.median.course.plot(axes)"),
        ("grains_scene_plot", "Planet, path and pile", "grains.grains_scene_plot(axes, piles)"),
        ("grains_figure", "Four stills, and all piles against time", "grains.grains_figure(piles)"),
    ],
    "Uncertain orbits": [
        ("distribution", "`EncounterDistribution`: clones on the target plane", "clones.plot(axes)"),
        ("linear_plane", "`LinearPlane`: ellipse of the linear map", "clones.linear.plot(axes)"),
        ("survival", "`Survival`: number of each verdict over the clones", "fs.survival(apophis, clones).plot(axes)"),
        ("verdict_points", "Verdicts on the target plane", 'outcome_map.verdict_points(axes, clones.b, fs.survival(apophis, clones).verdict)'),
    ],
    "Encounters and screenings": [
        ("encounters", "Table of `find_encounters`", 'fs.find_encounters([apophis, anteros], "2026", "2060", ["earth", "venus"], within=0.2 * u.au).plot(axes)'),
        ("screening", "Table of `screen`", 'fs.screen(None, "2026-01-01", "2040-01-01").plot(axes)'),
        ("margins", "Margin of each encounter of a screening", 'screening.margin_plot(axes, fs.screen(None, "2026-01-01", "2040-01-01"))'),
        ("bounds", "Table of `infer`", "fs.infer(anteros, []).plot(axes)"),
        ("impacts", "Table of `virtual_impactors`", 'fs.virtual_impactors(yr4, "2030", "2050", planet="moon").plot(axes)'),
    ],
    "Surfaces": [
        ("slopes", "`SurfaceSlopes`", "fs.shape_slopes(shape, solid).plot(axes)"),
        ("slope_change", "`SlopeChange`", "fs.surface_change(solid, far, shape=shape).plot(axes)"),
        ("surface_history", "`SurfaceHistory`", "slopes.plot(axes)"),
        ("shape_map", "A quantity on the facets", "shape_map.shape_map(axes, shape, fs.shape_slopes(shape, solid).slope.to_value(u.deg))"),
        ("slope_change_figure", "Slopes before, greatest, largest change", "shape_map.slope_change_figure(shape, slopes.extremes)"),
        ("surface_history_figure", "Slopes before, at and after closest approach", "shape_map.surface_history_figure(slopes)"),
    ],
    "Equilibrium and stability": [
        ("requirements", "`Requirements`: fraction of the samples in equilibrium", "fs.requirements(body, density_sigma=400 * u.kg / u.m**3, samples=400).plot(axes)"),
        ("stability", "`Stability`: energy barrier along the weakest direction", "fs.stability(body).plot(axes)"),
        ("push", "`Push`: energy barrier along a chosen direction", "fs.push(body, np.diag([1.0, 0.0, -1.0]), np.linspace(0, 0.3, 31)).plot(axes)"),
        ("regions_plot", "Required friction angle over axis ratios at one spin", "stability.regions_plot(axes, 0.4)"),
        ("critical_energy_plot", "Minimum critical energy over axis ratios", "stability.critical_energy_plot(axes, 0.2, 35 * u.deg)"),
        ("spin_limits", "Spin limits against the axis ratio", "stability.spin_plot(axes, (10, 20, 30, 40))"),
        ("failure_distance_plot", "Failure distance in a static tide", 'stability.failure_distance_plot(axes, {"body": body}, GM_EARTH * u.m**3 / u.s**2, fs.R_earth)'),
        ("barrier_figure", "Barrier for two laws of flow", "figures.barrier_figure(body)"),
    ],
    "Populations": [
        ("rates", "`EncounterRates`: rate within a distance", "rates[1].plot(axes)"),
        ("rate_plot", "The same for several planets", "population.rate_plot(axes, rates)"),
        ("verdict_rates", "`DisruptionRates`: rate of each verdict by planet", "verdicts.plot(axes)"),
        ("probability_plot", "Probability of a change over periapsis and speed", "population.probability_plot(axes, verdicts)"),
        ("size_plot", "Cumulative rate against diameter, for sizes that follow from H", "population.size_plot(axes, of_any_size)"),
        ("contributor_plot", "Orbits that contribute most", 'population.contributor_plot(axes, verdicts, orbits["designation"])'),
    ],
}  # fmt: skip

#: Results without a figure, and why.
WITHOUT = {
    "single numbers, vectors or matrices": (
        "FlybyMargin", "FlybyError", "Robustness", "VerdictMargins", "Equilibrium", "SpinState", "Recovery", "RecoveryLimit",
        "CohesionBounds", "YieldRegion", "ElasticChange", "RefreshDistance", "Freshness", "StateTransition",
        "ShapeSpin", "RotationState",
    ),
    "fields on or in a shape: plot their values with `shape_map` or the shape with `Shape.to_pyvista`": (
        "ElasticStress", "RocheLobe", "LobeHistory",
    ),
}  # fmt: skip


def draw(name, code, scope):
    """Run the code of a figure and write its image."""
    with figure_style():
        plt.close("all")
        local = {}
        if "solid_axes" in code:
            figure = plt.figure(figsize=(5.5, 4.0), layout="constrained")
            local["solid_axes"] = figure.add_subplot(projection="3d")
        elif "(axes" in code:
            figure, local["axes"] = plt.subplots(figsize=(5.5, 4.0), layout="constrained")
        else:
            figure = None
        made = eval(code, scope, local)
        if figure is None:
            figure = made if hasattr(made, "savefig") else made.flat[0].figure
        figure.savefig(FOLDER / f"{name}.png", dpi=80)
        plt.close("all")
    print(FOLDER / f"{name}.png", flush=True)


def page():
    """Text of the page."""
    lines = [
        "# Figures",
        "",
        "The figure of every plot, made by the code beside it (`python docs/figures.py` draws all of them and writes this",
        "page). `result.plot()` makes new axes, `result.plot(axes)` draws into given ones and returns them;",
        "`flybystab.plots.style.figure_style` sets the style ([how-to](howto.md)). Figures on this page share this set-up:",
        "",
        "```python",
        SETUP.rstrip(),
        "```",
        "",
    ]
    for section, items in SECTIONS.items():
        lines += [f"## {section}", ""]
        for name, text, code in items:
            alt = text.replace("`", "").split(":")[0]
            lines += [
                f"{text}:",
                "",
                "```python",
                code,
                "```",
                "",
                f"![{alt}](images/figures/{name}.png)",
                "",
            ]
    lines += ["## Results without a figure", ""]
    for why, names in WITHOUT.items():
        lines += [f"- {', '.join(f'`{n}`' for n in names)}: {why}."]
    return "\n".join(lines) + "\n"


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    chosen = sys.argv[1:]
    scope = {}
    if chosen != ["page"]:
        exec(SETUP, scope)
        for items in SECTIONS.values():
            for name, _, code in items:
                if not chosen or name in chosen:
                    draw(name, code, scope)
    (DOCS / "figures.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
