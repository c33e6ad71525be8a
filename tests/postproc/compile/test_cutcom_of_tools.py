"""What CUTCOM is for each tool: wear, the radius of a contour, or not written; said in the head, obeyed by both readings."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from postproc.pipeline.result import PostResult
from postproc.setup.fingerprint import fingerprint
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from postproc.verification.second_witness import second_witness
from tests.postproc.compile.test_cutcom_planes import square
from tests.postproc.kit import codes, convert, good, toolpath
from toolpaths.diagnostics import Diagnostic, Severity

NAMES = ["linuxcnc", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640", "generic-iso"]
ROUND = ["CUTTER/10", "RAPID", "GOTO/20,-20,20", "GOTO/20,-20,2", "CUTCOM/LEFT", "GOTO/20,0,2", "CIRCLE/0,0,2,0,0,1,20",
         "GOTO/0,20,2", "GOTO/-20,20,2", "CUTCOM/OFF", "GOTO/-50,20,2", "RAPID", "GOTO/-50,20,20"]
HOLDS = {"linuxcnc": "half the diameter of T1 in the tool table", "fanuc-30i": "D1", "haas-ngc": "D1", "generic-iso": "D1",
         "siemens-840d": "the radius of the cutting edge in the tool list",
         "heidenhain-tnc640": "R + DR of T1 in the tool table"}
KINDS: dict[str, dict[str, Any]] = {"": {}, "wear": {"compensation": "wear"}, "none": {"compensation": "none"},
                                    "contour": {"contour": True}, "radius": {"contour": True, "compensation": "radius"}}


def setup(kind: str, number: int = 1) -> SetupFile:
    tools = {str(n): {"gauge_length": 90.0, **(KINDS[kind] if n == number else {})} for n in (1, 2)}
    return SetupFile.model_validate({"tools": tools})


@cache
def made(controller: str, kind: str) -> PostResult:
    return convert(toolpath(*ROUND), "mill-3axis", controller, setup(kind))


def bare(text: str) -> str:
    """Without comments and numbers of blocks."""
    lines = (re.sub(r"^N?\d+ ", "", line) for line in text.splitlines())
    return "\n".join(line for line in lines if not line.startswith(("(", ";")))


def folded(text: str) -> str:
    return re.sub(r"[()]", "", " ".join(text.split())).lower()


def errors(found: list[Diagnostic]) -> list[str]:
    return [d.code for d in found if d.severity is Severity.ERROR]


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", NAMES)
def test_the_head_says_what_the_register_holds(controller: str) -> None:
    wear, radius, none = (folded(good(made(controller, kind)).text) for kind in ("wear", "radius", "none"))
    held = folded(HOLDS[controller])
    assert f"t1: cutcom by the wear, {held} holds by how much the radius is greater than 5.0000 mm" in wear
    assert f"t1: cutcom by the radius, {held} holds 5.0000 mm, the words are the contour" in radius
    assert "t1: cutcom is not written, the words are the path of the tool's centre" in none


def test_the_diameter_of_the_set_up_stands_before_that_of_the_cl_file() -> None:
    thicker = SetupFile.model_validate({"tools": {"1": {"gauge_length": 90.0, "contour": True, "diameter": 12.0},
                                                  "2": {"gauge_length": 90.0}}})
    head = folded(good(convert(toolpath(*ROUND), "mill-3axis", "fanuc-30i", thicker)).text)
    assert "d1 holds 6.0000 mm" in head and "5.0000 mm" not in head


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", NAMES)
def test_the_words_are_the_path_of_the_cl_file(controller: str) -> None:
    plain = bare(good(made(controller, "")).text)
    for kind in ("wear", "contour", "radius"):
        assert bare(good(made(controller, kind)).text) == plain
    said = re.compile(r"\s*\bG4[12]( D\d+)?\b| R[LR]\b")
    left, off = said.sub("", plain), bare(good(made(controller, "none")).text)
    assert said.search(plain) and not said.search(off)
    assert re.findall(r"[XY]\S+", left) == re.findall(r"[XY]\S+", off)


@pytest.mark.parametrize("controller", NAMES)
def test_what_nobody_has_stated_is_warned_of(controller: str) -> None:
    assert "cutcom.register" in codes(made(controller, "").diagnostics)
    for kind in ("wear", "contour", "radius", "none"):
        assert "cutcom.register" not in codes(made(controller, kind).diagnostics)
    assert "cutcom.none" in codes(made(controller, "none").diagnostics)


@pytest.mark.parametrize(("kind", "code", "then"), [
    ({"compensation": "wear", "contour": True}, "cutcom.contour", {"compensation": "wear"}),
    ({"compensation": "none", "contour": True}, "cutcom.contour", {"compensation": "radius", "contour": True})])
def test_a_register_that_does_not_belong_to_the_points_is_refused(kind: dict[str, Any], code: str,
                                                                  then: dict[str, Any]) -> None:
    def of(tool: dict[str, Any]) -> PostResult:
        return convert(toolpath(*ROUND), "mill-3axis", "fanuc-30i",
                       SetupFile.model_validate({"tools": {"1": {"gauge_length": 90.0, **tool}}}))
    result = of(kind)
    assert errors(list(result.diagnostics)) == [code] and result.text == ""
    [bad] = [d for d in result.diagnostics if d.code == code]
    assert bad.lines == (9,) and "[tools.1]" in bad.hint and good(of(then)).text


def test_a_tool_without_cutcom_may_say_what_it_likes() -> None:
    result = convert(toolpath(*[line for line in ROUND if "CUTCOM" not in line]), "mill-3axis", "fanuc-30i",
                     SetupFile.model_validate({"tools": {"1": {"gauge_length": 90.0, "compensation": "radius"}}}))
    assert "CUTCOM" not in good(result).text


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", NAMES)
def test_each_tool_has_its_own(controller: str) -> None:
    """The first tool of a file cuts under compensation, the second as its centre goes; then the other way round."""
    path = toolpath(*ROUND, "LOADTL/2", "SPINDL/RPM,1000,CLW", *ROUND)
    for number in (1, 2):
        text = bare(good(convert(path, "mill-3axis", controller, setup("none", number))).text)
        first, second = re.split(r"T2 M6|M6 T2|T2\nM6|TOOL CALL 2", text)[:2]
        on = [bool(re.search(r"\bG41\b| RL\b", part)) for part in (first, second)]
        assert on == [number == 2, number == 1]


@pytest.mark.parametrize("controller", NAMES)
def test_a_reader_that_ignores_it_is_caught(controller: str) -> None:
    """The read-back of a program with compensation, by a set-up that has none, and the other way round."""
    off, on = good(made(controller, "none")), good(made(controller, "wear"))
    assert off.job is not None and on.job is not None
    for text, job in ((on.text, off.job), (off.text, on.job)):
        found = read_back(text.encode(), job, "test.apt")[1]
        assert "cutter compensation" in " ".join(d.message for d in found if d.code == "verify.state")
    assert not errors(read_back(off.text.encode(), off.job, "test.apt")[1])


@pytest.mark.parametrize("controller", NAMES)
def test_the_second_witness_goes_by_cl_file_and_set_up(controller: str) -> None:
    for kind, other in (("none", "wear"), ("wear", "none")):
        result = good(made(controller, kind))
        assert result.job is not None and result.comparison is not None and result.witness is not None
        assert kind == "none" or any("cutter compensation" in str(what) for what in result.witness.compared)
        said, _ = second_witness(result.source, setup(other), result.options, result.job, result.comparison, result.text)
        assert [f.code for f in said.findings] == ["compensation"]


def test_the_second_witness_sees_the_other_side() -> None:
    result = good(made("fanuc-30i", "wear"))
    assert result.job is not None and result.comparison is not None and result.comparison.executed is not None
    code, motion = result.comparison.executed
    sides = np.where(motion.compensation == 41, 42, motion.compensation)
    turned = replace(result.comparison, executed=(code, replace(motion, compensation=sides)))
    said, _ = second_witness(result.source, result.setup, result.options, result.job, turned, result.text)
    assert [f.code for f in said.findings] == ["compensation"] and "right" in said.findings[0].message


@pytest.mark.parametrize("controller", ["linuxcnc", "generic-iso", "fanuc-30i", "siemens-840d", "heidenhain-tnc640"])
def test_a_leaning_tool_is_the_way_through_uncompensated(controller: str) -> None:
    """CUTCOM while the tool leans is refused in axis positions; the path of the centre needs no plane."""
    path = toolpath(*square(30.0))
    refused = convert(path, "mikron-ucp710", controller, setup("wear"), output="axes")
    assert "cutcom.tilted" in errors(list(refused.diagnostics))
    assert any("compensation" in d.hint for d in refused.diagnostics if d.code == "cutcom.tilted")
    text = good(convert(path, "mikron-ucp710", controller, setup("none"), output="axes")).text
    assert not re.search(r"\bG41\b| RL\b", bare(text))


def test_planes_that_cannot_be_written_pass_uncompensated() -> None:
    lines = [line.replace("CUTCOM/LEFT", "CUTCOM/LEFT,ZXPLAN") for line in ROUND]
    assert errors(list(convert(toolpath(*lines), "mill-3axis", "fanuc-30i", setup("wear")).diagnostics)) == ["cutcom.plane"]
    assert good(convert(toolpath(*lines), "mill-3axis", "fanuc-30i", setup("none"))).text


def test_set_ups_without_it_keep_their_fingerprint() -> None:
    plain = SetupFile.model_validate({"tools": {"1": {"gauge_length": 90.0}}})
    marks = {fingerprint(setup(kind), "") for kind in KINDS}
    assert len(marks) == len(KINDS)
    dumped = plain.model_copy(update={"tools": {"1": plain.tools["1"].model_copy(update={"contour": False})}})
    assert fingerprint(dumped, "") == fingerprint(plain, "")
