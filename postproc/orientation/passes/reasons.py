"""Why a pass cannot be run, as values: sentences are made of them where they are printed, decisions by their fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Refusal:
    """Why a machine cannot run through poses.

    Attributes:
        kind: "reach": no joints at all; "rods": rods, slides or joints of a parallel machine; "travel": end of travel
        axis, at, low, high, beyond, unit: of "travel": the joint that is worst outside, where it stands, what it is allowed,
            by how much it is beyond, in mm or degrees
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


@dataclass(frozen=True)
class Touching:
    """The pair that comes nearest to being through each other, and at which line.

    Attributes:
        tool, part, body: number of the tool, which part of it, name of the body
        depth: mm that are missing to the distance asked for, inf where the tool is inside altogether
        text: in words
    """

    tool: int
    part: int
    body: str
    depth: float
    text: str

    @property
    def alike(self) -> tuple[object, ...]:
        """The same for the same pair."""
        return self.tool, self.part, self.body

    def __str__(self) -> str:
        return self.text
