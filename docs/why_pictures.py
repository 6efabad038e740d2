"""Pictures of the page "Why": ``python docs/why_pictures.py``. Each is computed by the package."""

from pathlib import Path

import astropy.units as u
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse

import flybystab as fs
from flybystab.constants import GM_EARTH
from flybystab.plots.grains import grains_plot
from flybystab.plots.style import figure_style

IMAGES = Path(__file__).resolve().parent / "images"
BLUE, ORANGE, RED, GREEN = "#0072B2", "#E69F00", "#D55E00", "#009E73"
PILE = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)


def save(name, figure):
    figure.savefig(IMAGES / name, dpi=110)
    print(IMAGES / name)


def tide():
    """Tidal acceleration on the surface of a body at two Earth radii: stretched along the line, squeezed across."""
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.add_patch(Circle((0, 0), 1.0, color="0.85"))
    axes.add_patch(Circle((0, 0), 1.0, fill=False, ec="0.4"))
    angle = np.linspace(0, 2 * np.pi, 25)[:-1]
    x, y = np.cos(angle), np.sin(angle)
    distance = 2 * fs.R_earth.to_value(u.m)
    scale = GM_EARTH / distance**3  # K = GM/R^3 diag(2, -1, -1), the planet along x
    k = np.diag([2.0, -1.0]) * scale
    ax, ay = k @ np.stack([x, y]) / scale
    axes.quiver(x, y, ax, ay, color=BLUE, angles="xy", scale_units="xy", scale=4.5, width=0.005)
    axes.annotate("to the planet", (2.75, 0.0), (1.7, 0.0), va="center", arrowprops={"arrowstyle": "->"})
    stretch = 1.12
    axes.add_patch(Ellipse((0, 0), 2 * stretch, 2 / stretch, fill=False, ec=RED, ls="--"))
    axes.plot([], [], color=BLUE, marker=r"$\rightarrow$", markersize=14, ls="", label="tidal acceleration")
    axes.plot([], [], color=RED, ls="--", label="shape that the tide tends to give (exaggerated)")
    axes.set(xlim=(-2.0, 2.8), ylim=(-1.1, 1.1), aspect="equal")
    axes.axis("off")
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    save("why_tide.png", figure)


def friction():
    """Principal stresses of the pile far away and at closest approach, as Mohr circles with the mobilised friction."""
    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    axes = figure.subplots()
    alone = fs.equilibrium(PILE)
    distance = 2.6 * fs.R_earth.to_value(u.m)
    k = GM_EARTH / distance**3 * np.diag([2.0, -1.0, -1.0]) / u.s**2
    near = fs.equilibrium(PILE, tide=k)
    for found, name, colour, style in (
        (alone, "far away", BLUE, "-"),
        (near, "at 2.6 Earth radii", RED, "--"),
    ):
        s = -np.sort(np.linalg.eigvalsh(found.stress.to_value(u.Pa)))  # compression positive
        low, high = s.min(), s.max()
        phi = np.arcsin((high - low) / (high + low))
        centre, radius = 0.5 * (high + low), 0.5 * (high - low)
        turn = np.linspace(0, np.pi, 200)
        axes.plot(centre + radius * np.cos(turn), radius * np.sin(turn), color=colour, ls=style)
        x = np.array([0.0, 1.15 * high])
        label = f"{name}: mobilised friction angle {np.degrees(phi):.0f}°"
        axes.plot(x, np.tan(phi) * x, color=colour, ls=style, lw=0.9, label=label)
    x = np.array([0.0, 240.0])
    axes.fill_between(x, np.tan(np.radians(35)) * x, 1e9, color="0.9", lw=0)
    axes.text(94, 88, "not admissible", ha="center", color="0.3", fontsize=8)
    axes.plot(
        x, np.tan(np.radians(35)) * x, color="black", lw=1.4, label="friction angle of the material, 35°"
    )
    # Equal scales, so that the circles of Mohr are circles.
    axes.set(
        xlim=x,
        ylim=(0, 140),
        aspect="equal",
        xlabel="compressive stress (Pa)",
        ylabel="shear stress (Pa)",
    )
    axes.legend(frameon=False, fontsize=8, loc="upper left")
    save("why_friction.png", figure)


def margin():
    """Mobilised friction angle against time, for encounters at several distances."""
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    axes = figure.subplots()
    for q, colour, style in ((6.0, GREEN, ":"), (4.0, BLUE, "-"), (3.0, ORANGE, "--"), (2.2, RED, "-.")):
        encounter = fs.Encounter.hyperbolic("earth", q * fs.R_earth, 8 * u.km / u.s)
        result = fs.flyby(PILE, encounter)
        history = result.history
        t = history.time_from_periapsis.to_value(u.h)
        angle = history.required_friction_angle.to_value(u.deg)
        axes.plot(t, angle, color=colour, ls=style, label=f"{q:g} Earth radii: {result.verdict}")
    axes.axhline(35, color="black", lw=1.2)
    axes.annotate("friction angle of the material", (-1.9, 36), fontsize=8)
    axes.set(
        xlim=(-2, 2),
        ylim=(0, 42),
        xlabel="time from closest approach (h)",
        ylabel="mobilised friction angle (deg)",
    )
    axes.legend(frameon=False, fontsize=8, loc="center left")
    save("why_margin.png", figure)


def grains():
    """The same deep passage by grains: before, near closest approach, afterwards."""
    encounter = fs.Encounter.hyperbolic("earth", 1.5 * fs.R_earth, 5 * u.km / u.s)
    result = fs.flyby(PILE, encounter, grains=500, seeds=[1], model="grains")
    run = result.grains.runs[0]
    turn = fs.periapsis_axes(encounter)
    hours = run.course.time.to_value(u.h)
    figure = Figure(figsize=(7.2, 2.7), layout="constrained")
    rows = (0, int(np.abs(hours - 0.6).argmin()), int(np.abs(hours - 3.0).argmin()))
    for axes, row, reach in zip(figure.subplots(1, 3), rows, (2.2, 4.0, 14.0), strict=True):
        grains_plot(axes, run, row, turn, reach)
        axes.set_title(f"{hours[row]:+.1f} h from closest approach", fontsize=9)
    figure.axes[0].set_ylabel("y (km)")
    save("why_grains.png", figure)


if __name__ == "__main__":
    with figure_style():
        for picture in (tide, friction, margin, grains):
            picture()
