"""What all commands share: machines and controllers by name, diagnostics, progress, figures as text or JSON."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.base.job_place import NAME
from postproc.base.json_values import plain, rounded
from postproc.cli.shared.causes import FOLLOWS, lines_of
from postproc.cli.shared.says import SAYS, as_errors, readable

if TYPE_CHECKING:
    from machines.machine import Machine
    from postproc.base.options import Options
    from postproc.base.progress import Progress
    from postproc.controllers.model import ControllerFile
    from toolpaths.diagnostics import Diagnostic
    from toolpaths.toolpath import Toolpath

Json = Annotated[str, typer.Option("--json", metavar="FILE", help="write the figures as JSON; - for standard output")]

SCHEMA_VERSION = 1
"""of the JSON objects of all commands; it rises where a key changes its meaning or goes"""
LONGEST_NAME = 255
"""characters that the name of a file may have"""


def machine_of(name: str) -> Machine:
    """The machine of a name or a file."""
    import machines

    return machines.load(name)


def controller_of(name: str) -> str:
    """The same name, where its file is a controller."""
    controller_file(name)
    return name


def controller_file(name: str) -> ControllerFile:
    """The controller of a name or a file.

    Raises:
        DiagnosticError: where the file has errors; carries all of them.
    """
    from postproc.controllers.model import load_controller
    from toolpaths.diagnostics import DiagnosticError

    spec, found = load_controller(name)
    if spec is None:
        raise DiagnosticError(found)
    return spec


def no_program(file: Path, dialect: str = "") -> None:
    """An error where a program of a control stands in the place of a CL file; standard input is not looked at, nor a file
    whose dialect is given, nor one that is G-code and CL file in one (FreeCAD).

    Raises:
        DiagnosticError: says what it is.
    """
    from toolpaths.cl.systems.recognise import recognised
    from toolpaths.cl.text.kinds_of_file import looks_like_gcode
    from toolpaths.diagnostics import DiagnosticError, error
    from toolpaths.input_files import first_bytes

    head = b"" if dialect else first_bytes(file, 20_000)
    if looks_like_gcode(head) and not recognised(head):
        raise DiagnosticError([error("file.program", "this is G-code, a program of a control, not a CL file", file=str(file),
                                     hint="name the CL file that it was made from; postproc verify GCODE FILE compares the "
                                     "two, postproc time GCODE estimates its time; --dialect freecad reads FreeCAD's own")])


def no_cl_file(file: Path) -> None:
    """An error where a CL file stands in the place of a program; standard input is not looked at.

    Raises:
        DiagnosticError: says what it is.
    """
    from toolpaths.cl.text.kinds_of_file import looks_like_apt
    from toolpaths.cl.text.other_formats import shape_file
    from toolpaths.diagnostics import DiagnosticError, error
    from toolpaths.input_files import first_bytes

    head = first_bytes(file, 20_000)
    shapes = shape_file(head)
    if shapes:
        raise DiagnosticError([error("file.program", f"this is {shapes}, not a program of a control", file=str(file),
                                     hint="name the program first, then the CL file: postproc verify GCODE FILE")])
    if looks_like_apt(head):
        raise DiagnosticError([error("file.program", "this is a CL file, not a program of a control", file=str(file),
                                     hint="name the program first, then the CL file: postproc verify GCODE FILE")])


def read_cl(file: Path, options: Options, progress: Progress | None = None,
            tolerance: float | None = None) -> tuple[Toolpath, list[Diagnostic]]:
    """The CL file of a command; `tolerance` mm of its splines, that of `toolpaths.read` where it is None.

    Raises:
        DiagnosticError: where it is a program of a control.
    """
    import toolpaths
    from postproc.base.memory import LARGE, reuse
    from toolpaths.input_files import first_bytes

    no_program(file, options.dialect)
    reuse(len(first_bytes(file, LARGE)))
    given = {} if tolerance is None else {"tolerance": tolerance}

    def shown(at: int, total: int) -> None:
        if progress is not None:
            progress("reading", at, total)

    return toolpaths.read(file, units=options.units or None, dialect=options.dialect or None,
                          allow_unknown=options.allow_unknown, progress=shown, **given)


@contextmanager
def shown_errors(json: str) -> Iterator[None]:
    """Diagnostics that a library call raises, as output and exit code 1."""
    from toolpaths.diagnostics import DiagnosticError

    try:
        yield
    except DiagnosticError as fault:
        report(fault.diagnostics, json, {"diagnostics": [d.as_dict() for d in fault.diagnostics]}, "")


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """A bar on standard error for long work; silent where that is no terminal."""
    if SAYS.verbose:
        said: list[str] = []
        yield lambda stage, at, total: _say(stage, said)
        return
    if SAYS.quiet or not sys.stderr.isatty():
        yield lambda stage, at, total: None
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    bar = Bar(console=Console(stderr=True), transient=True)
    task = bar.add_task("")

    def shown(stage: str, at: int, total: int) -> None:
        bar.start()  # not before: a bar that stands already wipes out what is asked on its line
        bar.update(task, description=stage, completed=at, total=total)

    SAYS.still = bar.stop
    try:
        yield shown
    finally:
        bar.stop()
        SAYS.still = lambda: None


def _say(stage: str, said: list[str]) -> None:
    """Each stage once, as it begins."""
    if stage and said[-1:] != [stage]:
        said.append(stage)
        typer.echo(readable(stage), err=True)


def print_json(values: object) -> None:
    """JSON on standard output."""
    import json

    typer.echo(json.dumps(values, indent=2, allow_nan=False, default=plain))


def report(diagnostics: tuple[Diagnostic, ...], target: str, values: dict[str, Any], text: str,
           outputs: Mapping[Path, str | bytes] | None = None) -> None:
    """Messages to standard error, the figures where they were asked for; exit code 1 where there are errors.

    `outputs` (path -> content, the one that needs the others last) and the file of the figures are written
    together: all, or where one fails none.
    """
    from toolpaths.diagnostics import Severity, has_errors

    passed = not has_errors(diagnostics)
    if SAYS.strict:
        diagnostics = as_errors(diagnostics)
    if SAYS.job_units:
        diagnostics = _of_another_unit(diagnostics, SAYS.job_units)
    ok = not has_errors(diagnostics)
    if "diagnostics" not in values:
        values = values | {"diagnostics": [d.as_dict() for d in diagnostics]}
    if passed and not ok:  # by --strict or the job file's units alone
        unwritten = {"output": None} if "output" in values else {}
        values = values | unwritten | {"diagnostics": [d.as_dict() for d in diagnostics]}
        text, outputs = "", {}
    more, failed = _written(target, _headed(values, ok) if target else {}, dict(outputs or {}))
    lines = lines_of((*diagnostics, *more), Severity.WARNING if SAYS.quiet else Severity.INFO)
    for line in ([SAYS.job_line] if SAYS.job_line and lines else []) + lines:
        typer.echo(readable(line), err=True)
    if not ok and not SAYS.quiet and sys.stderr.isatty():
        typer.echo(address_of(diagnostics), err=True)
    if failed and outputs:
        values, text = {"diagnostics": [d.as_dict() for d in (*diagnostics, *more)]}, ""
    if target == "-":
        print_json(rounded(_headed(values, ok and not failed)))
    elif text and not SAYS.quiet:
        typer.echo(readable(text))
    if failed or not ok:
        raise typer.Exit(1)


def address_of(diagnostics: tuple[Diagnostic, ...]) -> str:
    """Where the page of the error that is to be put right first stands."""
    from toolpaths.diagnostics import Severity

    codes = {d.code for d in diagnostics if d.severity is Severity.ERROR}
    wrong = [d.code for d in diagnostics if d.severity is Severity.ERROR]
    first = next((code for code in wrong if codes.isdisjoint(FOLLOWS.get(code, ()))), wrong[0])
    return f"explained with an example: postproc explain {first}"


def _of_another_unit(diagnostics: tuple[Diagnostic, ...], job: str) -> tuple[Diagnostic, ...]:
    """The diagnostics with an error where the units of the job file, for files that state none, go against the file's."""
    from dataclasses import replace

    from toolpaths.diagnostics import Severity

    hint = f"units of {job} are for files that state none: take them out there, or give --units on the command line"
    return tuple(replace(d, severity=Severity.ERROR, hint=hint)
                 if d.code == "cl.units" and d.severity is Severity.WARNING else d for d in diagnostics)


def _headed(values: dict[str, Any], ok: bool) -> dict[str, Any]:
    """The keys that every JSON object of a command begins with (DESIGN, section 5)."""
    return {"schema_version": SCHEMA_VERSION, "ok": ok} | values


def _written(target: str, values: dict[str, Any],
             outputs: dict[Path, str | bytes]) -> tuple[list[Diagnostic], bool]:
    """Write the figures, where they go to a file, and the outputs; diagnostics, and True where that failed."""
    import json

    if target and target != "-":
        figures = json.dumps(rounded(values), indent=2, allow_nan=False, default=plain) + "\n"
        outputs = {Path(target): figures, **outputs}
    if not outputs:
        return [], False
    from toolpaths.diagnostics import DiagnosticError
    from toolpaths.transaction import write_together

    try:
        return write_together(outputs), False
    except DiagnosticError as fault:
        return list(fault.diagnostics), True


def refuse_overwriting(outputs: dict[str, str], inputs: dict[str, str]) -> None:
    """Wrong use where an output would replace an input, a file that a TOML input names, or another output, or
    is no regular file."""
    from toolpaths.input_files import place

    known = _places(inputs)
    for option, name in outputs.items():
        if not name or (name == "-" and option == "--json"):
            continue
        if name == "-":
            raise typer.BadParameter("a program is written whole or not at all, so not to standard output; name a file",
                                     param_hint=option)
        target = place(name)
        if target.name == NAME:
            raise typer.BadParameter(f"{NAME} is the name of job files, which all commands below their folder read; take "
                                     "another name", param_hint=option)
        try:
            same = next((what for other, what in known if other == target or (
                other.exists() and target.exists() and other.samefile(target))), "")
            kind = "" if not target.exists() or target.is_file() else "a folder; name a file" if target.is_dir() else \
                "no regular file"
        except OSError:  # no name a file can have: writing says so
            continue
        if same or kind:
            raise typer.BadParameter(f"the output would replace {same}" if same else f"{name} is {kind}", param_hint=option)
        known.append((target, f"the file of {option}"))


def own_files(machine: str, controller: str = "") -> dict[str, str]:
    """Files of machine and controller among the inputs of a command; names of built-in ones are no files."""
    given = {"the machine file": machine, "the controller file": controller}
    return {what: name for what, name in given.items() if name.lower().endswith(".toml")}


def refuse_inputs(outputs: list[Path], inputs: dict[str, str]) -> None:
    """An error where a file that comes with an output would replace an input.

    Raises:
        DiagnosticError: names both.
    """
    from toolpaths.diagnostics import DiagnosticError, error
    from toolpaths.input_files import place

    known = _places(inputs)
    for output in outputs:
        target = place(output)
        what = next((what for other, what in known if other == target or _same(other, target)), "")
        if what:
            raise DiagnosticError([error("file.input", f"the output would replace {what}", file=str(output),
                                         hint="write into another folder, or under another name")])


def _places(inputs: dict[str, str]) -> list[tuple[Path, str]]:
    """Where inputs, and files that they name, stand."""
    from toolpaths.input_files import place

    return [(at, what) for what, name in inputs.items() if name for at in (place(name), *_named_in(name))]


def _same(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:
        return False


def _named_in(name: str) -> list[Path]:
    """Files that there are under the texts of a TOML file (tables, meshes); none of a file that cannot be read."""
    if not name.lower().endswith(".toml"):
        return []
    import tomllib

    from toolpaths.input_files import is_regular, place, read_input

    try:
        todo: list[Any] = [tomllib.loads(read_input(name).decode("utf-8-sig"))]
    except (OSError, ValueError, RecursionError):
        return []
    found = []
    while todo:
        value = todo.pop()
        if isinstance(value, (dict, list)):
            todo += value.values() if isinstance(value, dict) else value
        elif isinstance(value, str) and "." in value and len(value) < LONGEST_NAME:
            found.append(place(Path(name).parent / value))
    return [at for at in found if is_regular(at)]
