"""Options of the control that the machine file confirms or denies: modes, head, blocks, read-back."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.machine import Machine
from postproc.base.options import Options
from postproc.controllers.fitted import fitted
from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, setup_of, tilted, toolpath
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

SETUP = setup_of("[part]\norigin = [31, -12, 5]\n[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 65\n")
"""the part off the rotary axes, tools of different lengths"""
BOUGHT = ("fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640")
OPTION = {"tilted": "tilted_planes", "tcp": "tip_control"}


def point(tip: np.ndarray, axis: np.ndarray) -> str:
    return "GOTO/" + ",".join(f"{v:.9f}" for v in (*tip, *axis))


@cache
def sides() -> Toolpath:
    """A tilted side, with the other tool a cut that turns the tool."""
    one, turn = tilted(40.0, 77.0), [tilted(30.0, float(t)) for t in np.linspace(0.0, 60.0, 5)]
    across = np.cross(one, [0.0, 0.0, 1.0])
    return toolpath("RAPID", point(45 * one, one), "FEDRAT/MMPM,500", point(30 * one, one),
                    point(30 * one + 8 * across, one), "RAPID", point(45 * one + 8 * across, one), "LOADTL/2",
                    "SPINDL/RPM,2000,CLW", "RAPID", point(45 * turn[0], turn[0]), "FEDRAT/MMPM,400",
                    *(point(30 * a, a) for a in turn), "RAPID",
                    point(60 * turn[-1], turn[-1]))


@cache
def shop(text: str = "", base: str = "mikron-ucp710") -> Machine:
    from tempfile import mkdtemp

    file = Path(mkdtemp()) / "shop.toml"
    file.write_text(f'base = "{base}"\n[control]\n{text}\n')
    return machines.load(file)


@cache
def converted(controller: str, text: str = "", output: str = "auto") -> PostResult:
    return postproc.convert(sides(), shop(text), controller, SETUP, Options(output=output))


def laws(result: PostResult) -> set[str]:
    assert result.ok, [str(d) for d in result.diagnostics]
    return {section.law for section in result.program.sections}


def verdict(text: str, result: PostResult) -> set[str]:
    _, found = read_back(text, result.job, "test.apt", gcode="edited.nc")
    return {d.code for d in found if d.severity is Severity.ERROR}


@pytest.mark.parametrize("controller", BOUGHT)
def test_auto_uses_only_what_is_fitted(controller: str) -> None:
    """Planes only, tip control only, neither; unset is used as true is."""
    if controller != "haas-ngc":
        assert {"tilted", "tcp"} <= laws(converted(controller))
    assert "tilted" not in laws(converted(controller, "tilted_planes = false"))
    assert "tcp" not in laws(converted(controller, "tip_control = false"))
    assert laws(converted(controller, "tilted_planes = false\ntip_control = false")) == {"axes"}


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "mode"), [(c, m) for c in BOUGHT for m in ("tilted", "tcp")])
def test_a_mode_that_is_asked_for_is_refused_with_the_line_of_the_machine_file(controller: str, mode: str) -> None:
    path = sides() if mode == "tcp" else toolpath(point(9 * tilted(20, 5), tilted(20, 5)))
    refused = postproc.convert(path, shop(f"# ours\n{OPTION[mode]} = false"), controller, SETUP, Options(output=mode))
    found = next(d for d in refused.diagnostics if d.severity is Severity.ERROR)
    assert found.code == "output.option" and found.lines == (4,) and found.file.endswith("shop.toml")
    assert f"{OPTION[mode]} = false" in found.message and "state true where it is fitted" in found.hint
    assert converted(controller, f"{OPTION['tcp']} = true", "tcp").ok


@pytest.mark.parametrize("controller", BOUGHT)
def test_the_head_names_what_is_used_and_not_confirmed(controller: str) -> None:
    result = converted(controller, "", "tcp")
    option = result.controller.modes.tcp.option
    assert option and option.upper() in result.text.upper()
    sure = converted(controller, "tip_control = true", "tcp")
    assert option.upper() not in sure.text.upper() and sure.controller.modes.tcp.relies_on
    assert option.upper() not in converted(controller, "tip_control = false").text.upper()


@pytest.mark.parametrize("controller", BOUGHT)
def test_the_work_offset_whose_rotary_values_must_be_zero_is_named(controller: str) -> None:
    head = converted(controller, "", "tcp").text.upper()
    name = "DATUM NUMBER 1" if controller.startswith("heid") else "G54"
    assert f"NEEDS ROTARY VALUES OF 0 IN {name}" in head
    assert "ROTARY VALUES" not in converted(controller, "", "axes").text.upper()


@pytest.mark.parametrize(("controller", "output", "words"), [
    ("fanuc-30i", "tcp", "5006#6 tos"), ("haas-ngc", "tcp", "MRZP offsets"), ("haas-ngc", "tcp", "G49 and G234"),
    ("siemens-840d", "auto", "swivel data set"),
    ("heidenhain-tnc640", "tcp", "rotary values of 0")])
def test_each_setting_is_confirmed_by_itself(controller: str, output: str, words: str) -> None:
    """The header leaves out what the machine file confirms, and nothing else; the words are the same."""
    usual, sure = (converted(controller, text, output).text.upper().splitlines() for text in ("", f'settings = ["{words}"]'))
    gone = [line for line in usual if "NEEDS" in line and words.upper() in line]
    left = [line for line in usual if "NEEDS" in line and line not in gone]
    assert gone and left == [line for line in sure if "NEEDS" in line]


@pytest.mark.covering
@pytest.mark.parametrize("controller", BOUGHT)
@pytest.mark.parametrize("option", ["tilted_planes", "tip_control"])
def test_a_program_that_uses_what_is_not_fitted_is_found(controller: str, option: str) -> None:
    result = converted(controller, "", "tcp" if option == "tip_control" else "auto")
    if option == "tilted_planes" and "tilted" not in laws(result):
        pytest.skip("no tilted plane on this control for this part")
    assert verdict(result.text, result) == set()
    job = replace(result.job, machine=replace(result.machine, options=shop(f"{option} = false").options))
    assert "verify.option" in verdict(result.text, replace(result, job=job))


@pytest.mark.parametrize("controller", BOUGHT)
def test_smoothing_that_is_not_fitted_is_left_out(controller: str) -> None:
    with_it, without = converted(controller, "", "axes"), converted(controller, "smoothing = false", "axes")
    code = dict(zip(BOUGHT, ("G05.1", "G187", "CYCLE832(", "CYCL DEF 32"), strict=True))[controller]
    assert code in with_it.text and without.ok and not any(
        line.lstrip("N0123456789 ").startswith(code) for line in without.text.splitlines())
    assert "CORNERS ROUNDED" in without.text.upper() and "CORNERS ROUNDED" not in with_it.text.upper()
    assert "verify.option" in verdict(with_it.text, without)


def test_linuxcnc_without_smoothing_stops_on_the_path() -> None:
    without = converted("linuxcnc", "smoothing = false")
    assert without.ok and "\nG61\n" in without.text and "G64" not in without.text
    assert "verify.smoothing" in verdict(without.text.replace("\nG61\n", "\nG64\n"), without)


HELIX = ["TOOL PATH/A,TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW"]
TURN = ["RAPID", "GOTO/10,0,5,0,0,1", "FEDRAT/MMPM,600", "GOTO/10,0,0", "CIRCLE/0,0,0,0,0,-1,10,0.03,0.5,10,0",
        "GOTO/0,10,-2", "END-OF-PATH"]


@pytest.mark.parametrize("controller", [*BOUGHT, "linuxcnc"])
def test_helices_are_lines_where_the_control_has_none(controller: str) -> None:
    path = toolpath(*TURN, head=HELIX)
    arcs, lines = (postproc.convert(path, shop(text, "mill-3axis"), controller, SETUP) for text in ("", "helical = false"))
    assert arcs.ok and lines.ok and (arcs.program.code == 2).any() and not (lines.program.code == 2).any()
    assert "verify.option" in verdict(arcs.text, lines)
    if controller == "fanuc-30i":
        assert "OPTION HELICAL" in arcs.text and "OPTION HELICAL" not in lines.text
        sure = postproc.convert(path, shop("helical = true", "mill-3axis"), controller, SETUP)
        assert "OPTION HELICAL" not in sure.text


TAP = ["RAPID", "GOTO/0,0,50", "CYCLE/TAP,DEPTH,5,MMPR,1,CLEAR,3", "GOTO/5,5,0", "CYCLE/OFF"]


def test_taps_without_rigid_tapping() -> None:
    """Fanuc taps with a floating holder, without M29; controls whose cycles are rigid refuse, with the line of the tap."""
    path = toolpath(*TAP)
    rigid, floating, sure = (postproc.convert(path, shop(text, "mill-3axis"), "fanuc-30i", SETUP)
                             for text in ("", "rigid_tapping = false", "rigid_tapping = true"))
    assert "\nM29" in rigid.text and "OPTION RIGID TAPPING" in rigid.text and "OPTION RIGID" not in sure.text
    assert floating.ok and "\nM29" not in floating.text and "FLOATING TAP HOLDER" in floating.text
    assert "verify.option" in verdict(rigid.text, floating)
    for controller in ("siemens-840d", "heidenhain-tnc640", "haas-ngc"):
        refused = postproc.convert(path, shop("rigid_tapping = false", "mill-3axis"), controller, SETUP)
        found = next(d for d in refused.diagnostics if d.severity is Severity.ERROR)
        assert found.code == "cycle.rigid_tap" and found.lines and "rigid_tapping = true" in found.hint
        assert postproc.convert(path, shop("rigid_tapping = true", "mill-3axis"), controller, SETUP).ok


def test_the_frame_of_the_tip_as_the_machine_confirms_it() -> None:
    """Fanuc: entered with the tables at zero where it is not known, above the part where it is."""
    usual, known = converted("fanuc-30i", "", "tcp"), converted("fanuc-30i", 'tip_frame = "table"', "tcp")
    assert "TABLES AT ZERO" in usual.text and known.ok and "TABLES AT ZERO" not in known.text
    assert known.controller.modes.tcp.frame == "table" and "output.tables_at_zero" not in codes(known.diagnostics)


def test_states_at_power_on_count_as_stated() -> None:
    """A program that leaves G17 out is right only where the machine puts it in force."""
    result = converted("fanuc-30i", "", "axes")
    bare = result.text.replace("G17 G21 ", "G21 ").replace(" G17 G40", " G40")
    assert bare != result.text and verdict(bare, result)
    job = replace(result.job, controller=fitted(result.controller, shop('power_on = ["G17"]').options))
    assert not verdict(bare, replace(result, job=job))
