"""Commands on the files that describe machines, set-ups and controllers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from postproc.cli.machine_certify import CERTIFIED, machine_certify
from postproc.cli.machine_design import DESIGNED, machine_design
from postproc.cli.machine_files import EXPORTED, IMPORTED, machine_export, machine_import
from postproc.cli.machine_forces import FORCES, STARS, machine_forces, machine_star
from postproc.cli.machine_new import EXAMPLES as NEW
from postproc.cli.machine_new import machine_new
from postproc.cli.machine_report import REPORTED, machine_report
from postproc.cli.machine_study import ANALYSED, STIFF, TOLERATED, machine_analyse, machine_stiffness, machine_tolerance
from postproc.cli.setup_align import EXAMPLES as ALIGNED
from postproc.cli.setup_align import setup_align
from postproc.cli.setup_new import EXAMPLES, setup_new
from postproc.cli.shared.console import (
    Json,
    controller_file,
    controller_of,
    machine_of,
    print_json,
    refuse_overwriting,
    report,
    shown_errors,
)
from postproc.cli.shared.group import Group
from postproc.cli.shared.options import figure_ending
from toolpaths.table_text import table_text

if TYPE_CHECKING:
    from machines.machine import Machine
    from toolpaths.arrays import Floats
    from toolpaths.choices import FigureEnding

SCHEMAS = "Examples: postproc schema setup-file; postproc schema machine check"
machine_app = typer.Typer(cls=Group, no_args_is_help=True, rich_markup_mode=None,
                          help="Machines: new, list, show, check, analyse, certify, design and more.")
controller_app = typer.Typer(cls=Group, no_args_is_help=True, rich_markup_mode=None,
                             help="Controllers: list, show, schema.")
setup_app = typer.Typer(cls=Group, no_args_is_help=True, rich_markup_mode=None,
                        help="Set-up files: new, align, check, schema.")


machine_app.command("new", epilog=NEW)(machine_new)
machine_app.command("import", epilog=IMPORTED)(machine_import)
machine_app.command("export", epilog=EXPORTED)(machine_export)
machine_app.command("analyse", epilog=ANALYSED)(machine_analyse)
machine_app.command("report", epilog=REPORTED)(machine_report)
machine_app.command("forces", epilog=FORCES)(machine_forces)
machine_app.command("star", epilog=STARS)(machine_star)
machine_app.command("stiffness", epilog=STIFF)(machine_stiffness)
machine_app.command("design", epilog=DESIGNED)(machine_design)
machine_app.command("tolerance", epilog=TOLERATED)(machine_tolerance)
machine_app.command("certify", epilog=CERTIFIED)(machine_certify)
setup_app.command("new", epilog=EXAMPLES)(setup_new)
setup_app.command("align", epilog=ALIGNED)(setup_align)


ShownAt = Annotated[list[str] | None, typer.Option("--at", metavar="AXIS=POSITION", help="mm or degrees at which the figure "
                                                   "shows an axis, instead of home")]


@machine_app.command("list")
def machine_list(json: Json = "") -> None:
    """List the built-in machines: those that people own, then models of kinds and classes."""
    import machines

    real, models = ([machines.load(name) for name in names] for names in (machines.catalogued(), machines.names()))
    rows = [{"name": m.name, "structure": m.structure, "axes": list(m.axis_names), "description": m.description,
             "catalogue": m in real} for m in [*real, *models]]
    parts = (("machines, with sources of their figures (machine show NAME):", real), ("models:", models))
    text = [line for heading, found in parts
            for line in (heading, *table_text([(m.name, " ".join(m.axis_names), m.description) for m in found], indent=2))]
    report((), json, {"machines": rows}, "\n".join(text))


@machine_app.command("show")
def machine_show(name: Annotated[str, typer.Argument(help="name or TOML file")],
                 figure: Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="a machine on legs, "
                                                             ".png or .svg")] = None,
                 at: ShownAt = None,
                 json: Json = "") -> None:
    """Show a machine: axes, travel, limits, which values are assumed."""
    from postproc.dossier.words import machine_dict, machine_text

    ending = figure_ending(figure)
    if at and figure is None:
        raise typer.BadParameter("it is the pose of a figure: --figure FILE is missing", param_hint="--at")
    refuse_overwriting({"--figure": str(figure or ""), "--json": json}, {"the machine": name})
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        m = machine_of(name)
        if figure is not None and ending is not None:
            outputs[figure] = _figure(m, ending, at)
    report((), json, machine_dict(m), machine_text(m), outputs)


def _figure(machine: Machine, ending: FigureEnding, at: Sequence[str] | None) -> bytes:
    """Of a machine at home, axes of `at` elsewhere; wrong use where it has no legs or they do not meet."""
    from machines.analysis.machine_figure import machine_figure

    try:
        return machine_figure(machine, ending, _joints(machine, at))
    except ValueError as fault:
        raise typer.BadParameter(str(fault), param_hint="--at" if at else "--figure") from fault


def _joints(machine: Machine, at: Sequence[str] | None) -> Floats:
    """(J,) mm and rad: home, but for the axes of `at`; wrong use outside their travel."""
    from postproc.cli.error_files import pairs
    from toolpaths.units import DEG

    q = machine.home.copy()
    for letter, value in pairs("--at", at, machine.axis_names).items():
        j = machine.axis_names.index(letter)
        size, unit = (DEG, "degrees") if machine.rotary[j] else (1.0, "mm")
        q[j] = value * size
        low, high = machine.limits.lower[j] / size, machine.limits.upper[j] / size
        if not low - 1e-9 <= value <= high + 1e-9:
            raise typer.BadParameter(f"{letter}={value:g}: travel {low:g} to {high:g} {unit}", param_hint="--at")
    return q


@machine_app.command("check", epilog="Example: postproc machine check my-machine.toml")
def machine_check(file: Annotated[str, typer.Argument(help="TOML file or name")], json: Json = "") -> None:
    """Check a machine file and say what is wrong with it."""
    import machines
    from postproc.dossier.words import workspace_dict, workspace_words

    m, found = machines.load_checked(file)
    found = [*found, *machines.implausible(file)] if m is not None else found
    good = f"{file}: OK: {m.name}, {m.structure}, axes {' '.join(m.axis_names)}" if m else ""
    good += f"\n{words}" if m is not None and (words := workspace_words(m)) else ""
    report(tuple(found), json, {"name": m.name if m else None, "workspace": workspace_dict(m) if m else None,
                                "diagnostics": [d.as_dict() for d in found]}, good)


@machine_app.command("schema")
def machine_schema() -> None:
    """Print the JSON schema of a machine file."""
    from postproc.cli.shared.schemas import file_schema

    print_json(file_schema("machine-file"))


@setup_app.command("check", epilog="Example: postproc setup check part.setup.toml")
def setup_check(file: Annotated[str, typer.Argument(help="TOML file")], json: Json = "") -> None:
    """Check a set-up file and say what is wrong with it."""
    from postproc.setup.model import load_setup, part_placement
    from toolpaths.diagnostics import has_errors, info

    refuse_overwriting({"--json": json}, {"the set-up": file})
    spec, found = load_setup(file)
    placement, more = part_placement(spec, file) if spec else (None, [])
    found, bodies = [*found, *more], ""
    if spec is not None and placement is not None:
        from postproc.collision.bodies import described

        bodies, more = described(spec, placement, file)
        found += more
        if spec.part.system and spec.bodies is not None:
            found.append(info("setup.system", "the part stands by a system of the CL file: bodies are shown as if that were "
                              "the file's absolute frame", file=file))
    count = len(spec.tools) if spec else 0
    good = "" if has_errors(found) else f"{file}: OK: {count} tool{'s' * (count != 1)}{bodies}"
    report(tuple(found), json, {"diagnostics": [d.as_dict() for d in found]}, good)


@setup_app.command("schema")
def setup_schema() -> None:
    """Print the JSON schema of a set-up file."""
    from postproc.cli.shared.schemas import file_schema

    print_json(file_schema("setup-file"))


@controller_app.command("list")
def controller_list(json: Json = "") -> None:
    """List the built-in controllers."""
    from postproc.controllers.model import builtin_files

    found = {name: controller_file(name) for name in builtin_files()}
    rows = [{"name": name, "description": spec.description} for name, spec in found.items()]
    report((), json, {"controllers": rows}, "\n".join(table_text([(r["name"], r["description"]) for r in rows])))


@controller_app.command("show")
def controller_show(name: Annotated[str, typer.Argument(help="name or TOML file")], json: Json = "") -> None:
    """Show every value of a controller with its bases merged in, and the file and line that it comes from."""
    from postproc.cli.catalogue import controller_text, controller_values

    with shown_errors(json):
        values, origins = controller_values(controller_of(name))
    text = controller_text(values, origins)
    report((), json, {"values": values, "origins": origins}, text)


@controller_app.command("schema")
def controller_schema() -> None:
    """Print the JSON schema of a controller file."""
    from postproc.cli.shared.schemas import file_schema

    print_json(file_schema("controller-file"))


def schema(what: Annotated[list[str] | None, typer.Argument(metavar="NAME", help="a file that users write, or the words of "
                                                            "a command; left out: the list of both")] = None) -> None:
    """Print the JSON schema of a file that users write, or of what a command writes with --json."""
    from postproc.cli.shared.schemas import FILES, RESULTS, file_schema, result_schema

    name = " ".join(what or ())
    if not name:
        typer.echo("\n".join(["files:", *(f"  {one}" for one in FILES), "results of commands (--json):",
                              *(f"  {one}" for one in RESULTS)]))
    elif name in FILES or name in RESULTS:
        found: dict[str, Any] = file_schema(name) if name in FILES else result_schema(name)
        print_json(found)
    else:
        from machines.value_words import nearest

        raise typer.BadParameter(f"no file and no command {name!r}; {nearest(name, [*FILES, *RESULTS])}", param_hint="NAME")
