"""The reader of G-code against hand-written programs, an own executor, and its compiled walk against the plain one."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.readback.alignment import align
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.offsets import Offsets
from postproc.readback.text.words import tokenise
from tests.postproc.kit import Peer, codes, unit
from tests.postproc.reader_kit import execute
from toolpaths.diagnostics import Diagnostic
from toolpaths.shape import Curves

XYZ, XYZAC = ("X", "Y", "Z"), ("X", "Y", "Z", "A", "C")
LENGTHS = {1: 100.0, 2: 55.5}
HOME = {XYZ: np.array([0.0, 0, 400]), XYZAC: np.array([0.0, 0, 400, 0, 0])}
WORK = {XYZ: np.array([10.0, 20, 30]), XYZAC: np.array([10.0, 20, 30, 0, 90])}


def read(text: str, letters: tuple[str, ...] = XYZ) -> tuple[Motion, list[Diagnostic]]:
    words, found = tokenise(text.encode(), "t.ngc")
    if found:
        return None, found
    offsets = Offsets(WORK[letters], np.array([0, 1, 2]), LENGTHS, HOME[letters], True, 0.254)
    return execute(words, letters, offsets, "t.ngc")


def ends(text: str, letters: tuple[str, ...] = XYZ) -> list[list[float]]:
    motion, found = read(text, letters)
    assert not found, [str(d) for d in found]
    return motion.end.tolist()


# ---- by hand -----------------------------------------------------------------------------------------------


def test_offsets_and_lengths() -> None:
    """Machine = word + work offset + length of the register; G53 without both; G49 ends the length."""
    assert ends("G21 G90 G54 G0 X0 Y0 Z0\nG43 H1\nZ5\nG53 G0 Z400\nG49\nX1\nZ5\nG43 H2 Z5\n") == [
        [10, 20, 30], [10, 20, 135], [10, 20, 400], [11, 20, 400], [11, 20, 35], [11, 20, 90.5]]


def test_rotary_words_take_their_own_offset() -> None:
    assert ends("G0 X0 A30 C-90\nC450\n", XYZAC) == [[10, 0, 400, 30, 0], [10, 0, 400, 30, 540]]


def test_inches_scale_lengths_only() -> None:
    assert ends("G20 G0 X1 A30\n", XYZAC) == [[35.4, 0, 400, 30, 0]]


def test_modal_words_and_kinds() -> None:
    motion, found = read("G0 X1\nY2\nG1 Z3 F100\nX4\nG0\nX5\nG4 P2\nX6\n")
    assert not found
    assert motion.code.tolist() == [0, 0, 1, 1, 0, 0]
    assert motion.end[:, 0].tolist() == [11, 11, 11, 14, 15, 16]
    assert motion.line.tolist() == [1, 2, 3, 4, 6, 8]


def test_feed_modes() -> None:
    """F of inverse time holds for its own block; a change of mode clears F."""
    motion, _ = read("G1 X1 F100\nX2\nG93 G1 X3 F6\nX4\nX5 F7\nG94 X6\nX7 F50\nX8\n")
    assert motion.missing_feed.tolist() == [False, False, False, True, False, True, False, False]
    assert motion.feed[[0, 1, 2, 4, 6, 7]].tolist() == [100, 100, 6, 7, 50, 50]
    assert motion.inverse.tolist() == [False, False, True, True, True, False, False, False]


def test_tool_spindle_coolant() -> None:
    motion, _ = read("T2\nG0 X1\nM6\nX2 M3 S500\nX3 M8\nS600\nX4\nM5 M9\nX5\nT1 M6\nX6 M4\n")
    assert motion.tool.tolist() == [-1, 2, 2, 2, 2, 1]
    assert motion.spindle.tolist() == [0, 1, 1, 1, 0, -1]
    assert motion.flood.tolist() == [False, False, True, True, False, False]
    assert motion.rpm[1:].tolist() == [500, 500, 600, 600, 600]


def test_arcs_in_three_planes() -> None:
    motion, _ = read("G0 X0 Y0 Z0\nG2 X10 Y10 I10 J0 F100\nG18 G3 X20 Z10 I0 K10\nG19 G2 Y20 Z20 J10 K0\nG17 G3 I5 J0\n")
    assert motion.code.tolist() == [0, 2, 2, 2, 2]
    assert motion.plane[1:].tolist() == [17, 18, 19, 17]
    assert motion.ccw.tolist() == [False, False, True, False, True]
    assert motion.center[1].tolist() == [20, 20, 30]
    assert motion.center[2][[0, 2]].tolist() == [20, 40]
    assert motion.center[3][[1, 2]].tolist() == [40, 40]
    assert motion.end[4].tolist() == motion.end[3].tolist(), "a full circle needs no end"


def test_drilling_to_the_initial_level_and_to_the_plane() -> None:
    """Offsets 10, 20, 30; R3 Z-12 from Z50: out to 80 (G98), then to 33 (G99)."""
    motion, _ = read("G0 X0 Y0 Z50\nG98 G81 X1 Y2 Z-12 R3 F100\nX5\nG99 X6\nX7\nG80\nG0 Z50\n")
    z = [(round(float(e[0]), 3), round(float(e[2]), 3), int(c)) for e, c in zip(motion.end, motion.code, strict=True)]
    assert z == [(10, 80, 0), (11, 80, 0), (11, 33, 0), (11, 18, 1), (11, 80, 0), (15, 80, 0), (15, 33, 0), (15, 18, 1),
                 (15, 80, 0), (16, 80, 0), (16, 33, 0), (16, 18, 1), (16, 33, 0), (17, 33, 0), (17, 18, 1), (17, 33, 0),
                 (17, 80, 0)]


def test_rises_to_the_plane_before_it_travels() -> None:
    motion, _ = read("G0 X0 Y0 Z1\nG99 G81 X1 Y2 Z-12 R3 F100\n")
    assert motion.end[1].tolist() == [10, 20, 33] and motion.end[2].tolist() == [11, 22, 33]


@pytest.mark.parametrize(("text", "travel"), [
    ("G99 G81 X50 Z-2 R3 F100\nG80\nG98 X10 G81 Z-5 R3\n", [(10, 3), (10, -5), (10, 3)]),
    ("G99 G81 X50 Z-2 R3 F100\nG98 X10 Z-5\n", [(10, 50), (10, 3), (10, -5), (10, 50)]),
    ("G99 G81 X50 Z-2 R3 F100\nG98 G82 X10 Z-5 R3 P1\n", [(10, 50), (10, 3), (10, -5), (10, 50)]),
    ("G99 G81 X50 Z-2 R40 F100\nG98 X10 R19\n", [(10, 40), (10, 19), (10, -2), (10, 50)]),
    ("G99 G81 X50 Z-2 R3 F100\nX10 R20\nX20 R5\n", [(10, 20), (10, -2), (10, 20), (20, 20), (20, 5), (20, -2), (20, 5)]),
    ("G99 G81 X50 Z-2 R3 F100\nG98 X10 R60\nX20\n",
     [(50, 60), (10, 60), (10, -2), (10, 60), (20, 60), (20, -2), (20, 60)]),
    ("G0 Z1\nG98 G81 X50 Z-2 R3 F100\nX10 R20\nX20 R3\n",
     [(50, 20), (10, 20), (10, -2), (10, 20), (10, 3), (20, 3), (20, -2), (20, 3)])])
def test_the_level_on_the_way_to_the_next_hole(text: str, travel: list[tuple[float, float]]) -> None:
    """As LinuxCNC's interpreter goes (rs274 of 2.9): aslant to where the cycle ends unless the tool stands
    above the plane, to the plane first where the sequence began below it; G80 begins a sequence again."""
    motion, _ = read("G0 X0 Y0 Z50\n" + text)
    found = [(round(float(e[0]) - 10, 3), round(float(e[2]) - 30, 3)) for e in motion.end]
    assert found[found.index((50, -2)) + 2:] == travel


def test_pecking_and_boring() -> None:
    def z(text: str) -> list[tuple[float, int]]:
        motion, _ = read("G0 X0 Y0 Z5\n" + text)
        return [(round(float(e[2]) - 30, 3), int(c)) for e, c in zip(motion.end, motion.code, strict=True)][2:]
    assert z("G99 G83 X1 Y0 Z-9 R3 Q5 F100\n") == [(3, 0), (-2, 1), (3, 0), (-1.746, 0), (-7, 1), (3, 0), (-6.746, 0),
                                                   (-9, 1), (3, 0)]
    assert z("G99 G73 X1 Y0 Z-9 R3 Q5 F100\n") == [(3, 0), (-2, 1), (-1.746, 0), (-7, 1), (-6.746, 0), (-9, 1), (3, 0)]
    for code in ("G84", "G85", "G89 P1"):
        assert z(f"G98 {code} X1 Y0 Z-9 R3 F100\n") == [(3, 0), (-9, 1), (3, 1), (5, 0)]


def test_lower_case_blanks_numbers_and_comments() -> None:
    text = "%\n(head X9)\nn10 g 0 x 1.5 y+2.\nN20 G1 z-.5F100 ; X7\nX 3 (between X8) Y4\r\n%\n"
    assert ends(text) == [[11.5, 22, 400], [11.5, 22, 29.5], [13, 24, 29.5]]


# ---- against the own executor ------------------------------------------------------------------------------


def random_program(rng: np.random.Generator) -> str:
    """Rapids, feeds in both modes, arcs, cycles, offsets and tool changes in random order, valid RS274/NGC."""
    lines, here = ["G21 G90 G94 G17 G54", "G0 X0 Y0 Z20"], [0.0, 0.0, 20.0]
    for _ in range(60):
        kind = rng.integers(0, 8)
        x, y, z = np.round(rng.uniform(-50, 50, 3), 3)
        if kind == 0:
            lines.append(f"G0 X{x} Y{y}")
            here[:2] = [x, y]
        elif kind == 1:
            lines += [f"G94 G1 X{x} F{rng.integers(50, 900)}", f"Z{z}"]
            here[0], here[2] = x, z
        elif kind == 2:
            lines += [f"G93 G1 Y{y} F{rng.integers(2, 90)}", f"X{x} F3", "G94"]
            here[0], here[1] = x, y
        elif kind == 3:
            r = round(rng.uniform(1, 9), 3)
            lines.append(f"G94 G17 G{rng.integers(2, 4)} X{here[0]:.3f} Y{here[1] + 2 * r:.3f} I0 J{r} F100")
            here[1] += 2 * r
        elif kind == 4:
            r = round(rng.uniform(1, 9), 3)
            lines.append(f"G94 G18 G{rng.integers(2, 4)} X{here[0] + r:.3f} Z{here[2] - r:.3f} I{r} K0 F100")
            here[0], here[2] = here[0] + r, here[2] - r
        elif kind == 5:
            code = ["81", "82", "83", "73", "84", "85", "89"][rng.integers(0, 7)]
            lines += ["G94 G17 G0 Z60", f"G9{rng.integers(8, 10)} G{code} X{x} Y{y} Z{-abs(z) - 5} R3 Q4 P1 F90",
                      f"X{y} Y{x}", f"G9{rng.integers(8, 10)} X{x - 1} R2", "G80", "G0 Z60"]
            here = [float(x) - 1, float(x), 60.0]
        elif kind == 6:
            lines += ["G53 G0 Z400", "G49", f"T{rng.integers(1, 3)} M6", f"G43 H{rng.integers(1, 3)}", "S900 M3", "M8",
                      "G0 Z30"]
            here[2] = 30.0
        else:
            lines += ["M9", "M5", f"G0 X{x} Z{z}"]
            here[0], here[2] = x, z
    return "\n".join(lines) + "\n"


@pytest.mark.covering(count=6)
@pytest.mark.parametrize("seed", range(12))
def test_random_programs_as_the_own_executor_runs_them(seed: int) -> None:
    text = random_program(np.random.default_rng(seed))
    motion, found = read(text)
    assert not found, [str(d) for d in found]
    steps = Peer(XYZ, WORK[XYZ], LENGTHS, HOME[XYZ]).run(text)
    before = np.concatenate([motion.start[None], motion.end[:-1]])
    moved = (np.abs(motion.end - before).max(axis=1) > 1e-9) | (motion.code == 2)
    mine = [s for s, at in zip(steps, [HOME[XYZ], *(s.end for s in steps)], strict=False)
            if s.kind == "arc" or np.abs(s.end - at).max() > 1e-9]
    assert moved.sum() == len(mine)
    rows = np.flatnonzero(moved)
    for k, s in zip(rows, mine, strict=True):
        where = f"line {s.line}: {text.splitlines()[s.line - 1]}"
        assert motion.line[k] == s.line, where
        assert np.abs(motion.end[k] - s.end).max() < 1e-9, where
        assert ("rapid", "feed", "arc")[motion.code[k]] == s.kind, where
        assert (motion.spindle[k], motion.flood[k]) == (s.spindle, s.coolant), where
        assert motion.register[k] == s.register and max(motion.tool[k], 0) == s.tool, where
        if s.kind != "rapid":
            assert motion.feed[k] == s.feed and motion.inverse[k] == s.inverse, where


# ---- what is refused ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("text", "code"), [
    ("G0 X1\nG68.2 X1\n", "gcode.unknown_code"), ("G92 X1\n", "gcode.unknown_code"),
    ("G58.1 X1\n", "gcode.unknown_code"), ("M98 P2\n", "gcode.unknown_code"),
    ("G0 B5\n", "gcode.unknown_word"), ("G0 U5\n", "gcode.unknown_word"),
    ("G0 X1 X2\n", "gcode.repeated"), ("G0 G1 X1 F9\n", "gcode.repeated"), ("G17 G18 G0 X1\n", "gcode.repeated"),
    ("G0 X#1\n", "gcode.syntax"), ("G0 X[1+2]\n", "gcode.syntax"),
    ("O100 SUB\n", "gcode.syntax"), ("G0 X1e3\n", "gcode.unknown_word"),
    ("G0 X1,5\n", "gcode.syntax"), ("G0 X\n", "gcode.syntax"), ("G0 X--1\n", "gcode.syntax"),
    ("G0 X1 (open\n", "gcode.syntax"),
    ("G0 X1\n/G0 X2\n", "gcode.block_delete"),
    ("G0 Z5\nG81 X1 Y1 F9\n", "gcode.cycle"), ("G0 Z5\nG83 X1 Y1 Z-5 R2 F9\n", "gcode.cycle"),
    ("G0 Z5\nG81 X1 Z-5 R2 F9\nG83 X2\n", "gcode.cycle"),
])
def test_what_it_cannot_execute_is_an_error_with_the_line(text: str, code: str) -> None:
    _, found = read(text)
    assert code in codes(found)
    d = next(d for d in found if d.code == code)
    assert d.lines and d.lines[0] == next(i for i, n in enumerate(text.splitlines(), 1) if re.search(
        r"^/|G68|G92|G58|M98|B5|U5|X1 X2|G0 G1|G17 G18|#|\[|SUB|1e3|,|X$|--|\(open|G81 X1 Y1|G83", n))


def test_nothing_at_all() -> None:
    motion, found = read("%\n(nothing)\n%\n")
    assert len(motion) == 0 and not found


# ---- the walk ----------------------------------------------------------------------------------------------


def random_walk(rng: np.random.Generator, moves: int) -> tuple:
    """Moves (lines, arcs, still, links) and blocks that follow them in several pieces, some with noise."""
    start, end, a0, a1, kinds, center, normal, sweep = [], [], [], [], [], [], [], []
    tips, axes, swept = [], [], []
    p, a = np.zeros(3), np.array([0, 0, 1.0])
    for _ in range(moves):
        kind, pieces = rng.choice(["line", "arc", "still", "turn", "link"], p=[0.5, 0.2, 0.1, 0.1, 0.1]), rng.integers(1, 5)
        c, n, s, b, q = np.zeros(3), np.array([0, 0, 1.0]), 0.0, a, p
        if kind in ("line", "link", "turn"):
            b = unit(a + rng.normal(0, 0.1, 3)) if kind != "line" or rng.random() < 0.5 else a
            q = p + rng.normal(0, 5, 3) if kind != "turn" else p
        if kind == "arc":
            r, s = rng.uniform(2, 9), rng.uniform(0.5, 9)
            c = p - [r, 0, 0]
            q = c + np.array([r * np.cos(s), r * np.sin(s), 0])
        for t in np.arange(1, pieces + 1) / pieces if kind != "still" else []:
            if kind == "arc":
                tips.append(c + np.array([r * np.cos(s * t), r * np.sin(s * t), 0]))
                swept.append(s / pieces)
            else:
                tips.append(p + t * (q - p) + (rng.normal(0, 0.002, 3) if t < 1 else 0))
                swept.append(np.nan)
            axes.append(unit(a + t * (b - a)))
        start.append(p)
        end.append(q)
        a0.append(a)
        a1.append(b)
        kinds.append({"arc": 1, "link": 2}.get(kind, 0))
        center.append(c)
        normal.append(n)
        sweep.append(s)
        p, a = q, b
    arrays = [np.array(x) for x in (start, end, a0, a1, kinds, center, normal, sweep)]
    return arrays, np.array(tips), np.array(axes), np.array(swept)


def walked(data: tuple, blocks: slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
    (start, end, a0, a1, kinds, center, normal, sweep), tips, axes, swept = data
    curves = Curves(start, end, a0, a1, kinds == 1, center, normal, sweep)
    return align.align(tips[blocks], axes[blocks], swept[blocks], curves, kinds == 2, 0.01, 1e-3)


@pytest.mark.slow  # make numeric runs it too; the plain walk alone is held below
@pytest.mark.numeric
def test_compiled_walk_is_the_plain_walk(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [random_walk(np.random.default_rng(seed), 150) for seed in range(8)]
    plain = [walked(c) for c in cases] + [walked(c, slice(0, 90)) for c in cases]
    monkeypatch.setattr(align, "_COMPILE_FROM", 0)
    fast = [walked(c) for c in cases] + [walked(c, slice(0, 90)) for c in cases]
    for (m0, o0), (m1, o1) in zip(plain, fast, strict=True):
        assert np.array_equal(m0, m1) and np.array_equal(o0, o1)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("seed", range(6))
def test_walk_gives_each_move_its_own_blocks(seed: int) -> None:
    (_, end, *_), tips, _, _ = data = random_walk(np.random.default_rng(100 + seed), 80)
    match, owner = walked(data)
    assert (match >= 0).all() and (np.diff(match) >= 0).all()
    assert np.abs(tips[match] - end).max() < 0.02
    assert match[-1] == len(tips) - 1 and (np.diff(owner) >= 0).all()


def line_move(axis1: np.ndarray) -> Curves:
    """10 mm along X, the axis turned from Z to axis1."""
    none = np.zeros((1, 3))
    return Curves(none, np.array([[10.0, 0, 0]]), np.array([[0.0, 0, 1]]), axis1[None], np.array([False]), none,
                  np.array([[0.0, 0, 1]]), np.zeros(1))


def test_blocks_that_come_nearer_to_the_end_are_the_moves_own() -> None:
    """The last 4 micrometres of a move are its own block, not the next move's."""
    tip, up = np.array([[5.0, 0, 0], [9.996, 0, 0], [10.0, 0, 0], [10.0, 1, 0]]), np.tile([0.0, 0, 1], (4, 1))
    match, owner = align.align(tip, up, np.full(4, np.nan), line_move(up[0]), np.array([False]), 0.01, 1e-3)
    assert match.tolist() == [2] and owner.tolist() == [0, 0, 0, 1]


def test_blocks_that_turn_alone_on_the_way_to_the_end_are_the_moves_own() -> None:
    """Near a pole the rotary words go on by one decimal at a time; a standing tip differs in the last bits."""
    x = [5.0, 9.993, 9.993 - 1e-15, 9.993, 9.998, 10.0, 10.3]
    turn = [4e-4, 3e-4, 2e-4, 2e-4, 1e-4, 0, 0]
    tip, axis = np.array([[v, 0, 0] for v in x]), np.array([[0, np.sin(a), np.cos(a)] for a in turn])
    match, owner = align.align(tip, axis, np.full(7, np.nan), line_move(axis[-1]), np.array([False]), 0.01, 1e-3)
    assert match.tolist() == [5] and owner.tolist() == [0] * 6 + [1]


def test_a_move_is_not_done_before_its_axis_is_there() -> None:
    """At the end of the path, but 1.5 tolerances short of the direction: the next block ends the move."""
    def at(degrees: float) -> np.ndarray:
        return np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    tip, axis = np.array([[10.0, 0, 0], [10.005, 0, 0]]), np.array([at(4.925), at(5.0)])
    match, _ = align.align(tip, axis, np.full(2, np.nan), line_move(at(5.0)), np.array([False]), 0.01,
                           np.radians(0.05))
    assert match.tolist() == [1]


def test_walk_stops_where_blocks_are_missing() -> None:
    data = random_walk(np.random.default_rng(4), 50)
    match, _ = walked(data, slice(0, len(data[1]) // 2))
    first = align.unreached(match)
    assert first > 0 and (match[first:] == -1).all()
