"""The reader of each dialect; one is imported where its dialect is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from functools import lru_cache
from typing import Literal

from machines.choices import Stop
from machines.machine import ClampCodes
from postproc.control.rollover import Rollover
from postproc.controllers.model import ControllerFile, WriterName
from postproc.readback.dialects.base import Reader
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass


def reader_for(controller: ControllerFile, letters: tuple[str, ...], home: Floats | None = None,
               stop: Stop | Literal[""] = "", rolls: dict[int, Rollover] | None = None,
               clamps: Mapping[str, ClampCodes] | None = None) -> Reader:
    """The reader of the dialect that the controller file's writer writes; `home` (J,): machine coordinates, mm, degrees;
    `stop`: what stops switch off where the machine file says it; `rolls`: modulo axes by joint; `clamps`: codes of the
    clamps that programs work, by axis."""
    return _READERS[controller.writer]()(letters, controller, home, stop, rolls, clamps)


@dataclass(frozen=True)
class _ByText:
    """A controller file that is another only where its text is."""

    text: str
    controller: ControllerFile = field(compare=False)


def smoothing_level(controller: ControllerFile, letters: tuple[str, ...], blocks: tuple[str, ...]) -> float:
    """See `Reader.smoothing_level`; a process reads the blocks of a controller file once."""
    return _smoothing_level(_ByText(controller.model_dump_json(), controller), letters, blocks) if blocks else float("nan")


@lru_cache(maxsize=64)
def _smoothing_level(of: _ByText, letters: tuple[str, ...], blocks: tuple[str, ...]) -> float:
    return reader_for(of.controller, letters).smoothing_level(blocks)


def _iso() -> type[Reader]:
    from postproc.readback.dialects.iso import IsoReader

    return IsoReader


def _fanuc() -> type[Reader]:
    from postproc.readback.dialects.fanuc import FanucReader

    return FanucReader


def _haas() -> type[Reader]:
    from postproc.readback.dialects.haas import HaasReader

    return HaasReader


def _siemens() -> type[Reader]:
    from postproc.readback.dialects.siemens import SiemensReader

    return SiemensReader


def _heidenhain() -> type[Reader]:
    from postproc.readback.dialects.klartext import KlartextReader

    return KlartextReader


_READERS: dict[WriterName, Callable[[], type[Reader]]] = {
    "iso": _iso, "linuxcnc": _iso, "fanuc": _fanuc, "haas": _haas, "siemens": _siemens, "heidenhain": _heidenhain}
