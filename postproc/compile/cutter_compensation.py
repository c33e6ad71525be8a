"""CUTCOM as the control's own cutter compensation."""

from __future__ import annotations

from typing import Literal

import numpy as np

from postproc.compile.program import Command, CommandName
from postproc.controllers.model import ControllerFile
from postproc.path.model import TRAVERSE, JointPath
from postproc.reference.cutcom_of_tools import CutcomOfTool
from postproc.reference.events import CompensationSide, compensation_side, numbers
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Ints, distinct
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.toolpath import Event, Kind

UPRIGHT = 1.0 - 1e-9
"""cosine of the lean below which the tool stands along Z"""
STILL = 1e-9
"""rad that a rotary axis may differ by and still stand"""
STARTS = ("CUTTER_COMPENSATION_LEFT", "CUTTER_COMPENSATION_RIGHT")

_SWITCH: dict[CompensationSide, CommandName] = {
    "LEFT": "CUTTER_COMPENSATION_LEFT", "RIGHT": "CUTTER_COMPENSATION_RIGHT", "OFF": "CUTTER_COMPENSATION_OFF"}


class RadiusCompensation:
    """CUTCOM as the control's cutter compensation: stated when it changes, off before linking moves, holes, tool changes.

    The points are written as the file has them; what the control adds depends on its register. It adds it in
    the plane of the words (Fanuc B-63944EN-2, cutter compensation: in the plane that G17 to G19 select), so
    that plane must be square
    to the tool all the while: a tilted plane, or the tool along Z and no rotary axis turning. Where D is modal and CUTCOM
    names none, that of the tool's length register is written: `registers` (N,) by row of the Toolpath, -1 for none.
    What the registers hold is said of `tools` by the set-up, else warned of.
    """

    def __init__(self, moves: Moves, path: JointPath, commands: dict[int, list[Command]], controller: ControllerFile,
                 registers: Ints, tools: tuple[CutcomOfTool, ...] = ()) -> None:
        self.moves, self.path, self.out = moves, path, commands
        self.modal, self.registers = controller.cutter_compensation.modal_register, registers
        self.stated = {line for tool in tools if tool.stated for line in tool.lines}
        self.without_tool: list[int] = []
        self.chosen: dict[int, list[int]] = {}
        """lines by register that is written though CUTCOM names none"""
        self.active: CompensationSide | Literal[""] = ""
        self.since = 0
        self.written: list[int] = []
        self.tilted: list[int] = []
        self.lacking: list[int] = []
        self.left_on: list[int] = []
        self.own = np.isnan(path.u) | (moves.hole[path.move] >= 0)
        """(K,) blocks that compensation must not touch"""
        self.breaks = np.flatnonzero(self.own & ~np.concatenate([[False], self.own[:-1]]))
        tcp, tilted = controller.modes.tcp, controller.modes.tilted
        self.in_tcp = path.frames[0].control.tip_law or (tcp is not None and tcp.compensation)
        self.in_plane = tilted is not None and tilted.compensation
        self.cut = np.append(np.flatnonzero((moves.kind != Kind.RAPID) & (moves.hole < 0)), len(moves))

    def off_before(self, move: int) -> None:
        """Switch off at the first break before a row of Moves; cutting between the two is not compensated."""
        if not self.active:
            return
        at = int(np.searchsorted(self.breaks, self.since))
        if at == len(self.breaks) or self.breaks[at] > self.path.begin[move]:
            return
        block = int(self.breaks[at])
        self.out.setdefault(block, []).extend(self.off())
        served = block > 0 and self.path.move[block - 1] == self.path.move[block]
        row = int(self.path.move[block]) + int(served)
        after = int(self.cut[np.searchsorted(self.cut, row)])
        if after < move:
            self.left_on.append(int(self.moves.line[after]))

    def begin(self, event: Event, move: int) -> None:
        """Carry one CUTCOM record out that acts before a row of Moves, or behind the linking move that leads there."""
        side, block = compensation_side(event), int(self.path.begin[move])
        if not side or side == self.active or (side == "OFF" and not self.active):
            return
        self.out.setdefault(block, []).extend(self.off(event.line))
        if side == "OFF":
            return
        block += int(np.argmin(np.append(self.own[block:], False)))
        if move >= len(self.moves) or not self._possible(min(block, len(self.path) - 1), move):
            upright = move < len(self.moves) and self.moves.axis[move, 2] > UPRIGHT
            (self.lacking if upright else self.tilted).append(event.line)
            return
        self.active, self.since = side, block
        self.written.append(event.line)
        command = Command(_SWITCH[side], self._register(event, move), event.line)
        self.out.setdefault(block, []).append(command)

    def _register(self, event: Event, move: int) -> tuple[float, ...]:
        """The register that CUTCOM names, else where D is modal that of the tool; none where the control takes its own."""
        named = tuple(numbers(event)[:1])
        if named or not self.modal:
            return named
        register = int(self.registers[self.moves.row[move]])
        if register < 1:
            self.without_tool.append(event.line)
            return ()
        self.chosen.setdefault(register, []).append(event.line)
        return (float(register),)

    def _possible(self, block: int, move: int) -> bool:
        """True where the control can compensate square to the tool: in a tilted plane, or with the tool along Z."""
        law = self.path.frames[int(self.path.frame[block])].control.law
        if law == "tilted":
            return self.in_plane
        return (law == "axes" or self.in_tcp) and bool(abs(self.moves.axis[move, 2]) > UPRIGHT)

    def off(self, line: int = 0) -> list[Command]:
        """The command that ends it, where it is on."""
        if not self.active:
            return []
        self.active = ""
        return [Command("CUTTER_COMPENSATION_OFF", (), line)]

    def diagnostics(self, file: str) -> list[Diagnostic]:
        """What the operator has to know, and records that could not be carried out."""
        result = []
        if unsaid := [line for line in self.written if line not in self.stated]:
            result.append(warning("cutcom.register", "cutter compensation is written and proved as programmed, for CL "
                                  "points of the tool's centre: the control adds what its register holds, which is "
                                  "the wear only" + self._chosen(), file=file, lines=unsaid[:6], count=len(unsaid),
                                  hint='say so in the set-up: [tools.N] compensation = "wear" (or "none": CUTCOM is not '
                                  "written), or contour = true where the CAM system writes the contour and the register "
                                  "holds the radius" + ("; where lengths and radii share one table, name another register "
                                                        "in CUTCOM" if self.chosen else "")))
        if self.without_tool:
            result.append(error("tool.missing", "CUTCOM names no register, and the file has loaded no tool of a number "
                                "above 0 whose register could be taken: D holds until another is stated", file=file,
                                lines=self.without_tool[:6], count=len(self.without_tool),
                                hint="write LOADTL before it, or the register: CUTCOM/LEFT,1"))
        if self.left_on:
            result.append(error("cutcom.left_on", "cutting goes on under CUTCOM after a linking move or a hole, which need "
                                "it off", file=file, lines=self.left_on[:6], count=len(self.left_on),
                                hint="write CUTCOM/OFF before the retract and CUTCOM/LEFT or RIGHT after the approach"))
        if self.lacking:
            result.append(error("cutcom.mode", "CUTCOM in an output mode in which the controller has no cutter compensation",
                                file=file, lines=self.lacking[:6], count=len(self.lacking),
                                hint="write the operation in machine coordinates or in a tilted plane (--output-mode)"))
        for code, lines, what in (("cutcom.tilted", self.tilted, "CUTCOM while the tool is tilted"),
                                  ("cutcom.turning", self.turning(), "the tool turns or leans while CUTCOM is on")):
            if lines:
                result.append(error(code, f"{what}: the control would shift the path in the plane of the axis words, not "
                                    "square to the tool", file=file, lines=lines[:6], count=len(lines),
                                    hint="write the operation in a tilted plane (--output-mode tilted, where the controller "
                                    "has it), or [tools.N] compensation = \"none\" in the set-up: the path of the "
                                    "tool's centre is written uncompensated"))
        return result

    def _chosen(self) -> str:
        """Which registers are written where CUTCOM names none."""
        if not self.chosen:
            return ""
        names = ", ".join(f"D{register}" for register in sorted(self.chosen))
        return f"; where CUTCOM names none that is {names}, by the number of the tool's length register"

    def turning(self) -> list[int]:
        """Lines of cuts under compensation that lean off Z, or turn rotary axes between machine coordinates."""
        path, moves = self.path, self.moves
        laws = np.array([frame.control.law for frame in path.frames])[path.frame]
        leans = (np.abs(moves.axis[path.move, 2]) <= UPRIGHT) & (laws != "tilted")
        rotary = path.frames[0].control.rotary
        turns = np.zeros(len(path), dtype=bool)
        turns[1:] = (np.abs(np.diff(path.q[:, rotary], axis=0)) > STILL).any(axis=1) & (laws[1:] == "axes")
        bad = self._compensated() & (path.code != TRAVERSE) & (leans | turns)
        return [int(line) for line in distinct(moves.line[path.move[bad]])]

    def _compensated(self) -> Bools:
        """(K,) blocks between a command that begins compensation and the one that ends it."""
        result, begun = np.zeros(len(self.path), dtype=bool), -1
        for block, group in sorted(self.out.items()):
            for command in group:
                if begun >= 0 and command.name.startswith("CUTTER_COMPENSATION"):
                    result[begun:block], begun = True, -1
                if command.name.startswith(STARTS):
                    begun = block
        result[begun if begun >= 0 else len(result):] = True
        return result
