"""Names that the set-up gives and the control or the program cannot have: its work offset, its number."""

from __future__ import annotations

from machines.toml_lines import KeyPath
from postproc.base.options import Options
from postproc.controllers.model import ControllerFile
from postproc.setup.model import SetupFile, line_of
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.toolpath import Toolpath


def work_offset(controller: ControllerFile, setup: SetupFile, options: Options) -> list[Diagnostic]:
    """Work offsets that the control does not have: that of the set-up, or those of its places."""
    program = controller.program
    codes = [place.work_offset_code for place in setup.places] or [setup.work_offset_code]
    where: list[KeyPath] = [("places", k, "work_offset_code") for k in range(len(setup.places))] or [("work_offset_code",)]
    blocks = [program.offset_block(code) for code in codes]
    twice = [(codes[blocks.index(block)], code) for k, (block, code) in enumerate(zip(blocks, codes, strict=True))
             if block is not None and block in blocks[:k]]
    return [error("setup.work_offset_code", f"work_offset_code = {code!r}: this control has no such work offset",
                  file=options.setup, lines=line_of(options.setup, at), hint=f"allowed are {program.offsets_named}")
            for code, block, at in zip(codes, blocks, where, strict=True) if block is None] + [
        error("setup.work_offset_code", f"work_offset_code = {code!r}: on this control that is the register of {first!r}, "
              "which another place has", file=options.setup, lines=line_of(options.setup, where[codes.index(code)]),
              hint="give each place a register of its own")
        for first, code in twice]


def program_number(toolpath: Toolpath, controller: ControllerFile, setup: SetupFile,
                    options: Options) -> list[Diagnostic]:
    """A number of the program that one of its subprograms bears."""
    last, number = 1000 + len(toolpath.operations), setup.output.program_number
    numbered = setup.output.divided and "{number}" in controller.subprograms.call
    if number is None or not numbered or not 1000 < number <= last:
        return []
    return [error("setup.program_number", f"program_number = {number}: subprograms have the numbers 1001 to {last}",
                  file=options.setup, lines=line_of(options.setup, ("output", "program_number")),
                  hint=f"a number below 1001 or above {last}")]
