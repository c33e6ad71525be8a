"""Text of a Program for controllers that read ISO 6983: blocks of words, modal codes stated when they change."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from postproc.controllers.model import CannedCycle
from postproc.controllers.state import peck_of
from postproc.controllers.writer import Writer
from postproc.program import INVERSE, PER_MINUTE, Hole
from postproc.word_arcs import PLANE_AXIS
from toolpaths.arrays import Array, Bools, Floats
from toolpaths.toolpath import Cycle

CHUNK = 20000


class IsoWriter(Writer):
    """Blocks of words as ISO 6983 has them."""

    def word_columns(self, at: int, stop: int) -> list[list[str]]:
        """The axis words of blocks at..stop by letter, '' where a block does not state one."""
        p = self.program
        columns = []
        for j, letter in enumerate(p.letters):
            rows = np.flatnonzero(p.write[at:stop, j])
            column = [""] * (stop - at)
            texts = self.number_text(p.words[at + rows, j], int(p.decimals[j]))
            head = self.space + letter
            for row, text in zip(rows.tolist(), texts, strict=True):
                column[row] = head + text
            columns.append(column)
        return columns

    def blocks(self, at: int, stop: int) -> Iterator[str]:
        """Motion blocks at..stop."""
        for first in range(at, stop, CHUNK):
            last = min(first + CHUNK, stop)
            words = self.word_columns(first, last)
            heads = self.heads(first, last)
            self.add_length(heads, first, last)
            feeds = self.feeds(first, last)
            arcs = self.arc_words(first, last)
            for head, axes, arc, feed in zip(heads, zip(*words, strict=True), arcs, feeds, strict=True):
                text = "".join((head, *axes, arc, feed))
                yield text[1:] if text.startswith(" ") else text

    def heads(self, first: int, last: int) -> list[str]:
        """Motion, plane and feed mode codes, '' where they stand already."""
        p, codes = self.program, self.controller.codes
        names = (codes.traverse, codes.feed, codes.arc_cw, codes.arc_ccw)
        motion = np.where(p.code[first:last] == 2, 2 + p.ccw[first:last], p.code[first:last])
        state = np.stack([motion, p.plane[first:last], p.mode[first:last]])
        differs = np.append(True, (state[:, 1:] != state[:, :-1]).any(axis=0)) | p.home[first:last]
        result = [""] * (last - first)
        for row in np.flatnonzero(differs).tolist():
            code, home, words = int(motion[row]), bool(p.home[first + row]), []
            plane, mode = int(p.plane[first + row]), int(p.mode[first + row])
            if code and mode != self.mode:
                words.append(codes.inverse_time if mode == INVERSE else codes.per_minute)
                self.mode = mode
                if self.controller.feed.cleared_by_mode_change:
                    self.feed = ""
            if code >= 2 and plane != self.plane:
                words.append(codes.planes[str(plane)])
                self.plane = plane
            if home:
                words.append(codes.machine_coordinates)
            if home or names[code] != self.motion:
                words.append(names[code])
                self.motion = names[code]
            result[row] = "".join(self.space + w for w in words)
        return result

    def add_length(self, heads: list[str], first: int, last: int) -> None:
        """The length register off in machine coordinates, and in force with the first block that states Z after that."""
        p, codes = self.program, self.controller.codes
        if "Z" not in p.letters:
            return
        homes = np.flatnonzero(p.home[first:last] & self.controller.tools.home_without_length)
        heights = np.flatnonzero(p.write[first:last, p.letters.index("Z")] & ~p.home[first:last])
        at = 0
        while True:
            if self.length_off and not self.length_waits:
                return
            rows = heights if self.length_off else homes
            found = int(np.searchsorted(rows, at))
            if found == len(rows):
                return
            at = int(rows[found])
            code = codes.length_offset.format(register=self.register) if self.length_off else codes.length_cancel
            heads[at] += self.space + code
            self.length_off = not self.length_off

    def feed_texts(self, values: Floats) -> list[str]:
        """The numbers of feed words: the controller's decimals, two more for feeds below 1."""
        places = self.controller.format.feed_decimals
        result = self.number_text(values, places)
        small = np.flatnonzero(values < 1.0)
        for k, text in zip(small.tolist(), self.number_text(values[small], places + 2), strict=True):
            result[k] = text
        return result

    def feed_text(self, value: float) -> str:
        """One of them."""
        return self.feed_texts(np.array([value]))[0]

    def feeds(self, first: int, last: int) -> list[str]:
        """Feed words, '' where the feed stands already (each block of inverse time states it)."""
        p = self.program
        result = [""] * (last - first)
        rows = np.flatnonzero(p.code[first:last] > 0)
        values, inverse = p.feed[first + rows], p.mode[first + rows] == INVERSE
        needed = self.mode_changes[first + rows] | (inverse & self.controller.feed.word_every_inverse_block)
        differs = np.append(True, values[1:] != values[:-1]) if len(rows) else needed
        stated = np.flatnonzero(needed | differs)
        for k, text in zip(stated.tolist(), self.feed_texts(values[stated]), strict=True):
            if needed[k] or text != self.feed:
                result[int(rows[k])] = f"{self.space}F{text}"
            self.feed = text
        return result

    @cached_property
    def mode_changes(self) -> Bools:
        """(K,) True where a cutting block follows one of another feed mode and so has to state its feed."""
        p = self.program
        cutting = np.flatnonzero(p.code > 0)
        changed = np.zeros(len(p), dtype=bool)
        modes: Array = p.mode[cutting]
        changed[cutting[1:][modes[1:] != modes[:-1]]] = self.controller.feed.cleared_by_mode_change
        return changed

    def arc_words(self, first: int, last: int) -> list[str]:
        """I, J, K of arc blocks, relative to the start: the two of the plane."""
        p = self.program
        result = [""] * (last - first)
        places = self.controller.format.linear_decimals
        for k in np.flatnonzero(p.code[first:last] == 2).tolist():
            third = PLANE_AXIS[int(p.plane[first + k])]
            texts = self.number_text(p.center[first + k], places)
            result[k] = "".join(f"{self.space}{'IJK'[i]}{texts[i]}" for i in range(3) if i != third)
        return result

    def hole(self, hole: Hole) -> Iterator[str]:
        """A canned cycle: in full where anything but the place of the hole changes, else the place alone."""
        cycle = self.cycles[hole.cycle]
        spec = self.cycle_of(hole)
        yield from self.before_cycle(hole)
        text = self._cycle_text(hole, cycle, spec, self.hole_feed(hole))
        place = self.place(hole)
        if self.in_cycle and text == self.cycle_text:
            yield place.removeprefix(" ")
            return
        if hole.key.startswith("TAP") and self.controller.codes.rigid_tap:
            yield from self.end_cycle()
            yield self.controller.codes.rigid_tap.format(speed=self.plain(abs(self.speed)))
        self.cycle_text = text
        head, _, tail = text.partition("|")
        yield f"{head}{place}{tail}"

    def before_cycle(self, hole: Hole) -> Iterator[str]:
        """Feed per minute, and the XY plane, where they do not stand."""
        if self.mode != PER_MINUTE:
            yield self.controller.codes.per_minute
            self.mode, self.feed = PER_MINUTE, ""
        if self.plane != 17:
            yield self.controller.codes.planes["17"]
            self.plane = 17

    def place(self, hole: Hole) -> str:
        """X and Y of a hole."""
        p = self.program
        result = ""
        for j, letter in enumerate(p.letters):
            if letter in ("X", "Y"):
                result += f"{self.space}{letter}{self.number_text(p.words[hole.last, j:j + 1], int(p.decimals[j]))[0]}"
        return result

    def _cycle_text(self, hole: Hole, cycle: Cycle, spec: CannedCycle, feed: float) -> str:
        cycles, places = self.controller.cycles, self.controller.format.linear_decimals
        z, r = self.number_text(np.array([hole.bottom, hole.plane_level]), places)
        out = cycles.to_plane if abs(hole.retract - hole.plane_level) < 1e-9 else cycles.to_initial
        extra = ""
        if spec.peck:
            extra += f"{self.space}{spec.peck}{self.number_text(np.array([peck_of(cycle)]), places)[0]}"
        if spec.dwell:
            dwell = str(round(cycle.dwell * 1000.0)) if cycles.dwell_milliseconds else self.plain(cycle.dwell)
            extra += f"{self.space}{spec.dwell}{dwell}"
        self.feed = self.feed_text(feed)
        tail = f"{self.space}Z{z}{self.space}R{r}{extra}{self.space}F{self.feed}"
        return f"{out}{self.space}{spec.code}|{tail}"

