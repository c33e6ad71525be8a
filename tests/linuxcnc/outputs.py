"""Our programs as LinuxCNC's interpreter, our own reader and the canonical Program see them, side by side."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from machines.machine import Machine
from postproc.pipeline.result import PostResult
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.offsets import Offsets
from postproc.readback.text.words import Words, tokenise
from tests.linuxcnc.interpreter import Canonical, Move, ToolEntry
from tests.postproc.reader_kit import execute
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import has_errors

AXES = "XYZABCUVW"
"""Columns of `Canonical.pos`."""
OFFSET_LINE, HOME_LINE = 2, 3
"""Lines of the header, comments as written, that `on_machine` fills."""
MOTION = (Move.TRAVERSE, Move.FEED, Move.ARC)


def start(result: PostResult) -> Floats:
    """(J,) machine coordinates at home in the program's letters, mm and degrees, without tool length offset."""
    assert result.job is not None
    control, machine = result.job.control, result.machine
    home = machine.home * control.unit
    if control.tip_law:
        home[control.xyz] = machine.kinematics.forward(machine.home[None])[0][0]
    return np.asarray(home)


def on_machine(result: PostResult, home: bool = True) -> str:
    """The text with two comments of its header replaced: the work offset set, the machine brought home.

    The lines keep their numbers.
    """
    assert result.job is not None
    lines, letters = result.text.split("\n"), result.machine.axis_names
    assert all(lines[k - 1].startswith("(") for k in (OFFSET_LINE, HOME_LINE))
    lines[OFFSET_LINE - 1] = "G21 G90 G10 L2 P1" + _words(letters, result.job.control.work_offset)
    if home:
        lines[HOME_LINE - 1] = "G53 G0" + _words(letters, start(result))
    return "\n".join(lines)


def _words(letters: tuple[str, ...], values: Floats) -> str:
    return "".join(f" {letter}{value:.12f}" for letter, value in zip(letters, values, strict=True))


def tools(result: PostResult) -> dict[int, ToolEntry]:
    """The tool table that the set-up asks for, by length register."""
    assert result.job is not None
    return {number: ToolEntry(z=length) for number, length in result.job.register_lengths().items()}


@dataclass(frozen=True)
class Output:
    """One program three times: what we meant, what we read back, what LinuxCNC reads."""

    result: PostResult
    words: Words
    motion: Motion
    canonical: Canonical

    @property
    def machine(self) -> Machine:
        return self.result.machine

    @cached_property
    def columns(self) -> list[int]:
        """Columns of `Canonical.pos` in the order of the machine's letters."""
        return [AXES.index(letter) for letter in self.machine.axis_names]

    @cached_property
    def moves(self) -> Ints:
        """Rows of `canonical` that are motion of the program itself, without the steps of cycles that go nowhere."""
        c = self.canonical
        rows = np.flatnonzero(np.isin(c.kind, MOTION) & (c.line != HOME_LINE))
        step = np.abs(np.diff(c.machine[rows], axis=0, prepend=np.nan)).max(axis=1)
        return rows[~((step == 0.0) & np.isin(c.line[rows], self.motion.line[self.motion.hole]))]

    @cached_property
    def lines(self) -> list[str]:
        """The text, line 1 at index 1."""
        return ["", *self.result.text.splitlines()]


def has_letters(machine: Machine) -> bool:
    """True where the machine that rs274 is, one with the axes X Y Z A B C, has all letters of the machine's programs."""
    return set(machine.axis_names) <= set("XYZABC")


def read(result: PostResult) -> tuple[Words, Motion]:
    """The text through our own reader."""
    assert result.job is not None
    words, found = tokenise(result.text.encode())
    assert not has_errors(found)
    control = result.job.control
    offsets = Offsets(control.work_offset, control.xyz, result.job.register_lengths(), start(result),
                      control.length_on_z, result.job.controller.cycles.peck_relief)
    motion, found = execute(words, result.machine.axis_names, offsets)
    assert not has_errors(found)
    return words, motion


def output(result: PostResult, interpret: Callable[..., Canonical]) -> Output:
    """Read a program's text with both readers."""
    words, motion = read(result)
    with tempfile.TemporaryDirectory(prefix="postproc-outputs-") as folder:
        program = Path(folder) / "program.ngc"
        program.write_text(on_machine(result))
        canonical = interpret(program, tools(result))
    return Output(result, words, _without_stops(motion), canonical)


def _without_stops(motion: Motion) -> Motion:
    """The motion without the steps of canned cycles that go nowhere."""
    step = np.diff(motion.end, axis=0, prepend=motion.start[None])
    keep = (step != 0.0).any(axis=1) | ~motion.hole
    return replace(motion, **{f.name: getattr(motion, f.name)[keep] for f in fields(motion)
                              if f.name not in ("start", "frames")})


def known(o: Output) -> Bools:
    """(E, J) False for axes that no block has stated since a tool change.

    LinuxCNC's stand-alone interpreter takes its position again after M6 and then counts the tool length
    twice; a whole LinuxCNC reads it from its motion control.
    """
    words, line = o.words, o.motion.line
    change = np.concatenate([[0], words.line[(words.letter == ord("M")) & (words.value == 6)]])
    last = change[np.searchsorted(change, line, side="right") - 1]
    result = np.ones((len(line), len(o.columns)), dtype=bool)
    for j, letter in enumerate(o.machine.axis_names):
        stated = np.concatenate([[0], words.line[words.letter == ord(letter)]])
        result[:, j] = stated[np.searchsorted(stated, line, side="right") - 1] >= last
    return result


def centers(o: Output) -> tuple[Array, Floats, Floats]:
    """(rows of arcs among the moves, ours (A, 2), LinuxCNC's (A, 2)): centres in machine coordinates of the plane."""
    c, m, xyz = o.canonical, o.motion, o.result.job.control.xyz if o.result.job else np.zeros(3)
    arcs = np.flatnonzero(m.code == 2)
    first, second = np.array([[0, 1], [2, 0], [1, 2]])[m.plane[arcs] - 17].T
    rows = o.moves[arcs]
    offset = c.machine[rows] - c.pos[rows]
    at = np.arange(len(arcs))
    theirs = c.center[rows] + np.stack([offset[at, first], offset[at, second]], axis=1)
    assert (xyz >= 0).all() or not len(arcs)
    return arcs, np.stack([m.center[arcs, first], m.center[arcs, second]], axis=1), theirs


_STATE = {"STOP_SPINDLE_TURNING": ("spindle", 0), "START_SPINDLE_CLOCKWISE": ("spindle", 1),
          "START_SPINDLE_COUNTERCLOCKWISE": ("spindle", -1), "FLOOD_ON": ("flood", 1), "FLOOD_OFF": ("flood", 0),
          "MIST_ON": ("mist", 1), "MIST_OFF": ("mist", 0)}


def states(canonical: Canonical) -> dict[str, Floats]:
    """(N,) spindle sense, rpm, flood and mist in force at each move, from LinuxCNC's calls."""
    now = {"spindle": 0.0, "rpm": np.nan, "flood": 0.0, "mist": 0.0}
    result = {name: np.full(len(canonical), value) for name, value in now.items()}
    for index, name, arguments in canonical.events:
        if name == "SET_SPINDLE_SPEED":
            result["rpm"][index:] = float(arguments.split(",")[1])
        elif name in _STATE:
            key, value = _STATE[name]
            result[key][index:] = value
    return result


def commands(o: Output) -> list[str]:
    """Names of LinuxCNC's calls that our Program has under the same name, in order."""
    wanted = {"START_SPINDLE_CLOCKWISE", "START_SPINDLE_COUNTERCLOCKWISE", "CHANGE_TOOL", "FLOOD_ON", "MIST_ON",
              "PROGRAM_STOP", "OPTIONAL_PROGRAM_STOP"}
    return [name for _, name, _ in o.canonical.events if re.sub(r"\W", "", name) in wanted]
