"""Why a pass cannot be run, as values: sentences are made of them where they are printed, decisions by their fields."""

from __future__ import annotations

from typing import Literal

from postproc.collision.touch_words import touch_words
from toolpaths.dataclass import dataclass

HALF_TURN = 180.0
"""degrees: an angle from a direction is never greater"""


@dataclass(frozen=True)
class Refusal:
    """Why a machine cannot run through poses.

    Attributes:
        kind: "reach": no joints at all; "rods": rods, slides or joints of a parallel machine; "travel": end of travel
        axis, at, low, high, beyond, unit: of "travel": the joint that is worst outside, where it stands, what
            it is allowed, by how much it is beyond, in mm or degrees
        above: True where it is too high
        missing: of "reach": degrees to the nearest tool axis that the rotary axes reach, 0 where that is not known
    """

    kind: Literal["reach", "rods", "travel"]
    axis: str = ""
    at: float = 0.0
    low: float = 0.0
    high: float = 0.0
    beyond: float = 0.0
    unit: Literal["mm", "degrees"] = "mm"
    above: bool = False
    missing: float = 0.0

    @property
    def rotary(self) -> bool:
        """Whether turning joints are what is against it: they stand alike wherever the part is."""
        return self.kind == "reach" or (self.kind == "travel" and self.unit == "degrees")

    @property
    def alike(self) -> tuple[object, ...]:
        """The same for refusals that differ by an amount alone."""
        return self.kind, self.axis, self.above, f"{self.missing:.3f}"

    @property
    def depth(self) -> float:
        """mm or degrees beyond travel as printed, 0 for other kinds."""
        return round(self.beyond, 3)

    @property
    def place(self) -> str:
        """Of "travel": where the axis stands and what is allowed."""
        return (f"axis {self.axis} at {self.at:.3f} {self.unit}, allowed {self.low:.3f} to {self.high:.3f}: "
                f"{self.beyond:.3f} {'too high' if self.above else 'too low'}")

    def __str__(self) -> str:
        if self.kind == "travel":
            return f"travel: {self.place}"
        if self.kind == "rods":
            return "out of the reach of the parallel machine"
        nearest = f": the rotary axes bring the tool no nearer to it than {self.missing:.3f} degrees"
        return "out of reach" + (nearest if self.missing > 0.0 else "")


LimitedAngle = Literal["tilt from the CL axis", "tilt from the normal", "lead", "tilt sideways", "criterion"]
"""angles of a tool axis that are limited"""
_ANGLE: dict[LimitedAngle, tuple[str, str]] = {
    "tilt from the CL axis": ("tilt", " from the axis of the CL file"), "lead": ("lead", ""),
    "tilt from the normal": ("tilt", " from the surface normal"), "tilt sideways": ("tilt sideways", ""),
    "criterion": ("", "")}
"""what each is called, and what it is measured from where the name does not say it"""


@dataclass(frozen=True)
class BrokenLimit:
    """The limit of tool axes that one breaks worst.

    Attributes:
        angle, low, high: degrees at the worst place, and what is allowed
        line: of the CL file, None where only the axis of the pass is known
        title: of the angle, where a criterion of a package limits it
    """

    limited: LimitedAngle
    angle: float
    low: float
    high: float
    line: int | None = None
    title: str = ""

    def __str__(self) -> str:
        where = "" if self.line is None else f" at line {self.line}"
        name, origin = _ANGLE[self.limited]
        name = self.title or name
        low, high = f"{self.low:.3f}", f"{self.high:.3f}"
        between = f"{low} to {high}" if self.low != 0.0 or not origin else high
        allowed = f"at least {low}" if self.high >= HALF_TURN else between
        return f"{name} {self.angle:.3f} degrees{origin}{where}, allowed {allowed}"


@dataclass(frozen=True)
class BoundTooLong:
    """The least time of a candidate, s, which others are below."""

    seconds: float

    def __str__(self) -> str:
        return f"takes at least {self.seconds:.4f} s"


@dataclass(frozen=True)
class Slower:
    """Slower than the best: its seconds where they are known, `about` where they are as ranked."""

    seconds: float | None = None
    about: bool = False

    def __str__(self) -> str:
        return "" if self.seconds is None else f"takes {'about ' if self.about else ''}{self.seconds:.4f} s"


@dataclass(frozen=True)
class Touching:
    """The pair that comes nearest to being through each other, and at which line.

    Attributes:
        tool, part, body: number of the tool, which part of it, name of the body
        distance, limit: mm between them, -inf where the tool is inside altogether, and what is allowed
        line: of the CL file
    """

    tool: int
    part: int
    body: str
    distance: float
    limit: float
    line: int

    @property
    def depth(self) -> float:
        """mm that are missing to the distance asked for."""
        return self.limit - self.distance

    @property
    def alike(self) -> tuple[object, ...]:
        """The same for the same pair."""
        return self.tool, self.part, self.body

    def __str__(self) -> str:
        return f"{touch_words(self.tool, self.part, self.body, self.distance, self.limit)} (at line {self.line})"


RejectionKind = Literal["limits", "reach", "travel", "touches", "bound", "slower"]
"""What a candidate can lose by."""
_LOST: dict[RejectionKind, str] = {"limits": "are outside the allowed angles", "travel": "are outside travel",
                                   "reach": "are out of reach"}


@dataclass(frozen=True)
class Unaimed:
    """Why no vertex is aimed along the mean direction of a pass; `lost`: how many axes that would were rejected, by kind."""

    why: Literal["no direction", "own axis", "no vertex", "lost"]
    lost: tuple[tuple[RejectionKind, int], ...] = ()

    def __str__(self) -> str:
        if self.why == "lost":
            return "of the axes that aim a vertex " + ", ".join(f"{number} {_LOST[kind]}" for kind, number in self.lost)
        return {"no direction": "the pass has no mean direction", "own axis": "the cut's own axis is out of reach",
                "no vertex": "no vertex can be turned into the mean direction"}[self.why]
