"""Output modes of a controller file: tool-centre-point mode and tilted work planes, how they are switched on and off."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from machines.user_model import UserModel
from postproc.controllers.texts import placeholders

LengthState = Literal["any", "off", "on"]
"""whether the length register is in force where a mode begins"""


class Mode(UserModel):
    """How a mode is switched on and off, and what may stand in it."""

    enter: tuple[str, ...]
    """blocks that switch it on"""
    leave: tuple[str, ...]
    """blocks that switch it off"""
    start: tuple[str, ...] = ()
    """blocks of the safe start, in programs that use the mode"""
    lifted: tuple[str, ...] = ()
    """the same, where they stand behind the block that goes home: the length is off there ([tools] home_without_length)"""
    option: str = ""
    """the option of the control that the mode is: a comment likewise, where the machine file does not confirm it"""
    relies_on: tuple[Annotated[str, placeholders("work_offset")], ...] = ()
    """settings of the control that the mode needs: comments in the header of programs that use it; {work_offset}
    is the name of the work offset"""
    length: LengthState = "any"
    """how the length register must stand where the mode is entered, and where its `leave` blocks begin"""
    arcs: bool = True
    """arcs may stand in it while the rotary axes stand still"""
    arc_planes: tuple[Literal[17, 18, 19], ...] = (17, 18, 19)
    """planes of those arcs"""
    cycles: bool = True
    """canned cycles may stand in it"""
    compensation: bool = True
    """cutter compensation may stand in it"""


class TcpMode(Mode):
    """Tool-centre-point mode: X, Y, Z are the tip in the work offset, fixed to the part; F is the speed of the tip."""

    enter: tuple[Annotated[str, placeholders("register", "work_offset")], ...]
    """blocks that switch it on; {register} is the length register in force"""
    leave: tuple[Annotated[str, placeholders("register", "work_offset")], ...]
    """blocks that switch it off"""
    frame: Literal["table", "entry", "either"] = "table"
    """what X, Y, Z are the tip in, where a rotary table stands turned when the mode is switched on: "table",
    the part's frame, turned with the table by its scale; "entry", the frame of the work offset as it lies
    unturned in the machine, which then goes with the table; "either": not known, so that the mode is entered
    with the tables at zero, where both are one, and `verify` proves the program under both"""
    cycles: bool = False
    """canned cycles may stand in it"""
    compensation: bool = False
    """cutter compensation may stand in it"""


class TiltedMode(Mode):
    """Tilted work plane: rotary axes stand still, X, Y, Z are the tip in a turned frame at the work offset's zero."""

    enter: tuple[Annotated[str, placeholders("first", "second", "third", "direction", "work_offset")], ...]
    """blocks that state the plane; {first}, {second}, {third} are the angles in the order of `angles`,
    {direction} is 1, or -1 where the first rotary axis that tilts the tool stands at a negative angle"""
    leave: tuple[Annotated[str, placeholders("work_offset")], ...]
    """blocks that end it"""
    angles: Literal["ZXZ", "ZYX", "XYZ", "rotary"]
    """turns about the axes of the moving frame, in order; "rotary": the frame is that of the rotary axes themselves"""
    decimals: int = Field(default=4, ge=0, le=9)
    """of the angles"""
    turns_axes: bool = True
    """the control may turn rotary axes where the plane is stated, if only by what its angles are rounded by:
    axes whose clamps the program works are free there"""
    by_home: bool = False
    """links that turn rotary axes from or to a plane go by home, where the length is cancelled, unless the set-up says where
    the tool waits ([clearance] index)"""
    tables_only: bool = False
    """only for machines whose rotary axes all carry the part"""


class Modes(UserModel):
    """Output modes next to machine coordinates."""

    tcp: TcpMode | None = None
    """tool-centre-point mode"""
    tilted: TiltedMode | None = None
    """tilted work plane"""
