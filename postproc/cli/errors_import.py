"""The command `postproc errors import`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from machines.geometric_error.tables.choices import MapDirections, TableRule, TableSign
from postproc.cli.error_files import doubted, finish, merged_into, model_files, pairs, required
from postproc.cli.shared.console import Json, machine_of, own_files, refuse_overwriting, shown_errors
from postproc.cli.shared.options import MachineName, word_option

EXAMPLE = "Example: postproc errors import X=x.comp y.csv -m mill-3axis -o errors.toml"
Sources = Annotated[list[str], typer.Argument(metavar="SOURCE...", help="tables per axis or of location errors (x.csv), of "
                                              "targets and runs of one error (EXX=laser.csv), a lattice (map.csv), "
                                              "LinuxCNC's files (X=x.comp)")]
OutputOption = Annotated[Path, typer.Option("-o", "--output", metavar="MODEL.toml",
                                            help="model to write; its tables are written "
                                            "next to it")]
Into = Annotated[Path | None, typer.Option("--into", metavar="MODEL.toml", help="add to this model: its other errors stay, "
                                           "with their covariance")]
Covariance = Annotated[Path | None, typer.Option("--covariance", metavar="C.csv", help="square table of what is imported, "
                                                 "um and arcsec")]
Interpolation = Annotated[TableRule, word_option("--interpolation", TableRule, "between rows: linear or spline")]
Repeats = Annotated[list[str] | None, typer.Option("--repeats", metavar="AXIS=PERIOD", help="degrees or mm after which a "
                                                   "table or map repeats, e.g. C=360")]
Sign = Annotated[TableSign, word_option("--sign", TableSign, "-1 where the numbers say how the part moves relative to the "
                                        "tool")]
ScrewFileTypeOption = Annotated[int, typer.Option("--type", metavar="{0,1}", min=0, max=1,
                                                   help="COMP_FILE_TYPE of LinuxCNC's files")]
ToolLengthOption = Annotated[float, typer.Option("--tool-length", metavar="MM", min=0.0, max=10_000.0,
                                                 help="of the tool whose tip a "
                                                 "map displaces; 0: the gauge point")]
Zero = Annotated[list[str] | None, typer.Option("--zero", metavar="AXIS=POSITION", help="place at which a map is to be 0, "
                                                "all its coordinates, mm or degrees")]
Average = Annotated[bool, typer.Option("--average", help="rows at the same place, columns of runs (EXX+1, EXX-1, EXX+2 ...) "
                                       "and files of runs are readings: the mean counts, the scatter is the uncertainty")]
NearOption = Annotated[list[str] | None, typer.Option("--near", metavar="AXIS=AMOUNT",
                                                      help="with --average: readings within this "
                                                      "amount of each other belong to one place, mm or degrees")]
Large = Annotated[bool, typer.Option("--large", help="accept errors above 1 mm or 0.5 degrees")]
DirectionsOption = Annotated[MapDirections, word_option("--directions", MapDirections, "axes along which a map gives its "
                                                        "values")]


def import_(sources: Sources, machine: MachineName, output: OutputOption, into: Into = None, covariance: Covariance = None,
            interpolation: Interpolation = "linear", repeats: Repeats = None, sign: Sign = 1, kind: ScrewFileTypeOption = 0,
            tool_length: ToolLengthOption = 0.0, directions: DirectionsOption = "table", zero: Zero = None,
            average: Average = False,
            near: NearOption = None, large: Large = False, json: Json = "") -> None:
    """Import tables of errors as an error model."""
    files_of = [source.split("=", 1)[-1] for source in sources]
    refuse_overwriting({"-o": str(output), "--json": json},
                       {**{name: name for name in files_of}, **own_files(machine)})
    refuse_overwriting({"--json": json}, {"the model of --into": str(into or ""),
                                         "the table of --covariance": str(covariance or "")})
    from machines.geometric_error.exchange.exports import in_units
    from machines.geometric_error.exchange.imports import ImportOptions, read_sources, with_covariance
    from machines.geometric_error.exchange.survey import beyond_travel, unmeasured

    with shown_errors(json):
        m = machine_of(machine)
        known = (*m.axis_names, *"xyz")
        periods, at = in_units(pairs("--repeats", repeats, known)), in_units(pairs("--zero", zero, known))
        apart = in_units(pairs("--near", near, known))
        how = ImportOptions(interpolation, periods, float(sign), kind, tool_length, directions,
                            at, average, apart, large)
        read, found = read_sources(sources, m, how)
        model, noted = required(read, found), [f"read: {', '.join(files_of)}"]
        found += [*beyond_travel(model, m, str(output)), *unmeasured(model, m, str(output))]
        if covariance is not None:
            noted += [f"uncertainty from {covariance.name}, not from the scatter"] if model.covariance is not None else []
            model = required(*with_covariance(model, covariance))
        if into is not None:
            model, lost = merged_into(model, into, m)
            noted += lost
        files = model_files(model, output.stem, ("imported from " + ", ".join(Path(s).name for s in files_of))[:200],
                            output.name)
    noted.append(f"{len(model.names)} parameters, {doubted(model)} with an uncertainty")
    inputs = [Path(name) for name in (*files_of, into, covariance) if name is not None]
    finish(files, output.parent, inputs, json, found, noted,
           {"parameters": len(model.names), "covariance": model.covariance is not None})
