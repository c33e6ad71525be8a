"""Records without motion as canonical commands at their places among the blocks."""

from __future__ import annotations

import math

import numpy as np

from postproc.controllers.model import ControllerFile
from postproc.events import Spindle, numbers, spindle_after, tool_changes, words
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
    diagnostics: list[Diagnostic] = []
    first_move = np.searchsorted(moves.row, np.arange(len(toolpath) + 1))
    changes = {c.index: c for c in tool_changes(toolpath)}
    changed: set[int] = set()
    spindle = Spindle()
    compensation = _Compensation(moves)
    lost: dict[str, list[int]] = {}
    coolant = Command("COOLANT_OFF")
    for at, event in enumerate(toolpath.events):
        block = int(path.begin[first_move[event.index]])
        out = result.setdefault(block, [])
        if event.word == "SPINDL":
            spindle = spindle_after(event, spindle)
            out.append(_spindle(spindle, event))
            diagnostics += _surface_speed(event, toolpath.file)
        elif event.word == "CUTCOM":
            out += compensation.commands(event, int(first_move[event.index]))
        elif event.word == "LOADTL":
            change = changes.get(event.index)
            if change is not None and event.index not in changed and change.number == int(numbers(event)[0]):
                changed.add(event.index)
                register = change.register if change.register is not None else change.number
                out += compensation.off() + (
                    [Command("STOP_SPINDLE_TURNING"), Command("COOLANT_OFF")] if spindle.direction else [])
                out.append(Command("CHANGE_TOOL", (float(change.number),), event.line))
                out.append(Command("USE_TOOL_LENGTH_OFFSET", (float(register),), event.line))
                follows = {e.word for e in toolpath.events[at + 1:] if e.index == event.index}
                if spindle.direction and "SPINDL" not in follows:
                    out.append(_spindle(spindle, event))
                if spindle.direction and coolant.name != "COOLANT_OFF" and "COOLNT" not in follows:
                    out.append(coolant)
        elif command := _simple(event, controller, spindle):
            out.append(command)
            coolant = command if event.word == "COOLNT" else coolant
        elif event.word not in QUIET:
            lost.setdefault(event.word, []).append(event.line)
    diagnostics += [warning("event.not_carried_out", f"{word} is not carried out", file=toolpath.file, lines=lines[:6],
                            count=len(lines)) for word, lines in lost.items()]
    result.setdefault(len(path), []).extend(compensation.off())
    diagnostics += compensation.diagnostics(toolpath.file)
    for k in _dwells(toolpath, moves, path, native, spindle):
        result.setdefault(k[0], []).insert(0, k[1])
    return {k: tuple(v) for k, v in result.items() if v}, diagnostics + _no_spindle(toolpath, moves)


def _spindle(state: Spindle, event: Event) -> Command:
    if state.direction == 0:
        return Command("STOP_SPINDLE_TURNING", (), event.line)
    name = "START_SPINDLE_CLOCKWISE" if state.direction > 0 else "START_SPINDLE_COUNTERCLOCKWISE"
    return Command(name, () if math.isnan(state.rpm) else (state.rpm,), event.line)


def _simple(event: Event, controller: ControllerFile, spindle: Spindle) -> Command | None:
    """Commands of events that stand for themselves."""
    said, values = words(event), numbers(event)
    if event.word == "COOLNT":
        return Command(_coolant(said, controller), (), event.line)
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
    if event.word in ("PREFUN", "AUXFUN") and values:
        return Command("INSERT", (f"{'G' if event.word == 'PREFUN' else 'M'}{values[0]:g}",), event.line)
    return None


class _Compensation:
    """CUTCOM as the control's cutter compensation: stated when it changes, off before tool changes and the end.

    The points are written as the file has them; what the control adds depends on its register.
    """

    def __init__(self, moves: Moves) -> None:
        self.moves, self.active = moves, ""
        self.written: list[int] = []
        self.tilted: list[int] = []

    def commands(self, event: Event, move: int) -> list[Command]:
        """The commands of one CUTCOM record that acts before a row of Moves."""
        side = next((w for w in words(event) if w in ("LEFT", "RIGHT", "OFF")), "")
        if side in ("", self.active) or (side == "OFF" and not self.active):
            return []
        if side == "OFF":
            return self.off(event.line)
        if move >= len(self.moves) or abs(self.moves.axis[move, 2]) < 1.0 - 1e-9:
            self.tilted.append(event.line)
            return []
        before = self.off(event.line)
        self.active = side
        self.written.append(event.line)
        return [*before, Command(f"CUTTER_COMPENSATION_{side}", tuple(numbers(event)[:1]), event.line)]

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
        if self.tilted:
            result.append(warning("cutcom.tilted", "CUTCOM while the tool axis is tilted is not carried out", file=file,
                                  lines=self.tilted[:6], count=len(self.tilted)))
        return result


def _surface_speed(event: Event, file: str) -> list[Diagnostic]:
    if not {"SFM", "SMM"} & set(words(event)):
        return []
    return [error("spindle.surface_speed", "the spindle speed is given as a cutting speed", file=file, lines=[event.line],
                  hint="state rev/min (SPINDL/RPM,n,CLW) in the CAM system")]


def _coolant(said: list[str], controller: ControllerFile) -> str:
    if "OFF" in said:
        return "COOLANT_OFF"
    if "MIST" in said or "AIR" in said:
        return "MIST_ON"
    return "THROUGH_ON" if "THRU" in said and controller.codes.through else "FLOOD_ON"


def _dwells(toolpath: Toolpath, moves: Moves, path: Path, native: Bools, spindle: Spindle) -> list[tuple[int, Command]]:
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
