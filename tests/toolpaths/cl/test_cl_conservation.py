"""Conservation of records: executed, neutral by a list, or refused; the counts are printed."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

import toolpaths
from toolpaths.cl import interpret
from toolpaths.cl.inspect import inspect, summary
from toolpaths.cl.read import read_bytes, read_file
from toolpaths.diagnostics import Severity, has_errors
from toolpaths.toolpath import RecordCounts

SAMPLES = Path(__file__).parents[3] / "samples"
FILES = sorted(p for p in SAMPLES.rglob("*") if p.suffix in (".cls", ".apt", ".ncl", ".clt", ".as", ".aptsource"))
HEAD = "UNITS/MM\nFEDRAT/100\n"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_every_record_of_a_sample_is_executed_or_neutral(path: Path) -> None:
    result = read_file(path)
    counts = result.toolpath.records
    assert not has_errors(result.diagnostics)
    assert counts.total == counts.executed + counts.neutral > 0 and counts.dropped == 0
    assert str(counts) in summary(result) and inspect(result)["records"]["total"] == counts.total


@pytest.mark.parametrize(("text", "counts"), [
    (HEAD + "$$ note\nPAINT/PATH\nRAPID\nGOTO/1,2,3\nGOTO/1,2, $\n4\nFINI\n", RecordCounts(7, 6, 1, 0)),
    (HEAD + "GOTO/1,2,3\nFLUB/1\n@@ text\nTRACUT/5\nGOTO/1,2,4\n", RecordCounts(7, 4, 0, 3)),
    ("$$-> MFGNO / A\n" + HEAD + "DEFSUB / 1\nGOTO / 1,2,3\nENDSUB\nCALSUB / 1\nCALSUB / 1\n", RecordCounts(7, 7, 0, 0)),
    (HEAD + "RAPID\nGOTO/0,0,0\nNURBS/\nKNOT/0.5\n$$ note\nKNOT/1.0\nCNTRL/1,0,0\nCNTRL/3,1,0\nCNTRL/5,2,0\nCNTRL/8,2,0\n"
     "GOTO/9,2,0\n", RecordCounts(12, 12, 0, 0)),
    (HEAD + "COPY/NOMORE\nGOTO/1,2,3\nTRACUT/NOMORE\n", RecordCounts(5, 5, 0, 0)),
    ("=====\nDate : today\n" + HEAD + "GOTO/1,2,3\nTool Path Listing has 5 lines.\n", RecordCounts(6, 3, 3, 0)),
])
def test_counts(text: str, counts: RecordCounts) -> None:
    path, diagnostics = toolpaths.read_bytes(text)
    assert path.records == counts
    assert has_errors(diagnostics) == (counts.dropped > 0)


def test_what_is_allowed_is_neutral() -> None:
    text = HEAD + "GOTO/1,2,3\nFLUB/1\n@@ text\nGOTO/1,2,4\n"
    result = read_bytes(text, allow_unknown=["FLUB", "(TEXT)"])
    assert not has_errors(result.diagnostics) and result.toolpath.records == RecordCounts(6, 4, 2, 0)


@pytest.mark.parametrize("record", ["STOP/RAPID", "OPSTOP/CHECK GOTO/1", "MULTAX/ON,4", "COOLNT/FLOOD,1,2,3",
                                    "$$-> CUTTER / 10.5, 3", "UNITS/MM,3", "DELAY/1,2", "MODE/1X", "ROTATE/CAXIS,1,2"])
def test_the_hint_of_a_form_names_the_word_that_takes_it(record: str) -> None:
    text = f"{HEAD}GOTO/1,2,3\n{record}\nGOTO/1,2,4\n"
    (found,) = [d for d in read_bytes(text).diagnostics if d.severity is Severity.ERROR]
    assert found.code == "cl.form" and found.lines == (4,)
    word = shlex.split(found.hint.partition("--allow-unknown ")[2])[0]
    assert not has_errors(read_bytes(text, allow_unknown=[word]).diagnostics)


def test_a_dropped_record_that_nobody_names_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion word without an answer, planted; its hint is followed."""
    text = "a listing\n" + HEAD + "GOTO/1,2,3\nTRACUT/5\nGOTO/1,2,4\nCOPY/2\nTRACUT/6\n"
    assert "cl.dropped" not in {d.code for d in read_bytes(text).diagnostics}
    monkeypatch.setattr(interpret, "_unsupported", lambda *_: None)
    result = read_bytes(text)
    found = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert [(d.code, d.lines) for d in found] == [("cl.dropped", (5,))] and result.toolpath.records.dropped == 3
    assert "--allow-unknown TRACUT leaves such records out" in found[0].hint
    rest = read_bytes(text, allow_unknown=["TRACUT"])
    assert rest.toolpath.records.dropped == 1 and [d.lines for d in rest.diagnostics if d.code == "cl.dropped"] == [(7,)]
    whole = read_bytes(text, allow_unknown=["TRACUT", "COPY"])
    assert not has_errors(whole.diagnostics) and whole.toolpath.records == RecordCounts(8, 4, 4, 0)


def test_an_uncalled_subroutine_with_motion_words_is_left_out_once() -> None:
    text = "$$-> MFGNO / A\n" + HEAD + "DEFSUB / 1\nTRACUT/5\nGOTO / 1,2,3\nENDSUB\nGOTO / 1,2,4\n"
    result = read_bytes(text, allow_unknown=["DEFSUB"])
    assert not has_errors(result.diagnostics) and result.toolpath.records.dropped == 0


@pytest.mark.parametrize(("remark", "refused"), [
    ("CUTTER COMP OFF", False), ("TOOL CHANGE / 4", False), ("TOOL 4", False), ("CSYS OF TABLE 2", False),
    ("TOOL LIST / CUTTER 10", False), ("CUTTER 10.5", True), ("CUTTER X 10.5", True), ("CUTER / 10.5", True),
    ("CUT TER / 10.5", True), ("CUTT/ER / 10.5", True), ("/CUTTER / 10.5", True), ("FEATNO 10", True),
    ("CSYS 1,0,0,0,0,1,0,0,0,0,1,0", True), ('TOOL {"number": 1}', True)])
def test_remarks_are_refused_only_as_what_is_left_of_one_that_says_something(remark: str, refused: bool) -> None:
    text = f"$$-> MFGNO / A\n{HEAD}GOTO/1,2,3\n$$-> {remark}\nGOTO/1,2,4\nFINI\n"
    found = [(d.code, d.lines) for d in read_bytes(text).diagnostics if d.severity is Severity.ERROR]
    assert found == ([("cl.data-comment", (5,))] if refused else [])


@pytest.mark.parametrize(("dialect", "refused"),
                         [("ncl", False), ("generic", False), ("solidworks", True), ("creo", True)])
def test_six_numbers_of_cutter(dialect: str, refused: bool) -> None:
    text = HEAD + "LOADTL/1\nCUTTER/10.0,2.0,50.0,0.0,0.0,0.0\nGOTO/1,2,3\n"
    found = read_bytes(text, dialect=dialect).diagnostics
    assert [d.code for d in found if d.severity is Severity.ERROR] == (["cl.form"] if refused else [])


def test_a_subroutine_that_nothing_calls_is_refused_or_left_out() -> None:
    text = "$$-> MFGNO / A\n" + HEAD + "DEFSUB / 1\nGOTO / 1,2,3\nENDSUB\nGOTO / 1,2,4\n"
    assert [d.code for d in read_bytes(text).diagnostics if d.lines == (4,)] == ["cl.subprogram"]
    assert not has_errors(read_bytes(text, allow_unknown=["DEFSUB"]).diagnostics)


@pytest.mark.parametrize("word", ["THRU1", "HIGH2"])
def test_a_word_of_the_shop_is_taken_as_it_stands_where_it_is_allowed(word: str) -> None:
    text = f"{HEAD}COOLNT/{word}\nGOTO/1,2,3\n"
    assert has_errors(read_bytes(text).diagnostics)
    result = read_bytes(text, allow_unknown=[word])
    assert not has_errors(result.diagnostics) and result.toolpath.events[0].values == (word,)


@pytest.mark.parametrize("line", [
    "$$ see drawing 7/8", "$$ - CUTTER of 10", "$$ -- TOOL / 4 --", "$$ CUTTER / 10 as drawn",
    "$$*TLAXIS/0,0,1", "$$ ---- CSYS ----", "$$ --- CSYS / WORLD ---", "PPRINT SPEED 1/2",
    "REMARK MACHID=MACHIN / X",
    "$$-> SETSTART / 5", "$$ DOORSTOP", "PPRINT/MOTION,CUT,TYPE", "INSERT/[HOLDER=C40] 20.0mm DRILL",
])
def test_comments_and_texts_of_real_files_pass(line: str) -> None:
    assert not has_errors(read_bytes(f"{HEAD}GOTO/1,2,3\n{line}\nGOTO/1,2,4\n").diagnostics)


@pytest.mark.parametrize(("record", "code"), [
    ("O)STOP", "cl.text"), ("OP)STOP", "cl.text"), ("SPINDL/RPM,3000,C\xdfLW", "cl.form"),
    ("LOADTL / 1, OSETNO, 19$$-> CUTTER / 10.500000", "cl.data-comment"), ("GOTO/0,0,2\nENDFINI", "cl.unknown-word"),
    *((text, "cl.data-comment") for text in (
        "$$;-> FEATNO / 10", "$$> CUTTER / 10.5", "$$-X CUTTER / 10.5", '$$x>TOOL {"number": 1}',
        "$$-> CUTTER , 10.5", "$$->E CUTTER / 10.5"))])
def test_what_a_byte_leaves_of_a_record_is_refused(record: str, code: str) -> None:
    """A bracket within a word, a letter that is none of ASCII, a remark on the line of a record."""
    found = read_bytes("\n".join(["UNITS/MM", "LOADTL/1", record, "GOTO/0,0,1", "FINI", ""]), file="part.apt").diagnostics
    assert has_errors(found), [str(d) for d in found]
    assert code in {d.code for d in found}


def test_a_label_and_a_remark_of_a_name_are_read_as_before() -> None:
    text = "UNITS/MM\nLOADTL/4, OSETNO, 4 $$-> THREAD TOOL\nA10)GOTO/0,0,1\nA20) STOP\nGOTO/0,0,2\nFINI\n"
    assert not has_errors(read_bytes(text, file="part.apt").diagnostics)
