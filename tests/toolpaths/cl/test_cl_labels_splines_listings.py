"""Habits of part programs and their writers beyond the common: labels, splines over several lines, MULTAX, listings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import toolpaths
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind, Role

ISO = "UNITS/MM\nFEDRAT/600\n"
NX = "TOOL PATH/A,TOOL,T1\nMSYS/0,0,0,1,0,0,0,1,0\nFEDRAT/MMPM,600\n"
CREO = "$$-> MFGNO / X\nUNITS / MM\nFEDRAT / 600, MMPM\n"
CREO_TILTED = "$$-> CSYS / 1, 0, 0, 5, $\n 0, 0.6, -0.8, 0, $\n 0, 0.8, 0.6, 0\n"


def errors(found: ReadResult) -> list[tuple[str, tuple[int, ...]]]:
    return [(d.code, d.lines) for d in found.diagnostics if d.severity is Severity.ERROR]


def codes(found: ReadResult) -> list[str]:
    return sorted(d.code for d in found.diagnostics if d.severity is not Severity.INFO)


@pytest.mark.parametrize("label", ["A10)", "10) ", "  start )", "l_1)\t"])
def test_statements_behind_a_label_are_read(label: str) -> None:
    lines = ("LOADTL/7", "MULTAX", "RAPID", "GOTO/0,0,5", "goto / 1,2,3", "$$ no statement")
    found = read_bytes(ISO + "".join(f"{label}{line}\n" for line in lines) + "GOTO/4,5,6\n")
    assert codes(found) == ["cl.text"]
    assert found.toolpath.tip.tolist() == [[0, 0, 5], [1, 2, 3], [4, 5, 6]]
    assert found.toolpath.kind.tolist() == [Kind.RAPID, Kind.FEED, Kind.FEED]
    assert [t.number for t in found.toolpath.tools] == [7]


@pytest.mark.covering
@pytest.mark.parametrize("line", ["GOTO(1,2,3)", "RAPID;1", "{GOTO/1,2,3}", "N10 GOTO/1,2,3", "@ CIRCLE/0,0,0,0,0,1,5",
                                  '"GODLTA/1"', "IF (X1) L1,L2,L3"])
@pytest.mark.parametrize("at", [0, 1, 2])
@pytest.mark.parametrize("end", ["", "FINI\n"])
def test_no_line_that_names_a_motion_is_left_out(line: str, at: int, end: str) -> None:
    points = ["GOTO/0,0,0", "GOTO/9,0,0"]
    points.insert(at, line)
    found = read_bytes(ISO + "\n".join(points) + "\n" + end)
    assert [(c in ("cl.text", "cl.slash", "cl.unknown-motion"), lines) for c, lines in errors(found)] == [(True, (3 + at,))]


def test_text_between_records_is_refused_unless_it_is_allowed() -> None:
    found = read_bytes(ISO + "GOTO/0,0,0\n* next: rapid to the clearance plane\nGOTO/1,0,0\n")
    assert [code for code, _ in errors(found)] == ["cl.text"]
    allowed = read_bytes(ISO + "GOTO/0,0,0\n* next: rapid to the clearance plane\nGOTO/1,0,0\n",
                         allow_unknown=["(TEXT)"])
    assert errors(allowed) == [] and allowed.toolpath.records.neutral == 1


def test_a_macro_is_refused_where_it_is_defined() -> None:
    found = read_bytes(ISO + "M1=MACRO/X\nGOTO/1,2,3\nTERMAC\nM2 = MACRO\nGOTO/1,2,3\nTERMAC\nGOTO/0,0,0\n")
    assert errors(found) == [("cl.unsupported-motion", (3, 6)), ("cl.unknown-word", (5, 8))]


@pytest.mark.parametrize("word", ["CONT", "MOVE", "ARC"])
@pytest.mark.parametrize("at", [0, 1, 2])
def test_motions_of_other_processors_are_refused_wherever_they_stand(word: str, at: int) -> None:
    points = ["GOTO/0,0,0", "GOTO/9,0,0"]
    points.insert(at, f"ISN/7\n{word}/1,2,3")
    found = read_bytes(ISO + "\n".join(points) + "\nFINI\n")
    assert errors(found) == [("cl.unsupported-motion", (4 + at,))] and codes(found) == ["cl.unsupported-motion"]


@pytest.mark.parametrize(("record", "noted"), [("INDEX/1,NOMORE", []), ("TRACUT/NOMORE", []),
                                               ("COPY/1,SAME,NOMORE", ["COPY"]), ("INDEX/1", ["INDEX"])])
def test_the_end_of_a_copy_alone_copies_nothing(record: str, noted: list[str]) -> None:
    found = read_bytes(f"{ISO}GOTO/0,0,0\n{record}\nGOTO/1,0,0\n")
    assert [d.message.split()[0] for d in found.diagnostics if d.severity is Severity.ERROR] == noted


@pytest.mark.parametrize("knots", ["KNOT/0.25,0.5,0.75,\n  1.0", "KNOT/0.25\n0.5,0.75\n$$ end\n1.0",
                                   "KNOT/0.25,0.5,0.75,1.0"])
def test_knots_over_several_lines(knots: str) -> None:
    control = "".join(f"CNTRL/{x},{x * x % 3},0\n" for x in range(1, 7))
    found = read_bytes(f"{NX}GOTO/0,0,0\nNURBS/\n{knots}\n{control}END-OF-PATH\n")
    assert codes(found) == []
    tip = found.toolpath.tip[found.toolpath.role == Role.POINT]
    assert tip.tolist() == [[0, 0, 0], [6, 0, 0]]


def test_three_numbers_after_six_are_along_the_local_z_in_creo() -> None:
    found = read_bytes(f"{CREO}{CREO_TILTED}MULTAX / ON\nGOTO / 5, 0, 0, 0.6, 0, 0.8\nMULTAX / OFF\n"
                       "GOTO / 0, 0, 10\nGOTO / 1, 0, 10\nTLAXIS / 0, 1, 0\nGOTO / 1, 0, 10\n")
    assert codes(found) == []
    z = [0, -0.8, 0.6]
    np.testing.assert_allclose(found.toolpath.axis, [[0.6, 0, 0.8], z, z, [0, 0.6, 0.8]], atol=1e-12)
    np.testing.assert_allclose(found.toolpath.tip[:2], [[5, 0, 0], [5, -8, 6]], atol=1e-12)


@pytest.mark.parametrize(("head", "after", "axis", "noted"), [
    (ISO, "GOTO/1,0,0", (0, 0.6, 0.8), ["cl.multax-off"]),
    (ISO, "GOTO/1,0,0,0,0,1", (0, 0, 1), []),
    (ISO, "TLAXIS/0,0,1\nGOTO/1,0,0", (0, 0, 1), []),
    ("$$ CATIA APT\nUNITS/MM\nFEDRAT/600\n", "GOTO/1,0,0", (0, 0.6, 0.8), []),
])
def test_the_axis_after_multax_off_is_reported_where_no_document_says_it(head: str, after: str, axis: tuple[float, ...],
                                                                     noted: list[str]) -> None:
    found = read_bytes(f"{head}MULTAX/ON\nGOTO/0,0,0,0,.6,.8\nMULTAX/OFF\n{after}\n")
    assert codes(found) == noted
    assert found.toolpath.axis[-1].tolist() == list(axis)


def test_load_of_a_turret_station_is_a_tool_change() -> None:
    found = read_bytes(f"{NX}LOAD/TURRET,4,ADJUST,9\nGOTO/0,0,0\nEND-OF-PATH\n")
    assert errors(found) == []
    assert [(t.number, t.length_register) for t in found.toolpath.tools] == [(4, 9)]


@pytest.mark.parametrize("record", ["LOADTL/4,0", "LOAD/TOOL,4,ADJUST,0", "LOADTL/4,OSETNO,0", "TURRET/4,OSETNO,0"])
def test_length_register_0_is_none(record: str) -> None:
    found = read_bytes(f"{ISO}{record}\nGOTO/0,0,0\n")
    assert codes(found) == ["cl.length-register"] and errors(found) == []
    assert [(t.number, t.length_register) for t in found.toolpath.tools] == [(4, None)]
    assert [e.values for e in found.toolpath.events] == [(4.0,)]


@pytest.mark.parametrize("record", ["LOADTL/4,120.5", "LOADTL/4,-1", "LOAD/TOOL,4,ADJUST,1E+10"])
def test_what_is_no_length_register_is_refused(record: str) -> None:
    assert errors(read_bytes(f"{ISO}{record}\nGOTO/0,0,0\n")) == [("cl.length-register", (3,))]


@pytest.mark.parametrize(("tail", "noted"), [
    ("END-OF-PATH\nTool Path Listing has 5 lines.", []), ("END-OF-PATH\r\n\r\nTool Path Listing has 5 lines.", []),
    ("END-OF-PATH\nTOOL PAT", ["cl.cut-off"]), ("GOTO/1,0,0\nGOTO/1 2 3.", ["cl.cut-off"]),
    ("FINI\nPart of GOTO/1,2,3 here", ["cl.cut-off"]),
])
def test_the_text_of_a_listing_behind_its_end_needs_no_line_end(tail: str, noted: list[str],
                                                                tmp_path: Path) -> None:
    file = tmp_path / "part.cls"
    file.write_bytes(f"{NX}GOTO/0,0,0\n{tail}".encode())
    _, diagnostics = toolpaths.read(file)
    assert [d.code for d in diagnostics if d.code == "cl.cut-off"] == noted
