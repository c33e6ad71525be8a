"""`Toolpath.from_arrays`: each kind of motion, the same path as from a CL file, and each fault by its rows."""

from __future__ import annotations

import numpy as np
import pytest

import toolpaths
from toolpaths.diagnostics import DiagnosticError
from toolpaths.toolpath import Arcs, Cycle, Event, Kind, Operation, Role, Tool, Toolpath

TIP = [[0.0, 0.0, 50.0], [0.0, 0.0, 10.0], [20.0, 0.0, 10.0], [20.0, 20.0, 10.0]]
FEED = [np.nan, 10.0, 10.0, 10.0]
HALF = Arcs(np.array([[10.0, 0.0, 10.0]]), np.array([[0.0, 0.0, 1.0]]), np.array([10.0]), np.array([np.pi]))
HOLE = Cycle("DRILL", 5.0, 2.0, None, 3.0)


def faults(**given: object) -> list[tuple[str, tuple[int, ...]]]:
    with pytest.raises(DiagnosticError) as found:
        Toolpath.from_arrays(**{"tip": TIP, "feed": FEED} | given)
    assert all(d.code == "arrays.value" and '; ' in d.message and d.file == "arrays" for d in found.value.diagnostics)
    assert all(len(d.message) < 200 for d in found.value.diagnostics), "an array stood in the message"
    return [(d.message.split()[0], d.lines) for d in found.value.diagnostics]


def test_arrays_are_the_path_that_a_file_of_the_same_records_is() -> None:
    text = ("PARTNO/A\nUNITS/MM\nLOADTL/1\nSPINDL/RPM,5000,CLW\nRAPID\nGOTO/0,0,50\nFEDRAT/MMPM,600\nGOTO/0,0,10\n"
            "GOTO/20,0,10\nGOTO/20,20,10\nFINI")
    read, _ = toolpaths.read_bytes(text)
    assert Toolpath.from_arrays(TIP, (0, 0, 7), FEED, spindle=5000, name="A").equals(read)


def test_arcs_holes_tools_and_operations_come_back_from_their_text() -> None:
    tip = [*TIP[:3], [0.0, 0.0, 10.0], [5.0, 5.0, 0.0], [9.0, 5.0, 0.0]]
    path = Toolpath.from_arrays(tip, feed=[np.nan, 10.0, 10.0, 10.0, np.nan, np.nan], arc=[-1, -1, -1, 0, -1, -1], arcs=HALF,
                                cycle=[-1, -1, -1, -1, 0, 0], cycles=[HOLE], tool=[0, 0, 0, 0, 1, 1],
                                tools=[Tool(3), Tool(7)], operation=[0, 0, 0, 0, 1, 1],
                                operations=[Operation("mill"), Operation("drill")], spindle=-900.0)
    assert path.kind.tolist() == [Kind.RAPID, Kind.FEED, Kind.FEED, Kind.ARC, Kind.RAPID, Kind.RAPID]
    assert path.role.tolist()[3:] == [Role.POINT, Role.HOLE, Role.HOLE]
    events = [(e.index, e.word, e.values[0]) for e in path.events]
    assert events == [(0, "LOADTL", 3.0), (0, "SPINDL", "RPM"), (4, "LOADTL", 7.0)]
    assert path.events[1].values[2] == "CCLW" and len(np.unique(path.pass_)) > 1 and path.line.tolist() == [1, 2, 3, 4, 5, 6]


def test_a_tool_is_loaded_once_where_an_event_loads_it() -> None:
    events = [Event(0, "LOADTL", (1.0, "ADJUST", 5.0)), Event(2, "COOLNT", ("ON",))]
    path = Toolpath.from_arrays(TIP, feed=FEED, events=events)
    assert [e.word for e in path.events] == ["LOADTL", "COOLNT"]


def test_rapid_says_where_no_feed_is_a_rapid() -> None:
    path = Toolpath.from_arrays(TIP, rapid=[True, False, False, False])
    assert path.kind.tolist() == [Kind.RAPID, Kind.FEED, Kind.FEED, Kind.FEED] and np.isnan(path.feed).all()
    assert Toolpath.from_arrays(TIP, feed=8, rapid=[True, False, False, False]).kind.tolist() == path.kind.tolist()


@pytest.mark.parametrize(("given", "expected"), [
    ({"tip": []}, [("tip", ())]), ({"tip": [[0, 0]]}, [("tip", ())]), ({"tip": [[0, 0, 0], [1]]}, [("tip", ())]),
    ({"tip": [["a", 0, 0]]}, [("tip", ())]), ({"tip": [[0, 0, np.inf], [0, 0, 0]], "feed": 1}, [("tip", (1,))]),
    ({"axis": (0, 0, 0)}, [("axis", (1, 2, 3, 4))]), ({"axis": [[0, 0, 1]] * 3}, [("axis", ())]),
    ({"feed": -1}, [("feed", (1, 2, 3, 4))]), ({"feed": [1, 2, np.inf, 3]}, [("feed", (3,))]),
    ({"rapid": [0, 1, 0, 0]}, [("rapid", ())]), ({"tool": [0, 0, 0, 1]}, [("tool", (4,))]),
    ({"operation": 0.5}, [("operation", (1, 2, 3, 4))]),
    ({"arc": [0, -1, -1, -1], "arcs": HALF, "feed": 1}, [("begin", (1,))]),
    ({"arc": [-1, -1, 0, -1]}, [("arc", (3,))]), ({"arc": [-1, -1, -1, 0], "arcs": HALF}, [("begin", (4,))]),
    ({"feed_mode": 3}, [("feed_mode", (1, 2, 3, 4))]), ({"spindle": 0.0}, [("spindle", ())]),
    ({"events": [Event(9, "COOLNT")]}, [("events", ())]), ({"contact": [0, 0, np.inf]}, [("contact", (1, 2, 3, 4))]),
    ({"tip": np.ones((4, 3), complex)}, [("tip", ())]), ({"tip": np.ones((4, 3), bool)}, [("tip", ())]),
    ({"tip": [["1", "2", "3"]]}, [("tip", ())]), ({"tip": [[0, 0, 10**400]]}, [("tip", ())]),
    ({"tip": np.ma.masked_equal(TIP, 20.0), "feed": 1}, [("tip", (3, 4))]), ({"feed": True}, [("feed", ())]),
    ({"spindle": "fast"}, [("spindle", ())]), ({"spindle": np.ones(600)}, [("spindle", ())]),
    ({"events": "COOLNT"}, [("events", ())]), ({"arcs": 3}, [("arcs", ())]),
    ({"tools": Tool(1)}, [("tools", ())]), ({"cycles": [3]}, [("cycles", ())]),
    ({"normal": (0, 0, 0), "spindle": np.nan}, [("normal", (1, 2, 3, 4)), ("spindle", ())]),
])
def test_faults_are_named_with_their_rows(given: dict[str, object], expected: list[tuple[str, tuple[int, ...]]]) -> None:
    assert faults(**given) == expected


def test_normals_may_have_gaps() -> None:
    path = Toolpath.from_arrays(TIP, feed=FEED, normal=[[0, 0, 2], [np.nan] * 3, [0, 3, 0], [0, 0, 1]])
    assert path.normal is not None and np.isnan(path.normal[1]).all() and path.normal[2].tolist() == [0.0, 1.0, 0.0]
