# ruff: noqa: E501
"""Calls of every public function with valid, borderline and invalid arguments, for tests and `benchmarks/attack.py`.

The callables are found in `flybystab.__all__`: functions, constructors of inputs, and public methods with arguments.
`VALID` has one valid call of each; the pools of its arguments follow from the signature (`pool`).
"""

import inspect
import os
import shutil
import signal
import sys
import tempfile
import warnings
from collections import Counter
from functools import cache
from importlib import resources
from pathlib import Path

import astropy.units as u
import matplotlib as mpl
import numpy as np
from astropy.time import Time
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from scripted import screening

import flybystab as fs
from flybystab.errors import FlybystabError
from flybystab.orbit.ephemeris import ephemeris

mpl.use("agg")

#: Longest processor time of a call, s: the wall-clock time depends on what else the machine computes.
LIMIT = 10
#: Longest wall-clock time, in units of the limit: for calls that wait without computing.
WAITING = 30
#: Classes of inputs: their constructors are called by users. All other classes are made by functions.
INPUTS = ("Asteroid", "Body", "Covariance", "Material", "Orbit", "Pile", "Shape")

ODD = [
    None, True, 3, -1, 0, 1.5, np.nan, np.inf, -np.inf, "", "x", "\x1b[31m", b"x", [], {}, (), [1, 2], {"a": 1}, object(),
    np.zeros(3), np.zeros((0, 3)), np.array(["a"]), 1 + 2j, 10**400, float,
]  # fmt: skip
NUMBERS = [1e-300, -1.0, 0.0, 1e100, 1e308, np.nan, np.inf, -np.inf, 1 + 1j, [], [1.0, 2.0], "x"]
COUNTS = [2, 1, 0, -1, 1.5, True, np.int64(2), 2**70]
TIMES = [
    Time("2029-04-13T21:46", scale="tdb"), Time("2029-04-13", scale="utc"), Time("2029-04-13", scale="local"),
    Time("2029-04-13", scale="ut1"), Time(1e9, format="jd", scale="tdb"), Time(-1e9, format="jd", scale="tdb"),
    Time(["2029-04-13", "2029-04-14"], scale="tdb"), Time("1600-01-01", scale="tdb"), "2029-04-13",
]  # fmt: skip
PATHS = ["/none.csv", "/dev/null", "a\0", "x" * 300, ".", "/", Path("none.csv")]
PLANETS = ["earth", "moon", "sun", ("earth",), ("x",), [None], {"earth"}]

#: Values of some parameters beside those that their annotation gives.
NAMED = {
    "attitude": [np.eye(3), np.ones((3, 3)), np.full((3, 3), np.nan), -np.eye(3)],
    "attitudes": [[np.eye(3)] * 2, [None] * 2, 2],
    "semi_axes": [(1e100, 1, 1) * u.m, (1, 1, 0) * u.m, (1, np.nan, 1) * u.m, (1, 2, 3) * u.m],
    "position": [(1e200, 0, 0) * u.m, (0, 0, 0) * u.m],
    "velocity": [(1e9, 0, 0) * u.km / u.s, (0, 0, 0) * u.m / u.s],
    "pole": [(0.0, 0.0, 1.0), (0, 0, 0), [0, 200] * u.deg],
    "e": [0.0, 1.0, 1.5, -1],
    "i": [190 * u.deg, -5 * u.deg],
    "a": [0.004 * u.au, 1e6 * u.au, -2 * u.au],
    "A3": [1e3 * u.au / u.d**2],
    "surfaces": [("tresca",), "tresca", ["x"]],
    "grains": [30, 10**7, "always"],
    "seeds": [1, [0, 0], [-1]],
    "dilatancy": [0.0, 1.0],
    "max_axis_ratio": [1.0, 1e6],
    "forces": [("x",), ("earth",)],
    "ephemeris": ["de421", "x"],
    "yield_surface": ["tresca", "drucker-prager", "x"],
    "asteroids": [["Apophis", "x"], "/none.csv"],
    "names": [("e", "q"), ("e",)],
    "matrix": [np.eye(6), -np.eye(6), np.full((6, 6), np.nan)],
    "facets": [[[0, 1, 2]], [[0, 1, 9]], np.full((4, 3), np.nan)],
    "tide": [
        np.eye(3) * 1e-8 / u.s**2,
        np.full((3, 3), np.nan) / u.s**2,
        np.arange(9.0).reshape(3, 3) / u.s**2,
    ],
    "level": [0.5, 1.0, 2.0],
    "levels": [(0.5,), (2.0,)],
    "material": [fs.Material()],
    "planet_orbit": [(1 * u.au, 0.1, 1 * u.deg), (1 * u.au, 2.0, 1 * u.deg)],
    "densities": [[1000, 2000] * u.kg / u.m**3],
    "direction": [np.diag([1.0, 0.0, -1.0]), np.zeros((3, 3)), (0, 0, 1)],
}
#: Units of parameters that have no default value.
UNITS = {
    "A1": u.au / u.d**2, "above": u.km / u.s, "area": u.m**2, "bulk_modulus": u.Pa, "cohesions": u.Pa, "density": u.kg / u.m**3,
    "densities": u.kg / u.m**3, "density_sigma": u.kg / u.m**3, "diameter": u.km, "friction_angle": u.deg, "periapsis": u.km,
    "pole": u.deg, "repose": u.deg, "rise": u.deg, "spin": u.rad / u.s, "spin_period": u.h, "spin_period_sigma": u.h,
    "start_distance": u.km, "tensile_strength": u.Pa, "tide": u.s**-2, "volume": u.m**3, "within": u.au,
}  # fmt: skip


def quantities(unit):
    """Values of any size in a unit, and quantities of other units."""
    made = []
    for x in NUMBERS:
        try:
            made.append(x * unit if not isinstance(x, str) else x)
        except TypeError:
            continue
    return [*made, 1 * u.kg, 1 * u.mag, np.ma.masked]


@cache
def scenes():
    """Objects that calls are made with; the first of each kind is the valid argument."""
    asteroid = fs.Asteroid.from_catalogue("Apophis")
    body = fs.Body((200, 150, 140) * u.m, 2000 * u.kg / u.m**3, spin_period=5 * u.h)
    weak = fs.Body((200, 199, 198) * u.m, 1000 * u.kg / u.m**3, spin_period=3 * u.h)
    near = fs.Encounter.hyperbolic("earth", 15000 * u.km, 6 * u.km / u.s)
    hit = fs.Encounter.hyperbolic("earth", 5000 * u.km, 6 * u.km / u.s)
    shape = fs.Shape.contact_binary((200, 150, 140) * u.m, (150, 120, 100) * u.m, facets=200)
    return {
        "Asteroid": [asteroid], "Body": [body, weak], "Encounter": [near, hit], "Orbit": [asteroid.orbit], "Shape": [shape],
        "Covariance": [asteroid.orbit.covariance],
    }  # fmt: skip


@cache
def results():
    """Objects whose methods are called."""
    s = scenes()
    body, near, shape, asteroid = (s[k][0] for k in ("Body", "Encounter", "Shape", "Asteroid"))
    rates = fs.encounter_rates(fs.known_population()[:20], "earth")
    samples = fs.disruption_rates(fs.known_population()[:20], ["earth"], samples=20)
    grains = fs.flyby(body, near, grains=30, seeds=1, model="grains").grains
    return {k: v[0] for k, v in s.items()} | {
        "BinarySample": fs.binary_flyby(body, near, 2 * u.km, samples=2),
        "CriticalValues": fs.critical(body, near, "periapsis", phases=1),
        "DisruptionRates": samples,
        "ElasticStress": fs.elastic_stress(body),
        "EncounterDistribution": distribution(),
        "EncounterRates": rates,
        "Equilibrium": fs.equilibrium(body),
        "FlybyMargin": fs.flyby_margin(body, near),
        "FlybyResult": fs.flyby(body, near, error=False),
        "GrainsOutcome": grains,
        "History": fs.flyby(body, near, error=False).history,
        "Material": body.material,
        "OutcomeMap": fs.outcome_map(body, [10000, 20000] * u.km, [5] * u.km / u.s, phases=1),
        "Pile": fs.Pile(body, 30),
        "Requirements": fs.requirements(body, samples=10),
        "ResultTable": fs.infer(body, [], densities=[1000, 2000] * u.kg / u.m**3, cohesions=[0, 1] * u.Pa),
        "SpinForecast": fs.spin_forecast(asteroid, near, 2),
        "SpinSample": fs.spin_sample(asteroid, near, 2),
        "Stability": fs.stability(body),
        "Survival": fs.survival(body, distribution()),
        "shape": shape,
    }


@cache
def files():
    """Folder of files that can be read."""
    folder = tempfile.TemporaryDirectory()
    place = Path(folder.name)
    source = (
        Path(str(resources.files("flybystab.data") / "asteroids.csv"))
        .read_text(encoding="utf-8")
        .splitlines()
    )
    chosen = [line for line in source if not line.startswith("#")][:1]
    chosen += [line for line in source if ",Apophis," in line]
    (place / "orbits.csv").write_text("\n".join(chosen) + "\n")
    shape = scenes()["Shape"][0]
    lines = ["v {} {} {}".format(*x) for x in shape.vertices.value]
    lines += ["f {} {} {}".format(*x) for x in shape.facets + 1]
    (place / "shape.obj").write_text("\n".join(lines) + "\n")
    results()["BinarySample"].save(place / "sample.ecsv")
    fs.equilibrium(scenes()["Body"][0]).save(place / "equilibrium.ecsv")
    screening(1, samples=2).run(place / "screening.ecsv")
    return folder, place


@cache
def distribution():
    """Three clones of Apophis in 2029."""
    return fs.encounter_distribution(scenes()["Asteroid"][0], "earth", TIMES[0], n=3)


@cache
def valid():
    """Name -> arguments of a valid call, without those that may keep their default value.

    Methods start with the class that has them. A public callable without an entry here fails a test.
    """
    s = scenes()
    body, near, shape, asteroid = (s[k][0] for k in ("Body", "Encounter", "Shape", "Asteroid"))
    lobes = fs.Body.from_shape(shape, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)
    orbit, when, density = asteroid.orbit, TIMES[0], 2000 * u.kg / u.m**3
    month = {"start": Time("2029-04-01", scale="tdb"), "stop": Time("2029-05-01", scale="tdb")}
    passage = {"body": body, "encounter": near}
    deg, turn = u.deg, np.diag([1.0, 0.0, -1.0])
    t = np.linspace(-5e4, 5e4, 201) * u.s
    track = {"times": t, "positions": near.position(t), "velocities": near.velocity(t)}
    elements = {
        "epoch": when,
        "a": 0.9 * u.au,
        "e": 0.2,
        "i": 3 * deg,
        "node": 204 * deg,
        "peri": 126 * deg,
        "M": 100 * deg,
    }
    state = {"epoch": when, "position": (1.0, 0.1, 0.1) * u.au, "velocity": (1.0, 30.0, 0.1) * u.km / u.s}
    covariance = {
        "epoch": when,
        "names": asteroid.orbit.covariance.names,
        "values": asteroid.orbit.covariance.values,
        "matrix": asteroid.orbit.covariance.matrix,
    }
    corners = {"vertices": shape.vertices, "facets": shape.facets}
    population = fs.known_population()[:5]
    _, place = files()
    window = ephemeris().window(orbit.epoch, -1e6, 1e6)
    known = {"e": u.one, "q": u.m, "tp": u.s, "A1": u.m / u.s**2, "A2": u.m / u.s**2}
    units = [known.get(name, u.rad) for name in asteroid.orbit.covariance.names]
    return {
        "Asteroid": {"orbit": orbit, "body": body, "name": "x"},
        "Asteroid.angular_velocities": {"phase": np.zeros(2)},
        "Asteroid.attitude": {"angle": 30 * deg},
        "Asteroid.body_with": {},
        "Asteroid.completed": {"other": asteroid},
        "Asteroid.from_catalogue": {"name": "Apophis"},
        "Asteroid.from_file": {"path": place / "orbits.csv", "name": "Apophis"},
        "Asteroid.knows": {},
        "Asteroid.quantity": {"column": "diameter_m"},
        "Asteroid.with_material": {"material": fs.Material()},
        "Asteroid.with_physical": {},
        "Asteroid.with_shape": {"shape": shape},
        "Asteroid.with_tumbling": {"precession_period": 27 * u.h, "rotation_period": 263 * u.h},
        "BinarySample.plot": {},
        "BinarySample.read": {"path": place / "sample.ecsv"},
        "BinarySample.save": {"path": "x.ecsv", "overwrite": True},
        "BinarySample.probability": {"fate": "bound"},
        "Body": {"semi_axes": (200, 150, 140) * u.m, "density": density, "spin_period": 5 * u.h},
        "Body.from_shape": {"shape": shape, "density": density, "spin_period": 6 * u.h},
        "Body.with_": {},
        "Covariance": covariance,
        "Covariance.deviations": {"parameters": asteroid.orbit.covariance.values[None]},
        "Covariance.in_units": covariance | {"units": units},
        "Covariance.nongrav_deviations": {"parameters": asteroid.orbit.covariance.values[None]},
        "Covariance.pushes": {"parameters": asteroid.orbit.covariance.values[None]},
        "Covariance.samples": {"n": 2, "seed": 0},
        "Covariance.states": {"parameters": asteroid.orbit.covariance.values[None]},
        "DisruptionRates.changed_fraction": {"time": 1 * u.Gyr},
        "DisruptionRates.contributors": {},
        "DisruptionRates.cumulative": {"diameters": 1 * u.km},
        "DisruptionRates.fragment_rate": {"diameters": 100 * u.m},
        "DisruptionRates.lifetime": {},
        "DisruptionRates.outcome_map": {
            "periapsis": [1.5, 2.0],
            "v_inf": [5, 10] * u.km / u.s,
            "planet_name": "earth",
        },
        "DisruptionRates.rate": {"verdict": "DISRUPTED"},
        "DisruptionRates.spin_change_rate": {"least": 0.1},
        "ElasticStress.at": {"points": np.zeros((1, 3)) * u.m},
        "ElasticStress.yield_region": {},
        "Encounter.b_plane": {},
        "Encounter.distances": {"t": np.zeros(2)},
        "Encounter.from_oem": {"path": "/none.oem", "planet": "earth"},
        "Encounter.from_orbit": {"orbit": orbit, "planet": "earth", "time": when},
        "Encounter.from_spk": {"path": "/none.bsp", "target": 1, "planet": "earth", "time": when},
        "Encounter.from_trajectory": track | {"planet": "earth"},
        "Encounter.hyperbolic": {"planet": "earth", "periapsis": 15000 * u.km, "v_inf": 6 * u.km / u.s},
        "Encounter.position": {"t": 0 * u.s},
        "Encounter.positions": {"t": np.zeros(2)},
        "Encounter.radius": {"t": 0 * u.s},
        "Encounter.tidal_tensor": {"t": 0.0},
        "Encounter.velocity": {"t": 0 * u.s},
        "EncounterDistribution.distance_interval": {},
        "EncounterDistribution.impact_interval": {},
        "EncounterRates.sample": {"count": 5, "seed": 0},
        "EncounterRates.within": {"periapsis": 20000 * u.km},
        "Equilibrium.other_surfaces": {},
        "FlybyResult.with_": {},
        "GrainsOutcome.probabilities": {},
        "Material": {"friction_angle": 35 * deg, "cohesion": 0 * u.Pa},
        "Material.with_": {},
        "Orbit": state,
        "Orbit.at": {"time": when},
        "Orbit.covariance_at": {"time": when},
        "Orbit.clones": {"n": 2},
        "Orbit.from_elements": elements,
        "Orbit.from_state": state,
        "Orbit.sigma_points": {},
        "Orbit.state_transition": {"time": when},
        "Orbit.to_skyfield": {},
        "Pile": {"source": body, "grains": 30},
        "Pile.state": {},
        "Requirements.quantiles": {"name": "friction_angle"},
        "Shape": corners,
        "Shape.contact_binary": {
            "first": (200, 150, 140) * u.m,
            "second": (150, 120, 100) * u.m,
            "facets": 200,
        },
        "Shape.from_ellipsoid": {"semi_axes": (200, 150, 140) * u.m, "facets": 200},
        "Shape.gravity": {"points": [(500, 0, 0)] * u.m, "density": density},
        "Shape.perturbed": {"semi_axes": (200, 150, 140) * u.m, "amplitude": 0.02, "seed": 0, "facets": 200},
        "Shape.read": {"path": place / "shape.obj", "unit": u.m},
        "Shape.scaled": {"diameter": 1 * u.km},
        "Shape.write": {"path": "y.vtk"},
        "Shape.to_pyvista": {},
        "ResultTable.plot": {},
        "ResultTable.read": {"path": place / "screening.ecsv"},
        "ResultTable.save": {"path": "z.ecsv", "overwrite": True},
        "ResultTable.to_pandas": {},
        "SpinForecast.quantiles": {"name": "effective_period"},
        "Stability.other_surfaces": {},
        "Survival.probability": {},
        "atlas": {"results": place / "screening.ecsv", "folder": "x", "overwrite": True},
        "attitude_at_start": passage | {"at_periapsis": np.eye(3)},
        "binary_flyby": {"primary": body, "encounter": near, "semi_major_axis": 2 * u.km, "samples": 2},
        "bound_fraction": {
            "shape": np.eye(3) * 1e4,
            "velocity_gradient": np.zeros((3, 3)),
            "density": 2000.0,
        },
        "catalogue": {},
        "cite": {},
        "cohesion_bounds": {"body": body},
        "critical": passage | {"quantity": "periapsis", "phases": 1},
        "density_intervals": {"body": body},
        "disruption_rates": {"population": population, "planets": ["earth"], "samples": 20},
        "elastic_change": passage,
        "elastic_stress": {"body": body},
        "encounter_distribution": {"orbit": asteroid, "planet": "earth", "time": when, "n": 3},
        "encounter_rates": {"orbits": population},
        "equilibrium": {"body": body},
        "failure_distance": {"body": body, "mass_parameter": 3.986e14 * u.m**3 / u.s**2},
        "find_encounters": {"objects": orbit, **month},
        "flyby": passage,
        "flyby_many": {"bodies": s["Body"], "encounters": s["Encounter"]},
        "flyby_margin": passage,
        "fresh_fraction": {"population": population, "radii": {"earth": 5.0}},
        "freshness": {"asteroid": asteroid, "distances": {"earth": 1e5 * u.km}},
        "impact_energy": {"mass": 1e10 * u.kg, "speed": 20 * u.km / u.s},
        "infer": {
            "asteroid": asteroid,
            "encounters": [near],
            "densities": density,
            "cohesions": 0 * u.Pa,
            "attitudes": 2,
        },
        "known_population": {},
        "lobe_history": {"body": lobes, "encounter": near, "shape": shape},
        "make_pile": {"body": body, "grains": 30},
        "outcome_map": {"body": body, "periapsis": [15000] * u.km, "v_inf": [5] * u.km / u.s, "phases": 1},
        "palermo_scale": {"probability": 1e-4, "energy": 1e18 * u.J, "time": 10 * u.yr},
        "periapsis_axes": {"encounter": near},
        "plot_result": {"result": fs.flyby(body, near)},
        "population_figure": {"result": results()["DisruptionRates"], "rates": [results()["EncounterRates"]]},
        "push": {"body": body, "direction": turn, "strain": 0.01},
        "read_population": {"path": place / "orbits.csv"},
        "recovery": {"body": body, "directions": 2, "refinements": 1, "searches": 2},
        "recovery_energy": {"body": body, "direction": turn},
        "refresh_distance": {"body": lobes, "shape": shape, "attitudes": 1},
        "requirements": {"body": body, "samples": 10},
        "roche_lobe": {"shape": shape, "body": lobes.with_(spin_period=30 * u.h)},
        "screen": {"asteroids": "Apophis", **month, "within": 0.01 * u.au},
        "shape_map": {"axes": Figure().add_subplot(), "shape": shape, "values": np.zeros(len(shape.facets))},
        "shape_slopes": {"shape": shape, "body": lobes},
        "shape_spin": {"body": lobes, "encounter": near, "shape": shape},
        "slope_change_figure": {"shape": shape, "change": fs.surface_change(lobes, near, shape=shape)},
        "spin_forecast": {"asteroid": asteroid, "encounter": near, "n": 2},
        "spin_limits": {"body": body},
        "spin_sample": {"asteroid": asteroid, "encounter": near, "n": 2},
        "stability": {"body": body},
        "surface_change": passage | {"count": 50},
        "surface_history": {"body": lobes, "encounter": near, "shape": shape, "instants": 5},
        "survival": {"body": body, "distribution": distribution()},
        "target_map": {"body": body, "v_inf": 5 * u.km / u.s, "periapsis": 15000 * u.km, "directions": 2},
        "torino_scale": {"probability": 1e-4, "energy": 1e18 * u.J},
        "virtual_impactors": {"orbit": asteroid, **month, "n": 5},
        "Orbit.barycentric": {"window": window},
        "Orbit.flight": {"window": window},
    }


def public():
    """Names of the public callables: functions, constructors of inputs, and methods with arguments."""
    found = {}
    for name in fs.__all__:
        value = getattr(fs, name)
        if not inspect.isclass(value):
            if callable(value):
                found.setdefault(value, name)
            continue
        if name in INPUTS:
            found[value] = name
        if issubclass(value, (str, Exception)):
            continue
        for method in dir(value):
            static = inspect.getattr_static(value, method)
            plain = getattr(static, "__func__", static)
            if method.startswith("_") or not inspect.isfunction(plain):
                continue
            if not plain.__module__.startswith("flybystab"):  # of a class of astropy
                continue
            if len(inspect.signature(plain).parameters) > 1 and name not in ("Record", "Tabular"):
                found.setdefault(plain, f"{name}.{method}")
    return sorted(found.values())


def pool(name, parameter, value):
    """Values of one argument: the valid one first, then those of its kind, then values of any kind."""
    kind = str(parameter.annotation)
    made = [value, *NAMED.get(parameter.name, [])]
    if isinstance(value, u.Quantity) or "Quantity" in kind:
        made += quantities(value.unit if isinstance(value, u.Quantity) else UNITS.get(parameter.name, u.one))
    if "int" in kind:
        made += COUNTS
    if "float" in kind or "Array" in kind:
        made += NUMBERS
    if "bool" in kind:
        made += [False, True, np.zeros(2)]
    if "Time" in kind:
        made += TIMES
    if "Path" in kind:
        made += PATHS
    if "lanet" in parameter.name:
        made += PLANETS
    for other, objects in scenes().items():
        if other in kind or (kind.strip("'") == "Any" and other in ("Asteroid", "Orbit")):
            made += objects
    return made + ODD


@cache
def calls():
    """Name -> (callable, pools of its arguments); the first value of each pool is valid."""
    made = {}
    for name, chosen in valid().items():
        owner, _, method = name.rpartition(".")
        function = getattr(fs, name) if not owner else None
        if owner:
            static = inspect.getattr_static(getattr(fs, owner), method)
            bound = isinstance(static, (classmethod, staticmethod))
            function = getattr(getattr(fs, owner) if bound else results()[owner], method)
        pools = {}
        for parameter in inspect.signature(function).parameters.values():
            plain = parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
            if plain and (parameter.name in chosen or parameter.default is not parameter.empty):
                default = None if parameter.default is parameter.empty else parameter.default
                pools[parameter.name] = pool(name, parameter, chosen.get(parameter.name, default))
        made[name] = function, pools
    return made


@st.composite
def arguments(draw, name):
    """Valid arguments of a callable with up to three replaced at random."""
    _, pools = calls()[name]
    changed = draw(st.lists(st.sampled_from(sorted(pools)), max_size=3, unique=True)) if pools else []
    return {k: draw(st.sampled_from(pool)) if k in changed else pool[0] for k, pool in pools.items()}


class TooSlow(BaseException):
    """A call took more processor time than `LIMIT`, or waited."""


def outcome(name, given, limit=LIMIT):
    """How a call ends: "result", "named error", or a description of a raw error or of a call that takes too long."""
    function, _ = calls()[name]

    def stop(*_):
        raise TooSlow

    timers = {signal.SIGPROF: signal.ITIMER_PROF, signal.SIGALRM: signal.ITIMER_REAL}
    before = {number: signal.signal(number, stop) for number in timers}
    signal.setitimer(signal.ITIMER_PROF, limit)
    signal.setitimer(signal.ITIMER_REAL, WAITING * limit)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            function(**given)
        return "result"
    except FlybystabError:
        return "named error"
    except TooSlow:
        return "too slow"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:120]}"
    finally:
        for number, timer in timers.items():
            signal.setitimer(timer, 0)
            signal.signal(number, before[number])
        if "matplotlib.pyplot" in sys.modules:
            sys.modules["matplotlib.pyplot"].close("all")


def fuzz(name, n):
    """Outcomes of `n` calls of a function, and the first arguments with each outcome; files go to an empty folder."""
    counts, example = Counter(), {}

    @seed(1)
    @settings(
        max_examples=n,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(arguments(name))
    def call(given):
        found = outcome(name, given)
        counts[found] += 1
        example.setdefault(found, given)

    pools = calls()[name][1]
    before, folder = Path.cwd(), tempfile.mkdtemp()
    os.chdir(folder)
    try:
        outcome(name, {k: pool[0] for k, pool in pools.items()}, limit=600)  # compiles the kernels
        call()
    finally:
        os.chdir(before)
        shutil.rmtree(folder, ignore_errors=True)
    return counts, example
