"""The writer of each dialect; one is imported where its dialect is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from postproc.compile.program import Program
from postproc.controllers.model import ControllerFile, WriterName
from postproc.job.smoothing import Smoothing
from postproc.writing.writer import Writer
from toolpaths.arrays import Floats
from toolpaths.toolpath import Cycle


def writer_for(controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], length_offsets: bool,
               smoothing: float, work_offset: str | Sequence[tuple[str, str]] = "G54", axis_smoothing: float = 0.0,
               name: str = "", subprograms: bool = False, stock: Floats | None = None,
               levels: dict[str, Smoothing] | None = None) -> Writer:
    """The writer that the controller file names.

    Args:
        length_offsets: machine coordinates of Z are less the tool's length, which a register of the control adds
        smoothing, axis_smoothing: mm and degrees left to the controller's own smoothing
        work_offset: the set-up's code, G54 to G59.3; of several places (name, code) of each
        name: of the program, where the controller's programs hold one
        stock: (2, 3), least and greatest X, Y, Z of the stock in the work offset, mm
        levels: the control's own smoothing of operations by name, where it is another
        subprograms: each operation becomes a subprogram of the file, where the controller has such
    """
    places = [("", work_offset)] if isinstance(work_offset, str) else work_offset
    writer = _WRITERS[controller.writer]()
    return writer(controller, program, cycles, length_offsets, smoothing, places, axis_smoothing, name, subprograms, stock,
                  levels)


def _iso() -> type[Writer]:
    from postproc.writing.iso import IsoWriter

    return IsoWriter


def _linuxcnc() -> type[Writer]:
    from postproc.writing.linuxcnc import LinuxcncWriter

    return LinuxcncWriter


def _fanuc() -> type[Writer]:
    from postproc.writing.fanuc import FanucWriter

    return FanucWriter


def _haas() -> type[Writer]:
    from postproc.writing.haas import HaasWriter

    return HaasWriter


def _siemens() -> type[Writer]:
    from postproc.writing.siemens import SiemensWriter

    return SiemensWriter


def _heidenhain() -> type[Writer]:
    from postproc.writing.heidenhain import KlartextWriter

    return KlartextWriter


_WRITERS: dict[WriterName, Callable[[], type[Writer]]] = {
    "iso": _iso, "linuxcnc": _linuxcnc, "fanuc": _fanuc, "haas": _haas, "siemens": _siemens, "heidenhain": _heidenhain}
