"""CUTCOM where the plane of the words is not square to the tool: refused, with what to do instead."""

from __future__ import annotations

import numpy as np
import pytest

from tests.postproc.kit import codes, convert, good, goto, tilted, toolpath

TURN = np.linspace(0.0, 60.0, 7)
FLAT = np.column_stack([20.0 * np.cos(np.radians(TURN)), 20.0 * np.sin(np.radians(TURN)), np.zeros(7)])


def square(lean: float) -> list[str]:
    """A compensated cut with the tool leaning all the while."""
    axis = tilted(lean, 0.0)
    side = np.array([0.0, 1.0, 0.0])
    tips = np.array([40.0 * axis, 0.0 * axis, 10.0 * side, 20.0 * side])
    first, *rest = goto(tips, np.tile(axis, (4, 1)))
    return ["RAPID", first, "CUTCOM/LEFT,1", *rest, "CUTCOM/OFF", "RAPID", first]


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["linuxcnc", "generic-iso", "fanuc-30i", "haas-ngc", "siemens-840d",
                                        "heidenhain-tnc640"])
@pytest.mark.parametrize("lean", [0.0, 30.0])
def test_a_leaning_tool_is_refused_in_axis_positions(controller: str, lean: float) -> None:
    result = convert(toolpath(*square(lean)), "mikron-ucp710", controller, output="axes")
    assert result.ok == (lean == 0.0)
    assert ("cutcom.tilted" in codes(d for d in result.diagnostics if d.severity.name == "ERROR")) == (lean > 0.0)
    assert all("tilted" in d.hint for d in result.diagnostics if d.code == "cutcom.tilted")


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640"])
def test_the_same_is_written_in_a_tilted_plane(controller: str) -> None:
    text = good(convert(toolpath(*square(30.0)), "mikron-ucp710", controller)).text
    assert " RL" in text if controller.startswith("heid") else "G41" in text


def test_a_tool_that_leans_later_is_refused() -> None:
    lean = np.array([tilted(a, 0.0) for a in (0, 0, 0, 5, 10, 15, 20)])
    first, *rest = goto(FLAT, lean)
    result = convert(toolpath("RAPID", first, "CUTCOM/LEFT,1", *rest, "CUTCOM/OFF", "GOTO/0,0,50"), "mikron-ucp710",
                     "fanuc-30i", output="axes")
    bad = [d for d in result.diagnostics if d.code == "cutcom.turning"]
    assert len(bad) == 1 and bad[0].severity.name == "ERROR" and bad[0].lines == (10, 11, 12, 13)


def test_a_turning_table_under_a_tool_along_z_is_refused() -> None:
    """The plane of X and Y words does not turn with the part; the tool leans by too little for a tilted plane."""
    lean = np.array([tilted(0.002, p) for p in TURN])
    first, *rest = goto(FLAT, lean)
    result = convert(toolpath("RAPID", first, "CUTCOM/LEFT,1", *rest, "CUTCOM/OFF", "GOTO/0,0,50"), "mikron-ucp710",
                     "linuxcnc", axis_tolerance=0.0005)
    assert codes(d for d in result.diagnostics if d.severity.name == "ERROR") & {"cutcom.turning"}
