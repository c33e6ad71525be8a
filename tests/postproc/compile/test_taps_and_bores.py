"""Taps and bores that rise above the level they came from: the cycle ends at its plane, a rapid behind it goes on."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.verification.read_back import read_back
from tests.postproc.kit import convert, execute, good, goto, tilted, toolpath
from toolpaths.diagnostics import Severity

STATES_IT = {"siemens-840d", "heidenhain-tnc640"}
CONTROLLERS = ["linuxcnc", "generic-iso", "fanuc-30i", "haas-ngc", *sorted(STATES_IT)]


def tapped(kind: str = "TAP,DEPTH,12,MMPR,1.0") -> list[str]:
    return ["RAPID", "GOTO/0,0,20", f"CYCLE/{kind},CLEAR,3,RETURN,50", "GOTO/10,0,0", "GOTO/20,0,0", "GOTO/20,10,4",
            "CYCLE/OFF", "RAPID", "GOTO/20,10,80"]


@pytest.mark.covering
@pytest.mark.parametrize("kind", ["TAP,DEPTH,12,MMPR,1.0", "BORE,DEPTH,12,MMPM,100", "REAM,DEPTH,12,MMPM,100"])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_every_control_writes_them_as_cycles(controller: str, kind: str) -> None:
    result = good(convert(toolpath(*tapped(kind)), "mill-3axis", controller))
    assert result.program is not None and result.comparison is not None
    assert result.comparison.worst_tip < 1e-6
    retracts = [h.retract for h in result.program.holes]
    assert retracts == ([50.0, 50.0, 54.0] if controller in STATES_IT else [3.0, 50.0, 7.0])


def test_the_rest_of_the_way_stands_behind_the_cycle() -> None:
    """G98 comes back to the level that the rapid before it has reached."""
    text = good(convert(toolpath(*tapped()), "mill-3axis", "fanuc-30i")).text
    assert re.findall(r"^(?:G9[89].*|G80|G0 Z[58][04]\.)$", text, re.MULTILINE) == [
        "G99 G84 X10. Y0. Z-12. R3. F1000.", "G80", "G0 Z50.", "G98 G84 X20. Y0. Z-12. R3. F1000.", "G80",
        "G99 G84 X20. Y10. Z-8. R7. F1000.", "G80", "G0 Z54."]


def test_linuxcnc_moves_as_single_moves_would() -> None:
    """The own executor: over the hole at the level reached before, feed in and out, rapid up to the named level."""
    steps = execute(good(convert(toolpath(*tapped()), "mill-3axis")))
    ends = [(s.kind, *(s.end - [0.0, 0.0, 120.0]).round(6)) for s in steps]
    at = ends.index(("feed", 10.0, 0.0, -12.0))
    assert ends[at - 1:at + 3] == [("rapid", 10.0, 0.0, 3.0), ("feed", 10.0, 0.0, -12.0), ("feed", 10.0, 0.0, 3.0),
                                   ("rapid", 10.0, 0.0, 50.0)]
    at = ends.index(("feed", 20.0, 10.0, -8.0))
    assert ends[at - 2:at + 3] == [("rapid", 20.0, 10.0, 50.0), ("rapid", 20.0, 10.0, 7.0), ("feed", 20.0, 10.0, -8.0),
                                   ("feed", 20.0, 10.0, 7.0), ("rapid", 20.0, 10.0, 54.0)]


@pytest.mark.parametrize("turning", [4, 5])
def test_how_the_spindle_turns_behind_a_tap_is_read(turning: int) -> None:
    """SDAC of CYCLE84: the next hole would be bored with the spindle the other way round, or standing."""
    path = toolpath(*tapped()[:4], "CYCLE/OFF", "CYCLE/BORE,DEPTH,12,MMPM,100,CLEAR,3,RETURN,50", "GOTO/20,0,0", "CYCLE/OFF")
    result = good(convert(path, "mill-3axis", "siemens-840d"))
    text, count = re.subn(r"(CYCLE84\(.*?,,0,)3,", rf"\g<1>{turning},", result.text)
    assert result.job is not None and count == 1
    _, found = read_back(text, result.job, "part.apt")
    assert {d.code for d in found if d.severity is Severity.ERROR} == {"verify.state"}


@pytest.mark.parametrize(("controller", "machine"), [("fanuc-30i", "mikron-ucp710"), ("haas-ngc", "trunnion-bc"),
                                                     ("siemens-840d", "mikron-ucp710")])
def test_in_a_tilted_plane_too(controller: str, machine: str) -> None:
    axis = tilted(30.0, 0.0)
    side = np.array([0.0, 1.0, 0.0])
    first, *holes = goto(np.array([20 * axis, 10 * side, 20 * side]), np.tile(axis, (3, 1)))
    path = toolpath("RAPID", first, "CYCLE/TAP,DEPTH,12,MMPR,1.0,CLEAR,3,RETURN,50", *holes, "CYCLE/OFF")
    result = good(convert(path, machine, controller))
    assert result.program is not None and len(result.program.holes) == 2
    assert result.comparison is not None and result.comparison.worst_tip < 0.002
