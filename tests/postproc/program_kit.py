"""Canonical programs made by hand, and what a writer makes of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.compile.program import INVERSE, Command, Hole, Program, Section
from postproc.controllers.model import load_controller
from postproc.writing.writers import writer_for
from toolpaths.toolpath import Cycle

CODES = {"rapid": 0, "feed": 1, "cw": 2, "ccw": 2}
Step = dict[str, Any]


def step(kind: str, **words: Any) -> Step:
    """One block: axis words by letter; F, inverse, home, plane, centre (relative to the start) where they matter."""
    return {"kind": kind, **words}


def program(steps: list[Step], commands: dict[int, list[Command]] | None = None, letters: str = "XYZAC", places: int = 4,
            holes: tuple[Hole, ...] = (), sections: tuple[Section, ...] = (Section(0, "axes"),)) -> Program:
    """The Program of blocks; axes that a block does not name stay where they are, from 0."""
    n = len(steps)
    words, write = np.zeros((n, len(letters))), np.zeros((n, len(letters)), dtype=bool)
    for k, row in enumerate(steps):
        words[k] = words[k - 1] if k else 0.0
        for j, letter in enumerate(letters):
            if letter in row:
                words[k, j], write[k, j] = row[letter], True

    def column(key: str, default: Any, dtype: Any) -> Any:
        return np.array([row.get(key, default) for row in steps], dtype=dtype)

    code = np.array([CODES[row["kind"]] for row in steps], dtype=np.int8)
    given = {"letters": tuple(letters), "words": words, "write": write, "code": code, "feed": column("F", np.nan, float),
             "mode": np.where(column("inverse", False, bool), INVERSE, 0).astype(np.int8),
             "plane": column("plane", 17, np.int64), "ccw": np.array([row["kind"] == "ccw" for row in steps], dtype=bool),
             "center": np.array([row.get("centre", (0.0, 0.0, 0.0)) for row in steps], dtype=float).reshape(n, 3),
             "home": column("home", False, bool), "link": np.zeros(n, dtype=bool), "row": np.zeros(n, dtype=np.int64),
             "line": np.zeros(n, dtype=np.int64), "commands": {k: tuple(v) for k, v in (commands or {}).items()},
             "holes": holes, "decimals": np.full(len(letters), places), "sections": sections}
    return Program(**given)


def command(name: str, *args: float | str) -> Command:
    return Command(name, args)


LOAD = [command("CHANGE_TOOL", 3.0), command("USE_TOOL_LENGTH_OFFSET", 3.0),
        command("START_SPINDLE_CLOCKWISE", 5000.0)]
"""tool 3 with its length register, spindle on"""


def blocks(controller: str, made: Program, cycles: tuple[Cycle, ...] = (), length_offsets: bool = True,
           **options: Any) -> list[str]:
    """The blocks of a program between preamble and ending."""
    spec, found = load_controller(controller)
    assert spec is not None and not found, [str(d) for d in found]
    writer = writer_for(spec, made, cycles, length_offsets, options.pop("smoothing", 0.0), **options)
    return list(writer.body())


def lines(controller: str, made: Program, **options: Any) -> list[str]:
    """The whole text."""
    spec, found = load_controller(controller)
    assert spec is not None and not found, [str(d) for d in found]
    writer = writer_for(spec, made, options.pop("cycles", ()), True, options.pop("smoothing", 0.0), **options)
    return "\n".join(writer.lines(["made by hand"])).split("\n")


def drilled(key: str, at: tuple[float, float] = (10.0, 20.0), plane_level: float = 2.0, bottom: float = -8.0,
            retract: float = 2.0, feed: float = 200.0) -> tuple[list[Step], Hole]:
    """The blocks of one hole from 20 mm above, and the hole as a canned cycle (blocks 1 to 3)."""
    steps = [step("rapid", X=0.0, Y=0.0, Z=20.0), step("rapid", X=at[0], Y=at[1]), step("feed", Z=bottom, F=feed),
             step("rapid", Z=retract)]
    return steps, Hole(1, 3, 0, plane_level, bottom, retract, 20.0, key, 2)
