"""Names of tools that the control does not know, or that two tools have."""

from __future__ import annotations

from collections import Counter

from postproc.controllers.model import ControllerFile
from toolpaths.diagnostics import Diagnostic, error


def called_tools(controller: ControllerFile, file: str) -> list[Diagnostic]:
    """Errors in the names by which tools are called; `file` is the set-up's."""
    names = controller.tools.names
    if not names:
        return []
    if not controller.codes.tool_by_name:
        said = ", ".join(f'T{number} "{name}"' for number, name in sorted(names.items())[:6])
        return [error("tool.called", f"{said}: this control calls tools by their numbers", file=file, count=len(names),
                      hint="take `called` out of [tools.N]")]
    count = Counter(name.upper() for name in names.values())
    return [error("tool.called", f'"{name}" is the name of more than one tool', file=file,
                  hint="give each tool a name of its own, as the control's tool list has it")
            for name, times in count.items() if times > 1]
