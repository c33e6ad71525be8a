"""One TOML file and one small class per controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from postproc.controllers.model import ControllerFile
    from postproc.controllers.writer import Writer
    from postproc.program import Program
    from toolpaths.toolpath import Cycle

_CLASSES = {"iso": "IsoWriter", "linuxcnc": "LinuxcncWriter", "fanuc": "FanucWriter", "haas": "HaasWriter",
            "siemens": "SiemensWriter", "heidenhain": "KlartextWriter"}


def writer_for(controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], length_offsets: bool,
               smoothing: float, work_offset: str = "G54", axis_smoothing: float = 0.0, name: str = "",
               subprograms: bool = False) -> Writer:
    """The writer that the controller file names.

    Args:
        length_offsets: axis positions of Z are less the tool's length, which a register of the control adds
        smoothing, axis_smoothing: mm and degrees left to the controller's own smoothing
        work_offset: the set-up's code, G54 to G59.3
        name: of the program, where the controller's programs hold one
        subprograms: each operation becomes a subprogram of the file, where the controller has such
    """
    from importlib import import_module

    writer = getattr(import_module(f"postproc.controllers.{controller.writer}"), _CLASSES[controller.writer])
    made: Writer = writer(controller, program, cycles, length_offsets, smoothing, work_offset, axis_smoothing, name,
                          subprograms)
    return made
