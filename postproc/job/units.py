"""Units of the program that blocks of the controller file contradict, or that a machine's letters cannot have."""

from __future__ import annotations

from machines.kinematics.chain import ROTARY
from machines.machine import Machine
from postproc.controllers.model import ControllerFile
from toolpaths.diagnostics import Diagnostic, error


def scaled_angles(controller: ControllerFile, machine: Machine, file: str) -> list[Diagnostic]:
    """An error where cranks have letters that a control takes for lengths, or slides such as it takes for angles, and the
    program is in inches: it would scale their degrees, or leave their lengths as they are."""
    if controller.format.units == "mm":
        return []
    named = list(zip(machine.axis_names, machine.rotary, strict=True))
    cranks = [name for name, turns in named if turns and name not in ROTARY]
    slides = [name for name, turns in named if not turns and name in ROTARY]
    said = [f"words of {', '.join(letters)} are {what}" for letters, what in (
        (cranks, "degrees, and controls scale words of that letter in programs in inches"),
        (slides, "lengths, and controls do not scale words of that letter in programs in inches")) if letters]
    return [error("output.units", text, file=file, hint='write [output] units = "mm" in the set-up') for text in said]


def other_units(controller: ControllerFile, file: str) -> list[Diagnostic]:
    """An error for each block around programs that says the opposite of the units of the output; `file` is the set-up's."""
    wanted, words, program = controller.format.units, controller.units, controller.program
    meanings = {words.mm: "mm", words.inch: "inch", **words.others}
    wrong = {word for word, units in meanings.items() if units != wanted}
    places = {"program.begin": program.begin, "program.preamble": program.preamble, "program.operation": program.operation,
              "subprograms.begin": controller.subprograms.begin}
    return [error("output.units", f"{key} of the controller file holds {word} ({meanings[word]}), and the program is "
                  f"written in {wanted}: {block}", file=file,
                  hint=f"write {{units}} in the place of {word}, or [output] units = \"{meanings[word]}\" in the set-up")
            for key, blocks in places.items() for block in blocks for word in block.split() if word in wrong]
