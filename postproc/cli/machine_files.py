"""`postproc machine import` and `machine export`: machine files of other systems. Heavy packages are imported inside."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from machines.exchange.choices import ExportForm, GivenForm
from postproc.cli.shared.console import Json, machine_of, own_files, refuse_inputs, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import word_option

IMPORTED = "Example: postproc machine import shop.ini -o shop.toml --set kinematics.axes.A.point=[0,0,55.5]"
EXPORTED = "Example: postproc machine export mikron-ucp710 --format linuxcnc-ini -o simulator"
Foreign = Annotated[Path, typer.Argument(metavar="FILE", help="LinuxCNC's INI, with the HAL files that it names; machine data "
                                           "of Siemens, Heidenhain's kinematics; machine files of FreeCAD, Fusion")]
FormOption = Annotated[GivenForm, word_option("--format", GivenForm, "what FILE is; auto: by its text")]
SetOption = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="what the file does not say: a key "
                                                     "of the machine file (axes.A.velocity=40) or a HAL pin")]
OutputFile = Annotated[Path, typer.Option("-o", "--output", metavar="MACHINE.toml", help="machine file to write")]
FolderOption = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="folder to write the files into")]
ExportOption = Annotated[ExportForm, word_option("--format", ExportForm, "an INI and a HAL file for LinuxCNC's simulator")]


def machine_import(file: Foreign, output: OutputFile, form: FormOption = "auto", stated: SetOption = None,
                   json: Json = "") -> None:
    """Read a machine file of another system; behind each value stands its line, what no line states is assumed."""
    refuse_overwriting({"-o": str(output), "--json": json}, {"the file": str(file)})
    if wrong := [pair for pair in stated or () if "=" not in pair]:
        raise typer.BadParameter(f"{wrong[0]!r} is not KEY=VALUE", param_hint="--set")
    from machines.exchange.read import import_machine

    text, machine, found = import_machine(file, form, stated or ())
    values = {"output": str(output) if machine else None, "assumed": sorted(machine.limits.assumed) if machine else [],
              "diagnostics": [d.as_dict() for d in found]}
    good = f"{output}: {machine.structure}, axes {' '.join(machine.axis_names)}, from {file}" if machine else ""
    report(tuple(found), json, values, good, {output: text} if machine else {})


def machine_export(name: Annotated[str, typer.Argument(help="name or TOML file")], output: FolderOption,
                   form: ExportOption = "linuxcnc-ini", json: Json = "") -> None:
    """Write the files with which LinuxCNC's simulator runs a machine; refused where its kinematics cannot."""
    from machines.exchange.export import export_linuxcnc

    texts: dict[str, str] = {}
    with shown_errors(json):
        machine = machine_of(name)
        texts, found = export_linuxcnc(machine, machine.name)
        files: dict[Path, str | bytes] = {output / file: text for file, text in texts.items()}
        refuse_inputs(list(files), own_files(name))
    report(tuple(found), json, {"files": [str(path) for path in files], "diagnostics": [d.as_dict() for d in found]},
           "\n".join(map(str, files)), files)
