"""``flybystab stability NAME``: equilibrium and stability of an asteroid on its own."""

from __future__ import annotations

import argparse

from flybystab import __version__
from flybystab.face.commands.common import asteroid_of, material_arguments, show

HELP = "equilibrium and stability of an asteroid on its own"
EXAMPLE = "flybystab stability Anteros --friction 30"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("name", help="number, name or designation")
    material_arguments(sub)


def run(options: argparse.Namespace) -> None:
    """Answer the command."""
    import astropy.units as u

    from flybystab.aggregate.equilibrium import spin_limits
    from flybystab.aggregate.stability import stability
    from flybystab.face.document import plain
    from flybystab.face.text import equilibrium_lines

    asteroid = asteroid_of(options)
    s = stability(asteroid.body)
    e = s.equilibrium
    limits = spin_limits(asteroid.body).to_value(u.rad / u.s)
    periods = [2.0 * 3.141592653589793 / w / 3600.0 if w > 0 else float("inf") for w in limits]
    show(
        options,
        lambda: plain(
            {
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
                "assumed": asteroid.assumptions,
            }
        ),
        lambda: [
            *equilibrium_lines(asteroid.label, e),
            f"small perturbations       {'stable' if s.stable_infinitesimal else 'not stable'}",
            f"critical strain           {s.critical_strain.second:.3g} (second order), "
            f"{s.critical_strain.third:.3g} (third), {s.critical_strain.barrier:.3g} (barrier)",
            f"holds for spin periods    {min(periods):.3f} to {max(periods):.3f} h about the short axis",
            *(
                [f"assumed                   {'; '.join(asteroid.assumptions)}"]
                if asteroid.assumptions
                else []
            ),
        ],
    )
