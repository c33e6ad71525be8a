"""Commands on error models: check, export, import, schema. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from machines.geometric_error.tables.choices import MapDirections
from postproc.cli.error_files import finish, loaded, model_files, or_refused, pairs, writable
from postproc.cli.errors_import import EXAMPLE, import_
from postproc.cli.shared.console import Json, machine_of, own_files, print_json, refuse_overwriting, report, shown_errors
from postproc.cli.shared.group import Group
from postproc.cli.shared.options import MachineName, figure_ending, word_option

errors_app = typer.Typer(cls=Group, no_args_is_help=True, rich_markup_mode=None,
                         help="Error models: check, export to tables, maps and "
                         "LinuxCNC's screw compensation, import, schema.")
errors_app.command("import", epilog=EXAMPLE)(import_)

ModelFile = Annotated[Path, typer.Argument(metavar="MODEL.toml", help="error model")]
Folder = Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="folder to write into")]
FigureOption = Annotated[Path | None, typer.Option("--figure", metavar="FILE",
                                                   help="drawing of the errors, and of the tip over "
                                                   "the work volume, .png or .svg")]
ToolLength = Annotated[float, typer.Option("--tool-length", metavar="MM", min=0.0, max=10_000.0,
                                           help="gauge length of the tool at whose tip errors are given")]
Step = Annotated[list[str] | None, typer.Option("--step", metavar="AXIS=STEP", help="mm or degrees between rows or nodes, "
                                                "e.g. X=50; may be repeated")]
Loss = Annotated[float, typer.Option("--loss", metavar="UM", min=1e-4, max=1e4,
                                     help="allowed interpolation error between rows, um")]
AngleLoss = Annotated[float, typer.Option("--angle-loss", metavar="ARCSEC", min=1e-4, max=1e5,
                                          help="the same of angles, arcsec")]
Rest = Annotated[Path | None, typer.Option("--rest", metavar="REST.toml",
                                           help="model of what LinuxCNC does not correct, for --error-model")]
MapFile = Annotated[Path, typer.Option("-o", "--output", metavar="MAP.toml",
                                       help="model to write; its lattice is written next to it")]
Over = Annotated[str, typer.Option("--over", metavar="LETTERS", help="coordinates: axes, e.g. XYZ or XYZAC, or x y z of the "
                                   "point in the table frame; default the slides, xyz of parallel-kinematic machines")]
MapLossOption = Annotated[float | None, typer.Option("--loss", metavar="UM", min=1e-3, max=1e4,
                                                     help="refine the lattice until the "
                                                     "interpolation error inside it is below UM")]
At = Annotated[list[str] | None, typer.Option("--at", metavar="AXIS=POSITION", help="position of an axis that is "
                                              "not a coordinate of the map, mm or degrees")]
MapToolLengthOption = Annotated[float, typer.Option("--tool-length", metavar="MM", min=0.0, max=10_000.0,
                                                    help="displacements are those "
                                                    "of the tip of this tool; 0: of the gauge point")]
MapDirectionsOption = Annotated[MapDirections, word_option("--directions", MapDirections, "axes along which the map gives "
                                                           "its values; those of the table turn with the rotary axes under "
                                                           "the part")]


@errors_app.command("check", epilog="Example: postproc errors check errors.toml -m mikron-ucp710 --tool-length 120")
def check(file: ModelFile, machine: MachineName, tool_length: ToolLength = 100.0, figure: FigureOption = None,
          json: Json = "") -> None:
    """Check an error model: its errors, range, worst tip and axis over the work volume, uncertainty."""
    refuse_overwriting({"--figure": str(figure or ""), "--json": json},
                       {"the error model": str(file), **own_files(machine)})
    ending = figure_ending(figure)
    from machines.geometric_error.exchange.survey import beyond_travel, survey, unmeasured
    from postproc.cli.error_text import check_text

    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        m = machine_of(machine)
        model, found = loaded(file, m)
        figures = survey(model, m, tool_length)
        found += [*beyond_travel(model, m, str(file)), *unmeasured(model, m, str(file))]
        if figure is not None and ending is not None:
            from machines.geometric_error.exchange.figures import model_figure

            outputs[figure] = model_figure(model, m, tool_length, ending)
    report(tuple(found), json, figures | {"diagnostics": [d.as_dict() for d in found]}, check_text(str(file), figures),
           outputs)


@errors_app.command("to-tables", epilog="Example: postproc errors to-tables errors.toml -m mikron-ucp710 -o tables")
def to_tables(file: ModelFile, machine: MachineName, output: Folder, step: Step = None, loss: Loss = 0.1,
              angle_loss: AngleLoss = 0.1, json: Json = "") -> None:
    """Write every component error as a table per axis with ISO 230-1 names, and a model that reads them."""
    refuse_overwriting({"--json": json}, {"the error model": str(file), **own_files(machine)})
    from machines.geometric_error.exchange import exports
    from machines.geometric_error.tables.csv_table import UNITS
    from postproc.cli.error_text import table_figures

    with shown_errors(json):
        m = machine_of(machine)
        model, found = loaded(file, m)
        steps = exports.in_units(pairs("--step", step, m.axis_names))
        allowed = loss * UNITS["um"], angle_loss * UNITS["arcsec"]
        made, losses = or_refused(lambda: exports.to_tables(model, m, steps, *allowed), file)
        made, noted = writable(model, made)
        files = model_files(made, file.stem, f"tables of {file.name}")
        files |= {f"{file.stem}-location.csv": exports.location_csv(made)} if made.axes.constants else {}
    figures, lost = table_figures(made, exports.named(losses))
    finish(files, output, [file], json, found, [*lost, *noted, *exports.notices(made, m)], figures)


@errors_app.command("to-linuxcnc", epilog="Example: postproc errors to-linuxcnc e.toml -m mill-3axis -o comp --rest r.toml")
def to_linuxcnc(file: ModelFile, machine: MachineName, output: Folder, rest: Rest = None, step: Step = None,
                loss: Loss = 0.1, angle_loss: AngleLoss = 0.1, tool_length: ToolLength = 100.0, json: Json = "") -> None:
    """Write positioning errors as LinuxCNC's screw compensation, one file per joint; report what is left."""
    refuse_overwriting({"--rest": str(rest or ""), "--json": json},
                       {"the error model": str(file), **own_files(machine)})
    from machines.geometric_error.exchange import exports
    from machines.geometric_error.tables.csv_table import UNITS
    from postproc.cli.error_text import screw_figures, screw_notice

    with shown_errors(json):
        m = machine_of(machine)
        model, found = loaded(file, m)
        steps = exports.in_units(pairs("--step", step, m.axis_names))
        allowed = loss * UNITS["um"], angle_loss * UNITS["arcsec"]
        screws = or_refused(lambda: exports.to_screws(model, m, steps, *allowed), file)
        names = {letter: f"{file.stem}-{letter}.comp" for letter in screws.texts}
        worst = [exports.worst(x, m, tool_length, model) for x in (model, screws.rest)]
        adjacent = {} if rest is None else {rest.parent / name: text for name, text in model_files(
            screws.rest, rest.stem, f"{file.name} less what LinuxCNC corrects", rest.name).items()}
    figures, noted = screw_figures(model, screws, names, exports.named(screws.losses), worst, tool_length)
    found.append(screw_notice(list(figures["losses"]), str(file), rest))
    finish({names[letter]: text for letter, text in screws.texts.items()}, output, [file], json, found,
           [*noted, *exports.notices(screws.held, m), "for the INI file:", *exports.ini_lines(m, names)], figures, adjacent)


@errors_app.command("to-map", epilog="Example: postproc errors to-map e.toml -m mikron-ucp710 -o map.toml --loss 2")
def to_map(file: ModelFile, machine: MachineName, output: MapFile, over: Over = "", step: Step = None,
           loss: MapLossOption = None,
           at: At = None, tool_length: MapToolLengthOption = 0.0, directions: MapDirectionsOption = "machine",
           json: Json = "") -> None:
    """Write an error map of a model, as controls hold it, and report its interpolation error."""
    refuse_overwriting({"-o": str(output), "--json": json},
                       {"the error model": str(file), **own_files(machine)})
    from machines.geometric_error.exchange import exports
    from machines.geometric_error.tables.csv_table import UNITS
    from postproc.cli.error_text import map_figures

    with shown_errors(json):
        m = machine_of(machine)
        known = (*m.axis_names, *"xyz")
        if not set(over) <= set(known) or len(set(over)) < len(over):
            raise typer.BadParameter(f"{over!r}: coordinates are {', '.join(known)}, each once",
                                     param_hint="--over")
        model, found = loaded(file, m)
        steps = exports.in_units(pairs("--step", step, known))
        stands = exports.in_units(pairs("--at", at, m.axis_names))
        empty = or_refused(lambda: exports.lattice_for(model, m, over, steps, stands, tool_length, directions), file)
        allowed = None if loss is None else loss * UNITS["um"]
        made = or_refused(lambda: exports.to_map(model, m, *empty, allowed), file)
        files = model_files(made.model, output.stem, f"map of {file.name}", output.name)
    figures, noted = map_figures(model, made)
    finish(files, output.parent, [file], json, found, noted, figures)


@errors_app.command("schema")
def errors_schema() -> None:
    """Print the JSON schema of an error model file."""
    from machines.geometric_error.files.loader import error_model_schema

    print_json(error_model_schema())


@errors_app.command("repeatability", epilog="Example: postproc errors repeatability C-42.csv --figure C-42.svg")
def repeatability(file: Annotated[Path, typer.Argument(metavar="READINGS.csv", help="column reading [arcsec] or [um]; where "
                                                       "there are several, position [deg] or [mm], and approach (1, -1)")],
                  figure: Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="the readings drawn, .png or "
                                                              ".svg")] = None, json: Json = "") -> None:
    """Repeatability of an axis from repeated readings: interval, standard deviation, reversal (ISO 230-2)."""
    from postproc.cli.catalogue import analysis_text

    ending = figure_ending(figure)
    refuse_overwriting({"--figure": str(figure or ""), "--json": json}, {"the readings": str(file)})
    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        from machines.calibration.repeatability import read_repeated, repeated_figure

        found, diagnostics = read_repeated(file)
        figures = {} if found is None else found.figures
        if found is not None and figure is not None and ending is not None:
            outputs[figure] = repeated_figure(found, file.stem, ending)
    words = {key: value for key, value in figures.items() if key != "positions"} | (
        {"positions": len(figures["positions"])} if figures else {})
    report(tuple(diagnostics), json, figures | {"diagnostics": [d.as_dict() for d in diagnostics]}, analysis_text(words),
           outputs)
