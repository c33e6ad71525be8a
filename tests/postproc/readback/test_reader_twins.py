"""Programs that must do the same: absolute and incremental, one dialect and another, written out and called."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.readback.execution.execute import Motion
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, TNC, good

Move = tuple[str, np.ndarray, tuple[float, ...]]
"""kind (rapid, feed, cw, ccw), end (3,), what it needs (feed; centre from the start)"""


def random_moves(rng: np.random.Generator, count: int = 40) -> list[Move]:
    """Rapids, feeds and G17 arcs in random order, three decimals."""
    here, moves = np.array([0.0, 0.0, 50.0]), [("rapid", np.array([0.0, 0.0, 50.0]), ())]
    for _ in range(count):
        kind = str(rng.choice(["rapid", "feed", "cw", "ccw"]))
        to = np.round(here + rng.uniform(-9, 9, 3), 3)
        if kind in ("cw", "ccw"):
            r = np.round(rng.uniform(2, 9), 2)
            to = np.array([here[0] + 2 * r, here[1], here[2]]).round(3)
            moves.append((kind, to, (float(rng.integers(50, 900)), float(r))))
        else:
            moves.append((kind, to, (float(rng.integers(50, 900)),)))
        here = to
    return moves


def iso(moves: list[Move], dialect: str, incremental: bool = False) -> str:
    """Fanuc, Haas or Siemens text; incremental from the second move on."""
    head = "%\nO0001\nG17 G21 G54 G90 G94\n" if dialect != SIEMENS else "G17 G710 G54 G90 G94\n"
    rows, here = [], np.zeros(3)
    for k, (kind, to, extra) in enumerate(moves):
        words = to - here if incremental and k else to
        text = " ".join(f"{a}{v:.3f}" for a, v in zip("XYZ", words, strict=True))
        code = {"rapid": "G0", "feed": "G1", "cw": "G2", "ccw": "G3"}[kind]
        rows.append(f"{code} {text}" + (f" I{extra[1]:.3f} J0.000" if len(extra) == 2 else "")
                    + (f" F{extra[0]:g}" if kind != "rapid" else ""))
        if incremental and not k:
            rows.append("G91")
        here = to
    return head + "\n".join(rows) + "\nM30\n" + ("%\n" if dialect != SIEMENS else "")


def klartext(moves: list[Move], incremental: bool = False) -> str:
    """The same as Klartext, arcs by CC and C or CR."""
    rows, here = ["BEGIN PGM T MM"], np.zeros(3)
    for k, (kind, to, extra) in enumerate(moves):
        sign = "I" if incremental and k else ""
        words = to - here if incremental and k else to
        text = [f"{sign}{a}{v:+.3f}" for a, v in zip("XYZ", words, strict=True)]
        if kind in ("cw", "ccw"):
            sense = "DR-" if kind == "cw" else "DR+"
            if k % 2:
                rows += [f"CC X{here[0] + extra[1]:+.3f} Y{here[1]:+.3f}", f"C {' '.join(text[:2])} {sense} F{extra[0]:g}"]
            else:
                rows.append(f"CR {' '.join(text[:2])} R{extra[1]:+.3f} {sense} F{extra[0]:g}")
        else:
            rows.append(f"L {' '.join(text)} R0 " + ("FMAX" if kind == "rapid" else f"F{extra[0]:g}"))
        here = to
    rows += ["M30", "END PGM T MM"]
    return "".join(f"{k} {row}\n" for k, row in enumerate(rows))


def same(a: Motion, b: Motion) -> None:
    assert np.array_equal(a.code, b.code)
    assert np.abs(a.end - b.end).max() < 1e-9
    arcs = a.code == 2
    assert np.abs(a.center[arcs][:, :2] - b.center[arcs][:, :2]).max(initial=0.0) < 1e-3
    assert np.array_equal(a.ccw[arcs], b.ccw[arcs])
    cutting = a.code > 0
    assert np.array_equal(a.feed[cutting], b.feed[cutting])


@pytest.mark.covering
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("dialect", [FANUC, HAAS, SIEMENS])
def test_incremental_twin(dialect: str, seed: int) -> None:
    moves = random_moves(np.random.default_rng(seed))
    same(good(dialect, iso(moves, dialect)), good(dialect, iso(moves, dialect, incremental=True)))


@pytest.mark.parametrize("seed", range(4))
def test_klartext_twin(seed: int) -> None:
    moves = random_moves(np.random.default_rng(100 + seed))
    expected = good(FANUC, iso(moves, FANUC))
    same(expected, good(TNC, klartext(moves)))
    same(expected, good(TNC, klartext(moves, incremental=True)))


@pytest.mark.parametrize("seed", range(3))
def test_siemens_twin_of_fanuc(seed: int) -> None:
    moves = random_moves(np.random.default_rng(200 + seed))
    same(good(FANUC, iso(moves, FANUC)), good(SIEMENS, iso(moves, SIEMENS)))


def cut(text: str, first: int, last: int) -> tuple[str, list[str], str]:
    rows = text.splitlines(keepends=True)
    return "".join(rows[:first]), rows[first:last], "".join(rows[last:])


@pytest.mark.parametrize("dialect", [FANUC, SIEMENS, TNC])
def test_called_twin(dialect: str) -> None:
    """A stretch of blocks in a subprogram, called where it stood."""
    moves = random_moves(np.random.default_rng(7), 30)
    text = klartext(moves) if dialect == TNC else iso(moves, dialect)
    before, middle, after = cut(text, 10, 20)
    if dialect == FANUC:
        called = before + "M98 P9\n" + after.removesuffix("%\n") + "O0009\n" + "".join(middle) + "M99\n%\n"
    elif dialect == SIEMENS:
        called = "%_N_A_MPF\n" + before + "PART\n" + after + "%_N_PART_SPF\n" + "".join(middle) + "M17\n"
    else:
        end = after.splitlines(keepends=True)
        called = before + "99 CALL LBL 5\n" + "".join(end[:-1]) + "100 LBL 5\n" + "".join(middle) + "101 LBL 0\n" + end[-1]
    plain, twin = good(dialect, text), good(dialect, called)
    same(plain, twin)
    assert not np.array_equal(plain.line, twin.line)


def test_feed_modes_and_planes_survive_a_call() -> None:
    """What a subprogram puts in force stays in force behind it."""
    text = "%\nO0001\nG54 G90 G94 G17\nG0 X0. Y0. Z0.\nM98 P2\nG1 X5. F100\nM30\nO0002\nG91 G18 G93\nM99\n%\n"
    motion = good(FANUC, text)
    assert motion.inverse[-1] and motion.plane[-1] == 18 and (motion.end[-1] - motion.end[-2])[0] == 5.0


@pytest.mark.parametrize("dialect", [FANUC, HAAS, SIEMENS, TNC])
def test_line_ends_and_case_do_not_matter(dialect: str) -> None:
    moves = random_moves(np.random.default_rng(11))
    text = klartext(moves) if dialect == TNC else iso(moves, dialect)
    same(good(dialect, text), good(dialect, text.replace("\n", "\r\n")))
    same(good(dialect, text), good(dialect, text.lower()))
