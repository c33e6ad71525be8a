"""The command `postproc orient`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from postproc.console import Json, machine_of, progress_bar, refuse_overwriting, report, shown_errors

ORIENTATIONS = ("keep", "per-pass", "whole-part", "auto")
MaxTilt = Annotated[float, typer.Option("--max-tilt", metavar="DEG", min=0.0, max=120.0, help="largest tilt of a chosen "
                                        "axis from the file's surface normals, or from its own axis")]
Orient = Annotated[str, typer.Option("--orient", help="keep: the tool axes of the CL file; per-pass, whole-part, auto: "
                                     "turned for the least planned time (3+2 passes of ball cutters)")]


def orient(file: Annotated[Path, typer.Argument(metavar="FILE", help="CL file (APT text)")],
           machine: Annotated[str, typer.Option("-m", "--machine", help="machine: a name from the list, or a TOML file")],
           max_tilt: MaxTilt = 60.0,
           setup: Annotated[str, typer.Option("--setup", metavar="S.toml", help="set-up file: placement, tools")] = "",
           tolerance: Annotated[float, typer.Option("--tolerance", metavar="MM", min=1e-6, max=10.0)] = 0.01,
           axis_tolerance: Annotated[float, typer.Option("--axis-tolerance", metavar="DEG", min=1e-6, max=10.0)] = 0.05,
           units: Annotated[str, typer.Option("--units", help="units of a CL file that states none: mm or inch")] = "",
           json: Json = "") -> None:
    """Choose the tool orientation of 3+2 passes for the least planned time."""
    if units not in ("", "mm", "inch"):
        raise typer.BadParameter(f"{units!r} is not available; choose from mm, inch", param_hint="--units")
    refuse_overwriting({"--json": json}, {"the CL file": str(file), "the set-up": setup})
    import toolpaths
    from postproc.options import Options
    from postproc.orientation import report as figures
    from postproc.orientation.orient import orient as run
    from postproc.setup import load_setup
    from toolpaths.diagnostics import has_errors, require

    options = Options(tolerance, axis_tolerance, setup=setup, units=units, max_tilt=max_tilt)
    values: dict[str, Any] = {}
    text = ""
    with shown_errors(json), progress_bar() as progress:
        m = machine_of(machine)
        path, found = toolpaths.read(file, units=units or None)
        settings, more = load_setup(setup or None)
        require(more)
        assert settings is not None
        found = [*found, *(d for d in path.faults if d not in found)]
        if not has_errors(found):
            choice, more = run(path, m, settings, options, progress)
            found += more
            if choice is not None:
                values, text = figures.as_dict(choice), figures.as_text(choice)
    report(tuple(found), json, values | {"diagnostics": [d.as_dict() for d in found]}, text)
