"""Figures of equilibrium and stability, one function each."""

from __future__ import annotations

from collections.abc import Mapping

import astropy.units as u
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flybystab.body.body import DEFAULT_SURFACE, Body, Material
from flybystab.body.fluids import roche_limit
from flybystab.constants import GM_EARTH, R_EARTH, G
from flybystab.plots.flyby import described
from flybystab.plots.stability import (
    ANGLES,
    BLACK,
    barrier_plot,
    failure_distance_plot,
    regions_legend,
    regions_plot,
    spin_plot,
)
from flybystab.plots.style import new_figure, styled

#: Spins of the panels of :func:`regions_figure`, omega^2/(pi G rho).
SPINS = (0.0, 0.2, 0.4, 0.8)

#: Asteroids that are labelled.
KNOWN = (
    "Apophis",
    "Eros",
    "Itokawa",
    "Bennu",
    "1950 DA",
    "Anteros",
    "Didymos",
    "1999 KW4",
    "Geographos",
    "Moshup",
)


def catalogue_bodies() -> dict[str, Body]:
    """Every body of the embedded catalogue that spins about its short axis, by name."""
    from flybystab.catalogues.catalogue import catalogue

    return {a.name: a.body for a in catalogue() if not a.tumbles}


@styled
def regions_figure(bodies: Mapping[str, Body], surface: str = DEFAULT_SURFACE, cells: int = 200) -> Figure:
    """Required friction angle of shapes at four spins; each body is on the panel of the spin nearest to its own."""
    figure = new_figure(9.0, 8.6)
    w2 = {name: float(b.omega @ b.omega) * b.dynamical_time**2 for name, b in bodies.items()}
    for axes, spin in zip(figure.subplots(2, 2).flat, SPINS, strict=True):
        near = {n: b for n, b in bodies.items() if min(SPINS, key=lambda s: abs(s - w2[n])) == spin}
        regions_plot(axes, spin, yield_surface=surface, bodies=near, named=KNOWN, cells=cells, legend=False)
    handles = [
        *regions_legend(),
        Line2D([], [], color=BLACK, ls="", marker="o", ms=4, mec="white", label="asteroids of the catalogue"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


@styled
def spin_figure(bodies: Mapping[str, Body], surface: str = DEFAULT_SURFACE) -> Figure:
    """Spin limits against the axis ratio, oblate and prolate, with bodies by ``a3/a1`` and ``omega^2/(pi G rho)``."""
    figure = new_figure(9.6, 4.8)
    flat, long = figure.subplots(1, 2, sharey=True)
    for axes in (flat, long):
        axes.set(xlim=(0.1, 1.02), ylim=(0.0, 1.3))
    oblate = {n: b for n, b in bodies.items() if b.axes[1] ** 2 >= b.axes[0] * b.axes[2]}
    spin_plot(flat, ANGLES, yield_surface=surface, bodies=oblate, named=KNOWN)
    others = {n: b for n, b in bodies.items() if n not in oblate}
    spin_plot(long, ANGLES, prolate=True, yield_surface=surface, bodies=others, named=KNOWN)
    return figure


@styled
def barrier_figure(body: Body) -> Figure:
    """Energy lost by a perturbation against its strain, for volume-preserving and for associative flow."""
    figure = new_figure(9.6, 4.2)
    for axes, dilatancy, name in zip(
        figure.subplots(1, 2), (0.0, 1.0), ("volume-preserving flow", "associative flow"), strict=True
    ):
        barrier_plot(axes, body, dilatancy=dilatancy)
        axes.set_title(name)
    figure.suptitle(described(body))
    return figure


@styled
def failure_figure(surface: str = DEFAULT_SURFACE) -> Figure:
    """Static failure distance from the Earth against the friction angle, for free bodies and synchronous satellites."""
    figure = new_figure(9.6, 4.4)
    free, bound = figure.subplots(1, 2)
    density, material = 2000 * u.kg / u.m**3, Material(yield_surface=surface)
    gm, radius = GM_EARTH * u.m**3 / u.s**2, R_EARTH * u.m

    def made(axes: tuple[float, float, float], period: float | None = None) -> Body:
        spin = None if period is None else period * u.h
        return Body(np.array(axes) * u.m, density, spin, material=material)

    still = {"sphere": made((1000, 1000, 1000)), "1400:850:750": made((1400, 850, 750))}
    failure_distance_plot(free, still | {"1400:850:750, 6 h": made((1400, 850, 750), 6.0)}, gm, radius)
    failure_distance_plot(bound, still, gm, radius, synchronous=True)
    fluid = roche_limit()
    mean = GM_EARTH / (4.0 / 3.0 * np.pi * G * R_EARTH**3)
    far = (4.0 * mean / (3.0 * fluid.load * density.value)) ** (1 / 3)
    bound.axhline(far, color=BLACK, ls=(0, (1, 3)), lw=2, label="fluid: Roche limit")
    bound.legend()
    free.set_title("own spin, long axis to the planet")
    bound.set_title("synchronous satellite")
    figure.suptitle(f"Earth; bodies of {density.value:g} kg/m$^3$, {surface.title()}")
    return figure
