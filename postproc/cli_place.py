"""The command `postproc place`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from postproc.cli_orient import ORIENTATIONS, MaxTilt, Orient
from postproc.console import Json, machine_of, progress_bar, refuse_overwriting, report, shown_errors


def place(file: Annotated[Path, typer.Argument(metavar="FILE", help="CL file (APT text)")],
          machine: Annotated[str, typer.Option("-m", "--machine", help="machine: a name from the list, or a TOML file")],
          setup: Annotated[Path, typer.Option("--setup", metavar="S.toml", help="set-up file; [placement] says where the "
                                              "part may stand")],
          output: Annotated[Path, typer.Option("-o", "--output", metavar="S2.toml", help="the same with [part] replaced")],
          controller: Annotated[str, typer.Option("-c", "--controller", help="for which the place is proved")] = "linuxcnc",
          orient: Orient = "keep", max_tilt: MaxTilt = 60.0,
          tolerance: Annotated[float, typer.Option("--tolerance", metavar="MM", min=1e-6, max=10.0)] = 0.01,
          axis_tolerance: Annotated[float, typer.Option("--axis-tolerance", metavar="DEG", min=1e-6, max=10.0)] = 0.05,
          units: Annotated[str, typer.Option("--units", help="units of a CL file that states none: mm or inch")] = "",
          figure: Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="map of the places, .png or "
                                                      ".svg")] = None,
          json: Json = "") -> None:
    """Place and turn the part on the table for the least planned time, inside the limits of the set-up."""
    if orient not in ORIENTATIONS:
        raise typer.BadParameter(f"{orient!r} is not available; choose from {', '.join(ORIENTATIONS)}",
                                 param_hint="--orient")
    if units not in ("", "mm", "inch"):
        raise typer.BadParameter(f"{units!r} is not available; choose from mm, inch", param_hint="--units")
    if figure is not None and figure.suffix.lower() not in (".png", ".svg"):
        raise typer.BadParameter(f"{figure.name} is no .png or .svg file", param_hint="--figure")
    if setup.exists() and not setup.is_file():
        raise typer.BadParameter(f"{setup} is no regular file: its text is read twice", param_hint="--setup")
    refuse_overwriting({"-o": str(output), "--json": json, "--figure": str(figure or "")},
                       {"the CL file": str(file), "the set-up": str(setup)})
    import toolpaths
    from postproc.files import write_atomically
    from postproc.options import Options
    from postproc.placement import report as figures
    from postproc.placement.place import place as run
    from postproc.placement.write import placed_text
    from postproc.setup import load_setup
    from toolpaths.diagnostics import has_errors, require

    options = Options(tolerance, axis_tolerance, setup=str(setup), units=units, orient=orient,  # type: ignore[arg-type]
                      max_tilt=max_tilt)
    values: dict[str, Any] = {}
    text = ""
    with shown_errors(json), progress_bar() as progress:
        m = machine_of(machine)
        settings, more = load_setup(setup)
        require(more)
        assert settings is not None
        path, found = toolpaths.read(file, units=units or None)
        found = [*found, *(d for d in path.faults if d not in found)]
        if not has_errors(found):
            choice, more = run(path, m, settings, options, controller, progress)
            found += more
            if choice is not None:
                write_atomically(output, placed_text(setup, output, choice.part))
                if figure is not None:
                    from postproc.placement.figure import placement_figure

                    write_atomically(figure, placement_figure(choice, figure.suffix.lower()))
                values = figures.as_dict(choice) | {"output": str(output)}
                text = figures.as_text(choice) + f"\nwritten: {output}"
    report(tuple(found), json, values | {"diagnostics": [d.as_dict() for d in found]}, text)
