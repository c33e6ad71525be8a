"""One path in the part frame, and how each CAM system spells it; see make_dialects.py."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from cltext import UP, WORLD, Floats, Frame, Triple, number, numbers

MM_PER_INCH = 25.4


@dataclass(frozen=True)
class Tool:
    """A mill, or a drill where `tip` (degrees) is not 0; lengths mm."""

    number: int
    name: str
    diameter: float
    tip: float = 0.0
    length: float = 75.0


@dataclass(frozen=True)
class Operation:
    """Name, tool, the frame that its moves are written in where the system has local frames, rev/min."""

    name: str
    tool: Tool
    frame: Frame
    rpm: int


@dataclass
class Spelling(ABC):
    """What all systems share; lengths are given in mm and the part frame and written in `unit`."""

    unit: str = "MM"
    decimals: int = 4
    lines: list[str] = field(default_factory=list)
    position: Floats = field(default_factory=lambda: np.zeros(3))
    axis: Triple = UP
    operation: Operation | None = None

    def __post_init__(self) -> None:
        self.feed_unit = "MMPM" if self.unit == "MM" else "IPM"
        if self.unit != "MM":
            self.decimals += 1
        self.head()

    def length(self, *values: float) -> list[float]:
        """mm to the unit of the file."""
        return [v / (1.0 if self.unit == "MM" else MM_PER_INCH) for v in values]

    def text_of(self, values: Iterable[float], decimals: int | None = None) -> str:
        """Lengths (mm) as text."""
        return numbers(self.length(*values), self.decimals if decimals is None else decimals)

    def local(self, point: Triple) -> Floats:
        """The point as the system writes it."""
        return np.asarray(point, float)

    def direction(self, vector: Triple) -> Floats:
        """The direction as the system writes it."""
        return np.asarray(vector, float)

    def rapid(self, point: Triple, axis: Triple = UP) -> None:
        """RAPID and its GOTO."""
        self.lines.append("RAPID")
        self.go(point, axis)

    def go(self, point: Triple, axis: Triple = UP) -> None:
        """GOTO."""
        self.lines.append(self.goto(point, axis))
        self.position, self.axis = np.asarray(point, float), axis

    def arc(self, center: Triple, end: Triple, ccw: bool, turns: int = 0) -> None:
        """Arc or helix about the tool axis, ending in `end`; `turns` whole turns and an end above or below the start."""
        normal = np.asarray(self.axis, float) * (1 if ccw else -1)
        c, e = np.asarray(center, float), np.asarray(end, float)
        start = self.position
        n = np.asarray(self.axis, float)
        at_start, at_end = c + n * ((start - c) @ n), c + n * ((e - c) @ n)
        self.circle(at_start, at_end, normal, float(np.linalg.norm(start - at_start)), e, turns)
        self.position = e

    @abstractmethod
    def head(self) -> None:
        """Records before the first operation."""

    @abstractmethod
    def goto(self, point: Triple, axis: Triple) -> str:
        """One GOTO."""

    @abstractmethod
    def circle(self, at_start: Floats, at_end: Floats, normal: Floats, radius: float, end: Floats,
               turns: int) -> None:
        """The records of an arc with its end; centre at the height of start and end, right-hand normal."""

    @abstractmethod
    def begin(self, op: Operation) -> None:
        """Open an operation: frame, tool, spindle, coolant."""

    @abstractmethod
    def feed(self, rate: float) -> None:
        """FEDRAT, mm/min."""

    @abstractmethod
    def cycle(self, depth: float, clear: float, back: float, rate: float, step: float = 0.0) -> None:
        """CYCLE of a kind: depth below and start and retract plane above the hole's top; `step` pecks."""

    @abstractmethod
    def cycle_off(self) -> None:
        """CYCLE/OFF."""

    @abstractmethod
    def end(self) -> None:
        """Close the operation."""

    @abstractmethod
    def close(self) -> None:
        """Records after the last operation."""

    def text(self) -> str:
        """The whole file."""
        return "\n".join(self.lines) + "\n"


@dataclass
class Nx(Spelling):
    """Siemens NX: MSYS for each operation, modal axis, left-hand arcs with the centre of a helix at its end."""

    written: str = ""

    def head(self) -> None:
        self.lines.append("$$ One path, spelt six ways: the tool path of a CLSF.")

    def begin(self, op: Operation) -> None:
        self.operation, self.written, t = op, "", op.tool
        self.lines += [f"TOOL PATH/{op.name},TOOL,{t.name}",
                       f"TLDATA/DRILL,MILL,{self.text_of((t.diameter, 0, t.length))},{number(t.tip, 4)},"
                       f"{self.text_of((t.length,))}" if t.tip else
                       f"TLDATA/MILL,{self.text_of((t.diameter, 0, t.length))},0.0000,0.0000",
                       f"MSYS/{self.text_of(op.frame.origin)},{numbers((*op.frame.x, *op.frame.y), 7)}",
                       "$$ centerline data", "PAINT/PATH", "PAINT/SPEED,10", f"LOAD/TOOL,{t.number}",
                       f"SPINDL/RPM,{op.rpm},CLW", "COOLNT/FLOOD"]

    def local(self, point: Triple) -> Floats:
        assert self.operation is not None
        return self.operation.frame.point_in(point)

    def direction(self, vector: Triple) -> Floats:
        assert self.operation is not None
        return self.operation.frame.vector_in(vector)

    def goto(self, point: Triple, axis: Triple) -> str:
        text = numbers(self.direction(axis), 7)
        tail = f",{text}" if text != self.written else ""
        self.written = text
        return f"GOTO/{self.text_of(self.local(point))}{tail}"

    def feed(self, rate: float) -> None:
        self.lines += ["PAINT/COLOR,31", f"FEDRAT/{self.feed_unit},{self.text_of((rate,))}"]

    def circle(self, at_start: Floats, at_end: Floats, normal: Floats, radius: float, end: Floats,
               turns: int) -> None:
        times = f",TIMES,{turns}" if turns else ""
        self.lines += [f"CIRCLE/{self.text_of(self.local(at_end))},{numbers(self.direction(-normal), 7)},"
                       f"{self.text_of((radius, 0.03))},0.5000,{self.text_of((10.0, 0.0))}{times}",
                       self.goto(end, self.axis)]

    def cycle(self, depth: float, clear: float, back: float, rate: float, step: float = 0.0) -> None:
        peck = f",DEEP,STEP,{self.text_of((step,))}" if step else ""
        self.lines.append(f"CYCLE/DRILL{peck},RAPTO,{self.text_of((clear,))},FEDTO,{self.text_of((-depth,))},"
                          f"RTRCTO,{self.text_of((back,))},MANUAL,{self.feed_unit},{self.text_of((rate,))}")

    def cycle_off(self) -> None:
        self.lines.append("CYCLE/OFF")

    def end(self) -> None:
        self.lines += ["COOLNT/OFF", "PAINT/TOOL,NOMORE", "END-OF-PATH"]

    def close(self) -> None:
        pass


@dataclass
class Creo(Spelling):
    """PTC Creo: continued CSYS comments, three numbers in it, or six in the common frame after MULTAX."""

    decimals: int = 10
    multax: bool = False

    def head(self) -> None:
        self.decimals = 10
        self.lines += ["$$ One path, spelt six ways: Pro/CLfile text.", "$$-> MFGNO / SAMPLE", "PARTNO / SAMPLE",
                       "MACHIN / UNCX01, 1", f"UNITS / {'MM' if self.unit == 'MM' else 'INCHES'}"]

    def begin(self, op: Operation) -> None:
        self.operation, t, f = op, op.tool, op.frame
        rows = np.column_stack((f.rotation, np.asarray(self.length(*f.origin))))
        csys = [", ".join(number(v, 10) for v in row) for row in rows]
        self.lines += [f"$$-> FEATNO / {100 + len(self.lines)}", f"LOADTL / {t.number}",
                       f"$$-> CUTTER / {self.text_of((t.diameter,), 6)}",
                       f"$$-> CSYS / {csys[0]},  $", f"\t    {csys[1]},  $", f"\t    {csys[2]}",
                       f"SPINDL / RPM, {op.rpm:.6f},  CLW", "COOLNT / FLOOD"]
        if f is not WORLD and not self.multax:
            self.lines.insert(-2, "MULTAX / ON")
            self.multax = True

    def goto(self, point: Triple, axis: Triple) -> str:
        text = f"GOTO / {self.text_of(point).replace(',', ', ')}"
        return f"{text}, $\n {numbers(axis, 10).replace(',', ', ')}" if self.multax else text

    def feed(self, rate: float) -> None:
        self.lines.append(f"FEDRAT / {self.text_of((rate,), 6)},  {self.feed_unit}")

    def circle(self, at_start: Floats, at_end: Floats, normal: Floats, radius: float, end: Floats,
               turns: int) -> None:
        self.lines += [f"CIRCLE / {self.text_of(at_start).replace(',', ', ')}, $\n"
                       f"{numbers(normal, 10).replace(',', ', ')}, {self.text_of((radius,))}", self.goto(end, self.axis)]

    def cycle(self, depth: float, clear: float, back: float, rate: float, step: float = 0.0) -> None:
        peck = f"STEP, {self.text_of((step,), 6)}, " if step else ""
        self.lines.append(f"CYCLE / {'DEEP' if step else 'DRILL'}, DEPTH, {self.text_of((depth,), 6)}, {peck}"
                          f"{self.feed_unit}, {self.text_of((rate,), 6)}, CLEAR, {self.text_of((clear,), 6)}, $\n"
                          f"RETURN, {self.text_of((back,), 6)}")

    def cycle_off(self) -> None:
        self.lines.append("CYCLE / OFF")

    def end(self) -> None:
        self.lines += ["COOLNT / OFF", "$$-> END /"]

    def close(self) -> None:
        self.lines.append("FINI")
