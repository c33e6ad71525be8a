"""Words read in one pass are those of the array form, to the last bit; what is no plain block is left to it."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.readback.text import word_loop
from postproc.readback.text.words import Words, read_words, tokenise


def read(text: bytes, at_once: bool, monkeypatch: pytest.MonkeyPatch) -> Words:
    monkeypatch.setattr(word_loop, "wanted", lambda *_: at_once)
    monkeypatch.setattr(word_loop, "compiled", lambda function: function)
    words, found = read_words(text)
    assert not found
    return words


def test_words_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    rows = [f"N{k} G1X{a:.4f} Y{b:.3f}\tZ{c:g}A+{abs(a):.5f} C-.{k} F{k}." for k, (a, b, c) in
            enumerate(rng.uniform(-900, 900, (80, 3)).tolist())]
    text = ("\n".join(rows) + "\n\n  \nM30\n").encode()
    fast, slow = (read(text, at_once, monkeypatch) for at_once in (True, False))
    assert fast.lines == slow.lines and fast.value.tobytes() == slow.value.tobytes()
    assert all(getattr(fast, name).tolist() == getattr(slow, name).tolist() for name in ("letter", "line", "point"))
    assert len(fast.letter) == 80 * 8 + 1


@pytest.mark.parametrize("text", [b"X1 (\n", b"X\n", b"X 1\n", b"1\n", b"X1.2.3\n", b"X--1\n", b"X.\n", b"X#1\n", b"X=1\n",
                                  b"X0.1234567890123456\n"])
def test_what_is_odd_is_left_to_the_array_form(text: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(word_loop, "wanted", lambda *_: True)
    monkeypatch.setattr(word_loop, "compiled", lambda function: function)
    assert word_loop.words_at_once(b"G0 Z5\n" + text) is None and word_loop.words_at_once(text) is None


@pytest.mark.parametrize("text", [b"271\n", b"G1 X5\n(51.)\n$\n", b"-+.5\n", b"(G1)\n9\n"])
def test_lines_without_letters_are_no_blocks(text: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(word_loop, "wanted", lambda *_: True)
    monkeypatch.setattr(word_loop, "compiled", lambda function: function)
    assert [d.code for d in tokenise(text)[1]] == ["gcode.syntax"]


@pytest.mark.parametrize(("text", "lines"), [
    (b"%\nG0 X1\n%\n", []), (b"%\nG0 X1\n %\nX2\n%\n", [3]), (b"\n\n%O1\nG0 X1\n\t%\nM30\n", [5]), (b"G0 X1\nX2 %\n%", [])])
def test_marks_of_the_tape_between_blocks(text: bytes, lines: list[int]) -> None:
    found = [d for d in tokenise(text)[1] if d.code == "gcode.after_end"]
    assert [d.lines for d in found] == ([tuple(lines)] if lines else [])
