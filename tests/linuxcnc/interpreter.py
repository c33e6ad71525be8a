"""LinuxCNC's stand-alone interpreter as an independent reader of G-code."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np

from toolpaths.arrays import Array, Bools, Floats

HERE = Path(__file__).parent
SYSTEM_PYTHON = Path("/usr/bin/python3")
"""LinuxCNC's Python modules are Debian's and only fit Debian's Python."""
MM_PER_INCH = 25.4
TIME_LIMIT = 300
UNMOVED = 1e-8
"""mm: displacements that LinuxCNC's motion takes for none"""
_AXES = 9
_AT, _OFFSET, _REST = slice(1, 1 + _AXES), slice(1 + _AXES, 1 + 2 * _AXES), 1 + 2 * _AXES
"""Columns of the rows that exact.py writes: position, offsets, then feed and what follows."""
_MOTIONS = {"STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED", "STRAIGHT_PROBE", "RIGID_TAP", "DWELL"}
_CALL = re.compile(r"^\s*\d+\s+N\S*?\s*([A-Z][A-Z_0-9]+)\((.*)\)\s*$")


class Move(IntEnum):
    """Kinds of canonical motion, as exact.py numbers them."""

    TRAVERSE = 0
    FEED = 1
    ARC = 2
    PROBE = 3
    TAP = 4
    DWELL = 5


class ToolEntry(NamedTuple):
    """One line of the tool table, mm."""

    z: float = 0.0
    diameter: float = 0.0


@dataclass(frozen=True)
class Canonical:
    """What the interpreter made of a program: one row per move, canned cycles expanded.

    Attributes:
        kind (N,): Move
        pos (N, 9): x y z a b c u v w at the end of the move in program coordinates, mm and degrees
        machine (N, 9): the same with work offset, G92 and tool length offset
        feed (N,): mm/min (deg/min where only rotary axes move); with G93 the feed that gives the block its time
        inverse (N,): True where G93 was active
        seconds (N,): nominal time at constant feed, nan for traverses and taps
        line (N,): 1-based line of the program
        tool (N,): tool in the spindle, 0 for none
        plane (N,): 17, 18 or 19
        center (N, 2): of arcs, program coordinates, (x, y) in plane 17, (z, x) in 18, (y, z) in 19; nan elsewhere
        turn (N,): of arcs, turns begun, counter-clockwise (G3) positive; 0 elsewhere
        events: (index of the next move, function, arguments as text) of the other canonical calls, feeds left
            out; none where the program moves U, V or W
        error: the interpreter's message, "" where the program was accepted
    """

    kind: Array
    pos: Floats
    machine: Floats
    feed: Floats
    inverse: Bools
    seconds: Floats
    line: Array
    tool: Array
    plane: Array
    center: Floats
    turn: Array
    events: tuple[tuple[int, str, str], ...]
    error: str

    def __len__(self) -> int:
        return len(self.kind)

    def calls(self, function: str) -> list[str]:
        """The arguments of each call of a canonical function that is no motion."""
        return [arguments for _, name, arguments in self.events if name == function]


def missing() -> str:
    """Why the interpreter cannot be used here, "" where it can."""
    if shutil.which("rs274") is None:
        return "LinuxCNC's interpreter rs274 is not installed (Debian: apt-get install linuxcnc-uspace)"
    probe = subprocess.run([SYSTEM_PYTHON, "-c", "import gcode"], capture_output=True, text=True, check=False)
    return "" if probe.returncode == 0 else f"{SYSTEM_PYTHON} has no module gcode of LinuxCNC"


def interpret(program: str | Path, tools: Mapping[int, ToolEntry | tuple[float, float]] | None = None) -> Canonical:
    """Run a G-code file through LinuxCNC's interpreter; nothing moves and no LinuxCNC need run.

    Args:
        program: the file.
        tools: tool table, number to (length offset z, diameter) in mm; no tools without it.

    Raises:
        RuntimeError: where the interpreter itself broke down; a refused program is no error but `Canonical.error`.
    """
    with tempfile.TemporaryDirectory(prefix="postproc-rs274-") as name:
        folder = Path(name)
        shutil.copyfile(program, folder / "program.ngc")
        events, error = ((), "") if _adjacent(folder / "program.ngc") else _run_rs274(folder, tools or {})
        rows, exact_error = _run_exact(folder, tools or {})
    return _canonical(rows, events, error or exact_error)


def table_text(tools: Mapping[int, ToolEntry | tuple[float, float]], unit: float = 1.0) -> str:
    """LinuxCNC's tool table in units of `unit` mm."""
    return "".join(f"T{number} P{pocket} Z{z / unit!r} D{diameter / unit!r}\n"
                   for pocket, (number, (z, diameter)) in enumerate(tools.items(), 1))


def _run(folder: Path, *command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, env={**os.environ, "HOME": str(folder)}, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, errors="replace", timeout=TIME_LIMIT, check=False)


def _adjacent(program: Path) -> bool:
    """True where a program moves U, V or W: the machine that rs274 is has none, the interpreter of exact.py has."""
    return re.search(r"[UVWuvw]\s*[-+.\d]", re.sub(r"\([^)]*\)|;.*", "", program.read_text(errors="replace"))) is not None


def _run_rs274(folder: Path, tools: Mapping[int, ToolEntry | tuple[float, float]]
               ) -> tuple[tuple[tuple[int, str, str], ...], str]:
    """Canonical calls that are no motion, and the verdict. rs274 is a machine in inch, so the table is too."""
    (folder / "inch.tbl").write_text(table_text(tools, MM_PER_INCH))
    (folder / "rs274.var").touch()
    done = _run(folder, "rs274", "-g", "-n", "2", "-t", "inch.tbl", "-v", "rs274.var", "program.ngc", "calls")
    (folder / ".tool.mmap").unlink(missing_ok=True)
    text = (folder / "calls").read_text(errors="replace") if (folder / "calls").exists() else ""
    message = "\n".join(line for line in done.stderr.splitlines() if line != "executing").strip()
    if done.returncode not in (0, 1):
        raise RuntimeError(f"rs274 ended with code {done.returncode}: {message}")
    return _events(text), (message or "refused without a message") if done.returncode else ""


def _events(text: str) -> tuple[tuple[int, str, str], ...]:
    events, moves = [], 0
    for call in filter(None, map(_CALL.match, text.splitlines())):
        if call[1] in _MOTIONS:
            moves += 1
        elif call[1] != "SET_FEED_RATE":
            events.append((moves, call[1], call[2]))
    return tuple(events)


def _run_exact(folder: Path, tools: Mapping[int, ToolEntry | tuple[float, float]]) -> tuple[Floats, str]:
    (folder / "tool.tbl").write_text(table_text(tools))
    done = _run(folder, SYSTEM_PYTHON, "-B", HERE / "exact.py", folder)
    if done.returncode:
        raise RuntimeError(f"exact.py ended with code {done.returncode}: {done.stderr.strip()}")
    result = json.loads((folder / "result.json").read_text())
    return np.fromfile(folder / "rows.f64").reshape(-1, result["width"]), result["error"]


def _canonical(rows: Floats, events: tuple[tuple[int, str, str], ...], error: str) -> Canonical:
    feed, inverse, line, tool, plane, first, second, turn, _, rotation = rows[:, _REST:].T
    if np.any(rotation):
        raise RuntimeError("the program turns the work offset about Z, which Canonical.machine does not hold")
    kind = rows[:, 0].astype(np.int8)
    arc = kind == Move.ARC
    return Canonical(
        kind=kind, pos=rows[:, _AT], machine=rows[:, _AT] + rows[:, _OFFSET], feed=feed, inverse=inverse > 0,
        seconds=_seconds(rows), line=line.astype(np.int64), tool=tool.astype(np.int64),
        plane=np.array([0, 17, 19, 18])[plane.astype(np.int64)],
        center=np.where(arc[:, None], np.stack([first, second], axis=1), np.nan), turn=turn.astype(np.int64),
        events=events, error=error)


def _seconds(rows: Floats) -> Floats:
    """Nominal time of each row: LinuxCNC's length (xyz where any of them moves, else uvw, else abc) over the feed.

    The first move starts at machine zero.
    """
    kind, feed, dwell = rows[:, 0], rows[:, _REST], rows[:, _REST + 8]
    before = np.vstack([np.zeros((1, _AXES)), rows[:-1, _AT] + rows[:-1, _OFFSET]]) - rows[:, _OFFSET]
    delta = rows[:, _AT] - before
    straight, adjacent = np.linalg.norm(delta[:, :3], axis=1), np.linalg.norm(delta[:, 6:], axis=1)
    length = np.where(adjacent > UNMOVED, adjacent, np.linalg.norm(delta[:, 3:6], axis=1))
    length = np.where(straight > UNMOVED, straight, length)
    length = np.where(kind == Move.ARC, _arc_length(rows, before), length)
    cutting = np.isin(kind, (Move.FEED, Move.ARC, Move.PROBE)) & (feed > 0)
    seconds = np.divide(60.0 * length, feed, out=np.full(len(rows), np.nan), where=cutting)
    return np.where(kind == Move.DWELL, dwell, seconds)


def _arc_length(rows: Floats, before: Floats) -> Floats:
    """Length of rows as helices from the position before, by their centre, plane and turns."""
    plane, center1, center2, turn = rows[:, _REST + 4:_REST + 8].T
    first, second, height = np.array([[0, 0, 0], [0, 1, 2], [1, 2, 0], [2, 0, 1]])[plane.astype(np.int64)].T
    row, at = np.arange(len(rows)), rows[:, _AT]
    u0, v0 = before[row, first] - center1, before[row, second] - center2
    u1, v1 = at[row, first] - center1, at[row, second] - center2
    sense = np.where(turn >= 0, 1.0, -1.0)
    part = np.mod(sense * (np.arctan2(v1, u1) - np.arctan2(v0, u0)), 2 * np.pi)
    part = np.where((part < 1e-9) | (part > 2 * np.pi - 1e-9), 2 * np.pi, part)
    angle = part + 2 * np.pi * np.maximum(np.abs(turn) - 1, 0)
    return np.hypot(np.hypot(u0, v0) * angle, at[row, height] - before[row, height])
