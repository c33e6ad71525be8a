"""Programs in output modes, executed from their canonical blocks in plain steps; kinematics are those typed in `kit`.

Only words that a block states are known to the control, and words mean what the section that holds the block says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from postproc.compile.program import Section
from postproc.pipeline.result import PostResult
from tests.postproc.kit import convert, pose_of, toolpath

TCP = '[modes.tcp]\nenter = ["G43.4 H{register}"]\nleave = ["G49"]\n'
TILTED = '[modes.tilted]\nenter = ["G68.2 X0 Y0 Z0 I{first} J{second} K{third}", "G53.1"]\nleave = ["G69"]\nangles = "ZXZ"\n'
DENSE = np.linspace(0.0, 1.0, 13)[1:]


@pytest.fixture(autouse=True)
def first_mode(monkeypatch: pytest.MonkeyPatch) -> None:
    """Conversions in the mode that comes first: the generic reader knows no codes of modes, so that `auto`
    would take machine coordinates next."""
    monkeypatch.setattr("postproc.pipeline.convert.with_next_modes", lambda begun, staged: staged(begun))


def shop(folder: Path, more: str = TCP + TILTED, base: str = "generic-iso") -> Path:
    """A controller file with output modes."""
    file = folder / "shop.toml"
    file.write_text(f'base = "{base}"\n{more}')
    return file


@dataclass
class Block:
    """One executed block: number, law, code, tip and axis (12, 3) along it in the table frame, where the rotaries stand."""

    k: int
    law: str
    code: int
    tip: np.ndarray
    axis: np.ndarray
    rotary: np.ndarray
    compensation: str


def turned(letter: str, degrees: float) -> np.ndarray:
    """Right-hand turn about X, Y or Z."""
    a = math.radians(degrees)
    k = {"X": [[0, 0, 0], [0, 0, -1], [0, 1, 0]], "Y": [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
         "Z": [[0, -1, 0], [1, 0, 0], [0, 0, 0]]}[letter]
    return np.eye(3) + math.sin(a) * np.array(k) + (1 - math.cos(a)) * (np.array(k) @ np.array(k))


class Reader:
    """The state of the control while it runs a Program."""

    def __init__(self, result: PostResult) -> None:
        assert result.program is not None and result.job is not None
        self.program, self.job, self.m = result.program, result.job, result.machine
        self.name = self.m.name
        self.tools = {int(k): v.gauge_length for k, v in result.setup.tools.items()}
        unit = np.where(np.array(self.m.rotary), 180.0 / math.pi, 1.0)
        self.rotary = np.flatnonzero(np.array(self.m.rotary))
        self.work = np.asarray(result.job.control.work_offset)
        self.zero = np.asarray(result.job.control.origin)
        self.at = self.m.home * unit
        self.words = np.full(len(self.at), np.nan)
        self.section: Section = self.program.sections[0]
        self.length = self.offset = 0.0
        self.compensation = ""
        self.blocks: list[Block] = []
        self.entered: list[int] = []
        self.stated = np.zeros(len(self.at), dtype=bool)
        mode = result.controller.modes.tilted
        self.convention = "" if mode is None else str(mode.angles)

    def run(self) -> list[Block]:
        for k in range(len(self.program) + 1):
            for command in self.program.commands.get(k, ()):
                self.command(k, command.name, command.args)
            if k < len(self.program):
                self.block(k)
        assert self.section.law == self.program.sections[0].law, "the program ends in a mode"
        return self.blocks

    def command(self, k: int, name: str, args: tuple) -> None:
        if name == "CHANGE_TOOL":
            assert self.section.law == self.program.sections[0].law, "tool change inside a mode"
            self.length, self.offset = self.tools.get(int(args[0]), 0.0), 0.0
        elif name == "USE_TOOL_LENGTH_OFFSET":
            self.offset = self.tools.get(int(args[0]), 0.0)
        elif name == "LEAVE_SECTION":
            assert self.program.sections[int(args[0])] is self.section and not self.compensation
            self.section, self.words = self.program.sections[0], np.full(len(self.at), np.nan)
            self.stated[:] = False
        elif name == "ENTER_SECTION":
            assert self.section.law == "axes"
            self.section, self.words = self.program.sections[int(args[0])], np.full(len(self.at), np.nan)
            assert self.section.first == k
            assert self.stated[self.rotary].all(), "rotary axes are not stated before the mode"
            self.entered.append(k)
            for letter, value in self.section.rotary:
                assert abs(self.at[self.m.axis_names.index(letter)] - value) < 1e-9, "the rotary axes stand elsewhere"
        elif name.startswith("CUTTER_COMPENSATION"):
            self.compensation = "" if name.endswith("OFF") else name.rsplit("_", 1)[1]

    def pose(self, words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(tip, axis) (N, 3) of words (N, J) in the law of the section."""
        if self.section.law == "axes":
            position = words + self.work
            position[:, 2] += self.offset
            return pose_of(self.name, position, self.length)
        still = np.where(np.isin(np.arange(words.shape[1]), self.rotary), words, 0.0)
        if self.section.law == "tilted":
            for letter, value in self.section.rotary:
                still[:, self.m.axis_names.index(letter)] = value
        axis = pose_of(self.name, still, 0.0)[1]
        if self.section.plane is None:
            return words[:, :3] + self.zero, axis
        return self.zero + words[:, :3] @ self.frame(still[0]).T, axis

    def frame(self, position: np.ndarray) -> np.ndarray:
        """The plane's X', Y', Z' as columns: of the printed angles, or how the slides run at the rotary position."""
        if self.convention != "rotary":
            a, b, c = (turned(letter, v) for letter, v in zip(self.convention, self.section.angles, strict=True))
            return a @ b @ c
        at = np.tile(position, (4, 1))
        at[1:, :3] += np.eye(3)
        tip = pose_of(self.name, at, 0.0)[0]
        return (tip[1:] - tip[0]).T

    def block(self, k: int) -> None:
        p = self.program
        if p.code[k] > 0:
            self.stated[:] = False
        self.stated |= p.write[k]
        if p.home[k]:
            assert self.section.law == "axes" and p.code[k] == 0
            self.at = np.where(p.write[k], p.words[k], self.at)
            self.words = np.full(len(self.at), np.nan)
            return
        if self.section.law == "axes":
            start = self.at - self.work
            start[2] -= self.offset
        else:
            start = self.words
            if k in self.entered:
                need = [j for j in range(len(start)) if self.section.law == "tcp" or j not in self.rotary]
                assert p.write[k, need].all(), "the first block in a mode does not state everything"
                start = p.words[k].copy()
        if self.section.law == "tilted":
            assert not p.write[k, self.rotary].any(), "a rotary word in a tilted plane"
        end = np.where(p.write[k], p.words[k], start)
        points = start + DENSE[:, None] * (end - start)
        if p.code[k] == 2:
            points = self.arc(k, start, end)
        tip, axis = self.pose(points)
        self.words = end
        if self.section.law == "axes":
            self.at = end + self.work
            self.at[2] += self.offset
        elif self.section.law == "tcp":
            self.at[self.rotary] = end[self.rotary]
        self.blocks.append(Block(k, self.section.law, int(p.code[k]), tip, axis, self.at[self.rotary].copy(),
                                 self.compensation))

    def arc(self, k: int, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        p = self.program
        a, b = {17: (0, 1), 18: (2, 0), 19: (1, 2)}[int(p.plane[k])]
        center = start[[a, b]] + p.center[k][[a, b]]
        first, last = start[[a, b]] - center, end[[a, b]] - center
        assert abs(np.hypot(*first) - np.hypot(*last)) < 0.002
        begin, stop = math.atan2(first[1], first[0]), math.atan2(last[1], last[0])
        turn = (stop - begin) % (2 * math.pi) if p.ccw[k] else -((begin - stop) % (2 * math.pi))
        if abs(turn) < 1e-9:
            turn = 2 * math.pi if p.ccw[k] else -2 * math.pi
        points = start + DENSE[:, None] * (end - start)
        points[:, a] = center[0] + np.hypot(*first) * np.cos(begin + DENSE * turn)
        points[:, b] = center[1] + np.hypot(*first) * np.sin(begin + DENSE * turn)
        return points


def run(result: PostResult) -> list[Block]:
    """The blocks of a conversion, whatever the reader of the product says of it."""
    assert result.program is not None, [str(d) for d in result.diagnostics]
    return Reader(result).run()


def made(folder: Path, lines: list[str], name: str, output: str = "auto", more: str = TCP + TILTED,
         **options: object) -> PostResult:
    """CL lines after the usual head, converted for a shop's controller."""
    return convert(toolpath(*lines), name, shop(folder, more), output=output, **options)
