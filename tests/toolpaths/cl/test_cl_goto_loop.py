"""Plain GOTO lines in one pass are what the array form makes of the same text, to the last bit; odd ones are left to it."""

from __future__ import annotations

import numpy as np
import pytest

from toolpaths.cl.text import goto_loop, scan

HEAD = "$$ part\nTOOL PATH/A,TOOL,B\n\n  \nPPRINT/GOTO/1,2,3\nGODLTA/1,2,3\n"


def split(text: str, at_once: bool, monkeypatch: pytest.MonkeyPatch) -> scan._Lines:
    monkeypatch.setattr(goto_loop, "wanted", lambda *_: at_once)
    monkeypatch.setattr(goto_loop, "compiled", lambda function: function)
    return scan._split(np.frombuffer(text.encode(), np.uint8), 1e6)


def numbers(count: int) -> list[str]:
    rng = np.random.default_rng(3)
    whole = rng.integers(-999_999, 999_999, (count, 9))
    places = rng.integers(0, 9, (count, 9))
    return [",".join(f"{w / 10.0**p:.{p}f}" for w, p in zip(row[:n], p_row[:n], strict=True))
            for row, p_row, n in zip(whole.tolist(), places.tolist(), [3, 6, 9] * count, strict=False)]


def test_lines_and_numbers_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    text = HEAD + "".join(f"GOTO/{row}\n" for row in numbers(60)) + "  goto  / +1. , -.5,\t-0 \nGOTO/1,2,3\n"
    fast, slow = (split(text, at_once, monkeypatch) for at_once in (True, False))
    assert fast.plain.sum() == 62
    for name in ("starts", "ends", "plain"):
        assert getattr(fast, name).tolist() == getattr(slow, name).tolist()
    assert fast.count[fast.plain].tolist() == slow.count[slow.plain].tolist()
    assert fast.numbers.tobytes() == slow.numbers.tobytes()


@pytest.mark.parametrize("line", [
    "GOTO/1,2,3e-3", "GOTO/1,2", "GOTO/1,2,3,4", "GOTO/1,2,3,", "GOTO/1,,3", "GOTO/1 2 3", "GOTO/1,2,--3", "GOTO/1,2,3.4.5",
    "GOTO/1,2,1234567.0", "GOTO/1,2,0.1234567890123456", "GOTO/A,1,2", "GOTO 1,2,3", "GOTO/1,2,3 $",
    "GOTO/" + "1," * 11 + "1",    "GOTO" + " " * 17 + "/1,2,3", " " * 17 + "GOTO/1,2,3", "GOTO/1,2,.", "GOTO", "GOTO/"])
def test_what_is_odd_is_left_to_the_array_form(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(goto_loop, "wanted", lambda *_: True)
    monkeypatch.setattr(goto_loop, "compiled", lambda function: function)
    text = f"GOTO/0,0,0\n{line}\nGOTO/4,5,6\n".encode()
    assert goto_loop.lines_at_once(np.frombuffer(text, np.uint8), 1e6) is None
