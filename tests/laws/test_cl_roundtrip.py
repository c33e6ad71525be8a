"""Laws of reading and writing CL text: whatever the text, what is read is whole, written text reads back,
fast and slow paths agree."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.internal.conjecture import providers

from toolpaths import write
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.scan import scan
from toolpaths.cl.text.source import normalise
from toolpaths.diagnostics import Severity, has_errors
from toolpaths.toolpath import FeedMode, Toolpath

# Constants of the project's own source are no likelier faults; hypothesis parses all of it, in each worker, for them.
providers.is_local_module_file = lambda file: False
SLOW = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
number = st.one_of(st.integers(-500, 500).map(str), st.floats(-1e4, 1e4).map(lambda x: f"{x:.4f}"),
                   st.floats(-1e3, 1e3).map(repr), st.sampled_from([".5", "-0", "1.", "-.25", "+3", "1E2", "2.5e-3"]))
blank = st.sampled_from(["", "", "", " ", "  "])


def joined(values: list[str], blanks: str) -> str:
    return f",{blanks}".join(values)


def unit_text(vector: tuple[float, float, float]) -> str:
    norm = math.hypot(*vector)
    return "0,0,1" if norm < 1e-3 else ",".join(f"{v / norm:.9f}" for v in vector)


vectors = st.tuples(*[st.floats(-1, 1)] * 3).map(unit_text)
points = st.tuples(number, number, number).map(",".join)
goto = st.one_of(points.map(lambda p: f"GOTO/{p}"), st.tuples(points, vectors).map(lambda t: f"GOTO  / {','.join(t)}"),
                 st.tuples(points, vectors, vectors).map(lambda t: f"goto/{','.join(t)}"),
                 st.tuples(points, vectors, points).map(lambda t: f"GOTO/{','.join(t)} $$ contact"),
                 points.map(lambda p: f"GODLTA/{p}"), number.map(lambda d: f"GODLTA/{d}"),
                 points.map(lambda p: f"GOTO/{p.replace(',', ' ')}"))
ANY_WORDS = st.sampled_from([
    "RAPID", "FEDRAT/MMPM,250.5", "FEDRAT/10,IPM", "FEDRAT/0.15,MMPR", "FEDRAT/INVERS,7.5", "FEDRAT/33.3", "STOP",
    "SPINDL/RPM,3000,CLW", "COOLNT/FLOOD", "COOLNT/OFF", "LOADTL/3,7", "LOAD/TOOL,2,ADJUST,2", "CUTTER/10,1,0,0,0,0,50",
    "TLDATA/MILL,10.0,1.0,75.0,3.0,0.0", "CUTCOM/LEFT,5", "DELAY/1.5", "OPSTOP", "PPRINT/Hello, World / 5$ = x",
    "INSERT M8 [x=1]", "SELECT/TOOL,5", "PREFUN/9", "AUXFUN/8,NOW", "PARTNO part / 7", "OPSKIP/ON", "GOHOME",
    "FROM/1,2,3", "GOHOME/0,0,100", "TLAXIS/0,1,0", "PAINT/PATH", "$$ remark", "TPRINT/END MILL 10,x",
    "TOOL PATH/ROUGH 1,TOOL,T10", "END-OF-PATH", "MSYS/1,2,3,0,1,0,1,0,0", "MSYS/0,0,0,1,0,0,0,1,0",
    "CYCLE/DRILL,FEDTO,-12.5,RAPTO,3,RTRCTO,AUTO,MMPM,100", "CYCLE/OFF", "CYCLE/ON", "RETRCT/5", "TRANS/0,0,2.5",
    "CYCLE/DEEP,DEPTH,20,CLEAR,2,MMPR,.1,STEP,5,3,RETURN,10,DWELL,.5", "$$-> CSYS / 1,0,0,5,0,0,-1,0,0,1,0,2.5",
    "CYCLE/TAP,DEPTH,-10,CLEAR,3,TPI,20,RETURN,5", "MULTAX/ON", "END",
    "NURBS/\nKNOT/0.4,1\nCNTRL/1,2,3\nCNTRL/8,-3,3\nCNTRL/20,9,3\nCNTRL/25,0,3",
    "GOTO/10,0,0\nCIRCLE/5,0,0,0,0,1,5\nGOTO/0,0,0",
    "GOTO/10,0,0\nCIRCLE/5,0,0,0,0,-1,5,.03,.5,10,0,TIMES,2\nGOTO/5,5,-3",
    "GOTO/3,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1,3\nGOTO/3,0,0", "FINI",
])
program = st.lists(st.one_of(goto, goto, ANY_WORDS), max_size=40)
heads = st.sampled_from(["UNITS/MM", "UNITS/INCHES", "$$", "TLDATA/MILL,6,0,50,0,0", "$$-> MFGNO / A",
                         "TRNTYP/WORLD,0,0,0"])


def assert_writes_back(toolpath: Toolpath) -> None:
    again = read_bytes(write(toolpath))
    assert not has_errors(again.diagnostics), [str(d) for d in again.diagnostics]
    assert again.toolpath.equals(toolpath)


def assert_whole(result: ReadResult) -> None:
    """What holds of any text: rows and arcs fit together, each row and each diagnostic names a line of the
    file, directions are unit vectors, an error says what to do; without one nothing is infinite, and the text
    that we write reads back."""
    path, found = result.toolpath, result.diagnostics
    assert path.axis.shape == path.tip.shape == (len(path), 3) and len(path.line) == len(path.feed) == len(path)
    assert ((path.line >= 1) & (path.line <= result.lines)).all()
    length = np.linalg.norm(path.axis, axis=1)
    assert np.allclose(length[np.isfinite(length)], 1.0, rtol=0.0, atol=1e-9)
    for d in found:
        assert d.code.startswith("cl.") and d.message and d.count >= 1
        assert all(1 <= line <= result.lines for line in d.lines), (d, result.lines)
    assert all(d.hint for d in found if d.severity is Severity.ERROR), [str(d) for d in found]
    if not has_errors(found):
        assert np.isfinite(path.tip).all() and np.isfinite(path.axis).all()
        assert_writes_back(path)


def test_a_tool_to_prepare_is_written_as_one() -> None:
    """A number alone may be a work offset."""
    path = read_bytes("GOTO/0,0,0\nSELECT/TOOL,5\nGOTO/1,0,0\n").toolpath
    assert [e.values for e in path.events] == [(5.0,)]
    assert_writes_back(path)


@SLOW
@given(heads, program, st.sampled_from(["\n", "\r\n", "\r"]))
def test_written_text_reads_back(head: str, lines: list[str], end: str) -> None:
    result = read_bytes(end.join([head, *lines]).replace("\n", end if end != "\r\n" else "\n"))
    if not has_errors(result.diagnostics):
        assert_writes_back(result.toolpath)


@SLOW
@given(st.one_of(st.text(max_size=300), st.lists(st.one_of(st.text(max_size=20), ANY_WORDS, goto), max_size=20)
                 .map("\n".join)))
@example("MSYS/1e200,0,0,1,0,0,0,1,0\nGOTO/1,2,3")
@example("GOTO/1e308,2,3\nUNITS/INCH\nGODLTA/1e308,0,0")
def test_any_text_is_read_whole(text: str) -> None:
    assert_whole(read_bytes(text))


@SLOW
@given(st.binary(max_size=300))
def test_any_bytes_are_read_whole(data: bytes) -> None:
    assert_whole(read_bytes(data))
    assert_whole(read_bytes(b"GOTO/1,2,3\n" + data + b"\nGOTO/4,5,6\n"))


MUTATIONS = ["", " ", ",", "$", "/", "\n", "9", "-", ".", "E", "GOTO/", "(", "$$", "\x00", "\t", "'", "NaN"]


@SLOW
@given(program, st.lists(st.tuples(st.integers(0, 2000), st.sampled_from(MUTATIONS)), max_size=8))
def test_a_broken_program_is_read_whole(lines: list[str], changes: list[tuple[int, str]]) -> None:
    text = "\n".join(lines)
    for at, what in changes:
        at %= len(text) + 1
        text = text[:at] + what + text[at + 1:]
    assert_whole(read_bytes(text))


@SLOW
@given(st.lists(st.tuples(st.sampled_from(["GOTO/", "goto/", "GOTO  /", "GOTO / "]), st.lists(number, min_size=1,
       max_size=10), st.sampled_from(["", " ", "   "]), st.sampled_from(["", " ", ",", " $$ x"])), max_size=30))
def test_fast_and_slow_paths_agree(rows: list[tuple[str, list[str], str, str]]) -> None:
    """A label before a line sends it down the slow path; the numbers must be the same to the last bit."""
    lines = [head + joined(values, blanks) + end for head, values, blanks, end in rows]
    fast = read_bytes("\n".join(["UNITS/MM", *lines]))
    labelled = ["UNITS/MM", *(f"L{k}){line}" for k, line in enumerate(lines))]
    slow = read_bytes("\n".join(labelled))
    assert not len(scan(normalise("\n".join(labelled).encode(), DiagnosticLog())).points.line)
    assert fast.toolpath.equals(slow.toolpath)
    assert np.array_equal(fast.toolpath.line, slow.toolpath.line)
    assert [(d.code, d.lines) for d in fast.diagnostics] == [(d.code, d.lines) for d in slow.diagnostics]


def test_plain_lines_take_the_fast_path() -> None:
    text = b"RAPID\nGOTO/1,2,3\nGOTO  /  1., .5,-3 , 0,0,1 \ngoto/1,2,3\nGOTO/1,2\nGOTO/1,2,3 $$ c\nGOTO/1 2 3\n"
    found = scan(normalise(text, DiagnosticLog()))
    assert found.points.line.tolist() == [2, 3, 4, 6]
    assert found.line == [1, 5, 7]
    assert found.before == [0, 3, 4]


def test_numbers_are_correctly_rounded() -> None:
    rng = np.random.default_rng(7)
    texts = [repr(float(x)) for x in rng.standard_normal(3000) * 10.0 ** rng.integers(-8, 8, 3000)]
    text = "\n".join(f"GOTO/{a},{b},{c}" for a, b, c in zip(texts[::3], texts[1::3], texts[2::3], strict=True))
    tip = read_bytes("UNITS/MM\n" + text).toolpath.tip
    assert tip.ravel().tolist() == [float(t) for t in texts]


def test_chunks_do_not_matter(monkeypatch: object) -> None:
    from toolpaths.cl.text import scan as module
    text = "UNITS/MM\n" + "".join(f"GOTO/{k},{-k}.5,0{',0,0,1' if k % 3 else ''}\n{'RAPID' if k % 5 else ''}\n"
                                  for k in range(400))
    whole = read_bytes(text).toolpath
    monkeypatch.setattr(module, "CHUNK", 50)
    parts = read_bytes(text).toolpath
    assert parts.equals(whole)
    assert np.array_equal(parts.line, whole.line)


def test_feeds_read_back_to_the_bit() -> None:
    rng = np.random.default_rng(11)
    feeds = np.exp(rng.uniform(-8, 8, 2000))
    n = len(feeds)
    zero, base = np.zeros(n, np.int8), read_bytes("UNITS/MM\nFEDRAT/1\n" + "GOTO/1,2,3\n" * n).toolpath
    for mode in FeedMode:
        p = replace(base, feed=feeds, feed_mode=zero + mode)
        assert_writes_back(p)


def test_contact_points_that_look_like_normals() -> None:
    text = "UNITS/INCHES\nFEDRAT/1\n" + "".join(f"GOTO/1,2,3,0,0,1,{x},0,0\n" for x in (1 / 25.4, 5, 1, 0.02))
    p = read_bytes(text).toolpath
    assert p.contact is not None and abs(p.contact[0, 0] - 1.0) < 1e-12
    assert_writes_back(p)


def test_numbers_that_grow_by_conversion() -> None:
    text = "UNITS/INCHES\nFEDRAT/9e+11,IPM\nGOTO/9e+11,2,3\nCYCLE/DRILL,DEPTH,1,1e+11,.003,CLEAR,9e+11\nGOTO/1,2,3\n"
    result = read_bytes(text)
    assert not has_errors(result.diagnostics)
    assert_writes_back(result.toolpath)
