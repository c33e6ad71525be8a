"""Set-ups and files that the second witness has to understand as the project does, and what it says in words."""

from __future__ import annotations

import numpy as np
import pytest

import postproc
import postproc.verification.second_witness
import toolpaths
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.verification.second_witness import second_witness
from postproc.witness.clfile import commanded
from postproc.witness.commanded import OWN, loads, registers_of, tools_of
from toolpaths.cl.build import ToolpathBuilder

BARE = b"PARTNO bare\nFEDRAT/500\nGOTO/-10,5,30\nGOTO/-10,5,0\nGOTO/10,5,0\nGOTO/10,5,30\nFINI\n"
LOADED = BARE.replace(b"FEDRAT", b"UNITS/MM\nLOADTL/1\nSPINDL/RPM,3000,CLW\nFEDRAT")


def converted(text: bytes, setup: dict[str, object], control: str = "linuxcnc",
              **options: object) -> PostResult:
    path, found = toolpaths.read_bytes(text, file="part.apt")
    return postproc.convert(path, "mill-3axis", control, SetupFile.model_validate(setup),
                            Options(**options), diagnostics=found)


@pytest.mark.covering
@pytest.mark.parametrize("control", ["linuxcnc", "fanuc-30i", "siemens-840d", "haas-ngc", "generic-iso"])
@pytest.mark.parametrize(("text", "number"), [(BARE, "0"), (LOADED, "1")])
def test_a_tool_measured_into_the_work_offset(control: str, text: bytes, number: str) -> None:
    result = converted(text, {"tools": {number: {"gauge_length": 120.0}}, "output": {
        "tool_call": False, "spindle": {"rpm": 3000.0}}}, control)
    assert result.ok and result.witness is not None, [str(d) for d in result.diagnostics]
    assert not result.witness.not_compared and any(said.what == "positions" for said in result.witness.compared)


def test_systems_are_kept_once() -> None:
    """Many systems, few different: each position by its own, also on arcs."""
    systems = [f"MSYS/{k % 7},2,3,0,1,0,-1,0,0\nGOTO/{k},0,0\nCIRCLE/{k - 10},0,0,0,0,-1,10,.03,.5,10,0\n"
               f"GOTO/{k - 10},10,0\n"
               for k in range(50)]
    text = ("TOOL PATH/A,TOOL,B\n" + "".join(systems) + "END-OF-PATH\n").encode()
    c, (path, _) = commanded(text), toolpaths.read_bytes(text)
    assert len(c.systems) == 7 and c.known.all()
    np.testing.assert_allclose(c.tip, path.tip, atol=1e-9)
    np.testing.assert_allclose(c.centre, path.arcs.center, atol=1e-9)
    np.testing.assert_allclose(c.normal, path.arcs.normal, atol=1e-12)


@pytest.mark.parametrize(("numbers", "tools"), [({}, [3, 4]), ({"MILL": 7}, [7, 4]), ({"OTHER": 7}, [3, 4])])
def test_tools_keep_their_number_where_the_setup_gives_none(numbers: dict[str, int],
                                                            tools: list[int]) -> None:
    c = commanded(b"TOOL PATH/A,TOOL,MILL\nLOAD/TOOL,3\nGOTO/1,2,3\nEND-OF-PATH\nTOOL PATH/B,TOOL,DRILL\nLOAD/TOOL,4\n"
                  b"GOTO/1,2,3\nEND-OF-PATH\n")
    assert tools_of(c, {"tool_numbers": numbers}).tolist() == tools


@pytest.mark.parametrize("setup", [
    {"output": {"spindle": {"rpm": 3000.0}}}, {"tools": {"1": {"spindle": {"rpm": 3000.0, "direction": "anti-clockwise"}}}}])
def test_the_spindle_of_the_setup_is_expected(setup: dict[str, object],
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    text = LOADED.replace(b"SPINDL/RPM,3000,CLW\n", b"")
    result = converted(text, setup)
    assert result.ok and result.witness is not None, [str(d) for d in result.diagnostics]
    assert not result.witness.not_compared and any(said.what == "spindle states" for said in result.witness.compared)
    old = ToolpathBuilder.event

    def hidden(self: ToolpathBuilder, word: str, values: tuple[object, ...]) -> None:
        old(self, word, values)
        if word == "LOADTL":
            old(self, "SPINDL", ("RPM", 2000.0, "CLW"))
    monkeypatch.setattr(ToolpathBuilder, "event", hidden)
    assert "witness.spindle" in {d.code for d in converted(text, setup).diagnostics}


SECOND = b"LOADTL/2\nSPINDL/RPM,3000,CLW\nGOTO/0,0,20\nGOTO/0,0,-1\nGOTO/5,0,-1\n"


@pytest.mark.covering
@pytest.mark.parametrize("between", [b"", b"COOLNT/OFF\n"])
@pytest.mark.parametrize("stated", [{"tools": {"2": {"coolant": "mist"}}}, {"output": {"coolant": "flood"}}])
def test_coolant_of_the_setup_for_a_tool_behind_one_with_its_own(stated: dict[str, object], between: bytes,
                                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    """The first tool's COOLNT is not the second's; where it still flows, `[output]` adds nothing."""
    text = LOADED.replace(b"SPINDL", b"COOLNT/FLOOD\nSPINDL", 1).replace(b"FINI", between + SECOND + b"FINI")
    result = converted(text, stated)
    assert result.ok and result.witness is not None, [str(d) for d in result.diagnostics]
    old = ToolpathBuilder.event
    monkeypatch.setattr(ToolpathBuilder, "event",
                        lambda self, word, values: old(self, word, ("AIR",) if word == "COOLNT" else values))
    assert "witness.coolant" in {d.code for d in converted(text, stated).diagnostics}


def test_a_finding_is_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    old = ToolpathBuilder.event

    def flooded(self: ToolpathBuilder, word: str, values: tuple[object, ...]) -> None:
        old(self, word, values)
        if word == "SPINDL":
            old(self, "COOLNT", ("FLOOD",))
    monkeypatch.setattr(ToolpathBuilder, "event", flooded)
    said = [d.message for d in converted(LOADED, {}).diagnostics if d.code == "witness.coolant"]
    assert said and "the coolant is flood, the CL file says nothing" in said[0]


@pytest.mark.parametrize("proof", [False, True])
def test_a_witness_that_fails_proves_nothing(proof: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise IndexError("planted")
    monkeypatch.setattr(postproc.verification.second_witness, "testify", fails)
    result = converted(LOADED, {}, require_proof=proof)
    assert result.witness is not None and "failed: IndexError: planted" in result.witness.not_compared[0].why
    assert [d.code for d in result.diagnostics if d.code.startswith("witness")] == ["witness.failed"] * proof
    assert result.ok is not proof
    assert second_witness(None, SetupFile(), Options(), result.job, result.comparison)[1] == []


SAME_NUMBER = ("TOOL PATH/{0},TOOL,{0}\nLOAD/TOOL,3{1}\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\nRAPID\nGOTO/0,0,50\n"
               "GOTO/0,0,5\nGOTO/9,0,5\nRAPID\nGOTO/9,0,50\nEND-OF-PATH\n")
NAMED = {"tool_numbers": {"D10": 3, "D6": 1}, "tools": {n: {"gauge_length": 80.0} for n in ("1", "3")}}


@pytest.mark.parametrize("control", ["linuxcnc", "fanuc-30i", "siemens-840d", "haas-ngc", "generic-iso",
                                     "heidenhain-tnc640"])
@pytest.mark.parametrize("adjusts", [("", ""), (",ADJUST,3", ""), ("", ",ADJUST,3"), (",ADJUST,3", ",ADJUST,3"),
                                     (",ADJUST,3", "", ",ADJUST,3")])
def test_a_register_is_of_the_tool_that_the_set_up_numbers(control: str, adjusts: tuple[str, ...]) -> None:
    """Two tools of one number told apart by name: the second has its own register where its record names none."""
    text = "UNITS/MM\n" + "".join(SAME_NUMBER.format(("D10", "D6")[k % 2], said) for k, said in enumerate(adjusts))
    if control in ("siemens-840d", "heidenhain-tnc640") and ",ADJUST,3" in adjusts:
        text = text.replace(",ADJUST,3", ",ADJUST,1")  # one edge there
    result = converted(text.encode(), NAMED, control)
    assert result.ok, [str(d) for d in result.diagnostics if d.severity]


def test_the_register_that_a_record_names_is_in_force_from_there() -> None:
    text = "UNITS/MM\n" + "".join(SAME_NUMBER.format(name, said) for name, said in (
        ("D10", ",ADJUST,3"), ("D6", ""), ("D6", ",ADJUST,9")))
    c = commanded(text.encode())
    assert registers_of(c, loads(tools_of(c, NAMED)), np.arange(12)).tolist() == [3] * 4 + [OWN] * 4 + [9] * 4
    assert registers_of(c, loads(tools_of(c, {})), np.arange(12)).tolist() == [3] * 8 + [9] * 4
