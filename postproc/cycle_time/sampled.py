"""Formulas held against the control, executed over some stretches of a program: where axes turn, what formulas are off
depends on how points stand along curves (0.84 to 1.42 of their time on one path); a few hundred executed blocks say it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import timed
from postproc.cycle_time.kinds import BY_FORMULAS, KINDS, kinds, time_by_kind
from postproc.cycle_time.levels import stretch
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import BlockTimes, summed
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass

STRETCHES, LONG, EDGE = 4, 150, 15
"""stretches that are executed, blocks of each, and blocks at both its ends that do not count: it begins and ends at rest"""
FEWEST, LEAST_SHARE = 400, 0.1
"""blocks, and share of the time in which axes turn, from which stretches are executed: what the control's clock loads takes
half a second of processor time, which a small program is converted in"""
STUDENT, LEAST_OFF = 1.4, 0.03
"""times the deviation of the mean of STRETCHES (Student's 95 % over the normal's), and its least share: what stretches
that begin and end at rest do not show"""
TURNING = KINDS.index("turning axes")


@dataclass(frozen=True)
class Sampled:
    """Times by formulas, those of turning axes by what the executed control takes of them.

    Attributes:
        off: standard deviation of the program's time over the executed control's, as a share; None where no stretch was
            executed
    """

    times: BlockTimes
    off: float | None


def sampled(blocks: MotionBlocks, model: CycleTimeModel) -> Sampled:
    """The times of a program by formulas, held against the control where axes turn; not where few do, where the program is
    short, and where no motion is found.

    Args:
        model: of a control that is executed, with what the machine says of it (`of_machine`); of others the times are theirs
    """
    made = timed(blocks, model.quick())
    if model.kind != "control" or len(blocks) < FEWEST:
        return Sampled(made, None)
    turning = kinds(blocks, made) == TURNING
    along = np.cumsum(np.where(turning, made.seconds, 0.0))
    if along[-1] < LEAST_SHARE * float(made.seconds.sum()):
        return Sampled(made, None)
    middle = np.searchsorted(along, (np.arange(STRETCHES) + 0.5) / STRETCHES * along[-1])
    pairs = [_pair(blocks, turning, model, max(int(k) - LONG // 2, 0)) for k in middle]
    if any(pair is None for pair in pairs):
        return Sampled(made, None)
    executed, about = np.array(pairs, dtype=np.float64).T
    factor = float(executed.sum() / about.sum())
    scatter = float(np.linalg.norm(executed - factor * about)) * (STRETCHES / (STRETCHES - 1.0))**0.5 / float(about.sum())
    share = time_by_kind(blocks, made) / max(float(made.seconds.sum()), 1e-9)
    others = float(sum(share[k] * BY_FORMULAS[name] for k, name in enumerate(KINDS) if k != TURNING))
    off = float(np.hypot(others, share[TURNING] * max(STUDENT * scatter / factor, LEAST_OFF)))
    return Sampled(_scaled(made, blocks, np.where(turning, factor, 1.0)), off)


def _pair(blocks: MotionBlocks, turning: Bools, model: CycleTimeModel, low: int) -> tuple[float, float] | None:
    """(s executed, s by formulas) of the turning blocks of a stretch; None where the control is not executed there."""
    high = min(low + LONG, len(blocks))
    part = stretch(blocks, low, high)
    count = np.flatnonzero(turning[low:high])
    inner = count[(count >= EDGE) & (count < high - low - EDGE)]
    moved = timed(part, model)
    if moved.found or not len(inner):
        return None
    return float(moved.seconds[inner].sum()), float(timed(part, model.quick()).seconds[inner].sum())


def _scaled(times: BlockTimes, blocks: MotionBlocks, factor: Floats) -> BlockTimes:
    """Times whose blocks take (E,) times as long; rests stay."""
    p = blocks.pauses
    inside = p.block >= 0
    seconds = factor * times.seconds
    rest = summed(times.pause[inside], p.block[inside], len(blocks))
    end = float(times.begin[0]) + np.cumsum(seconds) + np.concatenate([[0.0], np.cumsum(rest)[:-1]])
    columns = {name: factor * getattr(times, name) for name in ("ramp", "steady", "jerk", "lost_stop", "lost_corner")}
    return replace(times, begin=end - seconds, end=end, **columns)
