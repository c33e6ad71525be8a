"""`postproc calibrate`: a measurement file to an error model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from postproc.cli.shared.console import Json, print_json, refuse_inputs, refuse_overwriting, report, shown_errors
from postproc.cli.shared.options import figure_ending


def _schema(wanted: bool) -> None:
    if wanted:
        from machines.calibration.measurement_file import measurement_schema

        print_json(measurement_schema())
        raise typer.Exit


def calibrate(file: Annotated[Path, typer.Argument(metavar="MEASUREMENTS.toml", help="what was measured, and how")],
              output: Annotated[Path, typer.Option("-o", "--output", metavar="ERROR_MODEL.toml",
                                                   help="error model to write; its tables are written next to it")],
              figure: Annotated[Path | None, typer.Option("--figure", metavar="FILE", help="drawing of signatures, "
                                                          "residuals and condition number, .png or .svg")] = None,
              accept_residual: Annotated[bool, typer.Option("--accept-residual", help="accept a fit whose residuals are "
                                                            "larger than the stated noise; its covariance is scaled up "
                                                            "accordingly")] = False,
              schema: Annotated[bool, typer.Option("--schema", is_eager=True, callback=_schema, help="print the JSON schema "
                                                   "of a measurement file, with the columns of its table")] = False,
              json: Json = "") -> None:
    """Identify a machine's errors from measurements, each with its uncertainty; what the data cannot identify is refused."""
    refuse_overwriting({"-o": str(output), "--figure": str(figure or ""), "--json": json},
                       {"the measurements": str(file)})
    ending = figure_ending(figure)
    from dataclasses import replace

    from machines.calibration.calibrate import calibrate as run
    from machines.calibration.result_text import text
    from machines.geometric_error.exchange.write_model import write_model

    outputs: dict[Path, str | bytes] = {}
    with shown_errors(json):
        found, diagnostics = run(file, accept_residual)
        if found is not None and found.model is not None:
            if figure is not None and ending is not None:
                from machines.calibration.figures import draw

                outputs[figure] = draw(found.figures, f"calibration: {file.name}", ending)
            files = write_model(replace(found.model, name=output.stem), found.description(file.name))
            model = files.pop(f"{output.stem}.toml")
            refuse_inputs([output.parent / name for name in files], {"the measurements": str(file)})
            outputs |= {**{output.parent / name: content for name, content in files.items()}, output: model}
    done = found is not None and found.model is not None
    report(tuple(diagnostics), json, {"output": str(output) if done else None, **({} if found is None else found.figures),
                                      "diagnostics": [d.as_dict() for d in diagnostics]},
           text(None if found is None else found.figures, f"{output}: written" if done else "nothing written"), outputs)
