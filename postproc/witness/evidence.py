"""What the witness is given of a program, and what it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from postproc.witness.text import Array


@dataclass(frozen=True)
class Case:
    """A conversion: bytes of the CL file and how it is to be read, machine file over its bases, set-up, tolerances.

    `machine` lists the parsed file, then its base and that one's; `other` says what the program corrects or chooses that
    the CL file does not hold: each an aspect that is then not compared.
    """

    cl: bytes
    machine: list[dict[str, Any]]
    setup: dict[str, Any]
    tolerance: float
    axis_tolerance: float
    units: str | None = None
    dialect: str | None = None
    bent_rapids: bool = False
    planned: bool = False
    errors: bool = False
    oriented: bool = False


@dataclass(frozen=True)
class Executed:
    """E blocks of a program as its reader has executed them.

    Attributes:
        letters: of the joints; joints (E, J) at the end of every block, mm and rad; start (J,)
        line, code (E,): line of the program; 0 rapid, 1 feed, 2 arc; straight (E,): True where joints go straight
        sweep (E,): rad of arcs, NaN; seconds (E,): at the feed in force, for blocks at feed
        tool, spindle, rpm, coolant, dwell, pitch, hole (E,): as in force; pitch NaN outside taps, hole True in cycles
        joints_at: joints (K, J) of blocks (K,) at a fraction of each
        poses_at: (tip, axis) of blocks as the reader has them: the claim that rods are held against
    """

    letters: tuple[str, ...]
    joints: Array
    start: Array
    line: Array
    code: Array
    straight: Array
    sweep: Array
    seconds: Array
    tool: Array
    spindle: Array
    rpm: Array
    coolant: Array
    dwell: Array
    pitch: Array
    hole: Array
    joints_at: Callable[[Array, Any], Array]
    poses_at: Callable[[Array, Any], tuple[Array, Array]]

    def __len__(self) -> int:
        return len(self.line)


@dataclass(frozen=True)
class Finding:
    """A place where program and CL file differ: CL line and program line (0: none), `count` of such places."""

    code: str
    message: str
    line: int
    block: int
    count: int = 1


@dataclass(frozen=True)
class Testimony:
    """What was compared, what not and why, what was found; the worst tip (mm) and axis (rad) that was seen."""

    compared: tuple[str, ...]
    not_compared: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    points: int = 0
    worst_tip: float = 0.0
    worst_axis: float = 0.0
    seconds: float = 0.0
    details: dict[str, Any] = field(default_factory=dict)
