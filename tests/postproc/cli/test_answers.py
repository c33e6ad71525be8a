"""Answers on standard input: what ends them."""

from __future__ import annotations

import io
import os
from pathlib import Path

import pytest

from postproc.cli.shared.console import progress_bar
from postproc.cli.shared.says import answer_line


class Broken(io.StringIO):
    def readline(self, *_: object) -> str:
        raise OSError("no such device")


@pytest.mark.parametrize("stdin", [None, io.StringIO(""), Broken()])
def test_input_that_is_closed_ended_or_cannot_be_read_gives_no_answer(stdin: io.StringIO | None,
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", stdin)
    with pytest.raises(EOFError):
        answer_line("length: ")


def test_a_line_is_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("80.5\nnext\n"))
    assert answer_line("length: ") == "80.5\n"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("rounds", [1, 2])
def test_no_bar_moves_while_something_is_asked(rounds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Long work, a question, long work again and a second one: the bar wiped out what was asked, which waited for ever."""
    shown, moving = Terminal(), list[bool]()
    monkeypatch.setattr("sys.stderr", shown)
    monkeypatch.setattr("rich.progress.Progress.start", lambda bar: moving.append(True))
    monkeypatch.setattr("rich.progress.Progress.stop", lambda bar: moving.append(False))

    class Input(io.StringIO):
        def readline(self, *_: object) -> str:
            assert moving[-1] is False, "a bar runs over the question"
            return "80\n"

    monkeypatch.setattr("sys.stdin", Input())
    with progress_bar() as progress:
        for number in range(rounds):
            progress("solve", number, rounds)
            assert moving[-1] is True and answer_line(f"length {number}: ") == "80\n"
    assert "length 0: " in shown.getvalue()
    answer_line("after it: ")
    assert moving[-1] is False


def test_nothing_is_asked_where_nobody_can_answer(monkeypatch: pytest.MonkeyPatch,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    """A question on the null device stood in the middle of what was said next."""
    with Path(os.devnull).open(encoding="utf-8") as nobody:
        monkeypatch.setattr("sys.stdin", nobody)
        with pytest.raises(EOFError):
            answer_line("length: ")
    assert capsys.readouterr().err == ""
