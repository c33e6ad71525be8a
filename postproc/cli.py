"""The command line. Heavy packages are imported inside the commands, so that --help is instant."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from machines.machine import Machine
    from postproc.options import Options
    from toolpaths.diagnostics import Diagnostic
    from toolpaths.toolpath import Toolpath

app = typer.Typer(name="postproc", no_args_is_help=True, add_completion=False, rich_markup_mode=None,
                  context_settings={"help_option_names": ["-h", "--help"]},
                  help="CL file in, proved G-code out: a toolpath post-processor that plans the machine's motion.")
machine_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Machines: list, show, check, analyse, schema.")
controller_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Controllers: list, show, schema.")
setup_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Set-up files: check, schema.")
app.add_typer(machine_app, name="machine")
app.add_typer(setup_app, name="setup")
app.add_typer(controller_app, name="controller")

ClFile = Annotated[Path, typer.Argument(metavar="FILE", help="CL file (APT text)")]
MachineName = Annotated[str, typer.Option("-m", "--machine", help="machine: a name from the list, or a TOML file")]
ControllerName = Annotated[str, typer.Option("-c", "--controller", help="controller: a name from the list, or a TOML file")]
Setup = Annotated[str, typer.Option("--setup", metavar="S.toml", help="set-up file: placement, tools, safe distances")]
Tolerance = Annotated[float, typer.Option("--tolerance", metavar="MM", min=1e-6, max=10.0, help="tolerance of the tip")]
AxisTolerance = Annotated[float, typer.Option("--axis-tolerance", metavar="DEG", min=1e-6, max=10.0,
                                               help="tolerance of the axis")]
Units = Annotated[str, typer.Option("--units", help="units of a CL file that states none: mm or inch")]
Dialect = Annotated[str, typer.Option("--dialect", help="read the CL file as this dialect instead of the recognised one")]
Allow = Annotated[list[str] | None, typer.Option("--allow-unknown", metavar="WORD",
                                                 help="leave this word out although it looks like motion")]
Json = Annotated[str, typer.Option("--json", metavar="FILE", help="write the figures as JSON; - for standard output")]


def _version(wanted: bool) -> None:
    if wanted:
        from postproc import VERSION

        typer.echo(f"postproc {VERSION}")
        raise typer.Exit


@app.callback()
def options_of_all(version: Annotated[bool, typer.Option("--version", is_eager=True, callback=_version,
                                                         help="show the version")] = False) -> None:
    """Options before the command."""


@app.command(epilog="Example: postproc convert part.cls -m mikron-ucp710 -c linuxcnc -o part.ngc")
def convert(file: ClFile, machine: MachineName, controller: ControllerName,
            output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT", help="G-code file to write")],
            feed_mode: Annotated[str, typer.Option("--feed-mode", help="auto, per-minute or inverse-time")] = "auto",
            orient: Annotated[str, typer.Option("--orient", help="keep: the tool axes of the CL file")] = "keep",
            feed: Annotated[str, typer.Option("--feed", help="programmed: the feeds of the CL file")] = "programmed",
            setup: Setup = "", tolerance: Tolerance = 0.01, axis_tolerance: AxisTolerance = 0.05, units: Units = "",
            dialect: Dialect = "", allow_unknown: Allow = None, json: Json = "") -> None:
    """Convert a CL file to G-code, read it back and prove it; nothing is written where a proof fails."""
    _choice("--orient", orient, ("keep",))
    _choice("--feed", feed, ("programmed",))
    options = _options(tolerance, axis_tolerance, feed_mode, setup, units, dialect, allow_unknown)
    _targets({"-o": str(output), "--json": json}, {"the CL file": str(file), "the set-up": setup})
    from postproc import summary
    from postproc.files import write_atomically
    from postproc.pipeline import convert as run

    with _errors(json), _progress() as progress:
        m, spec = _machine(machine), _controller(controller)
        path, found = _read(file, options, progress)
        result = run(path, m, spec, options=options, diagnostics=found, progress=progress)
        if result.ok:
            write_atomically(output, result.text)
    _report(result.diagnostics, json, summary.as_dict(result, str(output)), summary.as_text(result, str(output)))


@app.command(epilog="Example: postproc verify part.ngc part.cls -m mikron-ucp710 -c linuxcnc")
def verify(gcode: Annotated[Path, typer.Argument(metavar="GCODE", help="G-code file")], file: ClFile,
           machine: MachineName, controller: ControllerName, setup: Setup = "", tolerance: Tolerance = 0.01,
           axis_tolerance: AxisTolerance = 0.05, units: Units = "", dialect: Dialect = "", allow_unknown: Allow = None,
           json: Json = "") -> None:
    """Read a G-code file back and compare its motion with a CL file."""
    options = _options(tolerance, axis_tolerance, "auto", setup, units, dialect, allow_unknown)
    _targets({"--json": json}, {"the CL file": str(file), "the G-code file": str(gcode), "the set-up": setup})
    from postproc import summary
    from postproc.pipeline import verify as run

    with _errors(json), _progress() as progress:
        m, spec = _machine(machine), _controller(controller)
        path, found = _read(file, options, progress)
        result = run(gcode, path, m, spec, options, found, progress)
    _report(result.diagnostics, json, summary.verify_dict(result), summary.verify_text(result))


@app.command(epilog="Example: postproc trace part.cls --line 120 -m mikron-ucp710 -c linuxcnc")
def trace(file: ClFile, line: Annotated[int, typer.Option("--line", metavar="L", min=1, help="line of the CL file")],
          machine: MachineName, controller: ControllerName, setup: Setup = "", tolerance: Tolerance = 0.01,
          axis_tolerance: AxisTolerance = 0.05, units: Units = "", dialect: Dialect = "", allow_unknown: Allow = None,
          json: Json = "") -> None:
    """Show one point of a CL file through every stage, from its record to its blocks and back."""
    options = _options(tolerance, axis_tolerance, "auto", setup, units, dialect, allow_unknown)
    _targets({"--json": json}, {"the CL file": str(file), "the set-up": setup})
    from postproc.pipeline import convert as run
    from postproc.trace import as_text, trace_line

    with _errors(json), _progress() as progress:
        m, spec = _machine(machine), _controller(controller)
        path, found = _read(file, options, progress)
        result = run(path, m, spec, options=options, diagnostics=found, progress=progress)
        stages, more = trace_line(result, line)
    _report((*result.diagnostics, *more), json, stages, as_text(stages))


@app.command(epilog="Example: postproc inspect part.cls --json -")
def inspect(file: ClFile, units: Units = "", dialect: Dialect = "", allow_unknown: Allow = None, json: Json = "") -> None:
    """Show what a CL file holds: operations, tools, points, extents, unknown words."""
    options = _options(0.01, 0.05, "auto", "", units, dialect, allow_unknown)
    _targets({"--json": json}, {"the CL file": str(file)})
    from toolpaths.cl.read import read_file
    from toolpaths.inspect import inspect as figures
    from toolpaths.inspect import summary as text_of

    with _progress() as progress:
        result = read_file(file, units=options.units or None, dialect=options.dialect or None,
                           allow_unknown=options.allow_unknown, progress=lambda at, total: progress("reading", at, total))
    found = figures(result)
    _report(tuple(result.diagnostics), json, found, text_of(result))


@machine_app.command("list")
def machine_list(json: Json = "") -> None:
    """List the built-in machines."""
    import machines

    found = [machines.load(name) for name in machines.names()]
    rows = [{"name": m.name, "structure": m.structure, "axes": list(m.axis_names), "description": m.description}
            for m in found]
    width = max(len(m.name) for m in found)
    _report((), json, {"machines": rows},
            "\n".join(f"{m.name:{width}}  {' '.join(m.axis_names):10}  {m.description}" for m in found))


@machine_app.command("show")
def machine_show(name: Annotated[str, typer.Argument(help="name or TOML file")], json: Json = "") -> None:
    """Show a machine: axes, travel, limits, which values are assumed."""
    from postproc.catalogue import machine_dict, machine_text

    with _errors(json):
        m = _machine(name)
    _report((), json, machine_dict(m), machine_text(m))


@machine_app.command("check", epilog="Example: postproc machine check my-machine.toml")
def machine_check(file: Annotated[str, typer.Argument(help="TOML file or name")], json: Json = "") -> None:
    """Check a machine file and say what is wrong with it."""
    import machines

    m, found = machines.load_checked(file)
    good = f"{file}: good: {m.name}, {m.structure}, axes {' '.join(m.axis_names)}" if m else ""
    _report(tuple(found), json, {"name": m.name if m else None, "diagnostics": [d.as_dict() for d in found]}, good)


@machine_app.command("analyse", epilog="Example: postproc machine analyse uranesx --json -")
def machine_analyse(name: Annotated[str, typer.Argument(help="name or TOML file")], json: Json = "") -> None:
    """Condition number, speed and force transmission, reachable box of a parallel machine, over its workspace."""
    from machines.analysis.report import analyse
    from postproc.catalogue import analysis_text

    with _errors(json):
        found = analyse(_machine(name))
    _report((), json, found, analysis_text(found))


@machine_app.command("schema")
def machine_schema() -> None:
    """Print the JSON schema of a machine file."""
    import machines

    _print_json(machines.schema())


@setup_app.command("check", epilog="Example: postproc setup check part.setup.toml")
def setup_check(file: Annotated[str, typer.Argument(help="TOML file")], json: Json = "") -> None:
    """Check a set-up file and say what is wrong with it."""
    from postproc.setup import load_setup, part_placement
    from toolpaths.diagnostics import has_errors

    _targets({"--json": json}, {"the set-up": file})
    spec, found = load_setup(file)
    found = list(found) + (part_placement(spec, file)[1] if spec else [])
    good = "" if spec is None or has_errors(found) else f"{file}: good: {len(spec.tools)} tools"
    _report(tuple(found), json, {"diagnostics": [d.as_dict() for d in found]}, good)


@setup_app.command("schema")
def setup_schema() -> None:
    """Print the JSON schema of a set-up file."""
    from machines.user_file import schema
    from postproc.setup import SetupFile

    _print_json(schema(SetupFile))


@controller_app.command("list")
def controller_list(json: Json = "") -> None:
    """List the built-in controllers."""
    from postproc.controllers.model import builtin_files

    found = {name: _controller_file(name) for name in builtin_files()}
    rows = [{"name": name, "description": spec.description} for name, spec in found.items()]
    _report((), json, {"controllers": rows}, "\n".join(f"{r['name']:12}  {r['description']}" for r in rows))


@controller_app.command("show")
def controller_show(name: Annotated[str, typer.Argument(help="name or TOML file")], json: Json = "") -> None:
    """Show every value of a controller file, and which file it comes from."""
    from postproc.catalogue import controller_values

    with _errors(json):
        values, origins = controller_values(_controller(name))
    text = "\n".join(f"{key} = {value!r}  ({origins[key]})" for key, value in values.items())
    _report((), json, {"values": values, "origins": origins}, text)


@controller_app.command("schema")
def controller_schema() -> None:
    """Print the JSON schema of a controller file."""
    from machines.user_file import schema
    from postproc.controllers.model import ControllerFile

    _print_json(schema(ControllerFile))


def main() -> None:
    """Entry point of the console script."""
    try:
        app()
    except (KeyboardInterrupt, SystemExit) as end:
        if isinstance(end, SystemExit) and end.code != 130:
            raise
        typer.echo("interrupted; nothing was written", err=True)
        raise SystemExit(130) from None


def _choice(option: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise typer.BadParameter(f"{value!r} is not available; choose from {', '.join(allowed)}", param_hint=option)


def _options(tolerance: float, axis_tolerance: float, feed_mode: str, setup: str, units: str, dialect: str,
             allow_unknown: list[str] | None) -> Options:
    from postproc.options import Options

    for option, value in (("--tolerance", tolerance), ("--axis-tolerance", axis_tolerance)):
        if not 1e-6 <= value <= 10.0:
            raise typer.BadParameter(f"{value} is not between 1e-6 and 10", param_hint=option)
    _choice("--feed-mode", feed_mode, ("auto", "per-minute", "inverse-time"))
    if units:
        _choice("--units", units, ("mm", "inch"))
    if dialect:
        from toolpaths.cl.dialects import DIALECTS

        _choice("--dialect", dialect, tuple(DIALECTS))
    return Options(tolerance, axis_tolerance, feed_mode, setup, units, dialect,  # type: ignore[arg-type]
                   tuple(w.upper() for w in allow_unknown or ()))


def _machine(name: str) -> Machine:
    import machines

    return machines.load(name)


def _controller(name: str) -> str:
    _controller_file(name)
    return name


def _controller_file(name: str) -> Any:
    from postproc.controllers.model import load_controller
    from toolpaths.diagnostics import DiagnosticError

    spec, found = load_controller(name)
    if spec is None:
        raise DiagnosticError(found)
    return spec


def _read(file: Path, options: Options, progress: Any) -> tuple[Toolpath, list[Diagnostic]]:
    import toolpaths

    return toolpaths.read(file, units=options.units or None, dialect=options.dialect or None,
                          allow_unknown=options.allow_unknown, progress=lambda at, total: progress("reading", at, total))


def _targets(outputs: dict[str, str], inputs: dict[str, str]) -> None:
    """Wrong use where an output would replace an input or another output, or is no regular file."""
    known = [(_place(name), what) for what, name in inputs.items() if name]
    for option, name in outputs.items():
        if not name or (name == "-" and option == "--json"):
            continue
        if name == "-":
            raise typer.BadParameter("a program is written whole or not at all, so not to standard output; name a file",
                                     param_hint=option)
        place = _place(name)
        try:
            same = next((what for other, what in known if other == place or (
                other.exists() and place.exists() and other.samefile(place))), "")
            kind = "" if not place.exists() or place.is_file() else "a folder; name a file" if place.is_dir() else \
                "no regular file"
        except OSError:  # no name a file can have: writing says so
            continue
        if same or kind:
            raise typer.BadParameter(f"the output would replace {same}" if same else f"{name} is {kind}", param_hint=option)
        known.append((place, f"the file of {option}"))


def _place(name: str) -> Path:
    """Where a name leads, through links; loops stay as they are."""
    try:
        return Path(name).resolve()
    except (OSError, RuntimeError):
        return Path(name)


@contextmanager
def _errors(json: str) -> Iterator[None]:
    """Diagnostics that a library call raises, as output and exit code 1."""
    from toolpaths.diagnostics import DiagnosticError

    try:
        yield
    except DiagnosticError as fault:
        _report(fault.diagnostics, json, {"diagnostics": [d.as_dict() for d in fault.diagnostics]}, "")


@contextmanager
def _progress() -> Iterator[Any]:
    """A bar on standard error for long work; silent where that is no terminal."""
    import sys

    if not sys.stderr.isatty():
        yield lambda stage, at, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("")
        yield lambda stage, at, total: bar.update(task, description=stage, completed=at, total=total)


def _print_json(values: object) -> None:
    import json

    typer.echo(json.dumps(values, indent=2, allow_nan=False, default=str))


def _report(diagnostics: tuple[Diagnostic, ...], target: str, values: dict[str, Any], text: str) -> None:
    """Messages to standard error, the figures where they were asked for; exit code 1 where there are errors."""
    from toolpaths.diagnostics import has_errors

    for d in diagnostics:
        typer.echo(str(d), err=True)
    failed = has_errors(diagnostics)
    if target == "-":
        _print_json(rounded(values))
    elif target:
        failed |= not _json_file(target, values)
    if target != "-" and text:
        typer.echo(text)
    if failed:
        raise typer.Exit(1)


def _json_file(target: str, values: dict[str, Any]) -> bool:
    """Write the figures; False, and why on standard error, where that fails."""
    import json

    from postproc.files import write_atomically
    from toolpaths.diagnostics import DiagnosticError

    try:
        write_atomically(Path(target), json.dumps(rounded(values), indent=2, allow_nan=False, default=str) + "\n")
    except DiagnosticError as fault:
        typer.echo(str(fault), err=True)
        return False
    return True


def rounded(value: Any) -> Any:
    """JSON values with numbers of at most 9 decimals, no -0."""
    if isinstance(value, float):
        return round(value, 9) + 0.0
    if isinstance(value, dict):
        return {key: rounded(v) for key, v in value.items()}
    return [rounded(v) for v in value] if isinstance(value, (list, tuple)) else value


if __name__ == "__main__":
    main()
