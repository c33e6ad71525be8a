"""Conservation of records: executed, neutral by a list, or refused; the counts are printed."""

from __future__ import annotations

from pathlib import Path

import pytest

import toolpaths
from toolpaths.cl.read import read_bytes, read_file
from toolpaths.diagnostics import has_errors
from toolpaths.inspect import inspect, summary
from toolpaths.toolpath import Records

SAMPLES = Path(__file__).parents[2] / "samples"
FILES = sorted(p for p in SAMPLES.rglob("*") if p.suffix in (".cls", ".apt", ".ncl", ".clt", ".as", ".aptsource"))
HEAD = "UNITS/MM\nFEDRAT/100\n"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_every_record_of_a_sample_is_executed_or_neutral(path: Path) -> None:
    result = read_file(path)
    counts = result.toolpath.records
    assert not has_errors(result.diagnostics)
    assert counts.total == counts.executed + counts.neutral > 0 and counts.dropped == 0
    assert str(counts) in summary(result) and inspect(result)["records"]["total"] == counts.total  # type: ignore[index]


@pytest.mark.parametrize(("text", "counts"), [
    (HEAD + "$$ note\nPAINT/PATH\nRAPID\nGOTO/1,2,3\nGOTO/1,2, $\n4\nFINI\n", Records(7, 6, 1, 0)),
    (HEAD + "GOTO/1,2,3\nFLUB/1\n@@ text\nTRACUT/5\nGOTO/1,2,4\n", Records(7, 4, 0, 3)),
    ("$$-> MFGNO / A\n" + HEAD + "DEFSUB / 1\nGOTO / 1,2,3\nENDSUB\nCALSUB / 1\nCALSUB / 1\n", Records(7, 7, 0, 0)),
    ("=====\nDate : today\n" + HEAD + "GOTO/1,2,3\nTool Path Listing has 5 lines.\n", Records(6, 3, 3, 0)),
])
def test_counts(text: str, counts: Records) -> None:
    path, diagnostics = toolpaths.read_bytes(text)
    assert path.records == counts
    assert has_errors(diagnostics) == (counts.dropped > 0)


def test_what_is_allowed_is_neutral() -> None:
    text = HEAD + "GOTO/1,2,3\nFLUB/1\n@@ text\nGOTO/1,2,4\n"
    result = read_bytes(text, allow_unknown=["FLUB", "(TEXT)"])
    assert not has_errors(result.diagnostics) and result.toolpath.records == Records(6, 4, 2, 0)


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
    "$$ see drawing 7/8", "$$ CUTTER / 10 as drawn", "$$*TLAXIS/0,0,1", "$$ ---- CSYS ----", "PPRINT SPEED 1/2",
    "REMARK MACHID=MACHIN / X",
    "$$-> SETSTART / 5", "$$ DOORSTOP", "PPRINT/MOTION,CUT,TYPE", "INSERT/[HOLDER=C40] 20.0mm DRILL",
])
def test_comments_and_texts_of_real_files_pass(line: str) -> None:
    assert not has_errors(read_bytes(f"{HEAD}GOTO/1,2,3\n{line}\nGOTO/1,2,4\n").diagnostics)


@pytest.mark.parametrize(("record", "code"), [
    ("O)STOP", "cl.text"), ("OP)STOP", "cl.text"), ("SPINDL/RPM,3000,C\xdfLW", "cl.form"),
    ("LOADTL / 1, OSETNO, 19$$-> CUTTER / 10.500000", "cl.data-comment")])
def test_what_a_byte_leaves_of_a_record_is_refused(record: str, code: str) -> None:
    """A bracket within a word, a letter that is none of ASCII, a remark on the line of a record."""
    found = read_bytes("\n".join(["UNITS/MM", "LOADTL/1", record, "GOTO/0,0,1", "FINI", ""]), file="part.apt").diagnostics
    assert has_errors(found), [str(d) for d in found]
    assert code in {d.code for d in found}


def test_a_label_and_a_remark_of_a_name_are_read_as_before() -> None:
    text = "UNITS/MM\nLOADTL/4, OSETNO, 4 $$-> THREAD TOOL\nA10)GOTO/0,0,1\nA20) STOP\nGOTO/0,0,2\nFINI\n"
    assert not has_errors(read_bytes(text, file="part.apt").diagnostics)
