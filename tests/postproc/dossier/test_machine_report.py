"""The command `machine report`: what the page and its JSON say is what the machine file, the controls and the proofs say."""

from __future__ import annotations

import hashlib
import json
import math
import re
from base64 import b64decode
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.analysis.chain_map import chain_map, chain_map_figure
from machines.analysis.lever_map import lever_figure, lever_map, moved_by_slides
from machines.analysis.levers import levers
from machines.sheet.drawing import drawing
from postproc.cli.app import app
from postproc.dossier.page import _region
from tests.postproc.kit import machine

ERRORS = "[components.EXX]\npolynomial = [0, 3]\nscale = 100\nrange = [-400, 400]\n"
HOSTILE = '<script>alert(1)</script>&"\'>'


def reported(folder: Path, *arguments: str) -> tuple[str, dict[str, Any]]:
    """(page, JSON)."""
    page, values = folder / "r.html", folder / "r.json"
    done = CliRunner().invoke(app, ["machine", "report", *arguments, "-o", str(page), "--json", str(values)])
    assert done.exit_code == 0, done.output
    return page.read_text(), json.loads(values.read_text())


def cells(page: str, section: str) -> list[list[str]]:
    """Rows of the tables of a section, as a reader sees them."""
    body = page.split(f'<section id="{section}">')[1].split("</section>")[0]
    return [[unescape(re.sub("<[^>]*>", "", cell)) for cell in re.findall("<td[^>]*>(.*?)</td>", row)]
            for row in re.findall("<tr>(.*?)</tr>", body)]


def test_a_trunnion_s_page_says_limits_pivots_and_levers(tmp_path: Path) -> None:
    page, values = reported(tmp_path, "mikron-ucp710", "-c", "haas-ngc", "-c", "siemens-840d")
    m = machine("mikron-ucp710")
    limits = {row[0]: row for row in cells(page, "limits") if len(row) == 8}
    for j, letter in enumerate(m.axis_names):
        unit = 1.0 if not m.rotary[j] else np.degrees(1.0)
        assert float(limits[letter][3]) == pytest.approx(m.limits.velocity[j] * unit)
        assert limits[letter][1].endswith("*")  # travel is assumed there
    assert set(values["pivots"]) == {"haas-ngc", "siemens-840d"} == {row[0] for row in cells(page, "pivots") if row}
    assert values["certificate"]["boxes"] > 100 and values["certificate"]["checked_with_this_version"]
    assert values["errors"] is None and any("A -30 to 120 degrees" in row[1] for row in cells(page, "certificate"))
    assert "X.travel" in values["assumed"] and values["ok"]
    assert {row[0]: row[1] for row in cells(page, "condition") if len(row) == 3} == {
        letter: f"{row['mm']:.4g}" for letter, row in values["levers"].items()}
    assert page.count("<img") == 4


def test_a_machine_on_legs_shows_maps_and_its_certificate(tmp_path: Path) -> None:
    page, values = reported(tmp_path, "planar-delta", "-c", "linuxcnc", "--figures", str(tmp_path / "f"))
    found = json.loads(Path(machine("planar-delta").certificate).read_text())
    assert values["certificate"]["boxes"] == len(found["boxes"]) and values["certificate"]["proved"] == found["proved"]
    rows = {row[0]: row[1:] for row in cells(page, "certificate") if row}
    assert rows["boxes"] == [str(len(found["boxes"]))] and rows["confirmed with this version"] == ["yes"]
    assert " rad" not in page and rows["region"][0].startswith("of the platform with a tool of 0 mm: x ")
    worst = values["analysis"]["condition_number"]["worst"]
    assert ["condition number", f"{worst:.6g}"] == next(row[:2] for row in cells(page, "condition") if row)
    drawn = {path.name for path in (tmp_path / "f").iterdir()}
    assert {"machine.png", "condition-x-z.svg", "force-x-y.png", "certificate.svg"} <= drawn
    shown = [b64decode(data) for data in re.findall(r"base64,([^\"]*)", page)]
    assert (tmp_path / "f" / "machine.svg").read_bytes() in shown


def test_errors_are_those_of_the_survey(tmp_path: Path) -> None:
    model = tmp_path / "e.toml"
    model.write_text(ERRORS)
    page, values = reported(tmp_path, "mikron-ucp710", "-c", "linuxcnc", "--error-model", str(model), "--tool-length", "80")
    volume = values["errors"]["volume"]
    assert volume["tool_length_mm"] == 80.0 and volume["tip_worst_um"] > 0.0
    assert ["tip, worst, um", f"{volume['tip_worst_um']:.2f}"] in cells(page, "errors")
    assert values["errors"]["file"] == "e.toml"
    hashes = {one["file"]: one["sha256"] for one in values["files"]}
    assert hashes["e.toml"] == hashlib.sha256(model.read_bytes()).hexdigest() and hashes["e.toml"] in page
    assert hashes["mikron-ucp710.toml"] == hashlib.sha256(Path(machine("mikron-ucp710").file).read_bytes()).hexdigest()


def test_texts_of_the_machine_file_stay_texts_and_nothing_is_loaded(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(f"base = \"mill-3axis\"\ndescription = '''{HOSTILE}'''\n")
    page, values = reported(tmp_path, str(file), "-c", "linuxcnc")
    assert values["machine"]["description"] == HOSTILE and HOSTILE not in page and "<script" not in page
    assert "default-src 'none'" in page and not re.search(r"""(src|href)=["']?(?!#|data:)\w|@import|url\(""", page)
    assert values["levers"] == {} and values["pivots"] == {"linuxcnc": []}


def test_ranges_of_a_certificate_are_in_degrees() -> None:
    words = _region({"of": "tip", "tool_mm": 50.0, "x_mm": [-10.0, 20.5], "tilt_rad": [0.0, math.pi / 6]})
    assert words == "of the tip with a tool of 50 mm: x -10 to 20.5 mm, tilt 0 to 30 degrees"


def test_a_name_does_not_turn_the_writing_of_the_drawing() -> None:
    assert "a\ufffdgpj\ufffd&lt;" in drawing(replace(machine("mikron-ucp710"), description="a\u202egpj\x00<"))


@pytest.mark.parametrize("arguments", [["-o", "r.txt"], ["-o", "own.toml"], ["-c", "nobody", "-o", "r.html"],
                                       ["--error-model", "none.toml", "-o", "r.html"]])
def test_wrong_use_writes_nothing(tmp_path: Path, arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text('base = "mill-3axis"\n')
    done = CliRunner().invoke(app, ["machine", "report", "own.toml", *arguments])
    assert done.exit_code in (1, 2) and "Traceback" not in done.output
    assert [path.name for path in tmp_path.iterdir()] == ["own.toml"]


@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table", "fork-head-ab", "mill-4axis"])
def test_levers_are_the_distances_that_random_positions_never_exceed(name: str) -> None:
    """The distance of the tip from the axis, by turning it a little with all else standing."""
    m, h = machine(name), 1e-5
    found = levers(m)
    low, high = (np.where(np.isfinite(end), end, turn) for end, turn in ((m.limits.lower, -3.0), (m.limits.upper, 3.0)))
    q = np.random.default_rng(3).uniform(low, high, (500, len(low)))
    assert set(found) == {letter for letter, turns in zip(m.axis_names, m.rotary, strict=True) if turns}
    for letter, row in found.items():
        j = m.axis_names.index(letter)
        at = np.array([np.radians(v) if turns else v for v, turns in zip(row["at"].values(), m.rotary, strict=True)])
        moved = np.stack([at, at])
        moved[:, j] += (-h, h)
        tip, _ = m.kinematics.forward(moved)
        assert float(np.linalg.norm(tip[1] - tip[0])) / (2 * h) == pytest.approx(row["mm"], rel=1e-4)
        ends = [m.kinematics.forward(q + s * h * np.eye(len(low))[j])[0] for s in (-1, 1)]
        assert float(np.linalg.norm(ends[1] - ends[0], axis=1).max()) / (2 * h) <= row["mm"] * (1 + 1e-4)


def test_the_map_of_torque_is_the_distance_from_the_axis() -> None:
    """A of the trunnion lies along X through the zero: the tip stands sqrt(y2 + z2) from it. Heads carry the tool along."""
    m = machine("mikron-ucp710")
    names, (y, z), arm = lever_map(m, "A")
    assert names == ("Y", "Z") and arm == pytest.approx(np.hypot(y[:, None], z[None, :]), abs=1e-9)
    assert arm.max() == pytest.approx(levers(m)["A"]["mm"]) and moved_by_slides(m) == ["A", "C"]
    assert moved_by_slides(machine("fork-head-ab")) == [] == moved_by_slides(machine("uranesx"))
    with pytest.raises(ValueError, match="no rotary axis"):
        lever_figure(machine("fork-head-ab"), ".svg")


def test_the_condition_of_a_trunnion_depends_on_its_tilt_alone_and_ends_where_it_is_singular() -> None:
    letters, sides, condition = chain_map(machine("mikron-ucp710"))
    assert letters == ["A", "C"] and condition.shape == (len(sides[0]), len(sides[1]))
    finite = np.isfinite(condition)
    assert not finite[np.abs(sides[0]) < 1e-9].any() and finite[np.abs(sides[0]) > 1.0].all()
    with pytest.raises(ValueError, match="no rotary axis"):
        chain_map_figure(machines.load("mill-3axis"), ".svg")

