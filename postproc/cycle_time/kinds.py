"""Kinds of motion of a program, and how far a calibrated model may be off on each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.phases import BlockTimes, summed
from postproc.cycle_time.shape import shape
from toolpaths.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from postproc.cycle_time.model import CycleTimeModel

KINDS = ("rapids", "lines at feed", "corners", "short lines", "shortest lines", "arcs", "turning axes")
"""every block is of one of these: long lines at feed and, where corners and ramps hold them, below it; short and shortest
lines"""
SHORT, SHORTEST = 0.05, 0.008
"""s at its feed below which a line is short (within the ramps of the control), and shortest (within its block time)"""
SLOWER = 1.1
"""times its time at the feed that a long line takes which is not at feed"""
NOT_SEEN = {"rapids": 0.12, "lines at feed": 0.06, "corners": 0.12, "short lines": 0.3, "shortest lines": 0.6, "arcs": 0.12,
            "turning axes": 0.4}
"""standard deviation as a share of the time of a kind that no run has shown; by `bench_bands.py` what a model fitted to one
kind of motion is off on another, on controls of another kind"""

OWN = {"rapids": 0.03, "lines at feed": 0.006, "corners": 0.05, "short lines": 0.06, "shortest lines": 0.08, "arcs": 0.04,
       "turning axes": 0.06}
"""the same of a control whose parameters are all known: how it rounds corners and builds up speed is its own, a line at its
feed takes its length over its feed on any. Seventeen stretches of real programs at feed were met within 1.9 %, a curve of
small bends within 4 % (`tests/benchmarks/published.py`); controls of other kinds: `bench_bands.py`"""

BY_FORMULAS = {"rapids": 0.04, "lines at feed": 0.02, "corners": 0.08, "short lines": 0.08, "shortest lines": 0.1,
               "arcs": 0.04, "turning axes": 0.2}
"""the same of the formulas over the executed control: 60 programs of six CL files, three machines and five controls"""


def kinds(blocks: MotionBlocks, times: BlockTimes) -> Ints:
    """(E,) index into KINDS of each block, under a model's times."""
    form = shape(blocks)
    at_feed = form.length / np.maximum(blocks.speed, 1e-300)
    kind = [blocks.rapid, form.turns, blocks.arc, at_feed < SHORTEST, at_feed < SHORT, times.seconds <= SLOWER * at_feed]
    return np.select(kind, [0, 6, 5, 4, 3, 1], default=2).astype(np.int64)


def time_by_kind(blocks: MotionBlocks, times: BlockTimes) -> Floats:
    """(KINDS,) s in motion by kind; pauses are of none."""
    return summed(times.seconds, kinds(blocks, times), len(KINDS))


def own_share(blocks: MotionBlocks, times: BlockTimes, model: CycleTimeModel, seconds: float,
              off: float | None = None) -> float:
    """Standard deviation of a program's time over the model's own, as a share of `seconds`.

    Arcs and turns that hold their feed count as lines at feed. Of a model without a run by kind of motion (`OWN`), kinds are
    independent of each other. Where the control is not executed, what the formulas are off. Of a calibrated model: what its
    run scatters, and by kind of motion what the model may be off where its parameters fit, each with the time that the
    program spends in it; errors of the kinds are added as if they all had one sign. `off` where stretches were executed.
    """
    record = model.calibration
    lasting = max(seconds, 1e-9)
    by_formulas = off if off is not None else float(time_by_kind(blocks, times) / lasting @ _row(BY_FORMULAS))
    formulas = by_formulas if model.kind == "formulas" else 0.0
    if record is None and model.own_share is not None:
        return float(np.hypot(model.own_share, formulas))
    kind = np.where(_at_feed(blocks, times), KINDS.index("lines at feed"), kinds(blocks, times))
    spent = summed(times.seconds, kind, len(KINDS)) / lasting
    if record is None:
        return float(np.hypot(np.linalg.norm(spent * _row(OWN)), formulas))
    by_kind = _row({name: record.structure.get(name, NOT_SEEN[name]) for name in KINDS})
    return float(np.hypot(np.hypot(record.relative, spent @ by_kind), formulas))


def _at_feed(blocks: MotionBlocks, times: BlockTimes) -> Bools:
    """(E,) feed moves that last and run at what the feed word asks for."""
    wanted = shape(blocks).length / np.maximum(blocks.speed, 1e-300)
    return np.asarray(~blocks.rapid & (wanted >= SHORT) & (times.seconds <= SLOWER * wanted))


def _row(by_name: dict[str, float]) -> Floats:
    return np.array([by_name[name] for name in KINDS])
