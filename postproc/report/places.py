"""Several parts in one program, place by place: register, travel and time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.cycle_time.report import as_dict, clock
from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.pipeline.result import PostResult
from toolpaths.arrays import Floats
from toolpaths.table_text import table_text

if TYPE_CHECKING:
    from postproc.cycle_time.estimate import Estimate


def places(result: PostResult, estimate: Estimate | None) -> list[dict[str, Any]]:
    """The figures of each place; none where the part stands at one alone. mm, degrees, s; null where not known."""
    job, path = result.job, result.path
    if job is None or path is None or job.repeats is None:
        return []
    seconds = seconds_at(job, estimate)
    letters, units = result.machine.axis_names, job.control.unit.tolist()
    return [{"place": place.name, "work_offset": result.controller.program.offset_name(place.code),
             "tables": dict(place.standing),
             "offset": dict(zip(letters, job.control_at(k).work_offset.tolist(), strict=True)),
             "axis_extents": {letter: [unit * low, unit * high] for letter, unit, low, high in zip(
                 letters, units, *(column.tolist() for column in _extents(job, path, k)), strict=True)},
             "time_s": None if seconds is None else float(seconds[k])} for k, place in enumerate(job.places)]


def seconds_at(job: Job, estimate: Estimate | None) -> Floats | None:
    """(P,) s at each place, the travel to it among them."""
    if estimate is None:
        return None
    seconds = np.array([op["time_s"] for op in as_dict(estimate)["operations"]])
    return np.asarray(np.bincount(job.modes.place, weights=seconds, minlength=len(job.places)), dtype=np.float64)


def _extents(job: Job, path: JointPath, place: int) -> tuple[Floats, Floats]:
    """(least, greatest) joints at a place, those of the moves there and home among them."""
    rows = np.flatnonzero(job.place[path.move] == place)
    return path.q[rows].min(axis=0), path.q[rows].max(axis=0)


def place_lines(result: PostResult, estimate: Estimate | None) -> list[str]:
    """The same for people."""
    rows = [(one["place"], one["work_offset"],
             " ".join([*(f"{k}{round(v, 4) + 0.0:.4f}" for k, v in one["offset"].items()),
                       *(f"with {letter} at {angle:g}" for letter, angle in one["tables"].items())]),
             ", ".join(f"{k} {low:.3f} to {high:.3f}" for k, (low, high) in one["axis_extents"].items()),
             "" if one["time_s"] is None else clock(one["time_s"])) for one in places(result, estimate)]
    return table_text([("place", "register", "work offset", "axes", "time"), *rows], align="llllr", indent=2) if rows else []
