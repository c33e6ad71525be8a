"""The reader of each dialect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from machines.choices import Stop
from machines.machine import ClampCodes
from postproc.control.rollover import Rollover
from postproc.controllers.model import ControllerFile, WriterName
from postproc.readback.dialects.base import Reader
from toolpaths.arrays import Floats


def reader_for(controller: ControllerFile, letters: tuple[str, ...], home: Floats | None = None,
               stop: Stop | Literal[""] = "", rolls: dict[int, Rollover] | None = None,
               clamps: Mapping[str, ClampCodes] | None = None) -> Reader:
    """The reader of the dialect that the controller file's writer writes; `home` (J,): machine coordinates, mm, degrees;
    `stop`: what stops switch off where the machine file says it; `rolls`: modulo axes by joint; `clamps`: codes of the
    clamps that programs work, by axis."""
    from postproc.readback.dialects.fanuc import FanucReader
    from postproc.readback.dialects.haas import HaasReader
    from postproc.readback.dialects.iso import IsoReader
    from postproc.readback.dialects.klartext import KlartextReader
    from postproc.readback.dialects.siemens import SiemensReader

    readers: dict[WriterName, type[Reader]] = {
        "iso": IsoReader, "linuxcnc": IsoReader, "fanuc": FanucReader, "haas": HaasReader, "siemens": SiemensReader,
        "heidenhain": KlartextReader}
    return readers[controller.writer](letters, controller, home, stop, rolls, clamps)
