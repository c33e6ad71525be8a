"""The control's own smoothing by operation: by which blocks it is set, and the mm that it may take of the tolerance."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.machine import Machine
from postproc.base.options import Options
from postproc.controllers.model import ControllerFile
from postproc.controllers.spelling import SmoothingLevel
from postproc.setup.model import SetupFile, line_of
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.toolpath import Toolpath


@dataclass(frozen=True)
class Smoothing:
    """mm that the control may take, and the blocks that say so, with placeholders."""

    mm: float
    blocks: tuple[str, ...]


@dataclass(frozen=True)
class SmoothingPlan:
    """The smoothing of operations that state none (`default`), and of others by name; `used` by the path's operations."""

    default: Smoothing
    named: dict[str, Smoothing]
    used: tuple[Smoothing, ...]
    asked: float = 0.0
    """mm, the largest number that the set-up asks for: it is refused alike where the control has levels that take less"""

    @cached_property
    def most(self) -> float:
        """mm that the control may take at the most: what the bound counts."""
        return max((one.mm for one in self.used), default=self.default.mm)

    @cached_property
    def by_operation(self) -> Floats:
        """(O,) mm of each operation of the path."""
        return np.array([one.mm for one in self.used] or [self.default.mm])


MOST = 0.8
"""of the tolerance that the control's smoothing may take"""
NOT_FITTED = ("by the machine file the control has no smoothing (smoothing = false under [control])",
              "take it out of the set-up, or state smoothing = true in the machine file where it is fitted")


def smoothing_plan(controller: ControllerFile, setup: SetupFile, options: Options, toolpath: Toolpath,
                   machine: Machine) -> tuple[SmoothingPlan, list[Diagnostic]]:
    """The smoothing that the set-up asks for ([output.smoothing]), and what the control or the file has not."""
    default = Smoothing(_usual(controller, options), controller.program.path_tolerance)
    named, found, names = dict[str, Smoothing](), list[Diagnostic](), {op.name for op in toolpath.operations}
    for name, asked in setup.output.smoothing.items():
        one, why = _asked(controller, asked, options, default)
        if name not in names:
            has = ", ".join(sorted(n for n in names if n)) or "none"
            why = "which is not an operation of the CL file", f"it has: {has}"
        if machine.options.absent("smoothing"):
            one, why = default, NOT_FITTED
        if why is not None:
            found.append(error("setup.smoothing", f"[output.smoothing] {name!r} = {asked!r}: {why[0]}", file=options.setup,
                               lines=line_of(options.setup, ("output", "smoothing", name)), hint=why[1]))
        named[name] = one
    stated = _stated(controller, options, default, named)
    named |= {} if stated == default else dict.fromkeys(sorted(names - named.keys()), stated)
    used = tuple(named.get(op.name, default) for op in toolpath.operations)
    asked_mm = max((mm for mm in setup.output.smoothing.values() if not isinstance(mm, str)), default=0.0)
    return SmoothingPlan(default, named, used, asked_mm), found


def _usual(controller: ControllerFile, options: Options) -> float:
    fixed = controller.kinematics.smoothing_fixed
    if fixed is None and options.smoothing and any("{tolerance}" in block for block in controller.program.path_tolerance):
        return min(options.smoothing, MOST * options.tolerance)
    return controller.kinematics.smoothing_share * options.tolerance if fixed is None else fixed


def _stated(controller: ControllerFile, options: Options, default: Smoothing, named: dict[str, Smoothing]) -> Smoothing:
    """The smoothing of operations that state none in a program where others state a level.

    No page at hand says that a word without a level (G05.1 Q1) does away with the level of the block before, so the level
    is stated that takes no more than is allowed for that word; where there is none, the word.
    """
    if controller.kinematics.smoothing_fixed is None or all(one.blocks == default.blocks for one in named.values()):
        return default
    one, why = _asked(controller, default.mm, options, default)
    return default if why is not None else one


def _asked(controller: ControllerFile, asked: str | float, options: Options,
           default: Smoothing) -> tuple[Smoothing, tuple[str, str] | None]:
    """(the smoothing of a level or of so many mm, what is wrong with it and what to do)."""
    levels = controller.levels
    if isinstance(asked, str):
        if asked in levels:
            return Smoothing(_taken(levels[asked], options, default), levels[asked].blocks), None
        known = ", ".join(levels) or "none: the controller file has no [levels]"
        return default, ("the controller has no such level", f"it has: {known}")
    if controller.kinematics.smoothing_fixed is None:
        if any("{tolerance}" in block for block in default.blocks):
            return Smoothing(asked, default.blocks), None
        return default, ("the control's smoothing takes no tolerance", "name a level of the controller file")
    within = [one for one in levels.values() if one.tolerance is not None and one.tolerance <= asked]
    if not within:
        least = min((one.tolerance for one in levels.values() if one.tolerance is not None), default=default.mm)
        return default, ("no level of the controller keeps that", f"{least:g} mm, or a level by its name")
    best = max(within, key=lambda one: one.tolerance or 0.0)
    return Smoothing(_taken(best, options, default), best.blocks), None


def _taken(level: SmoothingLevel, options: Options, default: Smoothing) -> float:
    if level.tolerance is not None:
        return level.tolerance
    return default.mm if level.share is None else level.share * options.tolerance
