"""Written programs with one thing changed: every word and block left out, every number and code changed, blocks twice.

`mutants` gives them all for the text of any of the controls; `verdict` says what the read-back makes of one:
refused, the same motion and states as before, or neither, which is to be judged.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.checks import block_seconds
from postproc.readback.comparison.compare import Comparison
from postproc.verification.read_back import read_back
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_WORD = re.compile(rf"(?:[A-Z]+\d*\s*=\s*{_NUMBER}|\$SC_[A-Z_]+=\d+|SP[ABC]{_NUMBER}|HSC-MODE:\d"
                   rf"|[A-Z]+(?={_NUMBER}){_NUMBER}|[A-Z][A-Z0-9_]*\([^)]*\)|[A-Z]+|{_NUMBER})")
SWAPS: dict[str, tuple[str, ...]] = {
    "G0": ("G1",), "G1": ("G0",), "G2": ("G3",), "G3": ("G2",), "G17": ("G18",), "G18": ("G19", "G17"),
    "G19": ("G18", "G17"), "G21": ("G20",), "G710": ("G700",), "G40": ("G41",), "G41": ("G42",), "G42": ("G41",),
    "G43": ("G49",), "G49": ("G43",), "G54": ("G55", "G53"), "G53": ("G54",), "G80": ("G81",), "G81": ("G82", "G83"),
    "G83": ("G73",), "G73": ("G83",), "G82": ("G81",), "G84": ("G74", "G85"), "G85": ("G84", "G81"), "G90": ("G91",),
    "G93": ("G94",), "G94": ("G93", "G95"), "G98": ("G99",), "G99": ("G98",), "G64": ("G61",), "M3": ("M4", "M5"),
    "M4": ("M3",), "M5": ("M3",), "M7": ("M8",), "M8": ("M7", "M9"), "M9": ("M8",), "M0": ("M1",), "M1": ("M0",),
    "M30": ("M0",), "M2": ("M1",), "D1": ("D0",), "D0": ("D1",), "FMAX": ("F100",), "RL": ("RR",), "RR": ("RL",),
    "R0": ("RL",), "M91": ("M92",), "M99": ("M89",), "TRAORI": ("TRAFOOF",), "STAY": ("TURN",), "TURN": ("STAY",),
    "TABLE": ("COORD",), "G43.4": ("G43",), "G234": ("G43",), "G254": ("G255",), "G255": ("G254",), "G69": ("G68",)}
"""near codes of each"""


@dataclass(frozen=True)
class Mutant:
    """A changed program: what was done, the 1-based line, the block before and after."""

    kind: str
    line: int
    before: str
    after: str | None
    text: str

    def __str__(self) -> str:
        return f"{self.kind:14s} {self.line:4d}: {self.before!r} -> {self.after!r}"


def mutants(text: str, comment: str) -> Iterator[Mutant]:
    """All of a program; lines that are comments alone (by the sign `comment`) are left alone."""
    lines = text.splitlines()
    for i, line in enumerate(lines):
        code, _, rest = line.partition(comment)
        if not code.strip() or code.strip() == "%" or re.fullmatch(r"\d+ (\* .*)?", code) or "PGM" in code:
            continue
        for kind, new in _changed(code, rest and comment + rest):
            if new == line:
                continue
            after = [] if new is None else new.split("\n")
            yield Mutant(kind, i + 1, line, new, "\n".join([*lines[:i], *after, *lines[i + 1:]]) + "\n")


def _changed(code: str, rest: str) -> Iterator[tuple[str, str | None]]:
    head = re.match(r"\s*(?:N?\d+\s+)?", code)
    begin = head.end() if head else 0
    yield "delete block", None
    yield "block twice", f"{code}{rest}\n{code}{rest}"
    for m in _WORD.finditer(code, begin):
        before, after = code[:m.start()], code[m.end():]
        yield "delete word", f"{before}{after.lstrip() if before.endswith(' ') else after}{rest}"
        for other in SWAPS.get(m[0], ()):
            yield "other code", f"{before}{other}{after}{rest}"
        for n in re.finditer(rf"(?<![\d.]){_NUMBER}", m[0]) if not re.match(r"[GM]\d", m[0]) else ():
            for kind, value in _numbers(n[0]):
                word = f"{m[0][:n.start()]}{value}{m[0][n.end():]}"
                yield kind, f"{before}{word}{after}{rest}"


def _numbers(text: str) -> Iterator[tuple[str, str]]:
    """Other numbers: sign, leading digit, ten times as much, all zero."""
    sign, digits = (text[0], text[1:]) if text[0] in "+-" else ("", text)
    if float(text):
        yield "sign", ("+" if sign == "-" and text.startswith("+") else "" if sign == "-" else "-") + digits
        yield "zero", sign + re.sub(r"\d", "0", digits)
        yield "ten times", sign + re.sub(r"^(\d+)(\.?)(\d?)", lambda d: d[1] + (d[3] or "0") + d[2], digits)
    first = re.search(r"\d", digits)
    assert first is not None
    yield "digit", sign + digits[:first.start()] + str((int(first[0]) + 1) % 10) + digits[first.end():]


def verdict(job: Job, text: str, effect: Effect) -> str:
    """"caught CODE", "same", "placed" (only rapids between operations end elsewhere, which the read-back has
    found clear and inside travel), "near" (inside the tolerance), or what differs from what the program does unchanged."""
    comparison, found = read_back(text.encode(), job, "f.cls")
    errors = [d.code for d in found if d.severity is Severity.ERROR]
    if errors:
        return f"caught {errors[0]}"
    warned = sorted({d.code for d in found if d.severity is Severity.WARNING and d.code.startswith("verify")})
    if warned:
        return f"warned {warned}"
    assert comparison is not None
    return effect.against(Effect.of(job, comparison))


@dataclass(frozen=True)
class Effect:
    """What a program does: rows that move, where they end, whether they link or begin a split rapid, what holds there and
    the rest behind each; the move of the CL file that each is part of, and the seconds of all cuts of that move."""

    end: np.ndarray
    link: np.ndarray
    states: dict[str, np.ndarray]
    line: np.ndarray
    move: np.ndarray
    seconds: np.ndarray

    @classmethod
    def of(cls, job: Job, comparison: Comparison) -> Effect:
        """Of a program as it was compared."""
        assert comparison.executed is not None
        motion, moves, owner = comparison.executed[1], job.moves.without_pecks(), comparison.owner
        split = (moves.kind == Kind.RAPID) & (np.append(moves.row[1:], -1) == moves.row)  # up and across, at any height
        link = (owner >= len(moves)) | (moves.link | split)[np.minimum(owner, len(moves) - 1)]
        before = np.vstack([motion.start, motion.end[:-1]])
        full = motion.code == 2
        keep = (np.abs(motion.end - before) > STILL).any(axis=1) | full
        rest = np.bincount(np.maximum(np.cumsum(keep) - 1, 0),
                           weights=np.broadcast_to(motion.dwell, (len(motion),)), minlength=int(keep.sum()))
        law = np.array([f.law for f in motion.frames])[motion.frame]
        cut = motion.code > 0
        states = {"code": motion.code, "law": law, "feed": np.where(cut, motion.feed, 0.0), "inverse": motion.inverse & cut,
                  "tool": motion.tool, "spindle": motion.spindle, "rpm": motion.rpm, "coolant": motion.coolant,
                  "compensation": motion.compensation, "radius": np.where(
                      motion.compensation == 40, -1.0, motion.radius), "offset": motion.offset, "blend": motion.blend,
                  "ccw": motion.ccw & full, "plane": np.where(full, motion.plane, 0), "pitch": motion.pitch}
        if "{register}" not in job.controller.codes.compensation_left:
            states.pop("radius")
        states = {k: np.broadcast_to(v, (len(motion),))[keep] for k, v in states.items()}
        states["dwell"] = np.round(rest, 9)
        spent = np.where(cut, block_seconds(motion, job.control, job.controller.feed.arc_inverse == "radius"), 0.0)
        seconds = np.where(link, spent, np.bincount(owner, weights=np.nan_to_num(spent))[owner])
        return cls(motion.end[keep], link[keep], states, np.broadcast_to(motion.line, (len(motion),))[keep], owner[keep],
                   seconds[keep])

    def kept(self, keep: np.ndarray) -> Effect:
        """Some of the rows."""
        return Effect(self.end[keep], self.link[keep], {k: v[keep] for k, v in self.states.items()},
                      self.line[keep], self.move[keep], self.seconds[keep])

    def against(self, other: Effect) -> str:
        """What differs in the other program."""
        short = self.without_spare(other)
        if short is not self and short.apart(other) in ("same", "near"):
            return "near"
        whole = self.apart(other)
        if whole in ("same", "near"):
            return whole
        rapid = [e.kept(~(e.link & (e.states["code"] == 0))) for e in (self, other)]
        between = rapid[0].apart(rapid[1])
        return "placed" if between in ("same", "near") else f"differs {between}"

    def apart(self, other: Effect) -> str:
        """The same for all rows."""
        if len(self.end) != len(other.end):
            return f"rows {len(self.end)} {len(other.end)}"
        near = [name for name, alike in (("feed", self.as_fast_as(other)), ("blend", self.rounds_more_than(other))) if alike]
        changed = [name for name, a in self.states.items() if not _equal(a, other.states[name])]
        unlike = [name for name in changed if name not in near]
        if unlike:
            name = unlike[0]
            both = zip(self.states[name], other.states[name], strict=True)
            k = next(k for k, (a, b) in enumerate(both) if not _equal(a, b))
            return f"{' '.join(unlike)} in line {self.line[k]}: {self.states[name][k]} {other.states[name][k]}"
        off = np.abs(self.end - other.end).max(initial=0.0)
        return "same" if off <= 1e-9 and not changed else "near" if off <= NEAR else f"ends {off:.4f} in line " \
            f"{self.line[int(np.abs(self.end - other.end).max(axis=1).argmax())]}"

    def without_spare(self, other: Effect) -> Effect:
        """Without the first block that the other program has not, where a move has more of them behind it: linearising
        leaves room, and the read-back has bounded the longer block."""
        n = len(other.end)
        if len(self.end) != n + 1:
            return self
        apart = np.append((np.abs(self.end[:n] - other.end) > NEAR).any(axis=1), True)
        k = int(apart.argmax())
        inside = k < n and self.move[k] == self.move[k + 1] and not self.link[k]
        return self.kept(np.arange(len(self.end)) != k) if inside else self

    def as_fast_as(self, other: Effect) -> bool:
        """Whether each move takes its time, and no block of it is run much faster than before."""
        faster = other.states["feed"] > FASTER * self.states["feed"] + 0.1
        return not faster.any() and bool((np.abs(self.seconds - other.seconds) <= SHARE * self.seconds + MOMENT).all())

    def rounds_more_than(self, other: Effect) -> bool:
        """Whether the control rounds corners in the other program as much or less."""
        return bool((other.states["blend"] <= self.states["blend"]).all())


STILL = 0.01
"""mm or degrees: blocks that move less are none"""
NEAR = 0.02
"""mm or degrees: twice the tolerance"""
SHARE, MOMENT = 0.006, 1e-3
"""of its time, and s: what the time of a move may differ by"""
FASTER = 1.03
"""of the feed of a block: the cutter's load rises as much, inside what overrides and the CAM system's own feeds leave"""


def _equal(a: Any, b: Any) -> bool:
    """True where all are equal, NaN to NaN."""
    a, b = np.asarray(a), np.asarray(b)
    same = a == b
    return bool((same | ((a != a) & (b != b))).all())
