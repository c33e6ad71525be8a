"""The command `postproc setup align`. Heavy packages are imported inside, so that --help is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from postproc.cli.shared.console import (
    Json,
    machine_of,
    own_files,
    progress_bar,
    read_cl,
    refuse_overwriting,
    report,
    shown_errors,
)
from postproc.cli.shared.options import (
    Allow,
    AxisToleranceOption,
    ClFile,
    ControllerName,
    DialectOption,
    MachineName,
    ToleranceOption,
    UnitsOption,
)

EXAMPLES = """Example: postproc setup align readings.csv part.cls -m mikron-ucp710 -c fanuc-30i --setup S.toml -o S2.toml

readings.csv has a row for each point that was touched: x, y, z [mm] where it is on the drawing (in the work offset),
nx, ny, nz the direction that its surface looks in, X, Y, Z [mm] what the control shows with the probe there. A point
without nx, ny, nz counts in all three directions (the centre of a ball)."""


def setup_align(readings: Annotated[Path, typer.Argument(metavar="READINGS", help="CSV file of points that were touched")],
                file: ClFile, machine: MachineName, controller: ControllerName,
                setup: Annotated[Path, typer.Option("--setup", metavar="S.toml", help="set-up of the nominal place")],
                output: Annotated[Path, typer.Option("-o", "--output", metavar="S2.toml", help="set-up file to write: the "
                                                     "same with [part] as it was measured")],
                probe_length: Annotated[float, typer.Option("--probe-length", metavar="MM", min=0.0, max=2000.0,
                                                            help="from the gauge point to the ball of the probe: for turned "
                                                            "heads, and with --machine-coordinates")] = 0.0,
                machine_coordinates: Annotated[bool, typer.Option("--machine-coordinates", help="X, Y, Z are machine "
                                                                  "coordinates, not those of the work offset")] = False,
                sigma_um: Annotated[float | None, typer.Option("--sigma-um", metavar="UM", min=0.01, max=1e4, help="of a "
                                                               "reading, one standard deviation; without it 5")] = None,
                large: Annotated[bool, typer.Option("--large", help="take a part that stands more than 5 mm or 3 degrees "
                                                    "off")] = False,
                tolerance: ToleranceOption = 0.01, axis_tolerance: AxisToleranceOption = 0.05,
                units: UnitsOption = "", dialect: DialectOption = "", allow_unknown: Allow = None, json: Json = "") -> None:
    """Place the part where it was measured, say what that does to its program, and prove a conversion."""
    refuse_overwriting({"-o": str(output), "--json": json},
                       {"the readings": str(readings), "the CL file": str(file), "the set-up": str(setup),
                        **own_files(machine, controller)})
    from postproc.alignment import report as figures
    from postproc.alignment.align import ProbeReading, align
    from postproc.base.options import Options
    from postproc.placement.write import placed_text

    options = Options(tolerance, axis_tolerance, setup=str(setup), units=units, dialect=dialect,
                      allow_unknown=tuple(w.upper() for w in allow_unknown or ()), name=output.stem)
    values: dict[str, Any] = {}
    text, outputs = "", dict[Path, str | bytes]()
    with shown_errors(json), progress_bar() as progress:
        m = machine_of(machine)
        path, found = read_cl(file, options, progress)
        probe = ProbeReading(probe_length, machine_coordinates, None if sigma_um is None else 1e-3 * sigma_um)
        made = align(path, m, controller, options, readings, probe, large, found, progress)
        values = figures.as_dict(made) | {"output": str(output) if made.part else None}
        text = figures.as_text(made)
        if made.part is not None:
            outputs[output] = placed_text(setup, output, made.part)
            text += f"\nwritten: {output}, proved by a conversion"
    report(made.diagnostics, json, values | {"diagnostics": [d.as_dict() for d in made.diagnostics]}, text, outputs)
