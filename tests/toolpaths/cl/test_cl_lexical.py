"""How lines become statements: section by section the habits of real files."""

from __future__ import annotations

import random

import numpy as np
import pytest

from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.cl.text import scan
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.source import normalise
from toolpaths.cl.text.statements import statement_of, words_of
from toolpaths.cl.write import text_of
from toolpaths.diagnostics import Severity, has_errors


def read(text: str | bytes, **options: str) -> ReadResult:
    return read_bytes(text, **options)


def clean(text: str | bytes) -> ReadResult:
    result = read(text)
    assert not [str(d) for d in result.diagnostics if d.severity is not Severity.INFO]
    return result


HEAD = "UNITS/MM\nFEDRAT/100\n"


@pytest.mark.parametrize("line", [
    "GOTO/1,2,3,0,0,1", "GOTO  /   1.00000,2.,  3.0 , 0,0,1", "goto/1,2,3,0,0,1   ", "  GOTO/1,2,3,0,0,1",
    "GOTO/1 2 3 0 0 1", "GOTO/1.0,2.0, $\n 3.0,0,$\n0,1", "GOTO/1,2,3, $ $$ the rest is below\n0,0,1",
    "GOTO/1,2,3,$ $$ and a comment\n0,0,1", "GOTO/1,2,3,0,0,1 $$-> note", "GOTO/+1.,2,.3E+1,0,0,1.",
    "GOTO/1,2,3,0,0,1,", "GOTO/1,2,3,0,0,1,,", "GOTO/1.0D+0,2,3,-0,0,1", "\tGOTO /\t1,2,3,0,0,1\t",
    "GOTO/1,2,$\n$$ between\n3,0,0,1", "GOTO/1,2,$\n   \n\n3,0,0,1", "GOTO/1,2,3,0.0000000,-0.0000000,1",
])
def test_one_point_in_many_spellings(line: str) -> None:
    p = clean(HEAD + line).toolpath
    assert p.tip.tolist() == [[1.0, 2.0, 3.0]]
    assert p.axis.tolist() == [[0.0, 0.0, 1.0]]
    assert p.line.tolist() == [3]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends(end: str) -> None:
    p = clean((HEAD + "GOTO/1,2,3\nRAPID\nGOTO/1,2,$\n4").replace("\n", end)).toolpath
    assert p.tip[:, 2].tolist() == [3.0, 4.0]
    assert p.line.tolist() == [3, 5]


def test_mixed_line_ends_keep_the_line_numbers() -> None:
    assert clean("UNITS/MM\r\nFEDRAT/1\nGOTO/1,2,3\rGOTO/1,2,4\r\n\r\nGOTO/1,2,5").toolpath.line.tolist() == [3, 4, 6]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1", "utf-32"])
def test_encodings(encoding: str) -> None:
    result = clean(("PARTNO/Stützplatte é\n" + HEAD + "GOTO/1,2,3\n").encode(encoding))
    assert result.toolpath.name == "Stützplatte é"
    assert result.toolpath.tip.tolist() == [[1.0, 2.0, 3.0]]


@pytest.mark.parametrize(("line", "word", "text"), [
    ("PPRINT hello", "PPRINT", "hello"), ("PPRINT/A/B,C=[1] $x", "PPRINT", "A/B,C=[1] $x"),
    ("INSERT/[HOLDER=C40-32ERP412] 20.0mm JOBBER DRILL", "INSERT", "[HOLDER=C40-32ERP412] 20.0mm JOBBER DRILL"),
    ("PPRINT / x, 1, 2, 3", "PPRINT", "x, 1, 2, 3"), ("INSERT G4 X2", "INSERT", "G4 X2"),
    ("PPRINTTEXT IN COLUMN 7", "PPRINT", "TEXT IN COLUMN 7"),
])
def test_text_words(line: str, word: str, text: str) -> None:
    events = clean(HEAD + line + "\nGOTO/1,2,3").toolpath.events
    assert [(e.word, e.values) for e in events] == [(word, (text,))]


def test_a_dollar_in_text_does_not_swallow_the_next_record() -> None:
    p = clean(HEAD + "PPRINT it costs 5$\nRAPID\nGOTO/1,2,3").toolpath
    assert p.kind.tolist() == [0]


def test_words_that_begin_with_a_digit() -> None:
    assert words_of("DEEP2, 1STPECK ,5.,3DCOMP,2 3,,x,,") == ("DEEP2", "1STPECK", 5.0, "3DCOMP", 2.0,
                                                              3.0, "", "X")


@pytest.mark.parametrize(("text", "major"), [
    ("TOOL PATH/a", "TOOL PATH"), ("tool   path / a", "TOOL PATH"), ("END-OF-PATH", "END-OF-PATH"),
    ("CSI_SET_FLUTE_LENGTH/5", "CSI_SET_FLUTE_LENGTH"), ("RAPID/", "RAPID"), ("TLON,GOFWD/ (x)", "TLON,GOFWD"),
    ("TLON, GOFWD /(x)", "TLON,GOFWD"),
])
def test_majors(text: str, major: str) -> None:
    assert statement_of(text).major == major


def test_word_lists_continue_behind_the_comma() -> None:
    p = clean(HEAD + "SPINDL / RPM,  1000.0, $\n  CLW\nLOADTL / 4,  $\n OSETNO,  4 $$-> THREAD TOOL\nGOTO/1,2,3").toolpath
    assert [(e.word, e.values) for e in p.events] == [("SPINDL", ("RPM", 1000.0, "CLW")), ("LOADTL", (4.0, 4.0))]
    assert [e.line for e in p.events] == [3, 5]


def test_continued_data_comment() -> None:
    text = HEAD + "$$-> CSYS / 1.0, 0.0, 0.0, 10.0,  $\n 0.0, 1.0, 0.0, 20.0,  $\n 0.0, 0.0, 1.0, 30.0\nGOTO/1,2,3"
    assert clean(text).toolpath.tip.tolist() == [[11.0, 22.0, 33.0]]


def test_listing_text_around_the_program() -> None:
    text = ("=====\nInformation listing created by :  someone\nDate :  2/4/2013 9:17:44 PM\n" + HEAD +
            "GOTO/1,2,3\nEND-OF-PATH\nTool Path Listing has 34633 lines.\nIZLAZ\n\x02\n")
    result = read(text)
    assert not has_errors(result.diagnostics)
    assert result.unknown_words == {}
    assert {d.code for d in result.diagnostics} == {"cl.listing-text"}


def test_card_numbers_are_left_out() -> None:
    lines = ["UNITS/MM", "FEDRAT/100", "GOTO/1,2,3", "GOTO/4,5,6", "GOTO/7,8,9", "FINI"]
    text = "\n".join(f"{line:<72}{10 * k:08d}" for k, line in enumerate(lines, 1))
    result = read(text)
    assert result.toolpath.tip.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert [d.code for d in result.diagnostics] == ["cl.card-numbers"]


def test_numbers_of_points_in_columns_73_to_80_are_left_out() -> None:
    arc = f"{'TLON,GOFWD/ (CIRCLE/    0.00000,    0.00000,    0.00000,$':<72}CIR    1\n   10.00000),ON,$\n" \
          "(LINE/    0.00000,    0.00000,    0.00000,    0.00000,   10.00000,    0.00000)\n"
    text = ("$$*CATIA0\nUNITS/MM\nFEDRAT/100,MMPM\n" + f"{'GOTO/   10.00000,    0.00000,    0.00000':<72}PT     1\n"
            + "INDIRV/    0.00000,    1.00000,    0.00000\n" + arc
            + f"{'GOTO/   -5.00000,   10.00000,    0.00000':<72}PT  4711\nPPRINT PT     3\n")
    result = read(text)
    assert result.toolpath.tip.tolist() == [[10, 0, 0], [0, 10, 0], [-5, 10, 0]]
    assert [(d.code, d.lines) for d in result.diagnostics] == [("cl.card-numbers", (4,))]
    assert result.toolpath.events[-1].values == ("PT     3",)


@pytest.mark.parametrize("tail", ["PT     1,", "PT 1", "XY     1", "9PT     1"])
def test_what_only_resembles_numbers_of_points_stays(tail: str) -> None:
    data = f"UNITS/MM\n{'PPRINT':<72}{tail}\n{'PPRINT':<71}PT     1\n".encode()
    assert normalise(data, DiagnosticLog()) == data


def test_long_lines_are_not_cut() -> None:
    numbers = ",".join(["1.00000000000000000000000"] * 3) + ",0.00000000000000000000,0.0000000000000000,1.000000000000"
    log = DiagnosticLog()
    data = ("UNITS/MM\n" + f"GOTO/{numbers}\n" * 8).encode()
    assert normalise(data, log) == data
    assert not log.diagnostics()


def test_unknown_words_are_counted_once_with_their_lines() -> None:
    result = read(HEAD + "FLUB/1\nGOTO/1,2,3\nFLUB/ON\nBLAB\nGOTO/1,2,3")
    assert result.unknown_words == {"FLUB": 2, "BLAB": 1}
    found = {d.message.split()[2].strip(","): (d.lines, d.count) for d in result.diagnostics}
    assert found == {"FLUB": ((3, 5), 2), "BLAB": ((6,), 1)}


def test_allow_unknown() -> None:
    text = HEAD + "GOTO/1,2,3\nMOVEXYZ/1,2,3\nTRACUT/5\nGOTO/1,2,4"
    assert has_errors(read(text).diagnostics)
    result = read_bytes(text, allow_unknown=["movexyz", "TRACUT"])
    assert not has_errors(result.diagnostics)
    assert result.unknown_words == {"MOVEXYZ": 1, "TRACUT": 1}


def test_wrong_use_raises() -> None:
    with pytest.raises(ValueError, match="did you mean 'creo'"):
        read("", dialect="croe")
    with pytest.raises(ValueError, match="mm or inch"):
        read("", units="cm")


@pytest.mark.parametrize(("spoilt", "rows"), [
    ("", 0), ("GOTO / 7, 8, $\n", 0), ("GOTO / 7, 8, 9 $\n 0, 0, 1\n", 1),
    ("GOTO / 7, 8, 9, $$ half a note $\n", 1), ("$$-> NOTE / 1, $\n 2, 3\n", 0), ("GOTO / 7, $\n8, $\n9\n", 1),
])
def test_continued_points_are_read_at_once_or_one_by_one_with_the_same_result(spoilt: str, rows: int) -> None:
    """One line that is no plain continuation sends its block to the slow path: rows and lines must not change."""
    lines = "".join(f"GOTO / {k}, 2, 3, $\n 0, 0, 1\nGOTO / {k}.5, 2, 3, 0, 0, 1  \nGOTO / {k}, $  \n{k}, 3\n"
                    for k in range(5))
    result = read(HEAD + lines + spoilt + lines)
    p = result.toolpath
    assert has_errors(result.diagnostics) == (spoilt == "GOTO / 7, 8, $\n")
    one, per = read(HEAD + lines).toolpath, lines.count("\n") + spoilt.count("\n")
    assert len(p) == 30 + rows
    assert not rows or p.tip[15].tolist() == [7, 8, 9]
    assert p.tip[:15].tolist() == one.tip.tolist() == p.tip[-15:].tolist()
    assert p.line[:15].tolist() == one.line.tolist() == (p.line[-15:] - per).tolist()
    assert one.line.tolist() == [3 + 5 * (i // 3) + (0, 2, 3)[i % 3] for i in range(15)]
    assert one.tip[:3].tolist() == [[0, 2, 3], [0.5, 2, 3], [0, 0, 3]]


def test_continued_points_go_the_fast_way() -> None:
    found = scan.scan(b"GOTO / 1, 2, 3, $\n 0, 0, 1\nRAPID\nGOTO/1,2,3,$\n0,0,1\nGOTO/4,5,6")
    assert found.points.line.tolist() == [1, 4, 6]
    assert (found.line, found.before, found.lines) == ([3], [1], 6)


@pytest.mark.parametrize("line", ["GOTO/ ,1,2", "GOTO/,1,2", "GOTO / , 1, 2", "GOTO/1, ,2", "GOTO/ , $\n 1,2"])
def test_a_missing_first_number_is_no_number(line: str) -> None:
    result = read(f"{HEAD}{line}\nGOTO/4,5,6\n")
    assert [d.code for d in result.diagnostics] == ["cl.number"]
    assert result.toolpath.tip.tolist() == [[4, 5, 6]]


def test_text_never_ends_in_a_continuation_mark() -> None:
    events = clean(HEAD + "PPRINT/now  $$ \nPPRINT 5$\nGOTO/1,2,3").toolpath.events
    assert [e.values for e in events] == [("now",), ("5",)]


def test_joining_at_once_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Random spellings of continued lines, in blocks of any size, with the joining and without it."""
    rng = random.Random(5)
    breaks = ["$\n", " $ \n", "$ \n ", "$$ c\n", "$ x\n", "\n", "$\n\n", "$\n$$ c\n", "", "", "", "", "", "", ""]
    heads = ["GOTO/", "GOTO / ", "goto/", "GOTO/", "GOTO", "GOXO/", "$$-> CSYS /", "CIRCLE/", "PPRINT ", "GODLTA/"]
    numbers = ["1", "2.5", "-3", "0", "1.", "0,0,1", "1 2", ""]
    for _ in range(150):
        text = HEAD
        for _ in range(rng.randint(1, 8)):
            fields = [rng.choice(numbers) + rng.choice(breaks) for _ in range(rng.randint(1, 7))]
            text += rng.choice(heads) + ",".join(fields) + rng.choice(["\n", ",\n", "$\n", "\n1,2,3\n", "\nRAPID\n"])
        results = []
        for size, joined in ((1 << 22, scan._joined), (40, scan._joined),
                             (60, lambda c: (c, np.zeros(0, np.int64)))):
            with monkeypatch.context() as patch:
                patch.setattr(scan, "CHUNK", size)
                patch.setattr(scan, "_joined", joined)
                results.append(read(text))
        for other in results[1:]:
            assert other.toolpath.equals(results[0].toolpath), text
            assert other.toolpath.line.tolist() == results[0].toolpath.line.tolist(), text
            assert [(d.code, d.lines) for d in other.diagnostics] == [(d.code, d.lines) for d in results[0].diagnostics]


def test_long_events_are_wrapped_where_no_record_could_begin() -> None:
    words = ["RPM", *["TPRINT"] * 40, *["5"] * 150, *["FINI"] * 60]
    p = read(HEAD + "SPINDL/" + ",".join(words) + "\nGOTO/1,2,3\n").toolpath
    text = text_of(p)
    assert text.count("$\n") > 1
    assert read(text).toolpath.equals(p)


def test_messages_of_endless_records_are_short() -> None:
    found = read_bytes("UNITS/MM\nGOTO/" + "1" * 100_000 + ",0,0\n").diagnostics
    assert found and all(len(str(d)) < 500 for d in found)
