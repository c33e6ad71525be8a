"""Letters of a machine's axes that words of its control cannot have."""

from __future__ import annotations

from machines.machine import Machine
from postproc.controllers.model import ControllerFile
from toolpaths.diagnostics import Diagnostic, error


def axis_letters(machine: Machine, controller: ControllerFile) -> list[Diagnostic]:
    """An error where the control has no word for an axis: P, Q and R mostly mean something else to it."""
    missing = [letter for letter in machine.axis_names if letter not in controller.axes]
    if not missing:
        return []
    return [error("write.axis_letters", f"{machine.name} has an axis {', '.join(missing)}, for which this control has no "
                  "word", file=machine.file, hint=f"letters of its axes: {' '.join(controller.axes)}; name the axis so in "
                  "the machine file, or take a controller that has the letter")]
