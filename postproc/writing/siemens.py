"""What Siemens 840D sl needs beyond its data."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from postproc.compile.program import PER_MINUTE, Hole
from postproc.writing.iso import IsoWriter


class SiemensWriter(IsoWriter):
    """Siemens: cycles are modal calls (MCALL), each block that moves calls them; F of a cycle is the feed in force."""

    def sorted_blocks(self) -> tuple[Iterable[str], dict[int, list[str]]]:
        """As of every writer; names of programs begin with two letters."""
        if not self.name[:2].isalpha():
            self.name = f"NC{self.name}"
        return super().sorted_blocks()

    def smoothed(self, mm: float, blocks: tuple[str, ...]) -> list[str]:
        """CYCLE832: its third parameter must be given, and is 1 on machines without rotary axes."""
        self.axis_smoothing = self.axis_smoothing or 1.0
        return super().smoothed(mm, blocks)

    def cubic(self, block: int) -> str:
        """POLY PO[X]=(end,a2,a3) ...: the parameter goes from 0 to 1, as without PL; BSPLINE X Y Z PL=1: a control point."""
        p, rules, words = self.program, self.controller, list[str]()
        spline = p.spline[block] >= 0
        if self.mode != PER_MINUTE:
            words.append(rules.codes.per_minute)
            self.mode, self.feed = PER_MINUTE, ""
        word = rules.splines.control_points if spline else rules.splines.word
        words += [word] if self.motion != word else []
        self.motion = word
        if spline:
            return " ".join([*words, self.axis_words(block, block + 1)[0].strip(), rules.splines.interval]) + (
                self.feeds(block, block + 1)[0])
        for letter, terms in zip("XYZ", p.curves[p.curve[block]] / rules.unit, strict=True):
            column = p.letters.index(letter)
            if p.write[block, column]:
                end, = self.number_text(self.stated(column, np.array([block])), int(p.decimals[column]))
                words.append(f"PO[{letter}]=({','.join([end, *self.number_text(terms, rules.splines.decimals)])})")
        return " ".join(words) + self.feeds(block, block + 1)[0]

    def hole(self, hole: Hole) -> Iterator[str]:
        """MCALL where anything but the place of the hole changes, then the place at rapid."""
        yield from self.before_cycle(hole)
        text = self.call(hole)
        if not self.in_cycle or text != self.cycle_text:
            feed = self.feed_text(self.hole_feed(hole))
            if feed != self.feed:
                yield f"F{feed}"
            self.cycle_text, self.feed, self.motion = text, feed, ""
            yield text
        head = "" if self.motion == self.controller.codes.traverse else self.controller.codes.traverse
        self.motion = self.controller.codes.traverse
        yield f"{head}{self.place(hole)}".removeprefix(" ")

    def call(self, hole: Hole) -> str:
        """The text of a cycle with its values."""
        places = self.controller.format.linear_decimals
        values = self.cycle_values(hole)
        texts = dict(zip(values, self.number_text(np.array(list(values.values())), places), strict=True))
        return self.cycle_of(hole).code.format(**texts)
