"""Where the job file is: nothing heavy is imported to look for it."""

from __future__ import annotations

from pathlib import Path

NAME = "postproc.toml"


def found_upwards(folder: Path) -> Path | None:
    """The job file of the nearest folder, from `folder` upwards, that has one."""
    try:
        start = folder.resolve()
        return next((at / NAME for at in (start, *start.parents) if (at / NAME).is_file()), None)
    except OSError:
        return None
