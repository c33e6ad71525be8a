"""What unwinding rotary axes costs: on the travel home in the program, and behind it, where they are left wound."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from postproc.pipeline.result import PostResult
from postproc.pipeline.written_figures import unwound


def unwinding(result: PostResult) -> dict[str, dict[str, Any]]:
    """By letter of each axis without end stops that counts its turns: seconds that linking moves of the
    program unwind it, turns from home at which it ends, seconds that the next start unwinds those."""
    path, job, figures = result.path, result.job, result.figures
    found = figures.unwound if figures else unwound(path, job) if path is not None and job is not None else {}
    return {letter: asdict(one) for letter, one in found.items()}


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
