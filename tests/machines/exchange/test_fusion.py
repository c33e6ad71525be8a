"""Fusion's machine files: the tree of bodies, how each body moves itself, speeds per minute."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from machines.exchange.read import import_machine
from machines.machine import Machine

Part = dict[str, Any]


def body(kind: str, name: str, *carries: Part, **more: Any) -> Part:
    return {"id": name, "type": kind, "control": "driven", **more, "parts": list(carries)}


def end(kind: str, point: tuple[float, ...], **more: Any) -> Part:
    return {"id": kind, "type": kind, "attach_frame": {"point": point, "z_direction": [0, 0, 1]}, **more}


def turning(point: tuple[float, ...], direction: tuple[float, ...]) -> Part:
    return {"axis_of_rotation": {"point": point, "direction": direction}, "offset": [0, 0, 0]}


def trunnion() -> Part:
    """X carries B, B carries C; Y carries Z, Z the spindle. The model stands 1000 mm above the floor."""
    c = body("rotary", "rotary_1", end("table", (0, 0, 700)), **turning((0, 0, 700), (0, 0, -1)))
    b = body("rotary", "rotary_0", c, min=-35, max=120, **turning((0, 0, 650), (0, -1, 0)))
    x = body("linear", "X", b, direction=[-1, 0, 0], min=-381, max=381, home=-300)
    z = body("linear", "Z", end("head", (0, 0, 1000), spindle={"max_speed": 12000}), direction=[0, 0, 1], min=-200, max=0)
    y = body("linear", "Y", z, direction=[0, 1, 0], min=-254, max=254)
    axes = {"X": 0, "Y": 1, "Z": 2, "rotary_0": 1, "rotary_1": 2}
    speeds = {name: {"coordinate": k, "max_rapid_speed": 18000 if "rotary" in name else 30000} for name, k in axes.items()}
    return {"controller": {"default": {"max_normal_speed": 15000, "parts": speeds}},
            "general": {"vendor": "Our", "model": "Five"}, "interactions": {"default": {"pairs": []}},
            "kinematics": {"default": {"conventions": {"rotation": "right-handed"}, "parts": [
                {"id": "static_0", "type": "static"}, x, y], "units": {"angle": "degrees", "length": "mm"}}},
            "machining": {"default": {"tool_change_time": 4}}}


def imported(folder: Path, file: Part, name: str = "m.mch") -> tuple[Machine | None, list[str]]:
    (folder / name).write_text(json.dumps(file, indent=3, separators=(",", " : ")))
    machine, found = import_machine(folder / name, "auto", ())[1:]
    return machine, [f"{d.severity.name} {d.code} {d.message}" for d in found]


def test_a_trunnion(tmp_path: Path) -> None:
    machine, found = imported(tmp_path, trunnion())
    assert machine is not None, found
    assert [line.split()[1] for line in found] == ["import.sense", "import.sense", "import.assumed"]
    assert machine.structure == "w C' B' X' b Y Z (C1) t" and machine.description == "Our Five"
    assert machine.limits.velocity[:3] == pytest.approx([500.0] * 3) and np.degrees(machine.limits.velocity[3:]) == (
        pytest.approx([300.0, 300.0]))
    assert machine.limits.lower[0] == -381.0 and np.degrees(machine.limits.upper[3]) == pytest.approx(120.0)
    assert np.isinf(machine.limits.upper[4]) and machine.home[0] == -300.0 and machine.timing.tool_change == 4.0
    assert (machine.largest_feed, machine.largest_spindle_speed) == (250.0, 12000.0)
    assert machine.figures["B.point"].startswith("m.mch: line ") and machine.figures["X.acceleration"] == "assumed"


def test_where_the_tool_is_on_the_turned_part(tmp_path: Path) -> None:
    """By the file itself: the table moves by -x, B turns it about (0, -1, 0) through z = 650, the head stands at 1000."""
    machine = imported(tmp_path, trunnion())[0]
    assert machine is not None
    q = np.array([[100.0, 20.0, -50.0, np.radians(30.0), 0.0]])
    tip, axis = machine.kinematics.forward(q)
    turn = np.radians(30.0)  # the part turned back: about (0, 1, 0) by +30 degrees, right-handed
    back = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    tool, pivot = np.array([100.0, 20.0, 950.0]), np.array([0.0, 0.0, 650.0])
    np.testing.assert_allclose(tip[0] + [0, 0, 1000.0], back @ (tool - pivot) + pivot, atol=1e-9)
    np.testing.assert_allclose(axis[0], back @ [0, 0, 1], atol=1e-12)


def test_reversed_axes_and_inches(tmp_path: Path) -> None:
    file = trunnion()
    file["controller"]["default"]["parts"]["rotary_0"]["reversed"] = True
    file["kinematics"]["default"]["units"]["length"] = "in"
    machine, found = imported(tmp_path, file)
    assert machine is not None and "reversed" in found[0]
    directions = {joint.name: joint.direction.tolist() for joint in machine.kinematics.chain}
    assert directions["B"] == [0, -1, 0] and directions["C"] == [0, 0, 1]
    assert machine.limits.upper[0] == pytest.approx(9677.4)


def test_what_no_speed_and_no_end_state_is_assumed(tmp_path: Path) -> None:
    """Speed 0 is none; a linear axis without ends has assumed ones, a rotary one turns without end."""
    file = trunnion()
    file["controller"]["default"]["parts"]["Y"]["max_rapid_speed"] = 0
    y, b = file["kinematics"]["default"]["parts"][2], file["kinematics"]["default"]["parts"][1]["parts"][0]
    ends = [(part, part.pop("min")) for part in (y, b)]
    assert [line[:19] for line in imported(tmp_path, file)[1] if "travel only" in line] == 2 * ["ERROR import.travel"], (
        "the other end was dropped, and B turned without end")
    b["min"] = ends[1][1]
    del y["max"]
    machine, found = imported(tmp_path, file, "m.machine")
    assert machine is not None and "axes.Y.travel" in found[-1] and "axes.Y.velocity" in found[-1]


def test_newer_files_name_the_configuration_of_the_control_and_state_lines_twice(tmp_path: Path) -> None:
    """As Autodesk's "5ax table bc head yxz.mch": controller.synced_configuration, offset a place of the line of B."""
    file, plain = trunnion(), imported(tmp_path, trunnion())[0]
    file["controller"] = {"synced_configuration": file["controller"]["default"]}
    turns = file["kinematics"]["default"]["parts"][1]["parts"][0]
    turns["axis_of_rotation"]["point"], turns["offset"] = [0, -454.0, 650.0], [0, 0, 650.0]
    machine, found = imported(tmp_path, file)
    assert machine is not None and plain is not None, found
    q = np.array([[100.0, 20.0, -50.0, 0.5, 1.0]])
    np.testing.assert_allclose(machine.kinematics.forward(q), plain.kinematics.forward(q), atol=1e-9)
    np.testing.assert_array_equal(machine.limits.velocity, plain.limits.velocity)


def test_a_place_that_is_stated_counts_where_the_file_is_not_understood(tmp_path: Path) -> None:
    file = trunnion()
    file["kinematics"]["default"]["parts"][1]["parts"][0]["offset"] = [7, 0, 650]
    assert imported(tmp_path, file)[0] is None
    machine = import_machine(tmp_path / "m.mch", "auto", ("kinematics.axes.B.point=[0,0,-350]",))[1]
    assert machine is not None and machine.figures["B.point"].startswith("stated at the import")


def faults() -> list[tuple[str, Part]]:
    made = []
    for says in ("no place of its line", "in cubits", "2 parts of type table", "0 parts of type head", "z of head",
                 "two axes are", "no coordinate", "no driven axis", "no direction", "kinematics.default.parts.2.direction"):
        made.append((says, trunnion()))
    tree = [file["kinematics"]["default"] for _, file in made]
    tree[0]["parts"][1]["parts"][0]["offset"] = [5, 0, 650]
    tree[1]["units"]["length"] = "cubits"
    tree[2]["parts"].append(end("table", (0, 0, 0)))
    tree[3]["parts"].pop()
    tree[4]["parts"][2]["parts"][0]["parts"][0]["attach_frame"]["z_direction"] = [0, 1, 0]
    made[5][1]["controller"]["default"]["parts"]["rotary_0"]["coordinate"] = 2
    del made[6][1]["controller"]["default"]["parts"]["rotary_0"]
    tree[7]["parts"][1]["control"] = "free"
    del tree[8]["parts"][1]["direction"]
    tree[9]["parts"][2]["direction"] = [0, 0, 0]
    return made


@pytest.mark.parametrize(("says", "file"), faults())
def test_what_is_not_understood_is_said(says: str, file: Part, tmp_path: Path) -> None:
    machine, found = imported(tmp_path, file)
    assert machine is None and any(line.startswith("ERROR import.") and says in line for line in found), found


def test_a_file_that_is_no_json(tmp_path: Path) -> None:
    (tmp_path / "m.mch").write_text("PK\x03\x04")
    assert import_machine(tmp_path / "m.mch", "auto", ())[2][0].code == "import.number"
