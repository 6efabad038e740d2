"""Every public plot function against an image that was looked at, without text, within a tolerance.

``FLYBYSTAB_BASELINES=1 pytest tests/plots/test_baselines.py`` writes the images anew.
"""

import inspect
import os
from importlib import import_module
from pathlib import Path

import astropy.units as u
import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.testing.compare import compare_images
from matplotlib.text import Text

import flybystab as fs
from flybystab.flybys.survival import Survival
from flybystab.plots import distributions, figures, flyby, grains, outcome_map, population, scene, shape_map
from flybystab.plots import screening as tables
from flybystab.plots import stability as regions
from flybystab.plots.style import figure_style
from flybystab.population.verdict_rates import DisruptionRates

FOLDER = Path(__file__).parent / "baseline"
#: Root mean square of the difference, of 255. Versions of matplotlib differ by 1 to 3 in antialiasing.
TOLERANCE = 8.0
#: Version of matplotlib that drew the images.
VERSION = "3.11"
#: Figures whose panels other versions place differently: differences of 8 to 19 with 3.8.4, where the 47 others agree.
PLACED = {"figures.regions_figure", "figures.spin_figure", "scene.body_plot"}

BODY = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
ROUGH = fs.Shape.perturbed([1400, 850, 750] * u.m, amplitude=0.05, seed=2, facets=320)
SOLID = fs.Body.from_shape(ROUGH, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


def passage(radii):
    return fs.Encounter.hyperbolic("earth", radii * fs.R_earth, 5 * u.km / u.s)


_KEPT = {}


def kept(make):
    """The result of a function, computed once."""
    if make not in _KEPT:
        _KEPT[make] = make()
    return _KEPT[make]


def flown():
    return fs.flyby(BODY, passage(2.0))


def grained():
    return fs.flyby(BODY, passage(1.5), grains=100, seeds=1, model="grains")


def mapped():
    return fs.outcome_map(BODY, [1.6, 2.0, 2.4, 3.0] * fs.R_earth, [1, 5, 9] * u.km / u.s, phases=6)


def targeted():
    return fs.target_map(BODY, 8 * u.km / u.s, [1.7, 2.2, 4.0] * fs.R_earth, 12)


def surfaces():
    return fs.surface_history(SOLID, passage(3.0), shape=ROUGH, instants=21)


def ellipsoid_slopes():
    return fs.shape_slopes(ROUGH, SOLID)


def rates():
    return [fs.encounter_rates(fs.known_population(15.0), p) for p in ("earth", "venus")]


def verdicts():
    from astropy.table import QTable

    table = QTable(
        {
            "planet": ["venus", "venus", "earth", "earth"],
            "verdict": ["RESHAPED", "DISRUPTED"] * 2,
            "rate": [0.03, 0.01, 0.05, 0.02] / u.Myr,
            "rate_error": [0.01, 0.005, 0.01, 0.01] / u.Myr,
        }
    )
    n = np.arange(60)
    samples = QTable(
        {
            "planet": np.where(n % 2, "earth", "venus"),
            "periapsis": (1.1 + 3.8 * n / 60) * fs.R_earth,
            "v_inf": (5.0 + n % 17) * u.km / u.s,
            "orbit": n % 7,
            "diameter": (0.5 + n % 5) * u.km,
            "verdict": np.where(n < 20, "RESHAPED", np.where(n < 26, "DISRUPTED", "INTACT")),
            "weight": np.full(60, 1e-9) / u.yr,
        }
    )
    return DisruptionRates(table, samples, 100.0, None)


def clones():
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    return fs.encounter_distribution(orbit, "earth", _april(), n=40, seed=1)


def _april():
    from astropy.time import Time

    return Time("2029-04-13", scale="tdb")


def binaries():
    return fs.binary_flyby(BODY, passage(4.0), 4 * u.km, samples=60)


def forecast():
    return fs.spin_forecast(BODY, passage(3.0), n=24)


def needs():
    return fs.requirements(BODY, density_sigma=400 * u.kg / u.m**3, spin_period_sigma=0.5 * u.h, samples=80)


def screened():
    return fs.screen(["Apophis", "Bennu", "Toutatis"], "2026-01-01", "2050-01-01", within=0.1 * u.au)


def bounded():
    return fs.infer(fs.Asteroid.from_catalogue("Anteros"), [])


def approaches():
    bodies = [fs.Asteroid.from_catalogue(name) for name in ("Apophis", "Bennu")]
    return fs.find_encounters(bodies, "2026-01-01", "2050-01-01", ["earth", "venus"], within=0.2 * u.au)


def possible_impacts():
    from astropy.time import Time

    days = Time(["2032-12-22", "2039-12-22", "2047-12-22"], scale="tdb")
    odds = {"sigma": [1.1, 1.2, 1.3], "probability": [1e-3, 2e-6, 4e-7]}
    return fs.ResultTable({"time": days, **odds}, meta={"planet": "earth"})


#: Figures by the name of their function; those of axes take them as an argument.
AXES = {
    "flyby.distance_plot": lambda a: flyby.distance_plot(a, kept(flown).history, passage(2.0)),
    "flyby.friction_plot": lambda a: flyby.friction_plot(a, kept(flown).history, 35 * u.deg),
    "flyby.spin_plot": lambda a: flyby.spin_plot(a, kept(flown).history),
    "flyby.axes_plot": lambda a: flyby.axes_plot(a, kept(flown).history),
    "grains.grains_plot": lambda a: grains.grains_plot(a, kept(grained).grains.median, -1),
    "grains.grains_scene_plot": lambda a: grains.grains_scene_plot(a, kept(grained)),
    "outcome_map.outcome_plot": lambda a: outcome_map.outcome_plot(a, kept(mapped)),
    "outcome_map.target_plot": lambda a: outcome_map.target_plot(a, kept(targeted)),
    "outcome_map.verdict_points": lambda a: outcome_map.verdict_points(
        a, [[1, 2], [3, 4], [5, 6]] * u.km, ["INTACT", "RESHAPED", "DISRUPTED"], 4 * u.km
    ),
    "shape_map.shape_map": lambda a: shape_map.shape_map(a, ROUGH, ROUGH.centroids.value[:, 0]),
    "stability.regions_plot": lambda a: regions.regions_plot(a, 0.4, cells=24),
    "stability.critical_energy_plot": lambda a: regions.critical_energy_plot(a, 0.2, 35 * u.deg, cells=24),
    "stability.spin_plot": lambda a: regions.spin_plot(a, (10, 40)),
    "stability.barrier_plot": lambda a: regions.barrier_plot(a, BODY),
    "stability.failure_distance_plot": lambda a: regions.failure_distance_plot(
        a, {"pile": BODY}, 3.986e14 * u.m**3 / u.s**2, 6378 * u.km
    ),
    "population.rate_plot": lambda a: population.rate_plot(a, kept(rates)),
    "population.verdict_plot": lambda a: population.verdict_plot(a, kept(verdicts)),
    "population.size_plot": lambda a: population.size_plot(a, kept(verdicts)),
    "population.contributor_plot": lambda a: population.contributor_plot(a, kept(verdicts)),
    "distributions.slope_plot": lambda a: distributions.slope_plot(a, kept(ellipsoid_slopes)),
    "distributions.slope_change_plot": lambda a: distributions.slope_change_plot(a, kept(surfaces).extremes),
    "distributions.surface_history_plot": lambda a: distributions.surface_history_plot(a, kept(surfaces)),
    "distributions.distribution_plot": lambda a: distributions.distribution_plot(a, kept(clones)),
    "distributions.forecast_plot": lambda a: distributions.forecast_plot(a, kept(forecast)),
    "distributions.binary_plot": lambda a: distributions.binary_plot(a, kept(binaries)),
    "distributions.grains_outcome_plot": lambda a: distributions.grains_outcome_plot(a, kept(grained).grains),
    "distributions.grains_course_plot": lambda a: distributions.grains_course_plot(
        a, kept(grained).grains.median.course
    ),
    "distributions.linear_plane_plot": lambda a: distributions.linear_plane_plot(a, kept(clones).linear),
    "distributions.push_plot": lambda a: distributions.push_plot(
        a, fs.push(BODY, np.diag([1.0, 0.0, -1.0]), np.linspace(0.0, 0.2, 21))
    ),
    "screening.rise_plot": lambda a: tables.rise_plot(a, kept(screened)),
    "screening.margin_plot": lambda a: tables.margin_plot(a, kept(screened)),
    "screening.bounds_plot": lambda a: tables.bounds_plot(a, kept(bounded), "friction_equilibrium"),
    "screening.encounters_plot": lambda a: tables.encounters_plot(a, kept(approaches)),
    "screening.impacts_plot": lambda a: tables.impacts_plot(a, possible_impacts()),
    "distributions.requirements_plot": lambda a: distributions.requirements_plot(a, kept(needs)),
    "results.survival": lambda a: fs.plot_result(
        Survival(
            np.array(["INTACT", "INTACT", "RESHAPED"]), np.ones(3, bool), np.zeros(3) * u.deg,
            np.full(3, ""), np.zeros(3, bool),
        ),
        a,
    ),
    "results.critical": lambda a: fs.plot_result(
        fs.critical(BODY, passage(2.2), "friction_angle", phases=4, tolerance=0.05), a
    ),
    "results.spin_sample": lambda a: fs.plot_result(fs.spin_sample(BODY, passage(3.0), n=16), a),
}  # fmt: skip
FIGURES = {
    "flyby.flyby_panels": lambda f: flyby.flyby_panels(f.subplots(4, 1), kept(flown)),
    "scene.scene_plot": lambda f: scene.scene_plot(f.add_subplot(projection="3d"), kept(flown)),
    "scene.body_plot": lambda f: scene.body_plot(f.add_subplot(projection="3d"), kept(flown).history, -1),
    "population.probability_plot": lambda f: population.probability_plot(f.subplots(), kept(verdicts)),
    "grains.grains_figure": lambda _: grains.grains_figure(kept(grained)),
    "shape_map.slope_change_figure": lambda _: shape_map.slope_change_figure(ROUGH, kept(surfaces).extremes),
    "shape_map.surface_history_figure": lambda _: shape_map.surface_history_figure(kept(surfaces)),
    "figures.barrier_figure": lambda _: figures.barrier_figure(BODY),
    "figures.failure_figure": lambda _: figures.failure_figure(),
    "figures.regions_figure": lambda _: figures.regions_figure({}, cells=16),
    "figures.spin_figure": lambda _: figures.spin_figure({}),
    "population.population_figure": lambda _: population.population_figure(kept(verdicts), kept(rates)),
}
#: Functions that write files, in other tests (their parts are above).
ELSEWHERE = {
    "flyby.flyby_figure", "scene.animation", "grains.grains_animation", "screening.inference_figure",
    "screening.results_figure", "labels.label_points",
}  # fmt: skip


def test_every_public_plot_function_has_an_image():
    found = set()
    for module in (
        distributions,
        figures,
        flyby,
        grains,
        outcome_map,
        population,
        scene,
        shape_map,
        regions,
        tables,
    ):
        for name, function in vars(module).items():
            own = inspect.isfunction(function) and function.__module__ == module.__name__
            if (
                own
                and not name.startswith("_")
                and name.endswith(("plot", "map", "figure", "points", "panels"))
            ):
                found.add(f"{module.__name__.rsplit('.', 1)[1]}.{name}")
    assert len(found) > 35
    assert found - ELSEWHERE <= set(AXES) | set(FIGURES)


@pytest.mark.parametrize("name", [*AXES, *FIGURES])
def test_images(name, tmp_path):
    version = ".".join(matplotlib.__version__.split(".")[:2])
    if name in PLACED and version != VERSION:
        pytest.skip(f"drawn with matplotlib {VERSION}; {version} places the panels differently")
    with figure_style():
        figure = Figure(figsize=(4.0, 3.0), dpi=60)
        FigureCanvasAgg(figure)
        if name in AXES:
            AXES[name](figure.subplots())
        else:
            made = FIGURES[name](figure)
            figure = made if isinstance(made, Figure) else figure
        without_text(figure)
        path = tmp_path / f"{name}.png"
        figure.savefig(path, dpi=60 if figure.get_figwidth() < 5 else 40, metadata={"Software": None})
    baseline = FOLDER / f"{name}.png"
    if os.environ.get("FLYBYSTAB_BASELINES"):
        FOLDER.mkdir(exist_ok=True)
        baseline.write_bytes(path.read_bytes())
    assert baseline.is_file(), "no baseline image"
    assert compare_images(str(baseline), str(path), tol=TOLERANCE) is None


def test_another_figure_is_noticed(tmp_path):
    figure = Figure(figsize=(4.0, 3.0), dpi=60)
    FigureCanvasAgg(figure)
    flyby.spin_plot(figure.subplots(), kept(flown).history)
    without_text(figure)
    figure.axes[0].lines[0].set_linewidth(6)
    figure.savefig(tmp_path / "x.png", dpi=60, metadata={"Software": None})
    assert compare_images(str(FOLDER / "flyby.spin_plot.png"), str(tmp_path / "x.png"), tol=TOLERANCE)


def without_text(figure):
    """Take away what depends on the installed fonts: text, legends, the layout that makes room for them."""
    figure.set_layout_engine("none")  # nothing is laid out before the first drawing
    for legend in [*figure.legends, *(a.get_legend() for a in figure.axes)]:
        if legend is not None:
            legend.remove()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis, *([axes.zaxis] if hasattr(axes, "zaxis") else [])):
            axis.set_major_formatter(matplotlib.ticker.NullFormatter())
            axis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    for text in figure.findobj(Text):
        text.set_visible(False)


def test_modules_of_the_figures_are_importable():
    for name in {n.split(".")[0] for n in [*AXES, *FIGURES]}:
        import_module(f"flybystab.plots.{name}")
