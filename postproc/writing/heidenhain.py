"""Klartext, the block format of Heidenhain TNC controls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from postproc.compile.program import Command, Hole
from postproc.control.word_arcs import PLANE_AXIS
from postproc.writing.polar_arc import polar_arc
from postproc.writing.writer import CHUNK, SKIP, Writer
from toolpaths.arrays import Floats
from toolpaths.units import DEG

LARGEST = 9.99999
"""above it a coefficient of SPL is written with an exponent"""
LONGEST_DWELL = 3600.0
"""s that one cycle 9 can rest"""


class KlartextWriter(Writer):
    """Blocks L, CC, C, CP; FMAX for rapids, R0, RL, RR where it changes, M91 for machine coordinates, M99 for cycles.

    `side` is the radius compensation in force, `asked` the one that the next line takes up; `helix` the block
    of the last CP and where in X, Y it ends, which is not to the last digit where its words say.
    """

    side, asked = "", "R0"
    called = 0.0
    """spindle speed of the last TOOL CALL, 1/min"""
    count = -1
    helix: tuple[int, Floats] | None = None

    def numbered(self, block: str) -> str:
        """The block with its number; comments are blocks too."""
        if block.startswith(SKIP):
            return SKIP + self.numbered(block[1:])
        self.count += 1
        return f"{self.count} {block}"

    @property
    def numbers_blocks(self) -> bool:
        """Every block has its number."""
        return True

    def first_number(self) -> None:
        """Begin to number blocks again."""
        self.count = -1

    def framed(self, block: str) -> str:
        """Blocks of the frame, and comments, are numbered too."""
        return self.numbered(block)

    # ---- motion --------------------------------------------------------------------------------------------

    def blocks(self, at: int, stop: int) -> Iterator[str]:
        """Motion blocks at..stop."""
        machine = " " + self.controller.codes.machine_coordinates
        for first in range(at, stop, CHUNK):
            last = min(first + CHUNK, stop)
            p, words = self.program, self.axis_words(first, last)
            for k, text, code, feed, home in zip(range(first, last), words, p.code[first:last].tolist(),
                                                 self.feeds(first, last), p.home[first:last].tolist(), strict=True):
                if code == 2:
                    yield from self.arc(k, text, feed)
                else:
                    side = "" if self.side == self.asked else " " + self.asked
                    self.side = self.asked
                    yield f"L{text}{side}{feed}{machine if home else ''}"

    def feeds(self, first: int, last: int) -> list[str]:
        """FMAX, which holds in its block alone, and F where it changes."""
        p, result = self.program, []
        for value, code in zip(p.feed[first:last].tolist(), p.code[first:last].tolist(), strict=True):
            text = " FMAX" if code == 0 else f" F{value:.{self.controller.format.feed_decimals}f}"
            if code == 0:
                result.append(text)
                continue
            text = text.rstrip("0").rstrip(".") if "." in text else text
            result.append("" if text == self.feed else text)
            self.feed = text
        return result

    def arc(self, k: int, text: str, feed: str) -> Iterator[str]:
        """CC with the centre, then C, or CP with the angle where the arc climbs (in the XY plane only).

        A whole circle must begin where it ends: an L takes back what a CP before it has left.
        """
        p = self.program
        third = PLANE_AXIS[int(p.plane[k])]
        columns = [p.letters.index(letter) for letter in "XYZ"]
        start, end = p.words[k - 1, columns], p.words[k, columns]
        sense = "DR+" if p.ccw[k] else "DR-"
        if end[third] != start[third]:
            yield from self.climbing(k, start, end, f"{sense}{feed}")
            return
        if (start == end).all() and (self.begins(k, start[:2]) != start[:2]).any():
            x, y = self.lengths(start[:2])
            yield f"L X{x} Y{y}"
            self.helix = None
        centre = self.lengths(start + p.center[k])
        yield "CC" + "".join(f" {'XYZ'[i]}{centre[i]}" for i in range(3) if i != third)
        yield f"C{text} {sense}{feed}"

    def cubic(self, block: int) -> str:
        """SPL with the end and K3, K2, K1 of each axis: K3 t3 + K2 t2 + K1 t + end, t from 1 to 0."""
        p, unit, places = self.program, self.controller.unit, self.controller.splines.decimals
        ends, terms = "", ""
        for letter, (second, third) in zip("XYZ", (p.curves[p.curve[block]] / unit).tolist(), strict=True):
            column = p.letters.index(letter)
            if not p.write[block, column]:
                continue
            begin, end = self.stated(column, np.array([block - 1, block])).tolist()
            cubic, square = (float(spline_number(v, places)) for v in (-third, second + 3.0 * third))
            ends += f" {letter}{self.number_text(np.array([end]), int(p.decimals[column]))[0]}"
            for n, value in ((3, cubic), (2, square), (1, begin - end - cubic - square)):
                terms += f" K{n}{letter}{spline_number(value, places)}"
        return f"SPL{ends}{terms}{self.feeds(block, block + 1)[0]}"

    def climbing(self, k: int, start: Floats, end: Floats, rest: str) -> Iterator[str]:
        """CC and CP of block k from `start` to `end` (3,), by the last decimals that end nearest, from where the tool is."""
        p, f = self.program, self.controller.format
        centre = (start + p.center[k])[:2]
        turn = sweep(start[:2] - centre, end[:2] - centre, bool(p.ccw[k])) * (1.0 if p.ccw[k] else -1.0)
        arc = polar_arc(self.begins(k, start[:2]), end[:2], centre, turn, self.controller.grain,
                        10.0 ** -f.rotary_decimals)
        self.helix = k, arc.end
        pole = self.lengths(arc.pole)
        turned, = self.number_text(np.array([arc.angle]), f.rotary_decimals)
        climbed, = self.lengths(np.array([end[2] - start[2]]))
        yield f"CC X{pole[0]} Y{pole[1]}"
        yield f"CP IPA{turned} IZ{climbed} {rest}"

    def begins(self, k: int, stated: Floats) -> Floats:
        """X, Y (2,) where the tool is before block k: as stated, or where the last CP has left it."""
        if self.helix is None:
            return stated
        at, left = self.helix
        columns = [self.program.letters.index(letter) for letter in "XY"]
        return np.asarray(np.where(self.program.write[at + 1:k, columns].any(axis=0), stated, left))

    def hole(self, hole: Hole) -> Iterator[str]:
        """CYCL DEF where anything but the place of the hole changes, then the place with M99."""
        values = self.cycle_values(hole)
        numbers = self.number_text(np.array(list(values.values())), self.controller.format.linear_decimals)
        text = self.cycle_of(hole).code.format(**dict(zip(values, numbers, strict=True)))
        if text != self.cycle_text:
            yield text
        self.cycle_text, self.side, self.asked, self.helix = text, "R0", "R0", None
        p = self.program
        place = "".join(f" {letter}{self.number_text(self.stated(j, hole.last), int(p.decimals[j]))[0]}"
                        for j, letter in enumerate(p.letters) if letter in "XY")
        yield f"L{place} R0 FMAX M99"

    def forget(self) -> None:
        """State radius compensation and feed again too."""
        super().forget()
        self.side = ""

    # ---- commands ------------------------------------------------------------------------------------------

    def command(self, command: Command) -> Iterator[str]:
        """The blocks of one canonical command; radius compensation waits for the next line."""
        if command.name.startswith("CUTTER_COMPENSATION"):
            codes = self.controller.codes
            sides = {"LEFT": codes.compensation_left, "RIGHT": codes.compensation_right}
            self.asked = sides.get(command.name.rsplit("_", 1)[1], codes.compensation_off)
        elif command.name == "CHANGE_TOOL":
            speed = self.speed_after(command)
            self.called = speed or self.called
            yield f"TOOL CALL {self.tool_said(self.plain(command.args[0]))} Z" + (f" S{self.plain(speed)}" if speed else "")
        elif command.name == "DWELL" and float(command.args[0]) > LONGEST_DWELL:
            for part in (LONGEST_DWELL, float(command.args[0]) - LONGEST_DWELL):
                yield from self.command(replace(command, args=(part,)))
        else:
            yield from super().command(command)

    def speed_after(self, change: Command) -> float:
        """Spindle speed that a command of the same place, after the tool change, sets; 0 for none."""
        return next((self.spindle_speed(float(c.args[0])) for c in self.after_changes[id(change)]
                     if c.name.startswith("START_SPINDLE") and c.args), 0.0)

    @cached_property
    def after_changes(self) -> dict[int, tuple[Command, ...]]:
        """The commands of the same place from each tool change on, by the change's `id`."""
        return {id(c): group[i:] for group in self.program.commands.values() for i, c in enumerate(group)
                if c.name == "CHANGE_TOOL"}

    def spindle(self, command: Command) -> Iterator[str]:
        """TOOL CALL with the speed where it is another, then M3 or M4."""
        *speed, start = (block for block in super().spindle(command) for block in block.split(" "))
        if speed and abs(self.speed) != self.called:
            self.called = abs(self.speed)
            yield f"TOOL CALL S{self.plain(self.called)}"
        yield start


def spline_number(value: float, places: int) -> str:
    """A coefficient of SPL: plain below 10, else with an exponent, no zeros behind."""
    mantissa, _, power = (f"{value:+.{places}f}" if abs(value) < LARGEST else f"{value:+.{places}e}").partition("e")
    short = mantissa.rstrip("0").rstrip(".")
    return ("+0" if float(short) == 0.0 else short) + (f"E{int(power):+d}" if power else "")


def sweep(start: Floats, end: Floats, ccw: bool) -> float:
    """Angle of an arc in degrees, more than 0 up to 360, from the vectors (2,) centre to start and to end."""
    turn = math.atan2(end[1], end[0]) - math.atan2(start[1], start[0])
    turn = (turn if ccw else -turn) % (2.0 * math.pi)
    return (turn if turn > 1e-9 else 2.0 * math.pi) / DEG
