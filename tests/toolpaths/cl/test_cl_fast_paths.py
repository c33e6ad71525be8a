"""What the fast paths of the lexer take must be what the slow ones make of the same text."""

from __future__ import annotations

import pytest

from toolpaths.cl.read import read_bytes
from toolpaths.cl.text.scan import scan
from toolpaths.cl.text.statements import words_of

HEAD = "UNITS/MM\nFEDRAT/600\n"


@pytest.mark.parametrize("line", ["GOTO/1,2,3 $$ up", "GOTO/1,2,3$$", "goto / 1,2,3 $$ $ $$ 4,5",
                                  "GOTO/1,2, $ $$ rest below\n3", "GOTO/1,2, $$ point 3 follows\n$$\n"])
def test_points_with_a_comment_behind_them(line: str) -> None:
    found = read_bytes(f"{HEAD}GOTO/0,0,0\n{line}\nGOTO/4,5,6,0,0,1 $$ end\nFINI $$ last\n")
    whole = "3" in line.replace("point 3", "")
    assert found.toolpath.tip.tolist() == ([[0, 0, 0], [1, 2, 3], [4, 5, 6]] if whole else [[0, 0, 0], [4, 5, 6]])
    assert ("cl.goto" in [d.code for d in found.diagnostics]) is not whole


def test_points_with_a_comment_behind_them_are_plain() -> None:
    found = scan(b"PPRINT/$$ GOTO/7,8,9\n"
                 b"GOTO/1,2,3 $$ a\nLOADTL/1 $$ b\nGOTO/4,5,6 $$ c, 7\n$$ GOTO/1,1,1\nGOTO/1,2 $$ ,3\n")
    assert found.points.xyz.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert found.points.line.tolist() == [2, 4] and found.line == [1, 3, 5, 6]


@pytest.mark.parametrize(("text", "value"), [
    ("1", 1.0), ("+1.", 1.0), ("-.5", -0.5), ("1e-3", 0.001), ("1D+2", 100.0), ("1.5d+1", 15.0), ("1_0", "1_0"),
    ("inf", "INF"), ("-inf", "-INF"), ("nan", "NAN"), ("0x10", "0X10"), ("1.2.3", "1.2.3"), ("--1", "--1"), ("1-", "1-"),
    (".", "."), ("1e999", "1E999"), ("3DCOMP", "3DCOMP"), ("DEEP2", "DEEP2"), ("+-1", "+-1"), ("1e", "1E"),
    ("\u0661", "\u0661"),
])
def test_what_is_a_number(text: str, value: float | str) -> None:
    assert words_of(text) == (value,)


@pytest.mark.parametrize(("plain", "other"), [
    ("FEDRAT/MMPM,100.", "fedrat / mmpm , 100."), ("SPINDL/RPM,900,CLW", "SPINDL/RPM,$\n900,CLW"),
    ("LOADTL/3", "LOADTL/3 $$ mill"), ("COOLNT/ON", "A1)COOLNT/ON"), ("PPRINT/A,B", "PPRINT A,B"),
    ("INSERT/M8", "INSERT M8"),
])
def test_plain_records_equal_their_other_spellings(plain: str, other: str) -> None:
    def of(record: str) -> object:
        path = read_bytes(f"{HEAD}GOTO/0,0,0\n{record}\nGOTO/1,0,0\n").toolpath
        return path.feed.tolist(), path.tools, [(e.word, e.values, e.index) for e in path.events]
    assert of(plain) == of(other)
