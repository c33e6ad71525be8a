"""The turn of the tool about its own axis: left open where the set-up has it planned, or where a program needs it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from machines.machine import Machine
from postproc.pipeline.result import PostResult, StageName
from postproc.setup.joints import SpinChoice
from postproc.setup.model import SetupFile
from toolpaths.diagnostics import Severity, info

CHANGED_BY_SPIN: tuple[StageName, ...] = ("solve", "correct", "check")
"""stages whose errors another spin may answer"""


def spun_machine(machine: Machine, setup: SetupFile) -> Machine:
    """The machine with its spin among the open parameters, where the set-up asks for more than none; else as it is."""
    if setup.joints.spin in ("needed", "zero"):
        return machine
    freed = machine.kinematics.with_free_spin()
    return machine if freed is machine.kinematics else replace(machine, kinematics=freed)


def with_spin_needed(result: PostResult, staged: Callable[[PostResult], PostResult]) -> PostResult:
    """A conversion; where the set-up leaves it to what is needed and the tool is not turned about itself in vain, again with
    its spin planned. What converts without is not touched; where nothing helps the first failure stands."""
    first = staged(result)
    kinematics = result.machine.kinematics
    if first.ok or result.setup.joints.spin != "needed" or first.reached not in CHANGED_BY_SPIN \
            or kinematics.with_free_spin() is kinematics:
        return first
    made = staged(replace(result, setup=_with_spin(result.setup, "planned")))
    if not made.ok:
        return first
    why = next(d for d in first.diagnostics if d.severity is Severity.ERROR)
    return made.with_found([info("joints.spin_needed", f"the tool is turned about its own axis, without that: {why.message}",
                                 file=result.toolpath.file, lines=list(why.lines))])


def _with_spin(setup: SetupFile, spin: SpinChoice) -> SetupFile:
    return setup.model_copy(update={"joints": setup.joints.model_copy(update={"spin": spin})})
