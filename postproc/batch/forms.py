"""What a batch has to know of a command: which options it has, which of them are files it reads or writes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from toolpaths.dataclass import dataclass

Taking = Literal["nothing", "one", "many"]
"""what an option takes: no value, one value, or it may be repeated"""
INPUTS = ("setup", "hooks", "error-model")
"""options that name a file which the command reads, in every command that has them"""
OUTPUTS = ("output", "json", "report", "csv", "figure", "figures", "check-program", "residuals", "proof")
"""options that name files which the command writes: a batch names them itself"""
WRITING = ("convert", "place", "report", "calibrate")
"""commands whose -o a batch states; the others leave figures alone"""
PLAIN = ("help", "max-file-size", "quiet", "verbose", "workers", "scheduler")
"""options of all commands that are none of a job"""


@dataclass(frozen=True)
class CommandForm:
    """One command as a batch calls it.

    Attributes:
        options: what each of its options takes, by its name without dashes
        required: options that have no default
        writes: it gets an -o; else its figures alone are kept
    """

    options: Mapping[str, Taking]
    required: tuple[str, ...]
    writes: bool

    def settable(self) -> tuple[str, ...]:
        """Options that a job may state."""
        without = {*OUTPUTS, *PLAIN, "machine", "controller"}
        return tuple(name for name in self.options if name not in without)


CommandForms = Mapping[str, CommandForm]
"""by command"""
