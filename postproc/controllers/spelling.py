"""Keys of a controller file that say how blocks are spelt: numbers, comments, the program's frame, codes, tools."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import Field

from machines.hooks import PASSIVE, PassiveWord
from machines.user_model import UserModel
from postproc.controllers.texts import (
    EMC_OFFSETS,
    WORK_OFFSETS,
    AlignmentText,
    DwellText,
    Named,
    Numbered,
    Registered,
    WorkOffsets,
    placeholders,
)


class Format(UserModel):
    """How numbers and blocks are spelt."""

    units: Literal["mm", "inch"] = "mm"
    """of lengths and feeds where the set-up states none ([output] units)"""
    linear_decimals: int = Field(default=4, ge=0, le=9)
    """of X, Y, Z and other lengths, mm"""
    rotary_decimals: int = Field(default=4, ge=0, le=9)
    """of A, B, C, degrees"""
    feed_decimals: int = Field(default=4, ge=0, le=9)
    """of F in mm/min"""
    small_feed_decimals: int = Field(default=2, ge=0, le=6)
    """how many more where F is below 1"""
    speed_decimals: int = Field(default=6, ge=0, le=6)
    """of S"""
    trim_zeros: bool = True
    """no zeros at the end of a decimal fraction"""
    decimal_point: bool = False
    """a point even in whole numbers"""
    space: bool = True
    """a blank between words"""
    line_length: int = Field(default=252, ge=40)
    """most characters of a block"""
    sequence_step: int = Field(default=0, ge=0)
    """block numbers: step, 0 for none"""
    sequence_prefix: str = Field(default="N", pattern=r"^[N:]?$")
    """letter before a block number"""
    plus_sign: bool = False
    """a sign before positive numbers too"""


class Units(UserModel):
    """The words that say whether lengths are mm or inches; {units} in `program.begin` and `preamble` is the one in force."""

    mm: str = Field(default="G21", min_length=1)
    """lengths and feeds in mm"""
    inch: str = Field(default="G20", min_length=1)
    """lengths and feeds in inches"""
    others: dict[str, Literal["mm", "inch"]] = Field(default_factory=dict)
    """further words of the control that state units"""


class InchFormat(UserModel):
    """What is different in a program in inches."""

    linear_decimals: int = Field(default=5, ge=0, le=9)
    """of X, Y, Z and other lengths, inches"""
    feed_decimals: int = Field(default=4, ge=0, le=9)
    """of F; two more below 1"""
    feed_parts: float = Field(default=1.0, gt=0.0)
    """what an inch per minute is in units of F: 10 where F counts tenths of it. Never of degrees per minute"""
    degree: Literal["mm", "inch"] = "inch"
    """what a degree counts as where a feed per minute refers to all axes"""
    relies_on: tuple[str, ...] = ()
    """settings of the control that a program in inches needs: comments in its header"""


class Comment(UserModel):
    """Comments of a block."""

    open: str = "("
    """what begins a comment"""
    close: str = ")"
    """what ends it"""
    forbidden: str = "()"
    """characters that a comment must not hold"""


class FurtherOffsets(UserModel):
    """Work offsets beyond the nine, by number."""

    block: Numbered
    """the block that puts one in force; {number}"""
    first: int = Field(default=1, ge=0)
    """the least number"""
    last: int = Field(ge=1)
    """the greatest"""
    needs: Annotated[str, placeholders("name")] = ""
    """what the control must have for it: a comment in the header of programs with one; {name} is its name"""


CarriedOutName = Annotated[str, Field(pattern=r"^[GM][0-9]+(\.[0-9]+)?-[GM][0-9]+(\.[0-9]+)?$|^[A-Z]$|" + PASSIVE)]


class ProgramBlocks(UserModel):
    """Blocks that stand around every program."""

    begin: tuple[Named, ...] = ("%",)
    """{name} is the program's name, {number} its number in four digits, {units} the word of its units"""
    number: int = Field(default=1, ge=1, le=9999)
    """of the program, where the controller has numbers"""
    suffix: Annotated[str, Field(pattern=r"^\.[A-Za-z0-9]+$")] = ".nc"
    """usual ending of the name of a program's file: what `batch` names programs by"""
    stock: tuple[Annotated[str, placeholders("x0", "y0", "z0", "x1", "y1", "z1")], ...] = ()
    """blocks behind `begin` that state the stock for the control's graphics, that of the set-up ([rewind.stock]), else the
    extents of the cuts: its least and greatest X, Y, Z, at all places, mm in the first work offset, rotary axes at 0"""
    preamble: tuple[Annotated[str, placeholders("work_offset", "units")], ...] = ()
    """safe start: units, modes and planes that the program relies on; {work_offset} is the
    set-up's code, {units} states mm or inches"""
    work_offsets: WorkOffsets = Field(default_factory=dict)
    """what the controller writes for each of G54 to G59, and for further codes that it has ("G110"); empty: for those and
    G59.1 to G59.3 the codes themselves"""
    more_offsets: dict[Numbered, FurtherOffsets] = Field(default_factory=dict)
    """further work offsets by the name that a set-up states for one, with {number}"""
    operation: tuple[Annotated[str, placeholders("comment", "name", "number")], ...] = ()
    """blocks at the start of each operation, from where a program can be taken up: {name} of the operation,
    {comment} with it, {number} 100, 200, ..."""
    passive: tuple[PassiveWord, ...] = ()
    """codes of the shop's own blocks that move nothing and change no state, or the words that such a
    statement begins with ("CYCLE977", "TCH PROBE"): read back without being executed"""
    carried_out: tuple[CarriedOutName, ...] = ("G0-G64.9", "G66-G199", "M0-M9", "M13-M14", "M29-M30",
                                               "M98-M99", "L")
    """what the control itself carries out, so that it never is passive: G and M numbers ("G52"), stretches of
    them ("G0-G64.9"), and the first words of statements ("TRANS", "CYCL DEF"), next to what the read-back knows"""
    path_tolerance: tuple[Annotated[str, placeholders("tolerance", "chain", "axis")], ...] = ()
    """blocks that set the control's own smoothing; {tolerance} and {chain} in mm, {axis} in degrees"""
    path_tolerance_off: tuple[str, ...] = ()
    """blocks that end it, before those of `ending`"""
    exact_path: tuple[str, ...] = ()
    """blocks that stand in the place of `path_tolerance` where the machine file says that the control has no smoothing"""
    smoothing_option: str = ""
    """the option that `path_tolerance` needs: a comment in the header, where the machine file does not confirm it"""
    without_smoothing: str = ""
    """what programs rely on without it: a comment in the header"""
    relies_on_turns: Annotated[str, placeholders("axes")] = ""
    """setting of the control that rotary words of 360 degrees and more need: a comment in the header of
    programs with such; {axes} are their letters"""
    ending: tuple[str, ...] = ("M30",)
    """blocks that end every program"""
    end: tuple[Named, ...] = ("%",)
    """{name} and {number} as in `begin`"""

    def offset_block(self, code: str) -> str | None:
        """The block of a work offset as the set-up names it; None where the control has none of that name."""
        if code in (self.work_offsets or (*WORK_OFFSETS, *EMC_OFFSETS)):
            return self.work_offsets.get(code, code)
        for name, more in self.more_offsets.items():
            head, tail = name.split("{number}")
            match = re.fullmatch(rf"{re.escape(head)}([1-9][0-9]*|0){re.escape(tail)}", code)
            if match and more.first <= int(match[1]) <= more.last:
                return more.block.format(number=match[1])
        return None

    def offset_needs(self, code: str) -> str:
        """What the control must have for a further work offset, "" for nothing."""
        found = (more for name, more in self.more_offsets.items() if code.startswith(name.split("{number}")[0]))
        more = None if code in self.work_offsets else next(found, None)
        return more.needs.format(name=code) if more is not None else ""

    @property
    def offsets_named(self) -> str:
        """All names of work offsets that a set-up may state."""
        own = [code for code in self.work_offsets or EMC_OFFSETS if code not in WORK_OFFSETS]
        run = len(own) > 1 and len(own) == round(10 ** ("." in own[0]) * (float(own[-1][1:]) - float(own[0][1:]))) + 1
        more = [f"{n.format(number=o.first)} to {n.format(number=o.last)}" for n, o in self.more_offsets.items()]
        return ", ".join(["G54 to G59", *([f"{own[0]} to {own[-1]}"] if run else own), *more])

    def offset_text(self, code: str) -> str:
        """The block that switches a work offset on, as the set-up names it where the control has none such."""
        return self.offset_block(code) or code

    def offset_name(self, code: str) -> str:
        """A work offset of the set-up as the control names it; of a parameter with a name, that name and its number."""
        text = self.offset_text(code)
        named = re.search(r"=\+?(\d+) *;(.+)$", text)
        return f"{named[2].strip().lower()} {named[1]}" if named else text


class SmoothingLevel(UserModel):
    """The control's own smoothing of one kind of operation, as roughing or finishing."""

    blocks: tuple[Annotated[str, placeholders("tolerance", "chain", "axis")], ...]
    """blocks that set it; as `program.path_tolerance`"""
    tolerance: float | None = Field(default=None, ge=0.0)
    """mm that it may take, where parameters of the control say so: the last of `blocks` stands for that when it is read"""
    share: float | None = Field(default=None, ge=0.0, le=0.8)
    """share of the tolerance that it may take, where its blocks state it; default: as `kinematics.smoothing_share`"""


Switch = Annotated[str, Field(pattern=r"^(M[0-9]+)?$")]
"""an M code, which is read back too, or none"""


class Codes(UserModel):
    """G and M codes by canonical function."""

    traverse: str = "G0"
    """rapid"""
    feed: str = "G1"
    """straight line at feed"""
    arc_cw: str = "G2"
    """arc clockwise"""
    arc_ccw: str = "G3"
    """arc anti-clockwise"""
    planes: dict[str, str] = Field(default_factory=lambda: {"17": "G17", "18": "G18", "19": "G19"})
    """of arcs, by 17, 18, 19"""
    per_minute: str = "G94"
    """feed per minute"""
    inverse_time: str = "G93"
    """feed by inverse time"""
    machine_coordinates: str = "G53"
    """block in machine coordinates"""
    spindle_cw: str = "M3"
    """spindle clockwise"""
    spindle_ccw: str = "M4"
    """spindle anti-clockwise"""
    spindle_stop: str = "M5"
    """spindle off"""
    flood: str = "M8"
    """coolant"""
    mist: str = "M7"
    """coolant as mist; empty: the controller has none, flood is used with a warning"""
    through: Switch = ""
    """coolant through the tool; empty: the controller has none, flood is used with a warning"""
    through_off: Switch = ""
    """ends it; empty: coolant_off does"""
    air: Switch = ""
    """air blast; empty: the controller has none, mist is used with a warning"""
    air_off: Switch = ""
    """ends it; empty: coolant_off does"""
    coolant_off: str = "M9"
    """coolant off, but for what has a code of its own for that"""
    stop: str = "M0"
    """stop"""
    optional_stop: str = "M1"
    """stop where the operator's switch says so"""
    tool_select: Numbered = "T{number}"
    """the tool of the next change is made ready"""
    tool_change: Numbered = "T{number} M6"
    """tool change, a block a line"""
    tool_by_name: Annotated[str, placeholders("name")] = ""
    """what stands in the place of {number} for tools that the control knows by name, with the blank or letter before it:
    '"{name}"' behind TOOL CALL, '="{name}"' behind T; empty: the control knows numbers alone"""
    length_offset: Registered = "G43 H{register}"
    """length register in force; empty: the controller has none"""
    length_cancel: str = "G49"
    """length register off"""
    dwell: DwellText = "G4 P{seconds}"
    """a dwell, a block a line"""
    rigid_tap: Annotated[str, placeholders("speed")] = ""
    """block before a tapping cycle that couples feed and spindle"""
    compensation_left: Registered = "G41 D{register}"
    """cutter compensation, cutter left of the path"""
    compensation_right: Registered = "G42 D{register}"
    """cutter right of the path"""
    compensation_off: str = "G40"
    """cutter compensation off"""


TOOL_NAME = r"^[A-Za-z0-9_.-]{1,31}$"
"""names of tools that all controls with names take"""


class Tools(UserModel):
    """Tool change, length register and preload."""

    preload: bool = False
    """the next tool is selected right after a change"""
    length_with_z: bool = False
    """the length register stands in the first block that states Z, not in a block of its own"""
    length_automatic: bool = False
    """a tool change puts the tool's length in force by itself; with an empty `length_cancel` it cannot be taken back"""
    names: dict[int, Annotated[str, Field(pattern=TOOL_NAME)]] = Field(default_factory=dict)
    """by number: the name by which the control calls a tool; [tools.N] called of the set-up goes before it"""
    home_without_length: bool = False
    """blocks in machine coordinates switch the length register off"""
    length_alone: str = ""
    """a setting that programs need in which the length register changes in a block that states no height: a comment in
    the header, and `verify` asks for it; empty: such a block moves nothing"""
    cutting_edges: bool = False
    """a tool has cutting edges D1 to D9, so that a register 2 to 9 of the CL file may be one: refused"""


class SubprogramFormat(UserModel):
    """Operations as subprograms; their numbers are 1001, 1002, ..., {name} is the program's."""

    call: Named = ""
    """block that calls one; empty: none are written"""
    begin: tuple[Named, ...] = ()
    """blocks that begin one"""
    end: tuple[Named, ...] = ()
    """blocks that end one"""
    place: Literal["before", "after", "files"] = "after"
    """before the main program's first block, behind its end, or each in a file of its own next to the program"""
    file: Named = "{name}_{number}"
    """name of such a file"""


class PartAlignment(UserModel):
    """What the control can do by itself about a part that is not where it was meant (`postproc setup align`)."""

    turns: Literal["space", "plane", "none"] = "none"
    """by which turns its work offset can be turned: in space, about Z alone, or not at all"""
    corrects: tuple[Literal["tcp", "tilted"], ...] = ()
    """output modes in which it turns the rotary axes with the part; elsewhere only the frame is turned"""
    entry: tuple[AlignmentText, ...] = ()
    """lines for the operator: {x}, {y}, {z} the work offset in machine coordinates, {dx}, {dy}, {dz} by how much its origin
    has gone, {a}, {b}, {c} degrees about the fixed X, then Y, then Z; {offset} and {number}: its name, 1 for G54"""
