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
from toolpaths.diagnostics import Diagnostic, warning
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
    lost: dict[str, list[int]] = {}
    for event in toolpath.events:
        block = int(path.begin[first_move[event.index]])
        out = result.setdefault(block, [])
        if event.word == "SPINDL":
            spindle = spindle_after(event, spindle)
            out.append(_spindle(spindle, event))
        elif event.word == "LOADTL":
            change = changes.get(event.index)
            if change is not None and event.index not in changed and change.number == int(numbers(event)[0]):
                changed.add(event.index)
                register = change.register if change.register is not None else change.number
                out[:0] = [Command("STOP_SPINDLE_TURNING"), Command("COOLANT_OFF")] if spindle.direction else []
                out.append(Command("CHANGE_TOOL", (float(change.number),), event.line))
                out.append(Command("USE_TOOL_LENGTH_OFFSET", (float(register),), event.line))
        elif command := _simple(event, controller, spindle):
            out.append(command)
        elif event.word not in QUIET:
            lost.setdefault(event.word, []).append(event.line)
    diagnostics += [warning("event.not_carried_out", f"{word} is not carried out", file=toolpath.file, lines=lines[:6],
                            count=len(lines)) for word, lines in lost.items()]
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
    if event.word == "CUTCOM":
        side = next((w for w in said if w in ("LEFT", "RIGHT", "OFF")), "")
        return Command(f"CUTTER_COMPENSATION_{side}", tuple(values[:1]), event.line) if side else None
    if event.word in ("PREFUN", "AUXFUN") and values:
        return Command("INSERT", (f"{'G' if event.word == 'PREFUN' else 'M'}{values[0]:g}",), event.line)
    return None


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
