"""Records without motion as canonical commands at their places among the blocks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from postproc.controllers.model import ControllerFile, Modes
from postproc.events import (
    Spindle,
    ToolChange,
    compensation_side,
    numbers,
    register_changes,
    spindle_after,
    tool_changes,
    words,
)
from postproc.moves import Moves, Phase
from postproc.path import Path
from postproc.program import Command
from toolpaths.arrays import Bools
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.toolpath import Event, Kind, Toolpath
from toolpaths.units import PER_MINUTE

Commands = dict[int, tuple[Command, ...]]
QUIET = frozenset({"GOHOME", "END", "SEQNO", "MODE", "ROTATE", "ROTABL", "ROTHED", "REWIND", "AIR"})
"""Events that need no command: the motion already holds what they say."""


def commands_of(toolpath: Toolpath, moves: Moves, path: Path, controller: ControllerFile,
                native: Bools) -> tuple[Commands, list[Diagnostic]]:
    """Commands by block, and what could not be carried out."""
    result: dict[int, list[Command]] = {}
    first_move = np.searchsorted(moves.row, np.arange(len(toolpath) + 1))
    changes = {(c.index, c.line): c for c in tool_changes(toolpath)}
    registers = {(c.index, c.line): c for c in register_changes(toolpath)}
    spindle, state = Spindle(), _Written()
    compensation = _Compensation(moves, path, result, controller.modes)
    lost: dict[str, list[int]] = {}
    for at, event in enumerate(toolpath.events):
        move = int(first_move[event.index])
        compensation.off_before(move)
        here = moves.link[move] if move < len(moves) else True
        waits = event.word == "DELAY" and here and not _gone(toolpath.events, at)
        out = result.setdefault(_behind(path, move) if waits else int(path.begin[move]), [])
        loads = any(e.word == "LOADTL" and (e.index, e.line) in changes and e.index == event.index
                    for e in toolpath.events[at + 1:at + 20])
        key = event.index, event.line
        if event.word == "SPINDL":
            spindle = spindle_after(event, spindle)
            out += state.spindle(_spindle(spindle, event), loads)
        elif event.word == "COOLNT":
            out += state.coolant(Command(_coolant(words(event), controller), (), event.line), loads)
        elif event.word == "CUTCOM":
            compensation.begin(event, move)
        elif event.word == "LOADTL":
            if key in changes:
                follows = {e.word for e in toolpath.events[at + 1:at + 20] if e.index == event.index}
                out += compensation.off() + state.change(changes[key], follows, move < len(moves))
            elif key in registers:
                out.append(Command("USE_TOOL_LENGTH_OFFSET", (float(registers[key].register or 0),), event.line))
        elif command := _simple(event, spindle):
            out.append(command)
        elif event.word not in QUIET:
            lost.setdefault(event.word, []).append(event.line)
    compensation.off_before(len(moves))
    result.setdefault(len(path), []).extend(compensation.off())
    diagnostics = [warning("event.not_carried_out", f"{word} is not carried out", file=toolpath.file, lines=lines[:6],
                           count=len(lines)) for word, lines in lost.items()]
    diagnostics += compensation.diagnostics(toolpath.file)
    for k in _dwells(toolpath, moves, path, native):
        result.setdefault(k[0], []).insert(0, k[1])
    return {k: tuple(v) for k, v in result.items() if v}, diagnostics + _no_spindle(toolpath, moves)


def _gone(events: tuple[Event, ...], at: int) -> bool:
    """True where a record of the same place, before this one, sends the tool away already."""
    return any(e.index == events[at].index and e.word in ("LOADTL", "GOHOME") for e in events[max(at - 20, 0):at])


def _behind(path: Path, move: int) -> int:
    """The block behind the last of the move before `move`: a dwell belongs there, not behind the retract."""
    last = np.flatnonzero((path.move == move - 1) & np.isfinite(path.u))
    return int(last[-1]) + 1 if len(last) else int(path.begin[min(move, len(path.begin) - 1)])


class _Written:
    """Spindle and coolant as the commands so far leave them: stated only where they change."""

    def __init__(self) -> None:
        self.turning: Command | None = None
        self.cooling: Command | None = None
        self.waiting: dict[str, Command] = {}
        """what a tool change that comes first will switch on"""

    def spindle(self, wanted: Command, loads: bool = False) -> list[Command]:
        """The command where it changes something; a start waits for the tool change that `loads`."""
        if loads and wanted.name != _STOPPED:
            self.waiting["spindle"] = wanted
            return []
        if self.turning is not None and (self.turning.name, self.turning.args) == (wanted.name, wanted.args):
            return []
        self.turning = wanted
        return [wanted]

    def coolant(self, wanted: Command, loads: bool = False) -> list[Command]:
        """The command where it changes something; a start waits for the tool change that `loads`."""
        if loads and wanted.name != _DRY:
            self.waiting["coolant"] = wanted
            return []
        if self.cooling is not None and self.cooling.name == wanted.name:
            return []
        self.cooling = wanted
        return [wanted]

    def change(self, change: ToolChange, follows: set[str], moves_on: bool) -> list[Command]:
        """A tool change with spindle and coolant off, and on again where no record that `follows` says otherwise.

        Nothing is switched on, and no length taken, where no motion follows.
        """
        out: list[Command] = []
        if self.turning is not None and self.turning.name != _STOPPED:
            out.append(Command(_STOPPED))
        if self.cooling is not None and self.cooling.name != _DRY:
            out.append(Command(_DRY))
        before = self.waiting.pop("spindle", self.turning)
        cooled = self.waiting.pop("coolant", self.cooling)
        register = change.register if change.register is not None else change.number
        out.append(Command("CHANGE_TOOL", (float(change.number),), change.line))
        if not moves_on:
            self.turning, self.cooling = Command(_STOPPED), Command(_DRY)
            return out
        out.append(Command("USE_TOOL_LENGTH_OFFSET", (float(register),), change.line))
        if before is not None:
            self.turning = Command(_STOPPED)
            out += [] if "SPINDL" in follows else self.spindle(replace(before, line=change.line))
        if cooled is not None:
            self.cooling = Command(_DRY)
            out += [] if "COOLNT" in follows else self.coolant(replace(cooled, line=change.line))
        return out


_STOPPED, _DRY = "STOP_SPINDLE_TURNING", "COOLANT_OFF"


def _spindle(state: Spindle, event: Event) -> Command:
    if state.direction == 0:
        return Command("STOP_SPINDLE_TURNING", (), event.line)
    name = "START_SPINDLE_CLOCKWISE" if state.direction > 0 else "START_SPINDLE_COUNTERCLOCKWISE"
    return Command(name, () if math.isnan(state.rpm) else (state.rpm,), event.line)


def _simple(event: Event, spindle: Spindle) -> Command | None:
    """Commands of events that stand for themselves."""
    said, values = words(event), numbers(event)
    if event.word == "DELAY" and values:
        seconds = values[0] / (spindle.rpm * PER_MINUTE) if "REV" in said else values[0]
        return Command("DWELL", (seconds,), event.line)
    if event.word in ("STOP", "OPSTOP"):
        return Command("PROGRAM_STOP" if event.word == "STOP" else "OPTIONAL_PROGRAM_STOP", (), event.line)
    if event.word == "PPRINT":
        return Command("COMMENT", (" ".join(str(v) for v in event.values),), event.line)
    if event.word == "INSERT":
        return Command("INSERT", (" ".join(str(v) for v in event.values),), event.line)
    if event.word == "SELECT" and values:
        return Command("SELECT_TOOL", (values[0],), event.line)
    return None


class _Compensation:
    """CUTCOM as the control's cutter compensation: stated when it changes, off before linking moves, holes, tool changes.

    The points are written as the file has them; what the control adds depends on its register.
    """

    def __init__(self, moves: Moves, path: Path, commands: dict[int, list[Command]], modes: Modes) -> None:
        self.moves, self.path, self.out = moves, path, commands
        self.active, self.since = "", 0
        self.written: list[int] = []
        self.tilted: list[int] = []
        self.left_on: list[int] = []
        self.own = np.isnan(path.u) | (moves.hole[path.move] >= 0)
        """(K,) blocks that compensation must not touch"""
        self.breaks = np.flatnonzero(self.own & ~np.concatenate([[False], self.own[:-1]]))
        tcp, tilted = modes.tcp, modes.tilted
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
        if side in ("", self.active) or (side == "OFF" and not self.active):
            return
        self.out.setdefault(block, []).extend(self.off(event.line))
        if side == "OFF":
            return
        block += int(np.argmin(np.append(self.own[block:], False)))
        if move >= len(self.moves) or not self._possible(min(block, len(self.path) - 1), move):
            self.tilted.append(event.line)
            return
        self.active, self.since = side, block
        self.written.append(event.line)
        command = Command(f"CUTTER_COMPENSATION_{side}", tuple(numbers(event)[:1]), event.line)
        self.out.setdefault(block, []).append(command)

    def _possible(self, block: int, move: int) -> bool:
        """True where the control can compensate square to the tool: in a tilted plane, or with the tool along Z."""
        law = self.path.frames[int(self.path.frame[block])].control.law
        if law == "tilted":
            return self.in_plane
        return (law == "axes" or self.in_tcp) and bool(abs(self.moves.axis[move, 2]) > 1.0 - 1e-9)

    def off(self, line: int = 0) -> list[Command]:
        """The command that ends it, where it is on."""
        if not self.active:
            return []
        self.active = ""
        return [Command("CUTTER_COMPENSATION_OFF", (), line)]

    def diagnostics(self, file: str) -> list[Diagnostic]:
        """What the operator has to know, and records that could not be carried out."""
        result = []
        if self.written:
            result.append(warning("cutcom.register", "cutter compensation is written and proved as the programmed contour: "
                                  "the control adds what its register holds", file=file, lines=self.written[:6],
                                  count=len(self.written), hint="points of the tool centre: the register holds the wear "
                                  "only; points of the contour: the radius"))
        if self.left_on:
            result.append(error("cutcom.left_on", "cutting goes on under CUTCOM after a linking move or a hole, which need "
                                "it off", file=file, lines=self.left_on[:6], count=len(self.left_on),
                                hint="write CUTCOM/OFF before the retract and CUTCOM/LEFT or RIGHT after the approach"))
        if self.tilted:
            result.append(warning("cutcom.tilted", "CUTCOM while the tool axis is tilted is not carried out", file=file,
                                  lines=self.tilted[:6], count=len(self.tilted),
                                  hint="it needs a tilted plane (--output-mode tilted, where the controller has it)"))
        return result


def _coolant(said: list[str], controller: ControllerFile) -> str:
    if "OFF" in said:
        return "COOLANT_OFF"
    if "MIST" in said or "AIR" in said:
        return "MIST_ON"
    return "THROUGH_ON" if "THRU" in said and controller.codes.through else "FLOOD_ON"


def _dwells(toolpath: Toolpath, moves: Moves, path: Path, native: Bools) -> list[tuple[int, Command]]:
    """Dwell at the bottom of holes that are written as single moves."""
    result = []
    for m in np.flatnonzero(moves.phase == Phase.DRILL):
        cycle = toolpath.cycles[int(moves.cycle[m])]
        block = int(path.begin[m])
        if cycle.dwell > 0.0 and not native[min(block, len(native) - 1)]:
            result.append((int(path.begin[m + 1]), Command("DWELL", (cycle.dwell,), int(moves.line[m]))))
    return result


def _no_spindle(toolpath: Toolpath, moves: Moves) -> list[Diagnostic]:
    """Cutting while no record has started the spindle."""
    started = [e.index for e in toolpath.events if e.word == "SPINDL" and "OFF" not in words(e)]
    cutting = np.flatnonzero((moves.kind != Kind.RAPID) & (moves.row < (min(started) if started else len(toolpath))))
    if not len(cutting):
        return []
    return [warning("spindle.not_started", "cutting before any record starts the spindle", file=toolpath.file,
                    lines=[int(moves.line[cutting[0]])], count=1, hint="state SPINDL/RPM,n,CLW in the CAM system")]
