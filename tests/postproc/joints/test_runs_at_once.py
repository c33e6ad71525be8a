"""Machines that leave no choice: the joints of all runs at once are those of run by run."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.joints import run_plan
from postproc.setup.model import SetupFile
from tests.postproc.kit import codes, convert, toolpath

SETUP = SetupFile.model_validate({"tools": {str(k): {"gauge_length": 90.0 + 7.0 * k} for k in (1, 2, 3)}})
PART = [line for k, tool in enumerate((1, 2, 1, 3)) for line in (
    f"LOADTL/{tool}", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID", f"GOTO/{9 * k},4,30", f"GOTO/{9 * k},4,{1 - k}",
    f"GOTO/{9 * k + 5},4,{-k}", "RAPID", f"GOTO/{9 * k + 5},4,30", "CYCLE/DRILL,DEPTH,6,MMPM,100,CLEAR,3",
    f"GOTO/{9 * k},20,0", f"GOTO/{9 * k + 3},20,0", "CYCLE/OFF")]


@pytest.mark.parametrize(("machine", "controller"), [("mill-3axis", "linuxcnc"), ("mill-3axis", "siemens-840d"),
                                                     ("uranesx", "linuxcnc")])
def test_programs_are_the_same(machine: str, controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    setup = SETUP if machine == "mill-3axis" else SETUP.model_copy(
        update={"part": SETUP.part.model_copy(update={"origin": (0.0, 0.0, -270.0)})})
    once = convert(toolpath(*PART), machine, controller, setup)
    taken = []
    monkeypatch.setattr(run_plan, "_without_choice", lambda *_: taken.append(1))
    each = convert(toolpath(*PART), machine, controller, setup)
    assert once.ok and each.ok and taken, [str(d) for d in once.diagnostics]
    assert once.text == each.text and once.path is not None and each.path is not None
    np.testing.assert_array_equal(once.path.q, each.path.q)


def test_a_pose_outside_travel_is_refused_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    far = toolpath(*PART, "RAPID", "GOTO/0,0,30", "GOTO/2000,0,30")
    once = convert(far, "mill-3axis", setup=SETUP)
    monkeypatch.setattr(run_plan, "_without_choice", lambda *_: None)
    each = convert(far, "mill-3axis", setup=SETUP)
    assert not once.ok and codes(once.diagnostics) == codes(each.diagnostics)
