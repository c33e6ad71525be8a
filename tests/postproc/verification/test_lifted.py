"""What registers take up: a program with tools of other lengths is known without executing it again."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from postproc.readback.execution.execute import run
from postproc.readback.execution.offsets import Offsets
from postproc.verification import length_limits
from postproc.verification.lifted import lifted
from tests.postproc.kit import sample
from tests.postproc.reader_kit import LENGTHS, control, controller, reader_for
from toolpaths.diagnostics import has_errors

LONGER = {1: 103.25, 2: 54.0}
"""mm in the registers instead of `LENGTHS`"""
BEGIN = ("G21 G90 G17 G94", "T1 M6", "S1000 M3", "F500")
LEVELS = ("G43 H1 G0 Z40", "G53 G0 Z-1", "G0 Z40", "G43 H2 G0 Z50", "G49 G0 Z45", "G91 G0 Z1\nG90")
"""how the tool comes to where it works, and goes on between"""
WORK = ("G1 X5 Y3", "G1 X5 Z10", "G2 X10 Y0 I5 J0", "G2 X10 Y0 Z8 I5 J0", "G18 G2 X10 Z0 R30\nG17",
        "G81 X1 Y2 Z-5 R3\nX4\nG80", "G99 G83 X1 Z-5 R3 Q2\nG98 X5\nG80", "G91 G1 Z-2 X1\nG90", "X3 H2 G43", "G4 P1")


def both(text: str) -> tuple[Any, Any] | None:
    """The motion with `LONGER`, as it is known and as it is executed; None for programs with faults."""
    held = control()
    home, letters = held.machine.home * held.unit, held.machine.axis_names
    reader = reader_for(controller("linuxcnc"), letters, home)
    code, found = reader.read(text.encode(), "MAIN", None)
    if code is None or has_errors(found):
        return None
    offsets = Offsets(held.work_offset, held.xyz, LENGTHS, home, held.length_on_z, 0.5, held, reader.rises_first,
                      reader.arc_slack)
    motion, more = run(code, letters, offsets)
    if has_errors(more):
        return None
    other, _ = run(code, letters, replace(offsets, lengths=LONGER))
    return lifted(motion, code, letters, offsets, LONGER), other


def same(known: Any, executed: Any) -> bool:
    """Whether two motions are the same to rounding."""
    return len(known) == len(executed) and all(np.allclose(np.nan_to_num(getattr(known, name)), np.nan_to_num(
        getattr(executed, name)), rtol=0.0, atol=1e-11) for name in ("end", "start", "code", "center", "register", "feed"))


def test_what_is_known_is_what_is_executed() -> None:
    """Every way of going to a level with every work, then others of both."""
    known = refused = 0
    for i, j in product(range(len(LEVELS)), range(len(WORK))):
        for other in (i + j + 1, i + 2 * j + 3):
            then, work = LEVELS[other % len(LEVELS)], WORK[(other + j) % len(WORK)]
            text = "\n".join([*BEGIN, LEVELS[i], "G0 X0 Y0", WORK[j], then, work, "M30", ""])
            found = both(text)
            if found is not None:
                refused, known = refused + (found[0] is None), known + (found[0] is not None)
                assert found[0] is None or same(*found), text
    assert known > 90 and 0 < refused < 20, (known, refused)


@pytest.mark.parametrize("file, machine, controller", [
    ("pocket.cls", "mill-3axis", "linuxcnc"), ("indexed_4axis.cls", "mill-4axis", "linuxcnc"),
    ("tool_axis_tour.apt", "mikron-ucp710", "generic-iso")])
def test_table_machines_are_not_executed_again(file: str, machine: str, controller: str,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(length_limits, "run", None)
    result = sample(file, machine, controller)
    assert result.comparison.lengths
