"""``flybystab stability NAME`` and ``--all [FILE]``: equilibrium and stability of isolated asteroids."""

from __future__ import annotations

import argparse
from collections import Counter
from typing import TYPE_CHECKING

from flybystab._version import __version__
from flybystab.cli.body_options import body_arguments
from flybystab.cli.common import (
    asteroid_of,
    catalogue_argument,
    check_computed,
    check_table,
    material_arguments,
    material_of,
    show,
)
from flybystab.cli.shape_options import rest_slopes, shape_arguments
from flybystab.errors import WrongUsage

if TYPE_CHECKING:
    from flybystab.typing import Array

HELP = "equilibrium and stability of an isolated asteroid, or of a whole catalogue"
EXAMPLE = "flybystab stability Anteros --friction 30"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("name", nargs="?", help="number, name or designation; with --all, a catalogue file")
    catalogue_argument(sub)
    sub.add_argument(
        "--all",
        action="store_true",
        help="classify the embedded catalogue, or a file in any format of docs/inputs.md",
    )
    material_arguments(sub)
    body_arguments(sub)
    shape_arguments(sub)
    sub.add_argument("--output", metavar="FILE", help="with --all: write the table (.ecsv, .parquet, .csv)")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    if options.all and options.shape:
        raise WrongUsage("--shape: expected with one asteroid, not with --all")
    if options.all and options.catalogue:
        raise WrongUsage("--catalogue: expected with one asteroid; for a whole file use stability --all FILE")
    if options.all:
        _catalogue(options)
    elif options.name is None:
        raise WrongUsage("NAME: expected an asteroid, or --all for the whole catalogue")
    elif options.output:
        raise WrongUsage("--output: expected only with --all; otherwise the result is printed")
    else:
        _asteroid(options)


def _catalogue(options: argparse.Namespace) -> None:
    """Classify all asteroids of a catalogue."""
    from pathlib import Path

    import astropy.units as u

    from flybystab.flybys.document import table_document
    from flybystab.screening.classification import COLUMNS, classification, counts
    from flybystab.screening.table_files import write_rows

    check_table(options.output)
    table = classification(
        None if options.name is None else Path(options.name), material=material_of(options)
    )
    if options.output:
        bare = {n: table[n].value if isinstance(table[n], u.Quantity) else table[n] for n in table.colnames}
        rows = (
            {n: v[i].item() if hasattr(v[i], "item") else v[i] for n, v in bare.items()}
            for i in range(len(table))
        )
        write_rows(rows, Path(options.output), COLUMNS, table.meta)

    def lines() -> list[str]:
        head = f"{'asteroid':>24} {'friction':>8}  30 35 40 {'strain':>7} {'cohesion':>9}  not measured"
        out = [f"{'':>24} {'deg':>8} {'level':>9} {'':>7} {'Pa':>9}", head]
        for row in table:
            if row["error"]:
                out.append(f"{row['asteroid']:>24} {row['error']}")
                continue
            unknown = "; ".join(t for t in (row["assumed"], row["drawn"] and "drawn: " + row["drawn"]) if t)
            out.append(
                f"{row['asteroid']:>24} {row['required_friction_angle'].value:8.2f} {row['level_30']:3d}"
                f"{row['level_35']:3d}{row['level_40']:3d} {row['critical_strain']:7.3g} "
                f"{row['required_cohesion'].value:9.3g}  {unknown}"
            )
        for angle, found in counts(table).items():
            out.append(f"{angle}: " + ", ".join(f"{n} {name}" for name, n in found.items()))
        levels = (
            "levels: 0 inadmissible, 1 admissible, 2 stable to infinitesimal perturbations, "
            "3 to finite ones at second order"
        )
        return [*out, levels, *([f"table      {options.output}"] if options.output else [])]

    show(options, lambda: table_document(table), lines)
    reasons = Counter(str(e) for e in table["error"] if e)
    check_computed(len(table), reasons.total(), dict(reasons.most_common()))


def _asteroid(options: argparse.Namespace) -> None:
    """Print one asteroid."""
    import astropy.units as u

    from flybystab.body.equilibrium import spin_limits
    from flybystab.body.stability import stability
    from flybystab.flybys.document import plain
    from flybystab.io.surface_text import slopes_document, slopes_text
    from flybystab.io.text import equilibrium_lines

    asteroid = asteroid_of(options)
    surface = rest_slopes(options, asteroid.body)
    s = stability(asteroid.body)
    e = s.equilibrium
    limits = spin_limits(asteroid.body).to_value(u.rad / u.s)
    show(
        options,
        lambda: plain(
            {
                "schema": "stability/1",
                "flybystab": __version__,
                "asteroid": asteroid.label,
                "admissible": e.admissible,
                "stable_infinitesimal": s.stable_infinitesimal,
                "critical_strain": {k: getattr(s.critical_strain, k) for k in ("second", "third", "barrier")},
                "critical_energy_J": {
                    k: getattr(s.critical_energy, k).to_value(u.J) for k in ("second", "third", "barrier")
                },
                "friction_angle_deg": asteroid.body.material.friction_angle.to_value(u.deg),
                "required_friction_angle_deg": e.required_friction_angle.to_value(u.deg),
                "margin_deg": e.margin.to_value(u.deg),
                "required_cohesion_Pa": e.required_cohesion.to_value(u.Pa),
                "mean_pressure_Pa": e.mean_pressure.to_value(u.Pa),
                "lode_angle_deg": e.lode_angle.to_value(u.deg),
                "stress_Pa": e.stress.to_value(u.Pa),
                "spin_limits_rad_s": list(limits),
                "spin_mode": s.spin_state.mode,
                "spin_growth_rate_per_s": s.spin_state.growth_rate.value,
                "assumed": asteroid.assumptions,
                **({} if surface is None else {"surface": slopes_document(surface)}),
            }
        ),
        lambda: [
            *equilibrium_lines(asteroid.label, e),
            f"rotation                  {s.spin_state.description}",
            f"small perturbations       {'stable' if s.stable_infinitesimal else 'not stable'}",
            f"critical strain           {s.critical_strain.second:.3g} (second order), "
            f"{s.critical_strain.third:.3g} (third), {s.critical_strain.barrier:.3g} (barrier)",
            f"energy barrier            {s.critical_energy.barrier.to_value(u.J):.3g} J"
            + (f" ({other})" if (other := s.other_surfaces()) else ""),
            f"admissible spin periods   {_period_range(limits)}",
            *([] if surface is None else [f"slopes at rest            {slopes_text(surface)}"]),
            *(
                [f"assumed                   {'; '.join(asteroid.assumptions)}"]
                if asteroid.assumptions
                else []
            ),
        ],
    )


def _period_range(limits: Array) -> str:
    """Range of spin periods between the spin limits (rad/s), about the short axis."""
    import numpy as np

    if not np.all(np.isfinite(limits)):
        return "none: no spin about the short axis is admissible"
    slowest, fastest = sorted(float(w) for w in limits)
    shortest = f"{2.0 * np.pi / fastest / 3600.0:.3f} h" if fastest > 0.0 else "infinite"
    if slowest == 0.0:
        return f"{shortest} and longer, including no spin, about the short axis"
    return f"{shortest} to {2.0 * np.pi / slowest / 3600.0:.3f} h about the short axis"
