"""A drilling cycle as the moves that it stands for."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from postproc.controllers.cycles import Cycles
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.toolpath import Cycle, Kind, Toolpath


class Phase(IntEnum):
    """What a move of a drilling cycle does."""

    NONE = 0
    POSITION = 1
    """to above the hole"""
    APPROACH = 2
    """down to the clearance plane"""
    DRILL = 3
    """to the bottom at feed, in pecks where the cycle says so"""
    PECK = 4
    """chip breaking on the path to the bottom: out or up, back, and the depths between"""
    RETRACT = 5


HoleLeg = tuple[Floats, Phase, Kind]


def stops_at_its_level(cycle: Cycle, cycles: Cycles | None) -> bool:
    """True where the tool stops on its path down to a hole at the retract level that the cycle names: of taps, and of cycles
    that go back to the level they begin from, and so are equal to what the CL file asks for from that level alone."""
    if cycle.retract is None or cycle.kind == "TAP" or cycles is None:
        return cycle.retract is not None and cycle.kind == "TAP"
    alike = cycles.with_dwell if cycle.dwell > 0.0 else cycles.table
    spec = (alike if len(set(cycle.steps)) <= 1 else cycles.falling).get(cycle.kind)
    return cycles.enabled and spec is not None and not spec.states_retract


def hole_legs(toolpath: Toolpath, link: Bools, holes: Ints, cycles: Cycles | None = None) -> list[list[HoleLeg]]:
    """The legs of each hole, for the canned cycles of a control. The level is the height along the tool axis the tool
    comes from."""
    result: list[list[HoleLeg]] = []
    before: Floats | None = None
    initial = 0.0
    for k, row in enumerate(holes):
        chained = k > 0 and holes[k - 1] == row - 1 and not link[row]
        if not chained:
            before = toolpath.tip[row - 1] if row > 0 and not link[row] else None
        axis = toolpath.axis[row]
        if not chained and before is not None:
            initial = float(axis @ before)
        cycle = toolpath.cycles[toolpath.cycle[row]]
        legs = _legs(toolpath.tip[row], axis, cycle, before, initial, stops_at_its_level(cycle, cycles))
        before = legs[-1][0]
        result.append(legs)
    return result


def _legs(top: Floats, axis: Floats, cycle: Cycle, before: Floats | None, initial: float, stops: bool) -> list[HoleLeg]:
    """Above the hole at the level the tool is at (never below the clearance plane), down, drill, out.

    Without a known level (`before` None: a linking move leads here) the tool comes straight to the clearance plane
    and AUTO retracts to it. What `stops` does so on its path down at the retract level that it names: controls come
    back to the level that a cycle begins from.
    """
    height = float(axis @ top)
    plane = height + cycle.clearance
    legs: list[HoleLeg] = []
    level = plane
    if before is not None:
        level = max(float(axis @ before), plane)
        if float(axis @ before) < plane - 1e-9:
            legs.append((before + (plane - float(axis @ before)) * axis, Phase.POSITION, Kind.RAPID))
    legs.append((top + (level - height) * axis, Phase.POSITION, Kind.RAPID))
    own = cycle.retract if stops and cycle.retract is not None else np.inf
    if cycle.clearance + 1e-9 < own < level - height - 1e-9:
        legs.append((top + own * axis, Phase.POSITION, Kind.RAPID))
    if level > plane + 1e-9:
        legs.append((top + cycle.clearance * axis, Phase.APPROACH, Kind.RAPID))
    legs += _pecks(top, axis, cycle)
    legs.append((top - cycle.depth * axis, Phase.DRILL, Kind.FEED))
    out = cycle.retract if cycle.retract is not None else (initial - height if before is not None else -np.inf)
    kind = Kind.FEED if cycle.kind in FEED_OUT else Kind.RAPID
    if kind is Kind.FEED:
        legs.append((top + cycle.clearance * axis, Phase.RETRACT, Kind.FEED))
        if out > cycle.clearance + 1e-9:
            legs.append((top + out * axis, Phase.RETRACT, Kind.RAPID))
    else:
        legs.append((top + max(cycle.clearance, out) * axis, Phase.RETRACT, Kind.RAPID))
    return legs


def _pecks(top: Floats, axis: Floats, cycle: Cycle) -> list[HoleLeg]:
    """Depths between of DEEP (out to the clearance plane each time) and BRKCHP (a little up each time)."""
    if cycle.kind not in PECKING or not cycle.steps or not cycle.steps[-1] > 0.0:
        return []
    legs: list[HoleLeg] = []
    total = cycle.depth + cycle.clearance
    done, k = cycle.steps[0], 1
    while done < total - ROUNDED:
        at = top + (cycle.clearance - done) * axis
        legs.append((at, Phase.PECK, Kind.FEED))
        if cycle.kind == "DEEP":
            legs.append((top + cycle.clearance * axis, Phase.PECK, Kind.RAPID))
            legs.append((at + min(PECK_RELIEF, done) * axis, Phase.PECK, Kind.RAPID))
        else:
            legs.append((at + min(PECK_RELIEF, done) * axis, Phase.PECK, Kind.RAPID))
        done += cycle.steps[min(k, len(cycle.steps) - 1)]
        k += 1
    return legs


PECKING = frozenset({"DEEP", "BRKCHP"})
ROUNDED = 0.005
"""mm from the bottom at which a peck is the last: a step of less is what rounding has left"""
PECK_RELIEF = 0.254
"""mm short of the last depth where the next peck begins (LinuxCNC G83, G73: 0.010 inch)"""
FEED_OUT = frozenset({"BORE", "REAM", "TAP"})
"""Cycles that leave the hole at feed, up to the clearance plane."""
