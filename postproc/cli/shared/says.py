"""How much a command says, by its options -q, -v and --strict."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Says:
    """Set by the options of the command that runs.

    Attributes:
        quiet: notes, figures and the job file's line are left out
        verbose: each stage is named as it begins
        strict: warnings are errors
        job_line: what --quiet holds back until there is a warning or an error: the values that a job file gives
        interrupted: what is said where the command is interrupted, "" where nothing was written
        job_units: the job file whose units the command takes, "" where it has its own or none
    """

    quiet: bool = False
    verbose: bool = False
    strict: bool = False
    job_units: str = ""
    job_line: str = ""
    interrupted: str = ""


SAYS = Says()
"""of the command that runs: every command sets all three before it begins"""
