"""Records without motion as canonical commands at their places among the blocks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from postproc.compile.cutter_compensation import RadiusCompensation
from postproc.compile.needless_pairs import needless_pairs
from postproc.compile.program import Command, CommandName, Commands
from postproc.compile.spindle_coolant_state import SpindleCoolantState
from postproc.controllers.model import ControllerFile
from postproc.path.model import JointPath
from postproc.reference.coolant import written
from postproc.reference.cutcom_of_tools import CutcomOfTool
from postproc.reference.events import (
    Spindle,
    ToolChange,
    cutting,
    loaded_registers,
    numbers,
    register_changes,
    spindle_after,
    stops_between,
    tool_changes,
    words,
)
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.toolpath import Event, Toolpath
from toolpaths.units import PER_MINUTE

QUIET = frozenset({"GOHOME", "END", "OPSKIP", "SEQNO", "MODE", "ROTATE", "ROTABL", "ROTHED", "REWIND", "AIR"})
"""Events that need no command: the motion already holds what they say."""
_STOPS = frozenset({"STOP", "OPSTOP"})


def commands_of(toolpath: Toolpath, moves: Moves, path: JointPath, controller: ControllerFile, native: Bools,
                restart: bool = False, tool_call: bool = True, stops: bool = False,
                cutcom: tuple[CutcomOfTool, ...] = ()) -> tuple[Commands, list[Diagnostic]]:
    """Commands by block, and what could not be carried out; with `restart` every operation restates its tool;
    without `tool_call` no length register may be left in force by what ran before; with `stops` the program
    stops optionally between tools."""
    writing = _Writing(toolpath, moves, path, controller, restart, stops, cutcom)
    for at, event in enumerate(toolpath.events):
        writing.operations(event)
        writing.event(at, event)
    writing.operations(None)
    result, diagnostics = writing.done()
    if not tool_call:
        _without_length(result, path, controller)
    for k in _dwells(toolpath, moves, path, native):
        result.setdefault(k[0], []).insert(0, k[1])
    return {k: tuple(v) for k, v in result.items() if v}, diagnostics


def operation_starts(toolpath: Toolpath, moves: Moves) -> list[tuple[int, int]]:
    """(move, operation) of the operations that begin with a linking move, in order."""
    operation = toolpath.operation[moves.row]
    begins = np.concatenate([[True], operation[1:] != operation[:-1]]) & moves.link
    return [(int(k), int(operation[k])) for k in np.flatnonzero(begins)]


class _Writing:
    """Goes through the records of a path and puts commands at their blocks."""

    def __init__(self, toolpath: Toolpath, moves: Moves, path: JointPath, controller: ControllerFile, restart: bool,
                 stops: bool, cutcom: tuple[CutcomOfTool, ...]) -> None:
        self.stops = {(c.index, c.line) for c in stops_between(toolpath)} if stops else set[tuple[int, int]]()
        self.toolpath, self.moves, self.path, self.controller, self.restart = toolpath, moves, path, controller, restart
        self.result: dict[int, list[Command]] = {}
        self.first_move = np.searchsorted(moves.row, np.arange(len(toolpath) + 1))
        self.changes = {(c.index, c.line): c for c in tool_changes(toolpath)}
        self.registers = {(c.index, c.line): c for c in register_changes(toolpath)}
        self.at_row: dict[int, list[Event]] = {}
        for event in toolpath.events if restart else ():
            self.at_row.setdefault(event.index, []).append(event)
        self.to_come = [c.number for c in self.changes.values()]
        self.selects = controller.tools.preload and not any(e.word == "SELECT" and numbers(e)[:1] != [0.0]
                                                                for e in toolpath.events)
        self.loaded: ToolChange | None = None
        self.spindle, self.state = Spindle(), SpindleCoolantState()
        self.compensation = RadiusCompensation(moves, path, self.result, controller,
                                               loaded_registers(toolpath), cutcom)
        self.starts = operation_starts(toolpath, moves)
        self.lost: dict[str, list[int]] = {}
        self.skipping = False
        self.cuts = np.flatnonzero(cutting(toolpath))
        renewing = [e.index for e in toolpath.events if e.word in _STOPS or (e.index, e.line) in self.changes]
        self.renewed = np.array([*sorted(renewing), len(toolpath) + 1])
        """rows before which spindle and coolant are stated again in any case"""

    def at(self, block: int) -> list[Command]:
        """The commands before a block."""
        return self.result.setdefault(block, [])

    def operations(self, before: Event | None) -> None:
        """The starts of operations that stand before a record (None: all that are left)."""
        while self.starts:
            move, operation = self.starts[0]
            named = self.toolpath.operations[operation]
            first = move if before is None else int(self.first_move[before.index])
            if before is not None and (move > first or (
                    move == first and not self._within(before, named.line, int(self.moves.row[move])))):
                return
            self.starts.pop(0)
            self.compensation.off_before(move)
            name = named.name or f"OPERATION {operation + 1}"
            args = (name, 1.0) if self.restart else (name,)
            self.at(self._label(move)).append(Command("OPERATION_START", args, named.line))
            if self.restart and self.loaded is not None:
                self._restate(self.loaded, self.at(int(self.path.begin[move])), move, named.line)

    def _within(self, event: Event, line: int, row: int) -> bool:
        """True for a record before a row that belongs to the operation from a line on: where the path stands at several
        places, the last records of the place before have lines behind that of the row."""
        return line <= event.line <= int(self.toolpath.line[row])

    def _label(self, move: int) -> int:
        """The block that an operation begins with: the travel home, where it leads there, so that a program
        taken up at the operation goes home from wherever the tool is."""
        block = int(self.path.begin[move])
        return block - 1 if block > 0 and self.path.home[block - 1] else block

    def _restate(self, loaded: ToolChange, out: list[Command], move: int, line: int) -> None:
        """The tool in the spindle again, unless the operation changes it."""
        row = int(self.moves.row[move])
        here = [e for e in self.at_row.get(row, ()) if self._within(e, line, row)]
        if not any((e.index, e.line) in self.changes for e in here):
            out += self.state.change(replace(loaded, line=line), {e.word for e in here}, True)
            self._preload(out, line)

    def _preload(self, out: list[Command], line: int) -> None:
        """The next tool to be loaded, made ready where the controller wants it."""
        if self.selects and self.to_come:
            out.append(Command("SELECT_TOOL", (float(self.to_come[0]),), line))

    def event(self, at: int, event: Event) -> None:
        """The commands of one record."""
        events, move = self.toolpath.events, int(self.first_move[event.index])
        self.compensation.off_before(move)
        here = self.moves.link[move] if move < len(self.moves) else True
        waits = event.word == "DELAY" and here and not _gone(events, at)
        out = self.at(_behind(self.path, move) if waits else int(self.path.begin[move]))
        known = len(out)
        if event.word == "OPSKIP":
            self.skipping = "OFF" not in words(event)
        elif event.word == "SPINDL":
            self.spindle = spindle_after(event, self.spindle)
            out += self.state.spindle(_spindle(self.spindle, event), self._loads(at, event))
        elif event.word == "COOLNT":
            out += self.state.coolant(Command(written(words(event), self.controller.codes), (), event.line),
                                      self._loads(at, event))
        elif event.word == "CUTCOM":
            self.compensation.begin(event, move)
        elif event.word == "LOADTL":
            self._tool(at, event, out, move < len(self.moves))
        elif event.word == "SELECT" and self._selects_nothing(event):
            return
        elif command := _simple(event, self.spindle):
            out.append(command)
            if event.word in _STOPS:
                out += self._behind_stop(at, event)
        elif event.word not in QUIET:
            self.lost.setdefault(event.word, []).append(event.line)
        if self.skipping:
            out[known:] = [replace(c, skip=True) for c in out[known:]]

    def _behind_stop(self, at: int, event: Event) -> list[Command]:
        """Spindle and coolant again behind a stop, where a cut follows before the next one and before a tool change."""
        self.state.stop()
        events, but = self.toolpath.events, set[str]()
        k = at + 1
        while k < len(events) and events[k].index == event.index:
            but.add(events[k].word)
            change = events[k].word == "LOADTL" and (events[k].index, events[k].line) in self.changes
            if change or events[k].word in _STOPS:
                return []
            k += 1
        cut = int(np.searchsorted(self.cuts, event.index))
        if cut == len(self.cuts) or self.renewed[np.searchsorted(self.renewed, event.index, side="right")] <= self.cuts[cut]:
            return []
        return self.state.again(event.line, but)

    def _selects_nothing(self, event: Event) -> bool:
        """True for SELECT/TOOL,0 before a change to a tool: an empty place made ready calls for no tool before it."""
        return numbers(event)[:1] == [0.0] and self.to_come[:1] != [0]

    def _loads(self, at: int, event: Event) -> bool:
        """True where a tool change follows at the same place."""
        return any(e.word == "LOADTL" and (e.index, e.line) in self.changes for e in self._near(at, event))

    def _near(self, at: int, event: Event) -> list[Event]:
        """The records behind one at the same place, as far as the next twenty."""
        events, last = self.toolpath.events, at + 1
        while last < min(at + 20, len(events)) and events[last].index == event.index:
            last += 1
        return list(events[at + 1:last])

    def _tool(self, at: int, event: Event, out: list[Command], moves_on: bool) -> None:
        key = event.index, event.line
        if key in self.changes:
            follows = {e.word for e in self._near(at, event)}
            change = self.state.change(self.changes[key], follows, moves_on)
            if key in self.stops:
                at = next(k for k, c in enumerate(change) if c.name == "CHANGE_TOOL")
                change.insert(at, Command("OPTIONAL_PROGRAM_STOP", (), event.line))
            out += self.compensation.off() + change
            self.loaded = self.changes[key]
            self.to_come.pop(0)
            self._preload(out, event.line)
        elif key in self.registers:
            self.loaded = self.registers[key]
            out.append(Command("USE_TOOL_LENGTH_OFFSET", (float(self.registers[key].register or 0),), event.line))

    def done(self) -> tuple[dict[int, list[Command]], list[Diagnostic]]:
        """The commands by block, with what ends at the end, and what was not carried out."""
        self.compensation.off_before(len(self.moves))
        self.at(len(self.path)).extend(self.compensation.off())
        undone = needless_pairs(self.result, len(self.path))
        for k, group in undone.items():
            self.result[k] = group
        lost = [warning("event.not_carried_out", f"{word} is not carried out", file=self.toolpath.file, lines=lines[:6],
                        count=len(lines)) for word, lines in self.lost.items()]
        return self.result, lost + self.compensation.diagnostics(self.toolpath.file)


def _without_length(commands: dict[int, list[Command]], path: JointPath, controller: ControllerFile) -> None:
    """The length register off at the program's beginning and wherever it may be taken up, where neither the safe start nor
    the block that goes home has it so."""
    cancel = controller.codes.length_cancel
    if not cancel or any(cancel in block.split() for block in controller.program.preamble):
        return
    at_home = {int(k) for k in np.flatnonzero(path.home)} if controller.tools.home_without_length else set[int]()
    for block, group in commands.items():
        for k in range(len(group) - 1, -1 if block not in at_home else len(group), -1):
            if group[k].name == "OPERATION_START" and len(group[k].args) > 1:
                group.insert(k + 1, Command("CANCEL_TOOL_LENGTH_OFFSET"))
    if 0 not in at_home:
        commands.setdefault(0, []).insert(0, Command("CANCEL_TOOL_LENGTH_OFFSET"))


def _gone(events: tuple[Event, ...], at: int) -> bool:
    """True where a record of the same place, before this one, sends the tool away already."""
    return any(e.index == events[at].index and e.word in ("LOADTL", "GOHOME") for e in events[max(at - 20, 0):at])


def _behind(path: JointPath, move: int) -> int:
    """The block behind the last of the move before `move`: a dwell belongs there, not behind the retract."""
    last = np.flatnonzero((path.move == move - 1) & np.isfinite(path.u))
    return int(last[-1]) + 1 if len(last) else int(path.begin[min(move, len(path.begin) - 1)])


def _spindle(state: Spindle, event: Event) -> Command:
    if state.direction == 0:
        return Command("STOP_SPINDLE_TURNING", (), event.line)
    name: CommandName = "START_SPINDLE_CLOCKWISE" if state.direction > 0 else "START_SPINDLE_COUNTERCLOCKWISE"
    return Command(name, () if math.isnan(state.rpm) else (state.rpm,), event.line)


def _simple(event: Event, spindle: Spindle) -> Command | None:
    """Commands of events that stand for themselves."""
    said, values = words(event), numbers(event)
    if event.word == "DELAY" and values:
        seconds = values[0] / (spindle.rpm * PER_MINUTE) if "REV" in said else values[0]
        return Command("DWELL", (seconds,), event.line)
    if event.word in _STOPS:
        return Command("PROGRAM_STOP" if event.word == "STOP" else "OPTIONAL_PROGRAM_STOP", (), event.line)
    if event.word == "PPRINT":
        return Command("COMMENT", (" ".join(str(v) for v in event.values),), event.line)
    if event.word == "INSERT":
        return Command("INSERT", (" ".join(str(v) for v in event.values),), event.line)
    if event.word == "SELECT" and values:
        return Command("SELECT_TOOL", (values[0],), event.line)
    return None


def _dwells(toolpath: Toolpath, moves: Moves, path: JointPath, native: Bools) -> list[tuple[int, Command]]:
    """Dwell at the bottom of holes that are written as single moves."""
    result = []
    for m in np.flatnonzero(moves.phase == Phase.DRILL):
        cycle = toolpath.cycles[int(moves.cycle[m])]
        block = int(path.begin[m])
        if cycle.dwell > 0.0 and not native[min(block, len(native) - 1)]:
            result.append((int(path.begin[m + 1]), Command("DWELL", (cycle.dwell,), int(moves.line[m]))))
    return result
