"""Plug-ins as installed packages register them: the worked examples, broken ones, and that nobody is asked without need."""

from __future__ import annotations

import importlib
import json
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import toolpaths
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import work_of
from postproc.page.document import document
from postproc.page.tabs import ReportTab, TabTable, with_tabs
from postproc.setup.model import load_setup
from tests.docs.page import faults
from tests.postproc.kit import machine
from toolpaths.choices import ShopName
from toolpaths.diagnostics import Severity
from toolpaths.plug_ins import PlugInFault, plug_in, registered

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "samples/plugins"
GROUPS = {"postproc.kinematics": "compound-slide", "postproc.cl_dialects": "shop-apt", "postproc.cl_readers": "probe-points",
          "postproc.orientation_criteria": "clear-of", "postproc.report_tabs": "tool-list"}
ON = ["--setup", str(FOLDER / "tools.setup.toml"), "-c", "linuxcnc"]


def install(folder: Path, name: str, points: dict[str, dict[str, str]], **modules: str) -> None:
    """A package as pip leaves it on the path: modules, and their metadata."""
    info = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("".join(
        f"[{group}]\n" + "".join(f"{key} = {value}\n" for key, value in some.items()) for group, some in points.items()))
    for module, text in modules.items():
        (folder / f"{module}.py").write_text(text)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on the path; what is imported from it is forgotten again."""
    folder, before = tmp_path / "site", set(sys.modules)
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    yield folder
    for name in set(sys.modules) - before:
        if str(getattr(sys.modules[name], "__file__", "")).startswith((str(folder), str(FOLDER))):
            del sys.modules[name]


@pytest.fixture
def shop(site: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The sample package, installed."""
    project = tomllib.loads((FOLDER / "pyproject.toml").read_text("utf-8"))["project"]
    install(site, project["name"], project["entry-points"])
    monkeypatch.syspath_prepend(str(FOLDER))
    return site


def run(*words: object, code: int = 0) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == code and (done.exception is None or isinstance(done.exception, SystemExit)), done.output
    assert "Traceback" not in done.output
    return done.output


def test_the_sample_registers_one_of_each_group(shop: Path) -> None:
    for group, name in GROUPS.items():
        assert name in registered(group)
        given, _ = plug_in(group, name, registered(group)[name])
        assert str(given) == f"{name} of shop-plugins 1.0" and re.fullmatch("[0-9a-f]{64}", given.sha256)


@pytest.mark.parametrize(("file", "name", "line"), [("part.points", "probe-points", 7), ("part.shop", "shop-apt", 16)])
def test_a_file_of_the_shop_converts_on_the_machine_of_the_shop(shop: Path, tmp_path: Path, file: str, name: str,
                                                                line: int) -> None:
    out, part, kind = tmp_path / "p.ngc", FOLDER / file, FOLDER / "compound_slide.toml"
    said = run("convert", part, "-m", kind, *ON, "-o", out, "--proof")
    assert f"as read by {name} of shop-plugins 1.0" in said
    proof = json.loads((tmp_path / "p.ngc.proof.json").read_text())
    given, _ = plug_in("postproc.cl_readers", "probe-points", registered("postproc.cl_readers")["probe-points"])
    assert proof["inputs"]["cl_file"][1] == {"file": f"{name} of shop-plugins 1.0", "sha256": given.sha256}
    assert [one["file"] for one in proof["inputs"]["machine"]] == ["compound_slide.toml", "compound_slide.py"]
    text = out.read_text()
    assert f"CL file as read by {name} of shop-plugins 1.0  code {given.sha256[:12]}" in text
    assert "machine by kind compound-slide of shop-plugins 1.0" in text
    assert "are those of the proof" in run("verify", out, part, "-m", kind, *ON)
    path, found = toolpaths.read(part)
    assert [d.severity for d in found] in ([], [Severity.INFO]) and path.line[4] == line
    np.testing.assert_array_equal(path.tip[-5:-1], [[40, 0, -2], [40, 25, -2], [0, 25, -2], [0, 0, -2]])
    assert "not compared records of the CL file" in run("convert", part, "-m", "mill-3axis", *ON, "-o", tmp_path / "q.ngc",
                                                        "--require-proof", code=1)


def test_the_commands_of_the_readme_run(shop: Path, tmp_path: Path) -> None:
    assert faults(FOLDER / "README.md", tmp_path) == [] and (tmp_path / "out/p.ngc").exists()


def test_code_that_has_changed_since_is_named(shop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out, part = tmp_path / "p.ngc", FOLDER / "part.points"
    run("convert", part, "-m", "mill-3axis", *ON, "-o", out, "--proof")
    monkeypatch.setattr("toolpaths.plug_ins.code_hash", lambda module: "0" * 64)
    assert "proof.cl_file" in run("verify", out, part, "-m", "mill-3axis", *ON)


def test_a_dialect_that_is_asked_for_stands_before_plug_ins(shop: Path) -> None:
    _, found = toolpaths.read(FOLDER / "part.shop", dialect="generic")
    assert any("MOVETO" in d.message for d in found if d.severity is Severity.ERROR)


@pytest.mark.parametrize(("file", "name"), [("part.points", "probe-points"), ("part.shop", "shop-apt")])
def test_a_dialect_of_a_package_is_asked_for_by_its_name(shop: Path, tmp_path: Path, file: str, name: str) -> None:
    """Without its mark a file of the shop is read by nobody, but where the name is said: the same path."""
    known, bare = FOLDER / file, tmp_path / "bare.cls"
    bare.write_text("\n".join(line for line in known.read_text().split("\n") if "SHOP" not in line.upper() or "/" in line))
    path, found = toolpaths.read(bare, dialect=ShopName(name))
    assert not [d for d in found if d.severity is Severity.ERROR] and path.source is not None
    assert path.source.plug_in is not None and path.source.plug_in.name == name
    np.testing.assert_array_equal(path.tip, toolpaths.read(known)[0].tip)
    said = run("convert", bare, "-m", "mill-3axis", *ON, "--dialect", name, "-o", tmp_path / "p.ngc")
    assert f"as read by {name} of shop-plugins 1.0" in said
    wrong = run("inspect", bare, "--dialect", "nobodys", code=2)
    assert "nobodys" in wrong and name in wrong and "generic" in wrong


def test_a_broken_dialect_that_is_asked_for_is_an_error(site: Path, tmp_path: Path) -> None:
    install(site, "broken-post", {"postproc.cl_dialects": {"broken": "broken_post:NOTHING"}}, broken_post="x = 1\n")
    part = tmp_path / "p.cls"
    part.write_text("GOTO/0,0,0\nFINI\n")
    assert "error [cl.plug-in]" in run("inspect", part, "--dialect", "broken", code=1)
    assert "cl.plug-in" not in run("inspect", part, "--dialect", "generic")
    with pytest.raises(ValueError, match="no dialect 'brokn'; did you mean 'broken'"):
        toolpaths.read(part, dialect=ShopName("brokn"))


def test_both_readings_are_given_the_lines_of_the_file(shop: Path) -> None:
    from postproc.witness.clfile import commanded

    path, _ = toolpaths.read(FOLDER / "part.points")
    source = path.source
    assert source is not None and source.data == (FOLDER / "part.points").read_bytes()
    second = commanded(source.records, None, source.dialect, source.lines)
    np.testing.assert_array_equal(second.line[second.known], path.line)
    np.testing.assert_allclose(second.tip[second.known], path.tip)


@pytest.mark.parametrize(("text", "words"), [
    ("tool, 1, 3000\nrapid, 0, 0\n", "line 3: not enough values"), ("cut, 0, 0, x\n", "line 2: could not convert"),
    ("drill, 0, 0, 0\n", "line 2: 'drill' is neither"), ("cut, 0, 0, inf\n", "line 2: a number that is none"),
    ("tool, x, 1\n", "line 2: invalid literal")])
def test_a_damaged_file_of_the_shop_is_one_line(shop: Path, tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "part.points"
    file.write_text("probe-points 1\n" + text)
    said = run("convert", file, "-m", "mill-3axis", *ON, "-o", tmp_path / "p.ngc", code=1)
    (line,) = [one for one in said.splitlines() if "error" in one and "cl.plug-in" in one]
    assert words in line and "probe-points of shop-plugins 1.0" in line and not (tmp_path / "p.ngc").exists()


BROKEN = {
    "does not run": ("1 / 0", "ZeroDivisionError: division by zero"),
    "ends the program": ("import sys; sys.exit(3)", "SystemExit: 3"),
    "has not the name": ("other = 1", "AttributeError"),
    "is something else": ("it = 7", "is no|no ShopDialect|no ShopReader|is not a KinematicsModel|no ReportTab|no Orient")}


@pytest.mark.parametrize("how", BROKEN)
@pytest.mark.parametrize("group", GROUPS)
def test_a_broken_package_is_one_line_that_names_it(site: Path, tmp_path: Path, group: str, how: str) -> None:
    code, words = BROKEN[how]
    install(site, "bad-shop", {group: {"worst": "bad_shop:it"}}, bad_shop=code)
    setup, made = tmp_path / "s.toml", FOLDER / "compound_slide.toml"
    setup.write_text((FOLDER / "tools.setup.toml").read_text() + (
        "[orientation.criteria.worst]\n" if group == "postproc.orientation_criteria" else ""))
    (tmp_path / "part.txt").write_text("some text\n")
    (tmp_path / "m.toml").write_text(made.read_text().replace("compound-slide", "worst"))
    part = tmp_path / "part.txt" if group == "postproc.cl_readers" else ROOT / "samples/tool_axis_tour.apt"
    kind = tmp_path / "m.toml" if group == "postproc.kinematics" else "mikron-ucp710"
    if group == "postproc.report_tabs":
        said = "".join(str(fault) for fault in with_tabs(report())[1])
    elif group == "postproc.cl_dialects":
        said = run("inspect", part)
    else:
        said = run("convert", part, "-m", kind, "--setup", setup, "-c", "linuxcnc", "-o", tmp_path / "p.ngc", code=1)
    lines = [line for line in said.splitlines() if "bad-shop" in line]
    assert len(lines) == 1 and re.search(words, lines[0]) and "worst" in lines[0], said


def test_two_packages_of_one_name_are_refused(site: Path, tmp_path: Path) -> None:
    install(site, "bad-shop", {"postproc.cl_readers": {"twice": "bad_shop:it"}}, bad_shop="it = 1")
    install(site, "other-shop", {"postproc.cl_readers": {"twice": "other_shop:it"}}, other_shop="it = 1")
    with pytest.raises(PlugInFault, match=r"several times: by bad-shop .*, other-shop"):
        plug_in("postproc.cl_readers", "twice", registered("postproc.cl_readers")["twice"])


CRITERION = ('[orientation.criteria.clear-of]\ndirection = [0.0, -1.0, 0.0]\nleast = 75.0\n'
             '[tools.1]\ngauge_length = 80.0\n')


def test_a_criterion_of_the_shop_limits_tool_axes(shop: Path, tmp_path: Path) -> None:
    setup = tmp_path / "s.toml"
    setup.write_text(CRITERION)
    loaded, found = load_setup(setup)
    assert not found
    path, _ = toolpaths.read_bytes(STRIP)
    work, _ = work_of(path, machine("mikron-ucp710"), loaded, Options())
    one = next(one for one in work.passes if not one.fixed)
    tilted = [[0.0, np.sin(t), np.cos(t)] for t in np.radians([-40.0, -16.0, -14.0, 0.0, 30.0])]
    free = AllowedAxes(np.pi).mask(one, np.array(tilted))
    held = AllowedAxes(np.pi, None, loaded.orientation)
    assert free.all() and held.mask(one, np.array(tilted)).tolist() == [False, False, True, True, True]
    why = str(held.outside(one, np.array(tilted[0])))
    assert "criterion clear-of of shop-plugins 1.0" in why and "50.000 degrees, allowed at least 75.000" in why
    setup.write_text(CRITERION.replace("least = 75.0", "most = 75.0"))
    assert "clear-of.least: Field required" in str(load_setup(setup)[1][0].message)
    setup.write_text(CRITERION.replace("clear-of", "clear-off"))
    (fault,) = load_setup(setup)[1]
    assert "unknown criterion 'clear-off'" in fault.message and "did you mean 'clear-of'?" in fault.hint


def test_a_criterion_is_named_in_header_and_proof(shop: Path, tmp_path: Path) -> None:
    setup, out = tmp_path / "s.toml", tmp_path / "p.ngc"
    setup.write_text(CRITERION)
    run("convert", ROOT / "samples/tool_axis_tour.apt", "-m", "mikron-ucp710", "--setup", setup, "-c", "linuxcnc", "-o", out,
        "--proof")
    assert "(orientation criterion clear-of of shop-plugins 1.0" in out.read_text()
    proof = json.loads((tmp_path / "p.ngc.proof.json").read_text())
    assert [one["file"] for one in proof["inputs"]["setup"]] == ["s.toml", "clear-of of shop-plugins 1.0"]


STRIP = ("UNITS/MM\nCUTTER/10,5\nLOADTL/1\nSPINDL/RPM,3000,CLW\nFEDRAT/MMPM,900\nRAPID\nGOTO/0,0,20\nRAPID\nGOTO/0,0,5\n"
         "GOTO/0,0,0\nGOTO/40,0,0\nRAPID\nGOTO/40,0,20\nFINI\n")
"""a level strip of a ball"""
CRITERIA = '''
from postproc.setup.criteria import OrientationCriterion
class it(OrientationCriterion):
    def title(self): return "angle"
    def bounds(self): return {bounds}
    def angles(self, axes, normal, travel): return {angles}
'''


@pytest.mark.parametrize(("bounds", "angles", "words"), [
    ("0.0, 1.0", "axes[:, 0]", "shape"), ("0.0, 1.0", "1 / 0", "ZeroDivisionError"),
    ("2.0, 1.0", "axes[:, :1]", "bounds 2.0"),
    ("None", "axes[:, :1]", "TypeError")])
def test_a_criterion_that_gives_no_angles_is_refused(site: Path, tmp_path: Path, bounds: str, angles: str,
                                                     words: str) -> None:
    install(site, "bad-shop", {"postproc.orientation_criteria": {"worst": "bad_shop:it"}},
            bad_shop=CRITERIA.format(bounds=bounds, angles=angles))
    (tmp_path / "s.toml").write_text("[orientation.criteria.worst]\n[tools.1]\ngauge_length = 80.0\n")
    (tmp_path / "strip.apt").write_text(STRIP)
    said = run("orient", tmp_path / "strip.apt", "-m", "mikron-ucp710", "--setup", tmp_path / "s.toml", code=1)
    (line,) = [one for one in said.splitlines() if "bad-shop" in one]
    assert "orient.criterion" in line and words in line


def report() -> dict[str, object]:
    tools = [{"number": 1, "name": "<b>EM10</b>", "time_s": 60.0}]
    run = {"machine": "m", "controller": "c", "tools": tools, "points": None}
    return {"report_version": 1, "postproc": "0", "part": "p", "cl_file": "p.cls", "points_in_part": 0, "runs": [run]}


def test_a_tab_of_the_shop_stands_in_the_report(shop: Path) -> None:
    values, found = with_tabs(report())
    (tab,) = values["runs"][0]["tabs"]
    assert not found and tab["title"] == "Tool room" and tab["package"] == "shop-plugins" and len(tab["sha256"]) == 64
    assert tab["blocks"][1]["rows"] == [["T1", "<b>EM10</b>", 60.0, 30.0]]
    page = document(values, [])
    assert "Tool room" in page and "<b>EM10" not in page


@pytest.mark.parametrize(("blocks", "words"), [
    (lambda run: 1 / 0, "ZeroDivisionError"), (lambda run: [7], "neither a text"), (lambda run: None, "TypeError"),
    (lambda run: [TabTable(("a",), [(1, 2)])], "cells as heads"), (lambda run: ["x"] * 101, "at most 100")])
def test_a_tab_that_fails_is_left_out(site: Path, monkeypatch: pytest.MonkeyPatch, blocks: object, words: str) -> None:
    install(site, "bad-shop", {"postproc.report_tabs": {"worst": "bad_shop:it"}}, bad_shop="it = None")
    bad_shop = importlib.import_module("bad_shop")
    monkeypatch.setattr(bad_shop, "it", ReportTab("Worst", blocks))
    given = report()
    values, (fault,) = with_tabs(given)
    assert values["runs"][0]["tabs"] == [] and fault.severity is Severity.WARNING and "tabs" not in given["runs"][0]
    assert "worst of bad-shop 1.0" in fault.message and words in fault.message


def test_a_tab_cannot_change_the_report(shop: Path, site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(site, "bad-shop", {"postproc.report_tabs": {"worst": "bad_shop:it"}}, bad_shop="it = None")
    bad_shop = importlib.import_module("bad_shop")
    monkeypatch.setattr(bad_shop, "it", ReportTab("Worst", lambda run: run["tools"].clear() or ["done"]))
    values, found = with_tabs(report())
    assert not found and len(values["runs"][0]["tools"]) == 1


def test_nobody_is_asked_without_need(shop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files known by themselves, or read as asked, look at no entry point; others at those of CL files alone."""
    import importlib.metadata

    asked: list[str] = []
    real = importlib.metadata.entry_points

    def noted(**given: str) -> object:
        asked.extend(group for group in given.values() if group.startswith("postproc."))
        return real(**given)

    monkeypatch.setattr(importlib.metadata, "entry_points", noted)
    own = tmp_path / "own.apt"
    path, _ = toolpaths.read(ROOT / "samples/tool_axis_tour.apt", dialect="generic")
    toolpaths.write(path, own)
    toolpaths.read(own)
    assert asked == []
    run("convert", ROOT / "samples/tool_axis_tour.apt", "-m", "mikron-ucp710", "-c", "linuxcnc", "-o", tmp_path / "p.ngc",
        "--setup", FOLDER / "tools.setup.toml")
    assert asked == ["postproc.cl_dialects"]
