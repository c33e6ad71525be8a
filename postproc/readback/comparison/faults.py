"""Where a fault of the read-back points: into the CL file, or into the program that a user asked to verify."""

from __future__ import annotations

from dataclasses import replace

from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, error


@dataclass(frozen=True)
class Faults:
    """`cl` is the CL file, `gcode` the program's file where it has one."""

    cl: str
    gcode: str = ""

    def warning(self, code: str, message: str, cl_line: int, block_line: int, count: int = 1,
                hint: str = "") -> Diagnostic:
        """A WARNING there."""
        return replace(self.error(code, message, cl_line, block_line, count, hint), severity=Severity.WARNING)

    def error(self, code: str, message: str, cl_line: int, block_line: int, count: int = 1,
              hint: str = "") -> Diagnostic:
        """An ERROR at a line of the CL file and a line of the program."""
        if self.gcode:
            where = f" (line {cl_line} of {self.cl})" if cl_line else ""
            return error(code, message + where, file=self.gcode, lines=[block_line], count=count, hint=hint)
        return error(code, f"{message} (line {block_line} of the program)", file=self.cl,
                     lines=[cl_line] if cl_line else [], count=count, hint=hint)
