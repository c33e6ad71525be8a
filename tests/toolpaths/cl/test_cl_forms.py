"""Forms of records that manuals and systems write are taken; what is left of one, or changes the motion, is refused."""

from __future__ import annotations

import random

import pytest

from toolpaths.cl.forms import FORMS
from toolpaths.cl.interpret import HANDLERS
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.cl.text.near import nearest, one_edit
from toolpaths.cl.text.words import NEUTRAL, UNSUPPORTED_MOTION
from toolpaths.diagnostics import Severity, has_errors
from toolpaths.toolpath import Cycle, Toolpath

HEADS = {
    "nx": "TOOL PATH/A,TOOL,D10\nTLDATA/MILL,10.0,0.0,75.0,0.0,0.0\nMSYS/0,0,0,1,0,0,0,1,0\nFEDRAT/MMPM,250.0\n",
    "creo": "$$-> MFGNO / A\nUNITS / MM\nLOADTL / 1\nFEDRAT / 200.0, MMPM\n",
    "catia": "$$ CATIA APT VERSION 1.0\nPARTNO PLATE\nLOADTL/1\nFEDRAT/ 300.0,MMPM\n",
    "ncl": "$$ NCL\nPARTNO PLATE\nUNITS/MM\nLOADTL/1\nFEDRAT/200.0\n",
    "generic": "PARTNO PLATE\nUNITS/MM\nLOADTL/1\nFEDRAT/200.0\n",
}
TAKEN = [
    # NX: events of the operations, with their texts
    "nx STOP/REMOVE THE CLAMPS", "nx OPSTOP/CHECK THE BORE 10.5 +/-.1", "nx AUXFUN/10,CLAMP TABLE", "nx OPSKIP/ON,1",
    "nx LOAD/TOOL,2,ZOFF,100.0,ADJUST,2", "nx LOAD/TOOL,1,HOLDER,3", "nx CUTCOM/LEFT,XYPLAN,OSETNO,5", "nx DELAY/REV,2",
    "nx SPINDL/RPM,500.0,CLW,RANGE,2", "nx COOLNT/FLOOD,HIGH", "nx CUTCOM/ON,LENGTH,1", "nx TLDATA/WEDM,0.2,25.0,0.0",
    # Creo: supported CL data commands
    "creo DMIS / OFF", "creo COOLNT / THRU, LOW", "creo LOADTL / 1, LENGTH, 100.0, OSETNO, 2", "creo CUTCOM / LEFT, 0",
    "creo SPINDL / RPM, 1000.0, CLW, RANGE, LOW", "creo $$-> CUTCOM_GEOMETRY_TYPE / OUTPUT_ON_CENTER",
    # CATIA: PP word tables, syntaxes of APT import
    "catia CUTCOM/NORMPS", "catia CUTCOM/SAME,NORMDS", "catia SPINDL/RPM,CLW,70.0", "catia SELECTL/2", "catia OUTOL/ 0.01",
    "catia TDATA/MILL,38.0,38.0,DIAM,1.0,TYPE,MfgEndMillTool,WEIGHT,,PITCH,,CORE,0.0", "catia PART_OPE/Part Operation.1",
    "catia CATPROCESS/D:/parts/A.CATProcess", "catia LOADTL/10,ADJUST,1,SPINDL,15915.5,MILL", "catia OP_NAME/Roughing.1",
    # PostWorks (NCL): clamp, seqno, spindl, cutcom, loadtl
    "ncl CLAMP/AXIS,1,2,OFF", "ncl SEQNO/100,INCR,10,2", "ncl SPINDL/1000,BOTH,AUTO", "ncl CUTCOM/OFF,MODIFY,1,2",
    "ncl LOADTL/1,LENGTH,100.0,OFFSET,1,2,LARGE,HIGH,AUTO", "ncl MODE/TOOL,0,0,1",
    # vocabulary of APT CL files, SURFCAM (INC2APT), Mastercam (NCI2APT), post-processors of part programs
    "generic TMARK", "generic MAXDPM/720", "generic DELETE/ON", "generic PPTOL/.001", "generic PIVOTZ/200.0",
    "generic OPERTN/CUT3AX,DRILL,1", "generic LOAD/ TOOL,   1.,LENGTH,  0.0000,ADJUST,   1.", "generic RTCP/ON",
    "generic MACHIN/ MILL,UNITS,INCHES,OUT,INCHES", "generic MACHIN/FANUC 15/30,1", "generic MULTAX/ON,LENGTH",
    "generic CLEARP/(PLANE/0,0,1,3.5)", "generic DISPLY/LOAD PART 1/2", "generic SEQUENCE/ BEGIN,toolpath",
    # texts that name a word of the language
    "generic PPRINT TOOL CUTTER / D10", "generic PPRINT ORIGIN / TOP LEFT", "generic PPRINT MODE / AUTO",
    "generic PPRINT EMERGENCY-STOP", "generic TPRINT/MILL CUTTER/D10", "generic PARTNO PLATE, ZERO / X0 Y0",
]


def errors(result: ReadResult) -> list[str]:
    return [str(d.code) for d in result.diagnostics if d.severity is Severity.ERROR]


def read(line: str, after: str = "") -> ReadResult:
    system, _, record = line.partition(" ")
    result = read_bytes(f"{HEADS[system]}RAPID\nGOTO/1,2,30\n{record}\nGOTO/1,2,4\n{after}", file="part.cl")
    assert system == "ncl" or result.dialect == system
    return result


@pytest.mark.parametrize("line", TAKEN)
def test_what_systems_write_is_taken(line: str) -> None:
    result = read(line)
    assert not errors(result), [str(d) for d in result.diagnostics]
    assert len(result.toolpath) == 2 and result.toolpath.records.dropped == 0


@pytest.mark.parametrize(("line", "code"), [
    ("nx STOP/RAPID", "cl.form"), ("nx OPSTOP/CHECK GOTO/1,2,3", "cl.form"), ("nx STOP/PPRINT SETUP 2", "cl.form"),
    ("catia TDATA/MILL,10.0,0.0,75.0,0.0,0.0", "cl.form"), ("catia SELECTL/TOOL,2", "cl.form"),
    ("generic PPRINT SETUP CUTTER/10.0,2.0", "cl.form"), ("generic MACHIN/MILL,1/UNITS/MM", "cl.form"),
    ("generic MULTAX/XN", "cl.form"), ("generic CLEARP/(PLANE/0,0,1)", "cl.form"), ("generic DELETE/ONN", "cl.form"),
    ("generic CUTCOM/NORMP", "cl.form"), ("generic GOCLER/1,2,3", "cl.unknown-motion"), ("generic RESET", "cl.unknown-word"),
    ("generic COUPLE/AUTO", "cl.unknown-word"), ("generic POSTN/1", "cl.unknown-word"),
    ("generic THREAD/LEAD,2.0", "cl.turning")])
def test_what_is_left_of_a_record_or_changes_the_motion_is_refused(line: str, code: str) -> None:
    assert code in errors(read(line))


def test_no_neutral_word_is_one_edit_from_a_word_that_acts() -> None:
    """A damaged byte would make the one of the other, and nobody would know: TDATA has a form of its own."""
    acting = [w for w in {*HANDLERS, *UNSUPPORTED_MOTION} - {*NEUTRAL} if not w.startswith("$$")]
    near = {(n, a) for n in NEUTRAL for a in acting if one_edit(n, a)}
    texts = {(n, a) for n in ("PRINT", "LPRINT") for a in ("PPRINT", "TPRINT")}
    assert near == {("TDATA", "TLDATA"), ("MCS2", "MCS")} | texts


def path(line: str, after: str = "") -> Toolpath:
    result = read(line, after)
    assert not has_errors(result.diagnostics)
    return result.toolpath


def test_the_text_of_a_stop_is_printed_before_it() -> None:
    events = path("nx OPSTOP/Check the bore").events
    assert [(e.word, e.values) for e in events[-2:]] == [("PPRINT", ("Check the bore",)), ("OPSTOP", ())]
    assert path("nx STOP").events[-1].word == "STOP" and "PPRINT" not in {e.word for e in path("nx STOP/").events}


def test_words_of_one_meaning() -> None:
    assert path("generic DELETE/ON").events == path("generic OPSKIP/ON").events
    assert [o.name for o in path("catia OP_NAME/Roughing.1").operations][-1:] == ["Roughing.1"]
    assert not any(o.turning for o in path("nx TLDATA/THREAD,MILL,10.0,0.0,50.0,0.0,0.0").operations)
    assert any(o.turning for o in path("nx TLDATA/THREAD,STD,0.8,50.0,2.0,9").operations)


def test_a_number_to_select_alone_is_no_tool() -> None:
    """SURFCAM writes the work offset so: two of them are refused, and the hint takes them out."""
    assert "SELECT" not in {e.word for e in path("generic SELECT/1").events}
    assert "SELECT" in {e.word for e in path("generic SELECT/TOOL,1").events}
    assert errors(read("generic SELECT/1\nSELECT/2")) == ["cl.select"]
    text = f"{HEADS['generic']}RAPID\nGOTO/1,2,30\nSELECT/1\nSELECT/2\nGOTO/1,2,4\n"
    assert not errors(read_bytes(text, allow_unknown=["SELECT"]))


def test_a_record_of_a_known_word_whose_form_is_allowed_is_executed_as_it_stands() -> None:
    """--help, `explain` and the manual said that it is left out."""
    text = f"{HEADS['generic']}SPINDL/100,200,CLW\nRAPID\nGOTO/1,2,30\nWIGGLE/3\n"
    assert errors(read_bytes(text)) == ["cl.form", "cl.unknown-word"]
    result = read_bytes(text, allow_unknown=["SPINDL", "WIGGLE"])
    assert not errors(result) and (100.0, 200.0, "CLW") in {e.values for e in result.toolpath.events}
    assert "WIGGLE" not in {e.word for e in result.toolpath.events} and result.toolpath.records.dropped == 0


def cycle(words: str) -> Cycle:
    return path(f"catia CYCLE/{words}", "CYCLE/OFF\n").cycles[0]


@pytest.mark.parametrize(("words", "like"), [
    ("DEEPHL, 10.0, INCR, 2.0, 0.4,MMPR,CLEAR,1.0", "DEEP,DEPTH,10.0,STEP,2.0,MMPR,0.4,CLEAR,1.0"),
    ("BRKCHP, 10.0, INCR, 2.0, 400.0,MMPM,CLEAR,1.0", "BRKCHP,DEPTH,10.0,STEP,2.0,MMPM,400.0,CLEAR,1.0"),
    ("CBORE,DEPTH,5.0,MMPM,90.0,CLEAR,1.0,DWELL,0.5", "DRILL,DEPTH,5.0,MMPM,90.0,CLEAR,1.0,DWELL,0.5"),
    ("SPDRL,DEPTH,5.0,MMPM,90.0,CLEAR,1.0", "DRILL,DEPTH,5.0,MMPM,90.0,CLEAR,1.0"),
    ("CNSINK,DEPTH,5.0,MMPM,90.0,CLEAR,1.0", "CSINK,DEPTH,5.0,MMPM,90.0,CLEAR,1.0")])
def test_cycles_of_catia_by_other_words(words: str, like: str) -> None:
    a, b = cycle(words), cycle(like)
    assert (a.kind, a.depth, a.clearance, a.retract, a.steps, a.dwell, a.feed, a.feed_mode) == (
        b.kind, b.depth, b.clearance, b.retract, b.steps, b.dwell, b.feed, b.feed_mode)


@pytest.mark.parametrize("before", ["OPFEATSTART/ HOLES ", "OPNAME/A "])
def test_a_name_may_end_with_the_bare_word_of_any_record(before: str) -> None:
    for word in FORMS:
        for behind in ("", "/", " ,"):
            read = read_bytes(f"{before}{word}{behind}\nGOTO/1,2,3\n".encode())
            assert has_errors(read.diagnostics) or len(read.toolpath) == 1, word


def test_the_nearest_word_is_the_first_that_is_one_edit_away() -> None:
    rng = random.Random(1)
    words = ["".join(rng.choices("ABC", k=rng.randint(0, 5))) for _ in range(60)]
    for word in ("".join(rng.choices("ABCD", k=rng.randint(0, 6))) for _ in range(300)):
        assert nearest(word, words) == next((known for known in words if one_edit(word, known)), "")


def test_zeros_without_a_digit_before_the_point_are_cut_off_unless_the_file_writes_all_numbers_so() -> None:
    """BobCAD's inch files write .5000 and .0000; where others write 0.5000, .0000 is what is left of 12.0000."""
    cutter = "generic CUTTER/1.0000,.0000"
    assert errors(read(cutter)) == ["cl.form"]
    assert not errors(read(cutter, "GOTO/.5000,.0000,-.2500\n"))
    assert errors(read("generic CUTTER/1.0000,07", "GOTO/.5000,.0000,-.2500\n")) == ["cl.form"]
