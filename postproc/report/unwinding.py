"""What unwinding rotary axes costs: on the travel home in the program, and behind it, where they are left wound."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.pipeline.result import PostResult
from toolpaths.rotations import TWO_PI, whole_turns


def unwinding(result: PostResult) -> dict[str, dict[str, Any]]:
    """By letter of each axis without end stops that counts its turns: seconds that linking moves of the
    program unwind it, turns from home at which it ends, seconds that the next start unwinds those."""
    path, job = result.path, result.job
    if path is None or job is None or not len(path):
        return {}
    found, machine = dict[str, dict[str, Any]](), job.machine
    steps = np.diff(np.concatenate([machine.home[None], path.q]), axis=0)
    link = np.isnan(path.u)
    for j in np.flatnonzero(machine.endless).tolist():
        if j in job.control.rolls:
            continue
        velocity, step = float(machine.limits.velocity[j]), np.abs(steps[link, j])
        seconds = float((step - np.abs(step - whole_turns(step))).sum()) / velocity
        turns = round(float(path.q[-1, j] - machine.home[j]) / TWO_PI)
        found[machine.axis_names[j]] = {"in_program_s": seconds, "turns_left": turns,
                                        "next_start_s": abs(turns) * TWO_PI / velocity}
    return found


def _remedy(result: PostResult, letter: str) -> str:
    """What the machine file is to say, where the axis rolls over at the machine; an axis that is modulo already has the
    controller's rule "none"."""
    machine = result.machine
    key = 'rollover = "shortest" or "sign"' if machine.turns[machine.axis_names.index(letter)].modulo else "modulo = true"
    return f"none with {key} in the machine file, where the axis rolls over"


def unwinding_lines(result: PostResult) -> list[str]:
    """The same for people, where there is any."""
    lines = []
    for letter, figures in unwinding(result).items():
        if figures["in_program_s"] > 0.0:
            lines.append(f"{letter} unwinds whole turns for {figures['in_program_s']:.1f} s")
        if figures["turns_left"]:
            lines.append(f"{letter} is left {abs(figures['turns_left'])} turns from home: the next start unwinds them in "
                         f"{figures['next_start_s']:.1f} s ({_remedy(result, letter)})")
    return lines
