"""One TOML file and one small class per controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from postproc.controllers.iso import IsoWriter
    from postproc.controllers.model import ControllerFile
    from postproc.program import Program
    from toolpaths.toolpath import Cycle


def writer_for(controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], length_offsets: bool,
               smoothing: float, work_offset: str = "G54") -> IsoWriter:
    """The writer that the controller file names; `smoothing` in mm is left to the controller's own smoothing."""
    from postproc.controllers.iso import IsoWriter
    from postproc.controllers.linuxcnc import LinuxcncWriter

    writer = {"iso": IsoWriter, "linuxcnc": LinuxcncWriter}[controller.writer]
    return writer(controller, program, cycles, length_offsets, smoothing, work_offset)
