"""Text of a Program for controllers that read ISO 6983: blocks of words, modal codes stated when they change."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from postproc.compile.program import INVERSE, PER_MINUTE, Hole
from postproc.control.word_arcs import PLANE_AXIS
from postproc.controllers.cycles import CannedCycle
from postproc.writing.block_text import TextPieces, WordColumn, block_text, certain, pays
from postproc.writing.writer import CHUNK, Writer
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.toolpath import Cycle


class IsoWriter(Writer):
    """Blocks of words as ISO 6983 has them."""

    def blocks(self, at: int, stop: int) -> Iterator[str]:
        """Motion blocks at..stop."""
        for first in range(at, stop, CHUNK):
            last = min(first + CHUNK, stop)
            heads = self.heads(first, last)
            self.add_length(heads, first, last)
            fast = pays(len(self.program), last - first) and not self.program.skip[first]
            text = self.at_once(heads, first, last) if fast else None
            if text is not None:
                yield from text.split("\n") if self.numbers_blocks else (text,)
                continue
            feeds = self.feeds(first, last)
            arcs = self.arc_words(first, last)
            for head, words, arc, feed in zip(heads, self.axis_words(first, last), arcs, feeds, strict=True):
                text = f"{head}{words}{arc}{feed}"
                yield text[1:] if text.startswith(" ") else text

    def at_once(self, heads: list[str], first: int, last: int) -> str | None:
        """The text of blocks first..last in one pass; None where that cannot be."""
        columns, before = self.columns(first, last), self.feed
        feed = None if columns is None else self.feed_column(first, last)
        if columns is None or feed is None:
            return None
        pieces = TextPieces(last - first)
        pieces.put_all(0, heads)
        pieces.put_all(1, self.arc_words(first, last))
        text = block_text([*columns, feed], pieces, self.number_style)
        self.feed = self.feed if text is not None else before
        return text

    def heads(self, first: int, last: int) -> list[str]:
        """Motion, plane and feed mode codes, '' where they stand already."""
        result = [""] * (last - first)
        if not result:
            return result
        begin, end = self.changes.searchsorted((first + 1, last)).tolist()
        states: list[list[int]] = self.change_states[begin - 1:end].tolist()
        states[0][3] = self.program.home.item(first)
        for row, state in zip((0, *(self.changes[begin:end] - first).tolist()), states, strict=True):
            result[row] = self.head(*state)
        return result

    def head(self, code: int, plane: int, mode: int, home: int) -> str:
        """Those of one block."""
        codes, motion, words = self.controller.codes, self.motion_codes[code], ""
        if code and mode != self.mode:
            words = self.space + (codes.inverse_time if mode == INVERSE else codes.per_minute)
            self.mode = mode
            if self.controller.feed.cleared_by_mode_change:
                self.feed = ""
        if code >= 2 and plane != self.plane:
            words += self.space + codes.planes[str(plane)]
            self.plane = plane
        if home:
            words += self.space + codes.machine_coordinates
        if home or motion != self.motion:
            words += self.space + motion
            self.motion = motion
        return words

    @cached_property
    def motion_codes(self) -> tuple[str, str, str, str]:
        """Traverse, feed and the two senses of an arc."""
        codes = self.controller.codes
        return codes.traverse, codes.feed, codes.arc_cw, codes.arc_ccw

    def add_length(self, heads: list[str], first: int, last: int) -> None:
        """The length register off in machine coordinates, and in force with the first block that states Z after that."""
        p, codes = self.program, self.controller.codes
        if "Z" not in p.letters:
            return
        at = first
        while not self.length_off or self.length_waits:
            rows = self.heights if self.length_off else self.homes
            found = rows.searchsorted(at)
            if found == len(rows) or rows[found] >= last:
                return
            at = rows.item(found)
            code = codes.length_offset.format(register=self.register) if self.length_off else codes.length_cancel
            heads[at - first] += self.space + code
            self.length_off = not self.length_off

    def feed_texts(self, values: Floats) -> list[str]:
        """The numbers of feed words: the controller's decimals, more of them for feeds below 1."""
        places, more = self.controller.format.feed_decimals, self.controller.format.small_feed_decimals
        result = self.number_text(values, places)
        small = np.flatnonzero(values < 1.0)
        if len(small):
            for k, text in zip(small.tolist(), self.number_text(values[small], places + more), strict=True):
                result[k] = text
        return result

    def feed_text(self, value: float) -> str:
        """One of them; kept, as short stretches repeat few feeds."""
        if value not in self.known_feeds:
            self.known_feeds[value] = self.feed_texts(np.array([value]))[0]
        return self.known_feeds[value]

    @cached_property
    def known_feeds(self) -> dict[float, str]:
        """Their texts by value."""
        return {}

    @cached_property
    def homes(self) -> Ints:
        """Blocks in machine coordinates before which the length goes off."""
        return np.flatnonzero(self.program.home & self.controller.tools.home_without_length)

    @cached_property
    def heights(self) -> Ints:
        """Blocks that state Z, not in machine coordinates."""
        return np.flatnonzero(self.program.write[:, self.program.letters.index("Z")] & ~self.program.home)

    @cached_property
    def changes(self) -> Ints:
        """Blocks, in order, with a motion, plane or feed mode that the block before has not, or in machine coordinates."""
        state = self._states(slice(None))
        return np.flatnonzero(np.append(True, (state[1:, :3] != state[:-1, :3]).any(axis=1)) | self.program.home)

    @cached_property
    def change_states(self) -> Ints:
        """Of those blocks, the number of `motion_codes`, plane, feed mode and 1 for machine coordinates."""
        return self._states(self.changes)

    def _states(self, rows: Ints | slice) -> Ints:
        p = self.program
        code, ccw = p.code[rows], p.ccw[rows]
        return np.stack([np.where(code == 2, 2 + ccw, code), p.plane[rows], p.mode[rows], p.home[rows]], axis=1)

    def feeds(self, first: int, last: int) -> list[str]:
        """Feed words, '' where the feed stands already (each block of inverse time states it)."""
        result = [""] * (last - first)
        cutting, _, needed = self.fed
        rows = self.stated_feeds(first, last)
        values = self.program.feed[cutting[rows]]
        texts = self.feed_texts(values) if len(rows) > 1 else [self.feed_text(v) for v in values.tolist()]
        for k, text in zip(rows.tolist(), texts, strict=True):
            if needed[k] or text != self.feed:
                result[int(cutting[k]) - first] = f"{self.space}F{text}"
            self.feed = text
        return result

    def stated_feeds(self, first: int, last: int) -> Ints:
        """The first of the blocks that cut, by number (`fed`), and those that may have to state their feed."""
        cutting, stated, _ = self.fed
        begin, end = int(cutting.searchsorted(first)), int(cutting.searchsorted(last))
        rows = stated[stated.searchsorted(begin):stated.searchsorted(end)]
        return np.append(begin, rows) if end > begin and (not len(rows) or rows[0] != begin) else rows

    def feed_column(self, first: int, last: int) -> WordColumn | None:
        """Feed words as numbers; None where some have other decimals, or are not certain to round as their texts do."""
        cutting, _, needed = self.fed
        rows, places = self.stated_feeds(first, last), self.controller.format.feed_decimals
        values = self.program.feed[cutting[rows]]
        write, value = np.zeros(last - first, dtype=bool), np.zeros(last - first)
        if len(rows):
            rounded = certain(values, places)
            if rounded is None or (values < 1.0).any():
                return None
            same = np.append(self.feed_text(values.item(0)) == self.feed, rounded[1:] == rounded[:-1])
            write[cutting[rows] - first], value[cutting[rows] - first] = needed[rows] | ~same, values
            self.feed = self.feed_text(values.item(-1))
        return WordColumn(f"{self.space}F", value, write, places)

    @cached_property
    def fed(self) -> tuple[Ints, Ints, Bools]:
        """Blocks that cut, in order; those of them (by number) that have another feed than the one before or
        must state it; and (C,) whether each must."""
        p, cutting = self.program, np.flatnonzero(self.program.code > 0)
        values, inverse = p.feed[cutting], p.mode[cutting] == INVERSE
        needed = self.mode_changes[cutting] | (inverse & self.controller.feed.word_every_inverse_block)
        differs = np.append(True, values[1:] != values[:-1])[:len(cutting)]
        return cutting, np.flatnonzero(needed | differs), needed

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
        if not self.has_arcs:
            return result
        for k in np.flatnonzero(p.code[first:last] == 2).tolist():
            third = PLANE_AXIS[int(p.plane[first + k])]
            texts = self.lengths(p.center[first + k])
            result[k] = "".join(f"{self.space}{'IJK'[i]}{texts[i]}" for i in range(3) if i != third)
        return result

    @cached_property
    def has_arcs(self) -> bool:
        """True where a block is an arc."""
        return bool((self.program.code == 2).any())

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
        if self.in_cycle and bool(spec.less) != self.falling:
            yield from self.end_cycle()  # the words of falling pecks hold from block to block
        self.falling = bool(spec.less)
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
                result += f"{self.space}{letter}{self.number_text(self.stated(j, hole.last), int(p.decimals[j]))[0]}"
        return result

    def _word(self, letter: str, length: float) -> str:
        """A word of a length in mm, a blank before it where there is one."""
        return f"{self.space}{letter}{self.lengths(np.array([length]))[0]}"

    def _cycle_text(self, hole: Hole, cycle: Cycle, spec: CannedCycle, feed: float) -> str:
        cycles = self.controller.cycles
        z, r = self.lengths(np.array([hole.bottom, hole.plane_level]))
        out = cycles.to_plane if abs(hole.retract - hole.plane_level) < 1e-9 else cycles.to_initial
        extra, first = "", 0.0
        if spec.peck:
            whole = cycle.depth + cycle.clearance
            first = max(self.peck_of(cycle, hole.plane_level - hole.bottom), cycle.steps[0]) if cycle.steps else whole
            extra += self._word(spec.peck, first)
        if spec.less and spec.least:
            extra += self._word(spec.less, first - min(cycle.steps)) + self._word(spec.least, min(cycle.steps))
        if spec.dwell and cycle.dwell > 0.0:
            dwell = str(round(cycle.dwell * 1000.0)) if cycles.dwell_milliseconds else self.plain(cycle.dwell)
            extra += f"{self.space}{spec.dwell}{dwell}"
        self.feed = self.feed_text(feed)
        tail = f"{self.space}Z{z}{self.space}R{r}{extra}{self.space}F{self.feed}"
        return f"{out}{self.space}{spec.code}|{tail}"

