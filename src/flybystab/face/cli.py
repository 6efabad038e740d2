"""The command line: ``flybystab COMMAND --help`` says what each one does, with examples.

Exit status: 0 done, 1 cannot be computed (why, on stderr), 2 wrong usage. With ``--json`` one document goes to
stdout and nothing else. Heavy modules are imported by the command that needs them.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import Any

from flybystab import __version__
from flybystab.errors import FlybystabError, InvalidInput

#: Span searched for the closest encounter when no date is given: inside every supported ephemeris.
SPAN = ("2000-01-01", "2050-01-01")

#: Other yield surfaces that a verdict is checked on.
OTHER_SURFACES = ("drucker-prager-extension", "mohr-coulomb", "matsuoka-nakai")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    parser = _parser()
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments and not arguments[0].startswith("-") and arguments[0] not in COMMANDS:
        near = get_close_matches(arguments[0], COMMANDS, cutoff=0.5)
        hint = f"; did you mean {near[0]}?" if near else ""
        print(
            f"flybystab: no command {arguments[0]!r}{hint} (commands: {', '.join(COMMANDS)})", file=sys.stderr
        )
        return 2
    try:
        options = parser.parse_args(arguments)
    except SystemExit as stop:  # argparse has printed help or the reason
        return int(stop.code or 0)
    options.words = arguments
    if options.command is None:
        parser.print_help()
        return 2
    # Dates beyond the table of leap seconds are read as TDB; UTC would be "dubious" there.
    warnings.filterwarnings("ignore", message=".*dubious year.*")
    try:
        COMMANDS[options.command](options)
        sys.stdout.flush()
    except FlybystabError as reason:
        print(f"flybystab: {reason}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as reason:
        print(f"flybystab: {reason}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("flybystab: stopped", file=sys.stderr)
        return 1
    return 0


def _attitude_words(asteroid: Any) -> str:
    """At which attitude the first result is: the sample is there because it cannot be known."""
    if asteroid.pole is None:
        return "one of many: the pole is not known; spin axis along the orbital angular momentum"
    return "one of many: the catalogued pole, an arbitrary turn about it"


def _coloured(line: str) -> str:
    """The verdict in bold, on a terminal that wants colours."""
    if not line.startswith("verdict") or os.environ.get("NO_COLOR") or not sys.stdout.isatty():
        return line
    return f"\033[1m{line}\033[0m"


def _print(options: argparse.Namespace, document: Callable[[], Any], lines: Callable[[], list[str]]) -> None:
    if options.json:
        print(json.dumps(document(), indent=1, allow_nan=False))
    else:
        print("\n".join(_coloured(line) for line in lines()))


def _time(text: str, name: str) -> Any:
    from astropy.time import Time

    try:
        return Time(text, scale="tdb")
    except ValueError:
        raise InvalidInput(name, text, "a date such as 2029-04-13, read as TDB") from None


def _asteroid(options: argparse.Namespace) -> Any:
    import astropy.units as u

    from flybystab.aggregate.body import Material
    from flybystab.survey.asteroid import Asteroid

    material = Material(
        friction_angle=options.friction * u.deg,
        cohesion=options.cohesion * u.Pa,
        yield_surface=options.surface,
    )
    return Asteroid.from_catalogue(options.name, material=material)


def _picture(path: str | None, endings: tuple[str, ...] = (".png", ".pdf", ".svg")) -> None:
    """Find out that a picture (or page) cannot be written before computing it."""
    if path is None:
        return
    from pathlib import Path

    target = Path(path)
    if target.suffix.lower() not in endings:
        raise InvalidInput("--output", path, f"a file that ends in {' or '.join(endings)}")
    if not target.parent.is_dir() or not os.access(target.parent, os.W_OK):
        raise InvalidInput("--output", path, "a folder that exists and can be written")


def _flown(options: argparse.Namespace) -> tuple[Any, Any, Any]:
    """Asteroid, result and sample of attitudes of its encounter at the date, or of its closest one."""
    from flybystab.errors import NoEncounter
    from flybystab.flybys import flyby, periapsis_axes
    from flybystab.sky.encounter import Encounter
    from flybystab.sky.finder import find_encounters
    from flybystab.spin import spin_sample

    asteroid = _asteroid(options)
    if options.date is None:
        table = find_encounters(
            asteroid, _time(SPAN[0], "start"), _time(SPAN[1], "stop"), planets=[options.planet]
        )
        if len(table) == 0:
            raise NoEncounter(
                f"{asteroid.label} has no encounter with {options.planet} within 0.05 au from {SPAN[0]} to "
                f"{SPAN[1]}; give a date with --date"
            )
        date = table["time"][int(table["distance"].argmin())]
    else:
        date = _time(options.date, "--date")
    encounter = Encounter.from_orbit(asteroid.orbit, options.planet, date)
    attitude = None
    if asteroid.pole is not None:
        import astropy.units as u

        attitude = periapsis_axes(encounter) @ asteroid.attitude(0 * u.deg)
    result = flyby(asteroid.body, encounter, attitude, surfaces=OTHER_SURFACES)
    sample = spin_sample(asteroid, encounter, n=options.attitudes, seed=options.seed)
    return asteroid, result, sample


def flyby_command(options: argparse.Namespace) -> None:
    """``flybystab flyby NAME``."""
    from flybystab.face import document, text

    _picture(options.output)
    asteroid, result, sample = _flown(options)
    encounter = result.encounter
    if options.output:
        from flybystab.face.plotting import flyby_figure

        flyby_figure(result, f"{asteroid.label}, {encounter.time.tdb.iso[:10]}", options.output)
    _print(
        options,
        lambda: document.flyby_document(
            result,
            sample,
            asteroid=asteroid.label,
            orbit_solution=asteroid.record.get("orbit_solution"),
            assumed=asteroid.assumptions,
            attitude=_attitude_words(asteroid),
            distance_error_numerical_km=None
            if encounter.distance_error is None
            else encounter.distance_error.to_value("km"),
            figure=options.output,
        ),
        lambda: [
            f"asteroid   {asteroid.label}",
            *text.encounter_lines(encounter),
            f"attitude   {_attitude_words(asteroid)}",
            *text.flyby_lines(result),
            *text.sample_lines(sample),
            *text.model_lines(result, asteroid.assumptions),
            *([f"figure     {options.output}"] if options.output else []),
        ],
    )


def report_command(options: argparse.Namespace) -> None:
    """``flybystab report NAME``."""
    import shlex

    import astropy.units as u

    from flybystab.face import document
    from flybystab.face.report import report
    from flybystab.survey.screening import screen

    _picture(options.output, (".html",))
    asteroid, result, sample = _flown(options)
    e = result.encounter
    screened = None
    if options.samples > 1:
        day = 1.0 * u.d
        table = screen(
            [asteroid],
            e.time - day,
            e.time + day,
            planets=[options.planet],
            within=1.01 * e.distance,
            samples=options.samples,
            seed=options.seed,
            material=asteroid.material,
        )
        screened = table[0] if len(table) == 1 and not table["error"][0] else None
    command = "flybystab " + shlex.join(options.words)
    path = report(asteroid, result, sample, options.output, screened=screened, command=command)
    _print(
        options,
        lambda: document.flyby_document(result, sample, asteroid=asteroid.label, report=str(path)),
        lambda: [f"{asteroid.label}: {result.verdict}", f"report     {path}"],
    )


def scenario_command(options: argparse.Namespace) -> None:
    """``flybystab scenario FILE.toml``."""
    from flybystab.face import document, text
    from flybystab.face.scenario import scenario
    from flybystab.flybys import flyby

    _picture(options.output)
    script = scenario(options.file)
    figure = options.output or script.figure
    _picture(figure)
    others = [s for s in (*OTHER_SURFACES, "drucker-prager") if s != script.body.material.yield_surface]
    result = flyby(script.body, script.encounter, script.attitude, surfaces=others)
    if figure:
        from flybystab.face.plotting import flyby_figure

        flyby_figure(result, script.title, figure)
    _print(
        options,
        lambda: document.flyby_document(result, title=script.title, figure=figure),
        lambda: [
            f"scenario   {script.title}",
            *text.encounter_lines(script.encounter),
            *text.flyby_lines(result),
            *text.model_lines(result),
            *([f"figure     {figure}"] if figure else []),
        ],
    )


def encounters_command(options: argparse.Namespace) -> None:
    """``flybystab encounters NAME``."""
    import astropy.units as u

    from flybystab.face.document import table_document
    from flybystab.sky.finder import find_encounters
    from flybystab.survey.asteroid import Asteroid

    asteroid = Asteroid.from_catalogue(options.name)
    table = find_encounters(
        asteroid,
        _time(options.start, "--from"),
        _time(options.stop, "--to"),
        planets=options.planet or ["earth"],
        within=options.within * u.au,
    )
    if options.output:
        from flybystab.survey.results import check_output

        check_output(options.output)
        table.write(options.output, format="ascii.ecsv", overwrite=True)

    def lines() -> list[str]:
        head = f"{'planet':8s} {'time (TDB)':19s} {'distance (km)':>16s} {'(au)':>9s} {'v_inf (km/s)':>12s}"
        rows = [
            f"{row['planet']:8s} {row['time'].tdb.iso[:19]} {row['distance'].to_value(u.km):16,.1f} "
            f"{row['distance'].to_value(u.au):9.6f} {row['v_inf'].to_value(u.km / u.s):12.4f}"
            + (" impact" if row["impact"] else "")
            for row in table
        ]
        return [f"{asteroid.label}: {len(rows)} encounters within {options.within:g} au", head, *rows]

    _print(options, lambda: table_document(table), lines)


def stability_command(options: argparse.Namespace) -> None:
    """``flybystab stability NAME``."""
    import astropy.units as u

    from flybystab.aggregate.equilibrium import spin_limits
    from flybystab.aggregate.stability import stability
    from flybystab.face.document import plain
    from flybystab.face.text import equilibrium_lines

    asteroid = _asteroid(options)
    s = stability(asteroid.body)
    e = s.equilibrium
    limits = spin_limits(asteroid.body).to_value(u.rad / u.s)
    periods = [2.0 * 3.141592653589793 / w / 3600.0 if w > 0 else float("inf") for w in limits]
    _print(
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


def screen_command(options: argparse.Namespace) -> None:
    """``flybystab screen [FILE]``."""
    import astropy.units as u

    from flybystab.face.document import table_document
    from flybystab.survey.executors import workers
    from flybystab.survey.progress import ProgressBar
    from flybystab.survey.results import check_output, read_results
    from flybystab.survey.screening import Screening, listed, settings
    from flybystab.survey.summary import summary

    output = check_output(options.output)
    screening = Screening(
        listed(options.file),
        settings(
            _time(options.start, "--from"),
            _time(options.stop, "--to"),
            planets=options.planet or ["earth"],
            within=options.within * u.au,
            samples=options.samples,
            seed=options.seed,
        ),
    )
    with workers(options.jobs, options.dask) as executor:
        screening.run(output, executor=executor, progress=ProgressBar())
    _print(
        options,
        lambda: table_document(read_results(output)),
        lambda: [summary(output).text(), f"table      {output}"],
    )


def show_command(options: argparse.Namespace) -> None:
    """``flybystab show FILE``."""
    from flybystab.face.document import table_document
    from flybystab.survey.results import read_results
    from flybystab.survey.summary import results_figure, summary

    _picture(options.output)
    table = read_results(options.file)
    if options.output:
        results_figure(table, options.output)
    _print(options, lambda: table_document(table), lambda: [summary(table).text()])


def infer_command(options: argparse.Namespace) -> None:
    """``flybystab infer NAME``."""
    import astropy.units as u

    from flybystab.face.document import table_document
    from flybystab.survey.asteroid import Asteroid
    from flybystab.survey.inference import infer, inference_figure, survived

    _picture(options.output)
    asteroid = Asteroid.from_catalogue(options.name)
    passages = survived(asteroid, _time(options.start, "--from"), _time(options.stop, "--to"))
    table = infer(asteroid, passages, yield_surface=options.surface)
    if options.output:
        inference_figure(table, options.output)

    def lines() -> list[str]:
        head = f"{asteroid.label}: least friction angle (deg), {len(passages)} passages survived"
        columns = [c for c in table.colnames if c.startswith("friction_")]
        rows = [f"{'density':>8s} {'cohesion':>9s} " + " ".join(f"{c[9:]:>15s}" for c in columns)]
        for row in table:
            values = " ".join(f"{row[c].to_value(u.deg):15.2f}" for c in columns)
            rows.append(f"{row['density'].value:8.0f} {row['cohesion'].value:9.1f} {values}")
        return [head, *rows]

    _print(options, lambda: table_document(table), lines)


def bench_command(options: argparse.Namespace) -> None:
    """``flybystab bench flyby``."""
    from flybystab.face.bench import flyby_bench, lines

    rows = flyby_bench(options.output)
    _print(options, lambda: {"flybystab": __version__, "rows": rows}, lambda: lines(rows))


def cite_command(options: argparse.Namespace) -> None:
    """``flybystab cite``."""
    from flybystab.face.cite import BIBTEX, cite

    _print(options, lambda: {"flybystab": __version__, "bibtex": list(BIBTEX.values())}, lambda: [cite()])


def completion_command(options: argparse.Namespace) -> None:
    """``flybystab completion SHELL``."""
    from flybystab.face.completion import script

    _print(
        options,
        lambda: {
            "flybystab": __version__,
            "shell": options.shell,
            "script": script(options.shell, _parser()),
        },
        lambda: [script(options.shell, _parser())],
    )


COMMANDS: dict[str, Callable[[argparse.Namespace], None]] = {
    "flyby": flyby_command,
    "report": report_command,
    "scenario": scenario_command,
    "encounters": encounters_command,
    "stability": stability_command,
    "screen": screen_command,
    "show": show_command,
    "infer": infer_command,
    "bench": bench_command,
    "cite": cite_command,
    "completion": completion_command,
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="flybystab",
        description="Do rubble-pile asteroids survive their close planetary encounters?",
        epilog="examples:\n  flybystab flyby Apophis --output apophis.png\n  flybystab scenario p2.toml --json\n"
        "  flybystab screen --from 2026-01-01 --to 2036-01-01",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"flybystab {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")

    def add(name: str, text: str, example: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(
            name,
            help=text,
            description=text,
            epilog=f"example:\n  {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        sub.add_argument(
            "--json", action="store_true", help="print one JSON document, with units in its keys"
        )
        return sub

    def material(sub: argparse.ArgumentParser) -> None:
        sub.add_argument(
            "--friction", type=float, default=35.0, metavar="DEG", help="friction angle (35 deg)"
        )
        sub.add_argument("--cohesion", type=float, default=0.0, metavar="PA", help="cohesion (0 Pa)")
        sub.add_argument("--surface", default="drucker-prager", help="yield surface (drucker-prager)")

    def span(sub: argparse.ArgumentParser, start: str, stop: str) -> None:
        sub.add_argument("--from", dest="start", default=start, metavar="DATE", help=f"TDB ({start})")
        sub.add_argument("--to", dest="stop", default=stop, metavar="DATE", help=f"TDB ({stop})")
        sub.add_argument("--planet", action="append", help="planet to look for; repeat for more (earth)")
        sub.add_argument(
            "--within", type=float, default=0.05, metavar="AU", help="largest distance (0.05 au)"
        )

    def passage(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("name", help="number, name or designation in the embedded catalogue")
        sub.add_argument(
            "--date", help=f"near the encounter, TDB; the closest one of {SPAN[0]} to {SPAN[1]} if left out"
        )
        sub.add_argument("--planet", default="earth", help="planet encountered (earth)")
        material(sub)
        sub.add_argument("--attitudes", type=int, default=64, metavar="N", help="attitudes to sample (64)")
        sub.add_argument("--seed", type=int, default=0, help="seed of the samples (0)")

    sub = add("flyby", "one asteroid through one encounter", "flybystab flyby Apophis --output apophis.png")
    passage(sub)
    sub.add_argument("--output", metavar="FILE", help="write a figure (.png, .pdf, .svg)")

    sub = add(
        "report",
        "the same as one web page, figures and all",
        "flybystab report Apophis --output apophis.html",
    )
    passage(sub)
    sub.add_argument(
        "--samples", type=int, default=200, metavar="N", help="draws of the uncertain inputs (200; 1: none)"
    )
    sub.add_argument("--output", default="report.html", metavar="FILE", help="the page (report.html)")

    sub = add(
        "scenario", "a scripted encounter from a TOML file", "flybystab scenario examples/disruption_p2.toml"
    )
    sub.add_argument("file", help="scenario file")
    sub.add_argument("--output", metavar="FILE", help="write a figure (.png, .pdf, .svg)")

    sub = add("encounters", "close approaches of an asteroid", "flybystab encounters Apophis --to 2030-01-01")
    sub.add_argument("name", help="number, name or designation")
    span(sub, "2020-01-01", "2050-01-01")
    sub.add_argument("--output", metavar="FILE", help="write the table (.ecsv)")

    sub = add(
        "stability", "equilibrium of an asteroid on its own", "flybystab stability Anteros --friction 30"
    )
    sub.add_argument("name", help="number, name or designation")
    material(sub)

    sub = add(
        "screen",
        "a whole catalogue through its encounters",
        "flybystab screen --from 2026-01-01 --to 2036-01-01 --samples 100 --jobs 2",
    )
    sub.add_argument("file", nargs="?", help="catalogue file; the embedded catalogue if left out")
    span(sub, "2026-01-01", "2036-01-01")
    sub.add_argument(
        "--samples", type=int, default=1, metavar="N", help="draws of the uncertain inputs (1: none)"
    )
    sub.add_argument("--seed", type=int, default=0, help="fixes every draw (0)")
    sub.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (1)")
    sub.add_argument("--dask", metavar="ADDRESS", help="a dask scheduler instead of processes")
    sub.add_argument("--output", default="screening.ecsv", metavar="FILE", help="table, .ecsv or .parquet")

    sub = add(
        "show", "summary of a screening's table", "flybystab show screening.ecsv --output screening.png"
    )
    sub.add_argument("file", help="table written by screen")
    sub.add_argument("--output", metavar="FILE", help="write a figure (.png, .pdf, .svg)")

    sub = add("infer", "what an asteroid's survival says of its material", "flybystab infer Toutatis")
    sub.add_argument("name", help="number, name or designation")
    sub.add_argument("--from", dest="start", default="2000-01-01", metavar="DATE", help="TDB (2000-01-01)")
    sub.add_argument("--to", dest="stop", default="2026-01-01", metavar="DATE", help="TDB (2026-01-01)")
    sub.add_argument("--surface", default="drucker-prager", help="yield surface (drucker-prager)")
    sub.add_argument("--output", metavar="FILE", help="write a figure (.png, .pdf, .svg)")

    sub = add(
        "bench", "error against time of the flyby integrators", "flybystab bench flyby --output bench.png"
    )
    sub.add_argument("what", choices=["flyby"], help="which benchmark")
    sub.add_argument("--output", metavar="FILE", help="write the plot (.png, .pdf, .svg)")

    add("cite", "BibTeX of the methods and data", "flybystab cite > flybystab.bib")

    sub = add("completion", "completion with the tab key", 'eval "$(flybystab completion bash)"')
    sub.add_argument("shell", choices=["bash", "zsh"], help="for which shell")
    return parser
