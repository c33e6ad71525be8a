"""Answers on standard input: what ends them."""

from __future__ import annotations

import io

import pytest

from postproc.cli.shared.says import answer_line


class Broken(io.StringIO):
    def readline(self, *_: object) -> str:
        raise OSError("no such device")


@pytest.mark.parametrize("stdin", [None, io.StringIO(""), Broken()])
def test_input_that_is_closed_ended_or_cannot_be_read_gives_no_answer(stdin: io.StringIO | None,
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", stdin)
    with pytest.raises(EOFError):
        answer_line()


def test_a_line_is_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("80.5\nnext\n"))
    assert answer_line() == "80.5\n"
