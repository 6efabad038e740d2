"""Summaries of results as text for the terminal."""

from __future__ import annotations

import math

import astropy.units as u
import numpy as np

from flybystab.body.equilibrium import Equilibrium
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.spin_sample import SpinSample
from flybystab.orbit.ephemeris import BELT, BODIES

#: Predicate of the sentence "The body ..." for each verdict.
MEANING = {
    "INTACT": "never yields",
    "RESHAPED": "yields and is deformed; all of its mass stays bound",
    "MASS LOSS": "loses mass",
    "DISRUPTED": "loses at least half of its mass",
    "IMPACT": "reaches the planet",
    "BEYOND MODEL": "is stretched beyond an axis ratio of 6:1, the limit of the homogeneous ellipsoid",
    "NOT IN EQUILIBRIUM": "is not in equilibrium even far from any planet",
}


def angle(value: u.Quantity) -> str:
    """An angle as text; an infinite one means that no friction angle suffices."""
    degrees = value.to_value(u.deg)
    return f"{degrees:.2f} deg" if np.isfinite(degrees) else "no friction angle suffices"


def encounter_lines(e: Encounter) -> list[str]:
    """Planet, time, distance, speed and predictability of an encounter."""
    when = f"{e.time.tdb.iso[:19]} TDB" if e.time is not None else "hyperbolic orbit without a date"
    radii = e.distance.to_value(u.m) / e.planet.radius
    speed = f"v_inf {e.v_inf.to_value(u.km / u.s):.4f} km/s"
    if e.bound:
        speed = f"{e.v_periapsis.to_value(u.km / u.s):.4f} km/s, bound to the planet"
    out = [
        f"encounter  {e.planet.name.capitalize()}, {when}",
        f"           {e.distance.to_value(u.km):,.1f} km from the centre ({radii:.3f} radii), {speed}",
    ]
    if e.impact:
        out.append(f"           reaches the {e.impact_level}{entry(e)}")
    if e.displacement is not None:
        out.append(f"orbit      {known(e)}")
    return out


def entry(e: Encounter) -> str:
    """Time and place of entry for an impact on a real orbit; empty for other encounters."""
    if e.entry_time is None:
        return ""
    top = "enters the atmosphere" if e.planet.atmosphere else "reaches the surface"
    where = ""
    if e.entry_place is not None:
        longitude, latitude = (x.to_value(u.deg) for x in e.entry_place)
        where = f" at {abs(latitude):.2f} {'N' if latitude >= 0 else 'S'} {abs(longitude):.2f} "
        where += "E" if longitude >= 0 else "W"
    return f"; {top} on {e.entry_time.tdb.iso[:19]} TDB{where}"


def grade(predictability: str) -> str:
    """Predictability of an encounter as text."""
    return (
        "unpredictable (1 sigma exceeds the miss distance)"
        if predictability == "one of many"
        else str(predictability)
    )


def known(e: Encounter) -> str:
    """Predictability of an encounter on a real orbit, with the displacement from which it follows."""
    assert e.displacement is not None
    km = f"{e.displacement.to_value(u.km):,.3g} km"
    sigma, caveat = e.neighbour.startswith("one sigma"), e.neighbour.partition(", ")[2]
    what = "1-sigma position uncertainty" if sigma else f"displacement of an orbit {e.neighbour},"
    note = f"; {caveat}" if caveat else ""
    return f"{grade(str(e.predictability))} ({what} at encounter {km}{note})"


def contact(r: FlybyResult) -> str:
    """Kind and time of the contact with the planet in an IMPACT."""
    e = r.encounter
    top = "the top of the atmosphere" if e.planet.atmosphere else "the ground"
    before = -(e.t_start + r.end_time.to_value(u.s))
    if r.contact == "path":
        return f"the path enters the {e.impact_level}; contact with {top} {before:,.1f} s before closest approach"
    return (
        f"the centre would pass {e.height / 1e3:,.3g} km above {top}, but the body touches it "
        f"{abs(before):,.1f} s {'before' if before >= 0 else 'after'} closest approach"
    )


def flyby_lines(r: FlybyResult) -> list[str]:
    """Verdict, margins and error of a flyby."""
    m = r.body.material
    letter = f" (class {r.verdict_class})" if r.verdict_class else ""
    out = [f"verdict    {r.verdict}{letter}: the body {MEANING[str(r.verdict)]}"]
    if r.verdict == "NOT IN EQUILIBRIUM":
        out.append(
            f"           friction angle needed: {angle(r.max_required_friction_angle)}; cohesion needed at "
            f"{m.friction_angle.to_value(u.deg):g} deg: {r.required_cohesion.to_value(u.Pa):.3g} Pa"
        )
        return out
    if r.contact is not None:
        out.append(f"contact    {contact(r)}")
    has = f"{m.friction_angle.to_value(u.deg):g} deg"
    if r.margin > 0 * u.deg:
        out.append(
            f"friction   mobilised {angle(r.max_required_friction_angle)} of {has}, margin {angle(r.margin)}"
        )
    else:
        out.append(
            f"friction   required to stay rigid {angle(r.max_required_friction_angle)}, the material has {has}"
        )
    if r.onset_time is not None:
        a = r.semi_axes.to_value(u.m)
        lode = "" if r.lode_angle is None else f", Lode angle {r.lode_angle.to_value(u.deg):.1f} deg"
        out.append(f"yield      {r.onset_time.to_value(u.h):.2f} h after the start{lode}")
        out.append(
            f"after      semi-axes {a[0]:.5g}, {a[1]:.5g}, {a[2]:.5g} m, bound mass fraction {r.bound_fraction:.1%}"
        )
    if r.verdict == "BEYOND MODEL" and r.grains is None:
        known = r.margins
        reach = f"{known.axis_ratio:.3g}" if math.isfinite(known.axis_ratio) else "not known"
        out.append(
            f"beyond     axis ratio {reach} (integrated beyond the limit {known.limit:.3g}), strain "
            f"{known.strain:.2f} at the limit; bound mass fraction at most {known.bound_fraction_upper:.1%}"
        )
    if not r.settled:
        out.append(
            "settled    no: the body still deforms at the end of the run, so that the verdict may change later"
        )
    out.append(f"spin       {spin_change(r)}")
    if r.robust is not None:
        others = ", ".join(f"{k} {v}" for k, v in r.verdict_by_surface.items())
        word = "does not depend" if r.robust else "depends"
        out.append(f"surfaces   the verdict {word} on the yield surface ({others})")
    if r.error is not None:
        out.append(
            f"error      semi-axes {r.error.semi_axes:.1e}, spin {r.error.spin:.1e} (relative, measured); "
            f"tide {r.error.tide:.1e}"
        )
    return out


def extent(values: np.ndarray, digits: int, unit: str = "", missing: str = "not defined") -> str:
    """Range of the finite values of a sample; `missing` describes the others, whose number is given."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return missing
    text = f"{finite.min():.{digits}f} to {finite.max():.{digits}f} {unit}".rstrip()
    others = len(values) - len(finite)
    return f"{text} ({missing} at {others} of {len(values)})" if others else text


def median(values: np.ndarray, digits: int) -> str:
    """Median of the finite values of a sample, in parentheses; empty if there are none."""
    finite = values[np.isfinite(values)]
    return f" (median {np.median(finite):.{digits}f})" if len(finite) else ""


def friction_extent(s: SpinSample, digits: int = 2) -> str:
    """Range of the friction angles mobilised over a sample of attitudes, or required for equilibrium."""
    needed = s.max_required_friction_angle.to_value(u.deg)
    held = s.verdict != "NOT IN EQUILIBRIUM"
    none = "no friction angle suffices"
    if not held.any():
        return f"not in equilibrium; friction angle needed: {extent(needed, digits, 'deg', none)}"
    text = f"friction mobilised: {extent(needed[held], digits, 'deg', none)}"
    out = len(held) - int(held.sum())
    return text + (f"; not in equilibrium at {out} of {len(held)}" if out else "")


def sample_lines(s: SpinSample) -> list[str]:
    """Verdicts and ranges over the sampled attitudes; without spin changes if none of them is in equilibrium."""
    turn = s.pole_change.to_value(u.deg)
    names, counts = np.unique(s.verdict, return_counts=True)
    pole = "catalogued pole, random phases" if s.pole_known else "unknown pole, random phases"
    out = [
        f"attitudes  {len(s)} ({pole}): "
        + ", ".join(f"{n} x {k}" for k, n in zip(names, counts, strict=True))
    ]
    if np.any(s.verdict != "NOT IN EQUILIBRIUM"):
        ratio = extent(s.spin_ratio, 2, missing="not defined (no spin before)")
        axis = extent(turn, 1, "deg", "an undefined angle")
        out.append(
            f"           spin rate x {ratio}{median(s.spin_ratio, 2)}, axis rotates by {axis}{median(turn, 1)}"
        )
    return [*out, f"           {friction_extent(s)}"]


def spin_change(r: FlybyResult) -> str:
    """Change of the spin by an encounter."""
    if not math.isfinite(r.spin_ratio):
        rate = r.spin.to_value(u.rad / u.h)
        return (
            f"none before, period {2.0 * math.pi / rate:.2f} h after"
            if rate > 0.0
            else "none before and after"
        )
    return f"rate x {r.spin_ratio:.3f}, axis rotates by {r.pole_change.to_value(u.deg):.2f} deg"


def modelled(r: FlybyResult) -> dict[str, str]:
    """Effects modelled for ``orbit``, ``tide`` and ``body``; of more than two asteroids only the number is given."""
    groups: dict[str, list[str]] = {}
    for entry in r.modelled:
        head, _, rest = entry.partition(": ")
        groups.setdefault(head if rest else "body", []).append(rest or entry)
    out = {}
    for head, entries in groups.items():
        names = [e.removesuffix(" point mass") for e in entries]
        small = [n for n in names if n in BELT]
        if len(small) > 2:
            at = names.index(small[0])
            names = [n for n in names if n not in small]
            names.insert(at, f"{len(small)} massive asteroids")
        out[head] = ", ".join(names if head == "body" else map(capital, names))
    return out


def capital(name: str) -> str:
    """Name of a force with its source capitalised: ``earth J2`` becomes Earth J2."""
    first, space, rest = name.partition(" ")
    return (first.capitalize() if first in (*BODIES, *BELT) else first) + space + rest


def left_out(r: FlybyResult, most: int = 4) -> str:
    """The largest neglected effects with their relative sizes, and the number of others."""
    largest = sorted(r.left_out, key=lambda x: -x[1])
    words = []
    for name, size in largest[:most]:
        head, colon, rest = name.rpartition(": ")
        words.append(f"{head}{colon}{capital(rest).removesuffix(' point mass')} ({size:.0e})")
    if len(largest) > most:
        words.append(f"{len(largest) - most} smaller effects")
    return "; ".join(words)


def model_lines(r: FlybyResult, assumed: tuple[str, ...] = ()) -> list[str]:
    """Effects modelled and neglected, and assumed inputs."""
    rows = [f"{head}: {what}" for head, what in modelled(r).items()]
    out = [("modelled   " if i == 0 else "           ") + row for i, row in enumerate(rows)]
    if r.left_out:
        out.append("neglected  " + left_out(r))
    if assumed:
        out.append("assumed    " + "; ".join(assumed))
    return out


def equilibrium_lines(name: str, e: Equilibrium) -> list[str]:
    """Equilibrium of an isolated body."""
    m = e.body.material
    out = [
        f"{name}: {'in equilibrium' if e.admissible else 'not in equilibrium'} with "
        f"{m.friction_angle.to_value(u.deg):g} deg and {m.cohesion.to_value(u.Pa):g} Pa ({m.yield_surface})",
        f"required friction angle   {angle(e.required_friction_angle)}"
        + (f" ({other})" if (other := e.other_surfaces()) else ""),
        f"required cohesion         {e.required_cohesion.to_value(u.Pa):.4g} Pa",
        f"mean pressure             {e.mean_pressure.to_value(u.Pa):.4g} Pa"
        + (" (tension)" if e.in_tension else ""),
    ]
    return out
