"""Blocks of the controller file that state other units than the program is written in."""

from __future__ import annotations

from postproc.controllers.model import ControllerFile
from toolpaths.diagnostics import Diagnostic, error


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
