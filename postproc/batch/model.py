"""The file of a batch: jobs, each a command over files, machines, controllers and options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import Field

from machines.user_file import UserFile, read_toml, validate
from machines.user_model import UserModel
from toolpaths.diagnostics import Diagnostic, error, has_errors

BatchCommand = Literal["convert", "time", "orient", "place", "report", "inspect", "calibrate"]
"""commands that a batch runs"""
COMMANDS: tuple[str, ...] = get_args(BatchCommand)
Text = Annotated[str, Field(min_length=1)]
OptionValue = bool | int | float | Text | list[bool | int | float | Text]
"""what an option of a command takes; true for one that takes nothing; a list: a run for each value"""
OptionValues = dict[Text, OptionValue]


class JobModel(UserModel):
    """One command over files; what it leaves out is as at the top of the file."""

    name: Text | None = None
    """of the job in the index; default: its number"""
    command: BatchCommand | None = None
    """what is run with each file; default: convert"""
    files: list[Text] = Field(min_length=1)
    """inputs of the command, named from this file's folder; `*` and `**` as in a shell"""
    machines: list[Text] = Field(default_factory=list)
    """as -m, a run for each: built-in names, or TOML files named from this file's folder"""
    controllers: list[Text] = Field(default_factory=list)
    """as -c, a run for each"""
    ending: Annotated[str, Field(pattern=r"^\.[A-Za-z0-9._-]+$")] | None = None
    """of what the command writes; default: the control's own for programs, .html for pages, .toml else"""
    options: OptionValues = Field(default_factory=dict)
    """options of the command by their names without dashes; a list makes a run of each of its values"""


class BatchFile(UserModel):
    """Jobs of a batch, and what they share."""

    output: Text = "out"
    """folder of what is written, named from this file's folder"""
    command: BatchCommand = "convert"
    """of jobs that state none"""
    machines: list[Text] = Field(default_factory=list)
    """of jobs that state none"""
    controllers: list[Text] = Field(default_factory=list)
    """of jobs that state none"""
    options: OptionValues = Field(default_factory=dict)
    """of all jobs whose command has them; those of a job take precedence"""
    jobs: list[JobModel] = Field(min_length=1)
    """[[jobs]]"""


def load_batch(file: Path) -> tuple[BatchFile | None, UserFile | None, list[Diagnostic]]:
    """The checked file of a batch and its values with their lines; None where it has faults."""
    values, found = read_toml(str(file), kind="batch")
    if values is None:
        return None, None, found
    batch, faults = validate(values, BatchFile)
    names = [] if batch is None else [one.name for one in batch.jobs if one.name is not None]
    twice = sorted({name for name in names if names.count(name) > 1})
    faults += [error("batch.same_name", f"{names.count(name)} jobs are called {name!r}", file=str(file),
                     hint="give each [[jobs]] a name of its own, or none") for name in twice]
    return (None if has_errors(faults) else batch), values, [*found, *faults]
