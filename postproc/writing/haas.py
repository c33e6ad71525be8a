"""What Haas needs beyond its data."""

from __future__ import annotations

from collections.abc import Iterator

from postproc.compile.program import Section
from postproc.writing.fanuc import FanucWriter


class HaasWriter(FanucWriter):
    """Haas NGC: after G254 X and Y are stated in one block, then Z in another (Mill Operator's Manual, G254)."""

    apart = False
    """True where the next block is the first of a plane"""

    def enter(self, section: Section) -> Iterator[str]:
        """Blocks that switch the mode of a section on."""
        yield from super().enter(section)
        self.apart = section.law == "tilted"

    def blocks(self, at: int, stop: int) -> Iterator[str]:
        """Motion blocks at..stop."""
        if not self.apart:
            yield from super().blocks(at, stop)
            return
        self.apart = False
        words = next(super().blocks(at, at + 1)).split(" ")
        late = [w for w in words if w[0] in "ZH" or w == "G43"]
        early = [w for w in words if w not in late]
        if any(w[0] in "XY" for w in early):
            yield " ".join(early)
        else:
            late = early + late
        if late:
            yield " ".join(late)
        if stop > at + 1:
            yield from super().blocks(at + 1, stop)
