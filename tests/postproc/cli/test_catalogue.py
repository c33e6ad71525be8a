"""What is said of a machine: where the part's frame lies, and the axes that turn it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from postproc.cli.app import app
from postproc.dossier.words import machine_text, rotary_lines
from tests.postproc.kit import machine

NAMES = [name for name in machines.names() if any(machine(name).rotary)]


@pytest.mark.parametrize("name", NAMES)
def test_points_of_a_rotary_axis_stay_where_they_are(name: str) -> None:
    """With the slides standing, a joint that turns moves the tool round its line: as far from it, and as high along it."""
    m = machine(name)
    turning = np.array(m.rotary) & ~np.array(m.kinematics.drives_tip)  # cranks of platforms have no line of the tool
    q = np.where(turning | m.kinematics.straight_slides, 0.0, m.home)
    assert {row["letter"] for row in rotary_lines(m)} == {a for a, turns in zip(m.axis_names, turning, strict=True) if turns}
    for row in rotary_lines(m):
        point, along = np.array(row["point"]), np.array(row["direction"])
        assert np.linalg.norm(along) == pytest.approx(1.0) and abs(point @ along) < 1e-5
        away = []
        for angle in (0.0, 0.1):
            turned = q.copy()
            turned[m.axis_names.index(row["letter"])] = angle
            tip = m.kinematics.forward(turned[None])[0][0] - point
            away.append((float(tip @ along), float(np.linalg.norm(np.cross(tip, along)))))
        assert away[1] == pytest.approx(away[0], abs=1e-5)


def test_where_the_rotary_axes_of_a_trunnion_lie() -> None:
    """The numbers of LinuxCNC's own sample: x-rot-point 5, y-rot-point -3, z-rot-point 7, offsets 20 and 10."""
    noted = machine_text(machine("linuxcnc-xyzac-trt"))
    assert "table frame: carries the part; with all axes at zero it is the machine's, and" in noted
    assert "  A turns about the line through (0, 17, 17) mm along (1, 0, 0)" in noted
    assert "  C turns about the line through (5, -3, 0) mm along (0, 0, 1)" in noted
    assert "with all axes at zero it is the machine's\n" in f"{machine_text(machine('mill-3axis'))}\n"


def test_inspect_counts_surface_normals(tmp_path: Path) -> None:
    file = tmp_path / "n.apt"
    file.write_text("UNITS/MM\nCUTTER/10,5\nMULTAX/ON\nFEDRAT/MMPM,500\nGOTO/0,0,0,0,0,1\nGOTO/1,0,0,0,0,1,0,0.6,0.8\n"
                    "GOTO/2,0,0,0,0,1,0,0,1\nFINI\n")
    result = CliRunner().invoke(app, ["inspect", str(file), "--json", str(tmp_path / "i.json")])
    assert result.exit_code == 0 and json.loads((tmp_path / "i.json").read_text())["normals"] == 2
    noted = CliRunner().invoke(app, ["inspect", str(file)]).output
    assert "  surface normals at 2 points" in noted
    file.write_text("UNITS/MM\nFEDRAT/MMPM,500\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    assert "surface normals" not in CliRunner().invoke(app, ["inspect", str(file)]).output


def undescribed(schema: Any) -> Iterator[str]:
    """Keys of a schema without a text; one that refers to a table has that of the table, a fixed word none."""
    if isinstance(schema, dict):
        if isinstance(keys := schema.get("properties"), dict):
            yield from (name for name, one in keys.items() if isinstance(one, dict) and not one.get("description")
                        and not {"$ref", "const"} & set(one))
        schema = list(schema.values())
    if isinstance(schema, list):
        yield from (name for one in schema for name in undescribed(one))


@pytest.mark.parametrize("command", [
    "machine schema", "controller schema", "setup schema", "errors schema", "calibrate --schema",
    "schema job-file", "schema batch-file"])
def test_a_schema_says_what_each_key_is(command: str) -> None:
    got = CliRunner().invoke(app, command.split())
    assert got.exit_code == 0 and list(undescribed(json.loads(got.stdout))) == []


def test_a_key_without_a_text_is_noticed() -> None:
    assert list(undescribed({"$defs": {"A": {"properties": {"x": {"type": "number"}, "kind": {"const": "a"}}}}})) == ["x"]
