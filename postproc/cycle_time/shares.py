"""Where the time goes: by kind, by cause, by axis and order, by operation, and the places that cost most."""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.blocks import Cause, CornerMode, MotionBlocks
from postproc.cycle_time.estimate import Estimate
from postproc.cycle_time.phases import BlockTimes, summed
from postproc.cycle_time.shape import shape
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass

CAUSES = ("feed", "limits", "corners", "stops", "rapids", "indexing", "tool_change", "spindle",
          "dwell", "commands")
FELT = 1e-9
"""relative difference above which an axis, not the feed word, holds the speed"""


@dataclass(frozen=True)
class TimeShares:
    """s of E blocks.

    Attributes:
        by_cause: CAUSES to (E,) s; pauses count at the block behind which they stand
        limiting: axis letter to (velocity, acceleration, jerk) s
        feed: s at the feed of the program
    """

    by_cause: dict[str, Floats]
    limiting: dict[str, tuple[float, float, float]]
    feed: float


def shares(e: Estimate) -> TimeShares:
    """The time of an estimate by activity."""
    blocks, times = e.blocks, e.timed
    form = shape(blocks)
    velocity, rate, jerk = (limit / np.maximum(form.share, 1e-300) for limit in (
        blocks.axes.velocity, blocks.axes.acceleration, blocks.axes.jerk))
    feeding = ~blocks.rapid
    held = times.peak >= velocity.min(axis=1) * (1.0 - FELT)
    at_feed = feeding & ~held
    moving = times.seconds
    by_feed = np.where(feeding, form.length / np.maximum(blocks.speed, 1e-300), 0.0)
    over = np.maximum(moving - by_feed, 0.0)
    corners, stops = _split(over, times)
    causes = {"feed": np.where(feeding, np.minimum(by_feed, moving), 0.0), "rapids": np.where(feeding, 0.0, moving),
              "corners": np.where(feeding, corners, 0.0), "stops": np.where(feeding, stops, 0.0)}
    causes["limits"] = np.where(feeding, np.maximum(over - corners - stops, 0.0), 0.0)
    causes |= _pauses(blocks, times)
    rows = np.arange(len(blocks))
    axis = {name: values.argmin(axis=1) if len(blocks) else rows for name, values in
            (("velocity", velocity), ("acceleration", rate), ("jerk", jerk))}
    spent = {"velocity": np.where(at_feed, 0.0, times.steady), "acceleration": times.ramp, "jerk": times.jerk}
    sums = {name: summed(spent[name], axis[name], len(blocks.axes.letters)) for name in axis}
    limiting = {letter: (float(sums["velocity"][j]), float(sums["acceleration"][j]), float(sums["jerk"][j]))
                for j, letter in enumerate(blocks.axes.letters)}
    return TimeShares(causes, limiting, float(np.where(at_feed, times.steady, 0.0).sum()))


def _split(over: Floats, times: BlockTimes) -> tuple[Floats, Floats]:
    """What a block takes beyond its feed, as far as ramps explain it: (corners, stops)."""
    lost = times.lost_corner + times.lost_stop + times.jerk
    scale = np.minimum(1.0, over / np.maximum(lost, 1e-300))
    stop = np.where(times.lost_stop + times.lost_corner > 0.0,
                    times.lost_stop / np.maximum(times.lost_stop + times.lost_corner, 1e-300), 1.0)
    return lost * scale * (1.0 - stop), lost * scale * stop


def _pauses(blocks: MotionBlocks, times: BlockTimes) -> dict[str, Floats]:
    p = blocks.pauses
    names = {Cause.DWELL: "dwell", Cause.TOOL_CHANGE: "tool_change", Cause.SPINDLE: "spindle", Cause.INDEXING: "indexing",
             Cause.OTHER: "commands"}
    return {name: summed(np.where(p.cause == cause, times.pause, 0.0), np.maximum(p.block, 0), len(blocks))
            for cause, name in names.items()}


def by_group(e: Estimate, s: TimeShares, group: Ints, count: int) -> dict[str, Floats]:
    """By cause, s of each of `count` groups of blocks; `group` (E,). Tool changes and the spindle's changes of speed count
    with the block that follows, which they are for."""
    sums = {name: summed(values, group, count) for name, values in s.by_cause.items()}
    p = e.blocks.pauses
    for name, cause in (("tool_change", Cause.TOOL_CHANGE), ("spindle", Cause.SPINDLE)) if len(group) else ():
        after = group[np.minimum(p.block + 1, len(group) - 1)]
        sums[name] = summed(np.where(p.cause == cause, e.timed.pause, 0.0), after, count)
    return sums


def operations(e: Estimate, s: TimeShares) -> list[dict[str, object]]:
    """Time of each operation, by cause."""
    sums = by_group(e, s, e.blocks.operation, len(e.blocks.operations))
    return [{"operation": name, "time_s": float(sum(values[k] for values in sums.values())),
             **{f"{cause}_s": float(values[k]) for cause, values in sums.items()}}
            for k, name in enumerate(e.blocks.operations)]


def exact_stops(e: Estimate) -> tuple[int, float]:
    """(blocks at whose end the program asks for an exact stop and nothing else makes the axes rest, s that the rests cost).

    G60, G9, G09, G61.1; G61 where the control rests under it.
    """
    blocks = e.blocks
    other = blocks.forced | np.append(blocks.rapid[1:] != blocks.rapid[:-1], True)[:len(blocks)]
    at = (blocks.path == CornerMode.STOP) & ~blocks.rapid & ~other
    return int(at.sum()), float(e.timed.lost_stop[at].sum())


_PLACES = 10
"""most expensive ones that are named"""


def most_expensive(e: Estimate, s: TimeShares) -> list[dict[str, object]]:
    """The places where most time goes beyond the feed of the program: lines, seconds lost, why."""
    lost = sum((values for name, values in s.by_cause.items() if name != "feed"), np.zeros(len(e.blocks)))
    order: Ints = np.argsort(-np.asarray(lost), kind="stable")[:_PLACES]
    names = [name for name in CAUSES if name != "feed"]
    result: list[dict[str, object]] = []
    for k in order.tolist():
        cause = max(names, key=lambda name: float(s.by_cause[name][k]))
        cl = int(e.blocks.cl_line[k]) if e.blocks.cl_line is not None else -1
        if lost[k] > 0.0:
            result.append({"nc_line": int(e.blocks.line[k]), "cl_line": cl if cl >= 0 else None, "lost_s": float(lost[k]),
                           "cause": cause})
    return result


NAMED = 5
"""lines that are named of a cause"""


def losses(e: Estimate, s: TimeShares) -> list[dict[str, object]]:
    """What goes beyond the feed of the program, by cause, the largest first: s, places, lines where most is lost."""
    result: list[tuple[float, dict[str, object]]] = []
    for cause in CAUSES[1:]:
        lost = s.by_cause[cause]
        rows = np.flatnonzero(lost > 0.0)
        if not len(rows):
            continue
        line = e.blocks.line[rows]
        number, index = np.unique(line, return_inverse=True)
        of_line = summed(lost[rows], index, len(number))
        worst = np.argsort(-of_line, kind="stable")[:NAMED]
        result.append((float(lost.sum()), {"cause": cause, "lost_s": float(lost.sum()), "places": len(number),
                       "nc_lines": sorted(int(number[k]) for k in worst), "largest_s": float(of_line[worst[0]])}))
    return [row for _, row in sorted(result, key=lambda pair: -pair[0])]
