"""What to enter at the control so that it corrects the part's place itself, in the words of the control."""

from __future__ import annotations

from itertools import takewhile

import numpy as np

from postproc.alignment.fit import Alignment
from postproc.controllers.texts import EMC_OFFSETS, WORK_OFFSETS
from postproc.job.job import Job
from toolpaths.arrays import Floats
from toolpaths.units import DEG

FURTHER = 500
"""G505 is the fifth settable frame of Siemens"""

def fixed_turns(rotation: Floats) -> tuple[float, float, float]:
    """(a, b, c) degrees: turns about the fixed X, then Y, then Z that make `rotation` (3, 3) = Rz(c) Ry(b) Rx(a)."""
    b = np.arcsin(np.clip(-rotation[2, 0], -1.0, 1.0))
    a, c = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    return float(a) / DEG, float(b) / DEG, float(c) / DEG


def control_entry(job: Job, aligned: Job, found: Alignment) -> list[str]:
    """Lines for the operator, from `[alignment] entry` of the controller file; `aligned`: the job at the measured place.

    Work offsets are machine coordinates, shifts those of the origin along the machine's axes, in the units of the program.
    None where its work offsets cannot be turned so.
    """
    rules, allowed = job.controller.alignment, job.options.axis_tolerance
    a, b, c = fixed_turns(found.move.rotation)
    free = {"space": True, "plane": max(abs(a), abs(b)) <= allowed and not any(job.machine.rotary),
            "none": max(abs(a), abs(b), abs(c)) <= allowed}
    if not free[rules.turns]:
        return []
    origin = job.control.origin[None]
    shift, said = (found.move.points(origin) - origin)[0], job.controller.lengths
    offset = dict(zip(job.machine.axis_names, aligned.control.work_offset.tolist(), strict=True))
    values = {name.lower(): said.plain(offset.get(name, 0.0)) for name in "XYZ"}
    values |= {f"d{name}": said.plain(float(v)) for name, v in zip("xyz", shift, strict=True)}
    values |= {name: f"{v + 0.0:.4f}" for name, v in zip("abc", (a, b, c), strict=True)}
    values |= {"offset": job.controller.program.offset_name(job.setup.work_offset_code),
               "number": str(_number(job.controller.program.offset_name(job.setup.work_offset_code)))}
    return [line.format(**values) for line in rules.entry]


def _number(code: str) -> int:
    """By the control's name: 1 for G54, ..., 7 for G59.1, 5 for G505 of Siemens; else the number that the name ends with."""
    if code in (*WORK_OFFSETS, *EMC_OFFSETS):
        return (*WORK_OFFSETS, *EMC_OFFSETS).index(code) + 1
    number = int("".join(reversed([*takewhile(str.isdigit, reversed(code))])))
    return number - FURTHER if number > FURTHER else number
