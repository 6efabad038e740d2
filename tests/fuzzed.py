# ruff: noqa: E501
"""Calls of every public function with valid, borderline and invalid arguments, for tests and `benchmarks/attack.py`."""

import signal
import warnings
from collections import Counter
from functools import cache

import astropy.units as u
import numpy as np
from astropy.time import Time
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

import flybystab as fs
from flybystab.errors import FlybystabError

#: Longest time of a call, s.
LIMIT = 10

ODD = [
    None, True, 3, -1, 0, 1.5, np.nan, np.inf, -np.inf, "", "x", "\x1b[31m", b"x", [], {}, (), [1, 2], {"a": 1}, object(),
    np.zeros(3), np.zeros((0, 3)), np.array(["a"]), 1 + 2j, 10**400, float,
]  # fmt: skip
NUMBERS = [1e-300, -1.0, 0.0, 1e100, 1e308, np.nan, np.inf, -np.inf, 1 + 1j, [], [1.0, 2.0], "x"]
TIMES = [
    Time("2029-04-13T21:46", scale="tdb"), Time("2029-04-13", scale="utc"), Time("2029-04-13", scale="local"),
    Time("2029-04-13", scale="ut1"), Time(1e9, format="jd", scale="tdb"), Time(-1e9, format="jd", scale="tdb"),
    Time(["2029-04-13", "2029-04-14"], scale="tdb"), Time("1600-01-01", scale="tdb"), "2029-04-13",
]  # fmt: skip


def quantities(unit, *valid):
    """Valid values, values of any size in the unit, and quantities of other units."""
    made = []
    for x in NUMBERS:
        try:
            made.append(x * unit if not isinstance(x, str) else x)
        except TypeError:
            continue
    return [v * unit for v in valid] + made + [1 * u.kg, 1 * u.mag, np.ma.masked]


@cache
def scenes():
    """Bodies, encounters and orbits that calls are made with."""
    asteroid = fs.Asteroid.from_catalogue("Apophis")
    body = fs.Body((200, 150, 140) * u.m, 2000 * u.kg / u.m**3, spin_period=5 * u.h)
    weak = fs.Body((200, 199, 198) * u.m, 1000 * u.kg / u.m**3, spin_period=3 * u.h)
    near = fs.Encounter.hyperbolic("earth", 15000 * u.km, 6 * u.km / u.s)
    hit = fs.Encounter.hyperbolic("earth", 5000 * u.km, 6 * u.km / u.s)
    return {"asteroid": [asteroid], "body": [body, weak], "encounter": [near, hit], "orbit": [asteroid.orbit]}


@cache
def calls():
    """Name -> (callable, pools of its arguments); the first value of each pool is valid."""
    s = scenes()
    bodies, encounters = s["body"] + ODD, s["encounter"] + ODD
    m, deg, day = (lambda *v: quantities(u.m, *v)), (lambda *v: quantities(u.deg, *v)), quantities(u.d, 1.0)
    plain = [None, np.eye(3), np.ones((3, 3)), np.full((3, 3), np.nan), *ODD]
    tolerance = [1e-6, 1e-3, -1.0, 0.0, np.inf, np.nan, 1e300, 1e-300, "x", None, 1j]
    count = [2, 1, 0, -1, 1.5, True, None, "x", np.int64(2), np.nan]
    seed = [0, 7, -1, 2**70, 1.5, None, "x"]
    planets = [("earth",), "earth", "moon", (), 3, None, ("x",), ("sun",), [None], {"earth"}]
    flag = [False, True, np.zeros(2), None, "x", 3]
    density = quantities(u.kg / u.m**3, 2000.0, 100.0)
    speed = quantities(u.km / u.s, 6.0, 30.0)
    period = quantities(u.h, 5.0, 1e6)
    text = ["mohr-coulomb", "x", "", None, 3, []]
    where = {
        "start": [Time("2029-04-01", scale="tdb"), *TIMES],
        "stop": [Time("2029-05-01", scale="tdb"), *TIMES],
    }
    axes = [(200, 150, 140) * u.m, (1e100, 1, 1) * u.m, (1, 1, 0) * u.m, (1, np.nan, 1) * u.m, *m(1.0), *ODD]
    vector = [(1.0, 0.1, 0.1) * u.au, (1e200, 0, 0) * u.m, (0, 0, 0) * u.m, *m(1.0), *ODD]
    velocity = [(1.0, 30.0, 0.1) * u.km / u.s, (1e9, 0, 0) * u.km / u.s, *speed]
    elements = {
        "epoch": TIMES[:1] + TIMES + ODD, "a": quantities(u.au, 0.9, 0.004, 1e6, -2.0), "e": [0.2, 0.0, 1.0, 1.5, -1, *NUMBERS],
        "i": deg(3.0, 190.0, -5.0), "node": deg(204.0), "peri": deg(126.0), "M": deg(100.0, 1e9),
        "A3": quantities(u.au / u.d**2, 0.0, 1e3), "law": ["asteroid", "x", None],
    }  # fmt: skip
    return {
        "Material": (fs.Material, {"friction_angle": deg(35.0, 0.0, 90.0), "cohesion": quantities(u.Pa, 0.0, 1e9),
            "dilatancy": [0.0, 1.0, *NUMBERS], "yield_surface": text, "brittle": flag,
            "bulk_modulus": [None, *quantities(u.Pa, 1e7)]}),
        "Body": (fs.Body, {"semi_axes": axes, "density": density, "spin_period": period, "material": [fs.Material(), *ODD]}),
        "hyperbolic": (fs.Encounter.hyperbolic, {"planet": ["earth", "moon", "x", None, 3], "periapsis": quantities(u.km, 15000.0, 1.0),
            "v_inf": speed, "settle": quantities(u.s, 100.0), "j2": flag, "pole": [(0.0, 0.0, 1.0), (0, 0, 0), *ODD]}),
        "from_elements": (fs.Orbit.from_elements, elements),
        "from_state": (fs.Orbit.from_state, {"epoch": TIMES[:1] + TIMES + ODD, "position": vector, "velocity": velocity,
            "centre": ["sun", "earth", "x", None], "frame": ["ICRF", "x", None, 3]}),
        "equilibrium": (fs.equilibrium, {"body": bodies, "tide": [None, *quantities(u.s**-2, 0.0), np.eye(3) * 1e-8 / u.s**2]}),
        "stability": (fs.stability, {"body": bodies, "dilatancy": [1.0, None, *NUMBERS]}),
        "flyby": (fs.flyby, {"body": bodies, "encounter": encounters, "attitude": plain, "tolerance": tolerance,
            "error": flag, "history": flag, "surfaces": [(), "tresca", 3, None, ["x"]], "max_axis_ratio": [6.0, 1.0, *NUMBERS]}),
        "flyby_many": (fs.flyby_many, {"bodies": [s["body"], bodies[0], [], [None], 3], "encounters": [s["encounter"], [], [3], None],
            "attitudes": [None, [np.eye(3)] * 2, [None] * 2, *ODD], "tolerance": tolerance, "workers": count}),
        "flyby_margin": (fs.flyby_margin, {"body": bodies, "encounter": encounters, "attitude": plain, "dilatancy": [None, 1.0, *NUMBERS]}),
        "find_encounters": (fs.find_encounters, {"objects": s["orbit"] + ODD, **where, "planets": planets,
            "within": quantities(u.au, 0.05, 1e9), "error": quantities(u.km, 0.1), "tolerance": [None, *tolerance],
            "ephemeris": [None, "de421", "x", 3], "forces": [None, (), ("x",), 3], "workers": count}),
        "from_orbit": (fs.Encounter.from_orbit, {"orbit": s["orbit"] + ODD, "planet": ["earth", "x", None, 3], "time": TIMES + ODD,
            "search": day, "within": [None, *quantities(u.au, 0.05)], "error": quantities(u.km, 0.1)}),
        "encounter_distribution": (fs.encounter_distribution, {"orbit": s["asteroid"] + ODD, "planet": ["earth", "x", 3],
            "time": TIMES + ODD, "n": [3, *count], "seed": seed, "search": day, "tolerance": tolerance}),
        "screen": (fs.screen, {"asteroids": ["Apophis", ["Apophis", "x"], "/none.csv", [], *ODD[1:]], **where, "planets": planets,
            "within": quantities(u.au, 0.01), "samples": count, "seed": seed, "material": [None, *ODD], "population": [None, *ODD],
            "tolerance": tolerance}),
        "infer": (fs.infer, {"asteroid": s["asteroid"] + bodies, "encounters": [s["encounter"][:1], (), 3, [3], None],
            "densities": [2000 * u.kg / u.m**3, *density], "cohesions": quantities(u.Pa, 0.0, 100.0), "attitudes": count, "seed": seed,
            "yield_surface": text}),
        "spin_sample": (fs.spin_sample, {"asteroid": s["asteroid"] + bodies, "encounter": encounters, "n": count, "seed": seed,
            "tolerance": tolerance, "workers": count}),
        "surface_change": (fs.surface_change, {"body": bodies, "encounter": encounters, "attitude": plain, "count": [50, *count]}),
        "catalogue": (fs.catalogue, {"path": ["/none.csv", "/dev/null", "a\0", "x" * 300, *ODD[1:]]}),
        "cite": (fs.cite, {"result": [None, {}, *ODD]}),
        "from_catalogue": (fs.Asteroid.from_catalogue, {"name": ["Apophis", 99942, "Apohpis", *ODD]}),
    }  # fmt: skip


@st.composite
def arguments(draw, name):
    """Valid arguments of a callable with up to three replaced at random."""
    _, pools = calls()[name]
    changed = draw(st.lists(st.sampled_from(sorted(pools)), max_size=3, unique=True))
    return {k: draw(st.sampled_from(pool)) if k in changed else pool[0] for k, pool in pools.items()}


class TooSlow(BaseException):
    """A call took longer than `LIMIT`."""


def outcome(name, given, limit=LIMIT):
    """How a call ends: "result", "named error", or a description of a raw error or of a call that takes too long."""
    function, _ = calls()[name]

    def stop(*_):
        raise TooSlow

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(limit)
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
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def fuzz(name, n):
    """Outcomes of `n` calls of a function, and the first arguments with each outcome."""
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

    call()
    return counts, example
