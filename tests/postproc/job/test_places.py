"""Several parts in one program: each place's cuts are those of the part alone, in the order that is asked for."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.base.options import Options
from postproc.compile import sections
from postproc.job import places
from postproc.pipeline.result import PostResult
from postproc.reference.repeated import Repeated, repeated
from postproc.setup.model import SetupFile, at_places
from postproc.setup.places import PlaceOrder
from postproc.verification.read_back import read_back
from postproc.verification.second_witness import _order
from tests.postproc.kit import body, codes, few_sides, good
from toolpaths.arrays import Floats, Ints

TOOLS = {str(n): {"gauge_length": 90.0 + 10.0 * n} for n in range(1, 6)}
TWO = [{"name": "left", "work_offset_code": "G54", "origin": (-30.0, 0.0, 20.0)},
       {"name": "right", "work_offset_code": "G57", "origin": (90.0, -10.0, 5.0), "x_axis": (0.0, 1.0, 0.0),
        "y_axis": (-1.0, 0.0, 0.0)}]
FACES = [{"name": f"face {k}", "work_offset_code": f"G5{4 + k}", "origin": (-20.0, 0.0, 60.0), "turn": {"A": 90.0 * k}}
         for k in range(3)]
CONTROLS = ("fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "linuxcnc", "generic-iso")
NEAR = 2.5e-4
"""mm and degrees between words that are rounded in two frames"""


def made(file: str, machine: str, control: str, **setup: object) -> PostResult:
    path = few_sides(file, (1, 2) if file == "pocket.cls" else None)
    return postproc.convert(path, machines.load(machine), control, SetupFile.model_validate({"tools": TOOLS, **setup}))


def cut_rows(result: PostResult) -> tuple[Ints, Ints]:
    """(executed blocks that run moves of the file at feed, the row of the path that each serves)."""
    assert result.comparison is not None and result.comparison.executed is not None
    motion, owner, moves = result.comparison.executed[1], result.comparison.owner, result.comparison.moves.without_pecks()
    blocks = np.flatnonzero(moves.run_by(owner) & (motion.code > 0))
    return blocks, moves.row[owner[blocks]]


def cuts(result: PostResult, place: int = 0) -> Floats:
    """Machine coordinates at the ends of the cuts of a place."""
    assert result.comparison is not None and result.comparison.executed is not None and result.job is not None
    blocks, rows = cut_rows(result)
    if result.job.repeats is not None:
        blocks = blocks[result.job.repeats.place[rows] == place]
    return result.comparison.executed[1].end[blocks]


def sequence(result: PostResult) -> list[tuple[int, int]]:
    """(place, tool) as the cuts of the program go."""
    assert result.comparison is not None and result.comparison.executed is not None
    assert result.job is not None and result.job.repeats is not None
    blocks, rows = cut_rows(result)
    at = result.job.repeats.place[rows].tolist()
    both = list(zip(at, result.comparison.executed[1].tool[blocks].tolist(), strict=True))
    return [one for k, one in enumerate(both) if k == 0 or both[k - 1] != one]


@pytest.mark.covering
@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("order", ["tool", "part"])
def test_cuts_are_those_of_each_part_alone(control: str, order: PlaceOrder) -> None:
    setup = SetupFile.model_validate({"tools": TOOLS, "places": TWO, "order": order})
    result = good(made("pocket.cls", "mill-3axis", control, places=TWO, order=order))
    for k, alone in enumerate(at_places(setup)):
        single = good(made("pocket.cls", "mill-3axis", control, **alone.model_dump(include={"part", "work_offset_code"})))
        assert np.abs(cuts(result, k) - cuts(single)).max() < NEAR
    assert result.witness is not None and not result.witness.not_compared
    one, = [c.count for c in made("pocket.cls", "mill-3axis", control).witness.compared if c.what == "positions"]
    assert [c.count for c in result.witness.compared if c.what == "positions"] == [2 * one]


def test_one_place_is_the_program_without_places() -> None:
    alone = good(made("pocket.cls", "mill-3axis", "fanuc-30i", part={"origin": (5.0, 6.0, 7.0)}, work_offset_code="G56"))
    one = good(made("pocket.cls", "mill-3axis", "fanuc-30i", places=[
        {"name": "only", "work_offset_code": "G56", "origin": (5.0, 6.0, 7.0)}]))
    assert one.text == alone.text


def test_order_by_tool_changes_tools_once() -> None:
    by_tool = good(made("pocket.cls", "mill-3axis", "linuxcnc", places=TWO))
    by_part = good(made("pocket.cls", "mill-3axis", "linuxcnc", places=TWO, order="part"))
    assert sequence(by_tool) == [(0, 1), (1, 1), (0, 2), (1, 2)]
    assert sequence(by_part) == [(0, 1), (0, 2), (1, 1), (1, 2)]
    assert [sum(" M6" in block for block in body(one.text)) for one in (by_tool, by_part)] == [2, 4]


def test_places_in_the_other_order_are_a_finding_of_the_second_witness() -> None:
    found = made("pocket.cls", "mill-3axis", "linuxcnc", places=TWO, order="part")
    assert found.comparison is not None and found.job is not None
    for order, said in (("part", []), ("tool", ["witness.order"])):
        setup = SetupFile.model_validate({"tools": TOOLS, "places": TWO, "order": order})
        assert [d.code for d in _order(setup, found.comparison, found.job)] == said


def test_operations_of_a_place_stay_in_order() -> None:
    """A tool that comes back later in the file comes back later in the program, at every place."""
    lines = ["PARTNO BACK", "UNITS/MM"]
    for tool, x in ((1, 0), (2, 10), (1, 20)):
        lines += [f"LOADTL/{tool}", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID", f"GOTO/{x},0,20", f"GOTO/{x},0,-1",
                  f"GOTO/{x + 5},0,-1", "RAPID", f"GOTO/{x + 5},0,20"]
    path, found = toolpaths.read_bytes("\n".join([*lines, "FINI"]), file="back.apt")
    result = good(postproc.convert(path, machines.load("mill-3axis"), "linuxcnc", SetupFile.model_validate(
        {"tools": TOOLS, "places": TWO}), diagnostics=found))
    assert sequence(result) == [(0, 1), (1, 1), (0, 2), (1, 2), (0, 1), (1, 1)]
    rows = cut_rows(result)[1]
    for k in (0, 1):
        own = result.toolpath.line[rows[result.job.repeats.place[rows] == k]].tolist()
        assert own == sorted(own) and len(own) == 6


def test_states_are_brought_back() -> None:
    """The second part begins as dry and as slow as the first, whatever the first has ended with."""
    path, found = toolpaths.read_bytes("\n".join([
        "UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID", "GOTO/0,0,20", "GOTO/0,0,-1",
        "GOTO/5,0,-1", "COOLNT/FLOOD", "SPINDL/RPM,3000,CLW", "GOTO/9,0,-1", "RAPID", "GOTO/9,0,20", "FINI"]),
                                         file="wet.apt")
    result = good(postproc.convert(path, machines.load("mill-3axis"), "linuxcnc", SetupFile.model_validate(
        {"tools": TOOLS, "places": TWO}), diagnostics=found))
    motion, (rows, _) = result.comparison.executed[1], cut_rows(result)
    states = list(zip(motion.rpm[rows].tolist(), motion.coolant[rows].tolist(), strict=True))
    assert states[:len(states) // 2] == states[len(states) // 2:] and len(set(states)) == 2


@pytest.mark.parametrize("order", ["tool", "part"])
def test_stops_and_dwells_stand_at_every_place(order: PlaceOrder) -> None:
    cut = ["RAPID", "GOTO/0,0,20", "GOTO/0,0,-1", "GOTO/5,0,-1", "DELAY/2", "GOTO/6,0,-1", "STOP", "GOTO/9,0,-1", "RAPID",
           "GOTO/9,0,20", "OPSTOP", "SPINDL/OFF", "COOLNT/OFF"]
    start = ["SPINDL/RPM,1000,CLW", "COOLNT/ON", "FEDRAT/MMPM,600"]
    path, found = toolpaths.read_bytes("\n".join(["UNITS/MM", "LOADTL/1", *start, *cut, "LOADTL/2", *start, *cut, "FINI"]),
                                       file="stops.apt")
    result = good(postproc.convert(path, machines.load("mill-3axis"), "linuxcnc", SetupFile.model_validate(
        {"tools": TOOLS, "places": TWO, "order": order}), diagnostics=found))
    assert [sum(block == code for block in body(result.text)) for code in ("M0", "M1", "G4 P2")] == [4, 4, 4]


@pytest.mark.parametrize("order", ["tool", "part"])
def test_records_at_the_end_of_a_place_stand_before_the_next_operation(order: PlaceOrder) -> None:
    """Its lines are behind those with which the next place begins: no stop of its own is missed, no label too early."""
    lines = ["UNITS/MM"]
    for n in (1, 2):
        lines += [f"TOOL PATH/OP{n},TOOL,T{n}", "MSYS/0,0,0,1,0,0,0,1,0", f"LOAD/TOOL,{n}", "SPINDL/RPM,1000,CLW",
                  "FEDRAT/MMPM,600", "RAPID", "GOTO/0,0,20", "GOTO/0,0,-1", "GOTO/9,0,-1", "RAPID", "GOTO/9,0,20", "STOP",
                  "PPRINT/DONE", "END-OF-PATH"]
    path, found = toolpaths.read_bytes("\n".join([*lines, "FINI"]), file="ends.cls")
    result = good(postproc.convert(path, machines.load("mill-3axis"), "linuxcnc", SetupFile.model_validate(
        {"tools": TOOLS, "places": TWO, "order": order, "output": {"stop_between_tools": True}}), diagnostics=found))
    assert [sum(block == code for block in body(result.text)) for code in ("M0", "M1")] == [4, 0]
    said = "".join(one[1] for one in re.finditer(r"(?m)^\(?(?=PLACE|DONE|M0$)(.)", result.text))
    assert said == ("MDPMDPMDPMD" if order == "tool" else "MDMDPMDMD")


def test_distance_counts_from_the_middle_of_each_place() -> None:
    """The safe plane is the highest of those of the places alone, and the program retracts to it."""
    path, found = toolpaths.read_bytes("\n".join([
        "UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID", "GOTO/0,0,20", "GOTO/0,0,-1",
        "GOTO/5,0,-1", "RAPID", "GOTO/5,0,20", "FINI"]), file="one.apt")
    far = SetupFile.model_validate({"tools": TOOLS, "clearance": {"distance": 70.0, "between": "plane"},
                                    "places": [TWO[0], TWO[1] | {"origin": (90.0, -10.0, -60.0)}]})

    def top(setup: SetupFile) -> float:
        done = good(postproc.convert(path, machines.load("mill-3axis"), "linuxcnc", setup, diagnostics=found))
        height = done.comparison.executed[1].end[:, 2]
        return float(height[height < 399.0].max())

    alone = [top(one) for one in at_places(far)]
    assert top(far) == pytest.approx(max(alone)) and alone[0] - alone[1] == pytest.approx(80.0)


def test_errors_are_corrected_at_every_place() -> None:
    """The plane of a corrected run is that of its own place, and what is left is inside the tolerance at each."""
    tilted = ",0.1,0,0.994987437"
    path, found = toolpaths.read_bytes("\n".join([
        "UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "MULTAX/ON", "RAPID", f"GOTO/0,0,20{tilted}",
        f"GOTO/0,0,-1{tilted}", f"GOTO/0,9,-1{tilted}", "RAPID", f"GOTO/0,9,20{tilted}", "FINI"]), file="one.apt")
    here = [TWO[0] | {"origin": (-20.0, 0.0, 10.0)}, TWO[1] | {"origin": (60.0, -10.0, 5.0)}]
    result = good(postproc.convert(path, machines.load("mikron-ucp710"), "fanuc-30i", SetupFile.model_validate(
        {"tools": TOOLS, "places": here}), Options(error_model="samples/errors/mikron-ucp710.toml"), found))
    assert result.witness is not None and not result.witness.not_compared and result.comparison.worst_tip < 0.01
    assert [block for block in body(result.text) if block in ("G54", "G57", "G69")] == ["G69", "G57", "G69"]


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("control", CONTROLS)
def test_faces_of_a_tombstone(control: str) -> None:
    """The slides go the same places on every face, the table stands at its turn."""
    result = good(made("pocket.cls", "mill-4axis", control, places=FACES, output={"default": "axes"}))
    first = cuts(result, 0)
    for k in (1, 2):
        assert np.abs(cuts(result, k) - first - [0.0, 0.0, 0.0, 90.0 * k]).max() < NEAR


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("control", CONTROLS)
def test_registers_of_faces_as_they_are_touched_off(control: str) -> None:
    """With the tables turned every register holds the same, and the words of X, Y, Z are the same on every face."""
    faces = [{**face, "measured": "turned"} for face in FACES]
    result = good(made("pocket.cls", "mill-4axis", control, places=faces))
    offsets = [result.job.control_at(k).work_offset for k in range(3)]
    assert np.abs(offsets - offsets[0]).max() < 1e-9
    at_zero = good(made("pocket.cls", "mill-4axis", control, places=FACES, output={"default": "axes"}))
    for k in range(3):
        assert np.abs(cuts(result, k) - cuts(at_zero, k)).max() < NEAR
    assert "WITH A AT 180: X-20" in result.text.upper()
    wrong = made("pocket.cls", "mill-4axis", control, places=faces, output={"default": "tcp"})
    assert "places.measured" in codes(wrong.diagnostics) or "output.mode" in codes(wrong.diagnostics)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("control", CONTROLS)
def test_five_axes_in_every_mode(control: str) -> None:
    faces = [{**TWO[0], "turn": {"C": 90.0}}, {**TWO[1], "origin": (60.0, 20.0, 10.0)}]
    result = good(made("five_faces.cls", "trunnion-bc", control, places=faces, work_offset="MSYS 1"))
    assert result.witness is not None and len(result.job.places) == 2


def test_parallel_machines_take_places_without_a_turn() -> None:
    result = good(made("pocket.cls", "linuxcnc-lineardelta", "linuxcnc", places=[
        {"name": "a", "work_offset_code": "G54", "origin": (-20.0, 0.0, 0.0)},
        {"name": "b", "work_offset_code": "G55", "origin": (20.0, 0.0, 0.0)}]))
    assert np.abs(cuts(result, 1) - cuts(result, 0))[:, 0] == pytest.approx(40.0, abs=NEAR)
    wrong = made("pocket.cls", "linuxcnc-lineardelta", "linuxcnc", places=[{**TWO[0], "turn": {"C": 90.0}}, TWO[1]])
    assert "places.turn" in codes(wrong.diagnostics)


def test_an_offset_that_is_not_switched_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = sections.with_sections

    def without(*rest: object) -> object:
        result = kept(*rest)
        return {k: tuple(c for c in group if c.name != "SET_ORIGIN_OFFSETS") for k, group in result.items()}

    monkeypatch.setattr("postproc.compile.compile.with_sections", without)
    assert "verify.not_reached" in codes(made("pocket.cls", "mill-3axis", "linuxcnc", places=TWO).diagnostics)


def test_a_place_that_is_left_out_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the second witness, which repeats the CL file by the set-up alone."""

    def without(path: toolpaths.toolpath.Toolpath, some: list, order: PlaceOrder) -> tuple[object, Repeated]:
        whole, rows = repeated(path, [some[0], some[0]], order)
        return whole, replace(rows, place=np.zeros_like(rows.place))

    monkeypatch.setattr(places, "repeated", without)
    monkeypatch.setattr(places, "modes_at", lambda some, modes, frame: modes)
    result = made("pocket.cls", "mill-3axis", "linuxcnc", places=TWO)
    assert not result.ok


def test_bodies_stand_at_every_place() -> None:
    """A clamp of the part is in the path of both; what stands on the table is in that of the part next to it alone."""
    clamp = {"name": "clamp", "frame": "part", "box": {"low": (-5.0, 38.0, -20.0), "high": (5.0, 60.0, 30.0)}}
    post = {"name": "post", "frame": "table", "box": {"low": (110.0, -30.0, 0.0), "high": (140.0, 10.0, 80.0)}}
    for body_of, named in ((clamp, {"fixture clamp at left", "fixture clamp at right"}), (post, {"fixture post"})):
        result = made("pocket.cls", "mill-3axis", "linuxcnc", places=TWO, bodies={"fixtures": [body_of]})
        said = " ".join(str(d) for d in result.diagnostics if d.code in ("collision.touch", "collision.near"))
        assert not result.ok and all(name in said for name in named)
        assert ('at the place "right"' in said) and ('at the place "left"' in said) == ("fixture post" not in named)


def test_travel_is_said_by_place() -> None:
    """Where it ends in planning, and where the program of a shorter machine is read."""
    far = [TWO[0], {**TWO[1], "origin": (900.0, -10.0, 5.0)}]
    asked = made("pocket.cls", "mill-3axis", "linuxcnc", places=far, clearance={"between": "home"})
    said = [d.message for d in asked.diagnostics if d.code == "travel.exceeded" and "axis X" in d.message]
    assert said and all('"right"' in text for text in said)
    result = good(made("pocket.cls", "mill-3axis", "linuxcnc", places=TWO))
    assert result.job is not None
    limits = result.machine.limits
    shorter = replace(result.machine, limits=replace(limits, upper=np.minimum(limits.upper, [60.0, np.inf, np.inf])))
    job = replace(result.job, machine=shorter, control=replace(result.job.control, machine=shorter))
    found = [d.message for d in read_back(result.text, job, "pocket.cls")[1] if d.code == "verify.travel"]
    assert found and all('at the place "right"' in text for text in found)


@pytest.mark.parametrize(("setup", "code"), [
    ({"places": TWO, "clearance": {"centre": (0.0, 0.0, 0.0)}}, "places.centre"),
    ({"places": [{**TWO[0], "turn": {"A": 90.0}}, TWO[1]]}, "places.turn"),
    ({"places": [{**TWO[0], "work_offset_code": "G54.1 P7"}, TWO[1]]}, "setup.work_offset_code")])
def test_what_makes_no_sense_is_refused(setup: dict, code: str) -> None:
    assert code in codes(made("pocket.cls", "mill-3axis", "linuxcnc", **setup).diagnostics)


def test_tool_axes_are_chosen_for_one_part() -> None:
    path, found = toolpaths.read("samples/pocket.cls")
    result = postproc.convert(path, machines.load("mill-3axis"), "linuxcnc", SetupFile.model_validate({"places": TWO}),
                              Options(orient="auto"), found)
    assert codes(result.diagnostics) >= {"places.one"}


def test_one_register_under_two_names_is_refused() -> None:
    same = [TWO[0], TWO[1] | {"work_offset_code": "preset 1"}]
    assert "setup.work_offset_code" in codes(made("pocket.cls", "mill-3axis", "heidenhain-tnc640", places=same).diagnostics)
