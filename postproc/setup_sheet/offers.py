"""What is offered where a conversion is refused: the command that asks for all that is missing, a place that fits."""

from __future__ import annotations

import shlex

from postproc.job.job import OF_SETUP
from postproc.pipeline.result import PostResult
from postproc.setup_sheet.place import found_place
from toolpaths.diagnostics import Diagnostic, Severity, info
from toolpaths.toolpath import Toolpath


def offers(result: PostResult, toolpath: Toolpath, machine: str, controller: str) -> list[Diagnostic]:
    """Notes behind the errors of a conversion that was refused; `machine` and `controller` as the command was given them.

    Args:
        toolpath: as it was read
    """
    codes = {d.code for d in result.diagnostics if d.severity is Severity.ERROR}
    missing = sorted(codes & OF_SETUP)
    if missing:
        words = shlex.join([toolpath.file or "part.cls", "-m", machine, "-c", controller])
        rest = ", ".join(sorted(codes - OF_SETUP))
        return [info("setup.offered", f"a set-up answers all of this: {', '.join([*missing, *_place(result)])}"
                     + (f"; put {rest} right first" if rest else ""),
                     hint=f"postproc setup new {words} -o part.setup.toml asks for all of "
                     "them at once, and finds a place that fits")]
    return found_place(result, toolpath)


def _place(result: PostResult) -> list[str]:
    """Where the part stands, where it matters and nobody has said it: travel is looked at only when the rest is known."""
    stated = result.setup.part.model_fields_set or result.setup.places
    turning = any(f"{letter}'" in result.machine.structure.split() for letter in "ABC")
    return [] if stated or not turning else ["where the part stands on the table ([part])"]
