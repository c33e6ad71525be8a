"""What a redundant machine leaves open, planned over all runs of a program: carriers first, then the spin."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from machines.machine import Machine
from postproc.joints.run_roads import ParameterCurve, RunRoad, columns_of
from postproc.joints.spin_plan import planned_spins
from postproc.joints.split_plan import planned_split
from toolpaths.arrays import Floats


def planned_parameters(roads: Sequence[RunRoad], machine: Machine, least: float,
                       spin: float | None, split: bool,
                       drawn: Callable[[Floats, Floats], Floats] | None) -> list[tuple[ParameterCurve, ...]]:
    """The curves of the open parameters of every road, which together have all of them.

    Args:
        least: distance from singular positions that the set-up states
        spin: rad, the one spin that is asked for; None: planned
        split: False where the platform rests on carriers that do all
        drawn: as of `RunOptions`
    """
    kin, result = roads[0].kin, [tuple[ParameterCurve, ...]() for _ in roads]
    if columns_of(kin, False):
        result = [(curve,) for curve in planned_split(roads, machine, split)]
    if columns_of(kin, True):
        spins = planned_spins(roads, result, machine, least, spin, drawn)
        result = [(*others, curve) for others, curve in zip(result, spins, strict=True)]
    return result
