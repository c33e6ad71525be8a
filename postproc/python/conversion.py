"""`convert` and `verify` as they are called from Python: choices go by the clock of the control."""

from __future__ import annotations

from pathlib import Path

from machines.machine import Machine
from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.cycle_time.conversion import program_clock
from postproc.pipeline.convert import convert as run_convert
from postproc.pipeline.convert import verify as run_verify
from postproc.pipeline.result import PostResult, VerifyResult
from postproc.pipeline.written_figures import Keep
from postproc.setup.model import SetupFile
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import Toolpath


def convert(path: Toolpath, machine: Machine | str | Path, controller: str | Path = "linuxcnc",
            setup: SetupFile | str | Path | None = None, options: Options | None = None,
            diagnostics: list[Diagnostic] | None = None, progress: Progress | None = None, *, model: str = "",
            keep: Keep = "all") -> PostResult:
    """`pipeline.convert.convert`, whose arguments are the same; what is chosen goes by the control's clock.

    Args:
        model: of the control, as of `time`
        keep: "all", or "summary" for long files: path, program and feeds are let go once the text is written, and `figures`
            of the result hold what a summary needs of them; with "all" they are None

    Raises:
        DiagnosticError: where path, options or keep are none, or machine, controller or set-up cannot be loaded.
    """
    return run_convert(path, machine, controller, setup, options, diagnostics, progress, program_clock(model), keep)


def verify(gcode: str | Path, path: Toolpath, machine: Machine | str | Path, controller: str | Path = "linuxcnc",
           setup: SetupFile | str | Path | None = None, options: Options | None = None,
           diagnostics: list[Diagnostic] | None = None, progress: Progress | None = None, tool_table: str | Path = "", *,
           model: str = "") -> VerifyResult:
    """`pipeline.convert.verify`, tool axes chosen by the control's clock as `convert` does; `model` as of
    `time`.

    Raises:
        DiagnosticError: where path or options are none, or one of the files cannot be loaded.
    """
    return run_verify(gcode, path, machine, controller, setup, options, diagnostics, progress, tool_table,
                      program_clock(model))
