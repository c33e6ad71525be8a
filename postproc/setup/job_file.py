"""`postproc.toml` next to a job: machine, controller, set-up and tolerances that the command line leaves out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from machines.hooks import HooksModel
from machines.user_file import read_toml, validate
from machines.user_model import UserModel
from toolpaths.choices import DialectName, LengthUnit
from toolpaths.diagnostics import Diagnostic

_FILES = ("setup", "hooks", "error_model")
"""keys that name a file"""
_NAMES = ("machine", "controller")
"""keys that name a file where they end in .toml, else a built-in one"""


class JobFile(UserModel):
    """What a job is converted with; every key has an option that takes precedence. Files are named from its folder."""

    ELSEWHERE: ClassVar[dict[str, str]] = {"jobs": "this file is one job; several are the file of postproc batch JOBS.toml, "
                                                   "under another name"}
    """what a key says that belongs to another file"""

    machine: Annotated[str, Field(min_length=1)] | None = None
    """as -m"""
    controller: Annotated[str, Field(min_length=1)] | None = None
    """as -c"""
    setup: Annotated[str, Field(min_length=1)] | None = None
    """as --setup"""
    hooks: HooksModel | Annotated[str, Field(min_length=1)] | None = None
    """as --hooks: a file whose [hooks] hold, or the [hooks] themselves, for every set-up of the job"""
    error_model: Annotated[str, Field(min_length=1)] | None = None
    """as --error-model"""
    tolerance: float | None = Field(default=None, ge=1e-6, le=10.0)
    """as --tolerance, mm"""
    axis_tolerance: float | None = Field(default=None, ge=1e-6, le=10.0)
    """as --axis-tolerance, degrees"""
    units: LengthUnit | None = None
    """as --units"""
    dialect: DialectName | None = None
    """as --dialect"""
    allow_unknown: list[str] | None = None
    """as --allow-unknown"""


def load_job_file(file: Path) -> tuple[dict[str, str | float | list[str]] | None, list[Diagnostic]]:
    """Values by option, names of files as they are seen from here; None where the file has faults."""
    values, found = read_toml(str(file), kind="job")
    job, found = (None, found) if values is None else validate(values, JobFile)
    if job is None:
        return None, found
    stated = {key: value for key, value in job.model_dump().items() if value is not None}
    if isinstance(job.hooks, HooksModel):
        stated["hooks"] = file.name
    for key in (*_FILES, *_NAMES):
        if key in stated and (key in _FILES or stated[key].lower().endswith(".toml")):
            stated[key] = str(file.parent / stated[key])
    return stated, found
