"""LinuxCNC's kinematics modules as geometry of ours: what each pin means, and why some modules are none of ours.

Sources: kins(9), trivkins(9) and the text of each module in LinuxCNC 2.9 (src/emc/kinematics: trtfuncs.c, 5axiskins.c,
lineardeltakins-common.h, maxkins.c); section "Kinematics in LinuxCNC" of its Integrator Manual.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from machines.exchange.draft import Draft, KeyNames
from toolpaths.dataclass import dataclass

COORDINATES = {"trivkins": "XYZABCUVW", "xyzac-trt-kins": "XYZAC", "xyzbc-trt-kins": "XYZBC", "5axiskins": "XYZBCW",
               "lineardeltakins": "XYZABCUVW"}
"""letters of joints 0, 1, ... where the INI gives no coordinates="""
UNREAD_PINS = ("conventional-directions", "J0off", "J1off", "J2off")
"""pins that change the geometry where they are not 0"""
_ROBOTS = "it moves arms, struts or belts, no machine of three linear and up to two rotary axes in a chain"
ON_LEGS = ("genhexkins", "pentakins", "rotarydeltakins")
"""modules of struts and arms that a machine file of kind `legs` describes"""
NOT_OURS = {
    "maxkins": "up to LinuxCNC 2.9 it adds the offset of the swivelled head without turning it with the table, so that the "
               "tip is right with B or C at 0 only: run trivkins, and state the structure of the machine in [POSTPROC]",
    "xyzab_tdr_kins": "two rotary tables in a row under A and B are not among the modules known here: run trivkins",
    **dict.fromkeys(("genserkins", "genhexkins", "pumakins", "scarakins", "rotarydeltakins", "pentakins", "tripodkins",
                     "scorbot-kins", "three21kins", "corexykins", "rosekins", "rotatekins"), _ROBOTS)}
"""module: why its machine is not imported"""


@dataclass(frozen=True)
class PinReader:
    """Pins of the module by their last name, in units of the machine."""

    read: Callable[[str, float], tuple[float, int, str, str]]
    """(last name, LinuxCNC's default) -> value, line, how it is stated, file"""
    scale: float
    """mm per unit of the INI"""


def put_geometry(draft: Draft, module: str, pins: PinReader) -> None:
    """Structure, lines of rotary axes and legs that a module's pins give."""
    if module.endswith("-trt-kins"):
        _tables(draft, module, pins)
    elif module == "5axiskins":
        _head(draft, pins)
    elif module == "lineardeltakins":
        _delta(draft, pins)


def _tables(draft: Draft, module: str, pins: PinReader) -> None:
    """C carries the part, the tilting axis carries C; both turn against ISO 841 (trtfuncs.c, 2.9)."""
    letter, offset, at = ("A", "y-offset", 1) if module == "xyzac-trt-kins" else ("B", "x-offset", 0)
    points = [pins.read(f"{axis}-rot-point", 0.0) for axis in "xyz"]
    across, up = pins.read(offset, 0.0), pins.read("z-offset", 0.0)
    centre = [value * pins.scale for value, *_ in points]
    tilted = list(centre)
    tilted[at] += across[0] * pins.scale
    tilted[2] += up[0] * pins.scale
    _structure(draft, f"w C' {letter}' b X Y Z (C1) t", module)
    _put(draft, ("C", "point"), centre, points)
    _put(draft, (letter, "point"), tilted, [*points, across, up])
    draft.made(("kinematics", "axes", letter, "direction"), [-1.0, 0.0, 0.0] if letter == "A" else [0.0, -1.0, 0.0], module)
    draft.made(("kinematics", "axes", "C", "direction"), [0.0, 0.0, -1.0], module)


def _head(draft: Draft, pins: PinReader) -> None:
    """C turns the head, B swivels it about a line P above the gauge point, against ISO 841 (5axiskins.c: s2r)."""
    pivot = pins.read("pivot-length", 250.0)
    if pivot[0] < 0.0 and "kinematics.axes.B.point" not in draft.stated:
        draft.error("import.geometry", f"the pivot length of 5axiskins is {pivot[0] * pins.scale:g} mm ({pivot[2]}): the "
                    "head would swivel about a line below the gauge point of the spindle", pivot[1],
                    "it counts up from the gauge point: state it, and the gain on its road, above 0")
    _structure(draft, "w b X Y Z C B (C1) t", "5axiskins")
    _put(draft, ("B", "point"), [0.0, 0.0, pivot[0] * pins.scale], [pivot])
    draft.made(("kinematics", "axes", "B", "direction"), [0.0, -1.0, 0.0], "5axiskins")
    draft.made(("kinematics", "axes", "C", "point"), [0.0, 0.0, 0.0], "5axiskins")


def _delta(draft: Draft, pins: PinReader) -> None:
    """Rods L on slides at R from the middle, at 90, 210 and 330 degrees (lineardeltakins-common.h)."""
    radius, rod = pins.read("R", 130.25), pins.read("L", 269.0)
    draft.made(("kinematics", "kind"), "linear-delta", "lineardeltakins")
    for k, letter in enumerate("XYZ"):
        turn = math.radians(90.0 + 120.0 * k)
        slide = [radius[0] * pins.scale * math.cos(turn) if k else 0.0, radius[0] * pins.scale * math.sin(turn), 0.0]
        path = ("kinematics", "legs", letter)
        draft.put((*path, "slide"), slide, radius[1], radius[2], radius[3])
        draft.made((*path, "direction"), [0.0, 0.0, 1.0], "lineardeltakins")
        draft.put((*path, "rod"), rod[0] * pins.scale, rod[1], rod[2], rod[3])


def _structure(draft: Draft, code: str, module: str) -> None:
    draft.made(("kinematics", "kind"), "serial", module)
    draft.made(("kinematics", "structure"), code, module)


def _put(draft: Draft, key: KeyNames, point: list[float], pins: list[tuple[float, int, str, str]]) -> None:
    said = ", ".join(dict.fromkeys(text for _, _, text, _ in pins))
    line, file = next(((line, file) for _, line, _, file in pins if line), (0, draft.file))
    draft.put(("kinematics", "axes", *key), point, line, said, file)
