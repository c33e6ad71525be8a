"""LinuxCNC's trajectory planner (2.9, no jerk limit): how long it takes over a program.

Segments come from `linuxcnc_segments`, what happens where they meet from `linuxcnc_corners`; here they are
put in a row, the look-ahead gives each its speeds, and ramps give the times. Described from src/emc/tp/tp.c
of LinuxCNC 2.9 (`tpRunOptimization`, `tpComputeOptimalVelocity`, `tpCalculateTrapezoidalAccel`,
`tpActivateSegment`, `tcIsBlending`), src/emc/tp/tc.c (`tcGetOverallMaxAccel`) and
src/emc/task/emctaskmain.cc; stop and command times are measured on the simulator.
"""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.blocks import Cause, CornerMode, MotionBlocks
from postproc.cycle_time.linuxcnc_corners import KINK, BlendArcs, Corners, blends, corners
from postproc.cycle_time.linuxcnc_kernels import next_begins, speeds, timeline
from postproc.cycle_time.linuxcnc_segments import KERNEL_FROM, NORMAL_SHARE, PlannerSegments, clamped, segments
from postproc.cycle_time.phases import BlockTimes, Ramps, ramps, summed
from postproc.cycle_time.shape import NOTHING, block_lengths
from toolpaths.arrays import Array, Bools, Floats, Ints, repeated
from toolpaths.compiled import chosen
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

STOP, TANGENT, OVERLAP = 0, 2, 3
"""How a segment of the row ends; OVERLAP: the next one starts while this one slows down (parabolic blend)"""
LEAST_CYCLES = 1.02
"""servo cycles that a segment lasts at least where the look-ahead runs through it (TP_MIN_SEGMENT_CYCLES)"""
TANGENTIAL = 0.5
"""share of the acceleration along a circle where the rest may point to its centre (BLEND_ACC_RATIO_TANGENTIAL)"""
RAMP_TIME = 0.01
"""s below which a segment has one constant acceleration ([TRAJ] ARC_BLEND_RAMP_FREQ 100)"""
GAP_CYCLES = 4.0
"""servo cycles below which what blends leave of a line goes to the blend ([TRAJ] ARC_BLEND_GAP_CYCLES)"""


COMPILED_FROM = 4_000
"""segments that are executed cycle by cycle, from which compiling pays"""
_TOGETHER = 20_000
"""corners that are looked at together"""
ON_CYCLE = 1e-6
"""of a servo cycle: nearer to its begin a moment falls on it"""
COMMAND = {Cause.DWELL: 0.004, Cause.TOOL_CHANGE: 0.043, Cause.SPINDLE: 0.005, Cause.OTHER: 0.007, Cause.INDEXING: 0.0}
"""s that a command takes next to its own time, measured: the task's cycle is 1 ms, that of tool changes (io) 10 ms"""
SETTLED = 0.003
"""s from the planner's end to the joints' (cubic interpolation of motion's control.c, measured)"""


@dataclass(frozen=True)
class Settings:
    """Of the controller: servo cycle, s; depth of the look-ahead in segments ([TRAJ]
    ARC_BLEND_OPTIMIZATION_DEPTH).

    `stop_cycles`: servo cycles that a stop costs over the ramps, `blend_cycles`: by which overlapping segments begin earlier
    (both measured); `override`: of feeds; `rapid`: of rapids.
    """

    cycle: float = 0.001
    depth: int = 50
    stop_cycles: float = 0.5
    blend_cycles: float = 0.5
    override: float = 1.0
    rapid: float = 1.0


@dataclass(frozen=True)
@arrays(owner="M", length="M", asked="M", most="M", rate="M", ends="int8: M", kink="M", fresh="M", traverse="M",
        overlap_speed="M")
class Row:
    """M segments and blend arcs in the order of motion; fields as in `PlannerSegments`."""

    owner: Ints
    length: Floats
    asked: Floats
    most: Floats
    rate: Floats
    ends: Array
    kink: Floats
    fresh: Bools
    traverse: Bools
    overlap_speed: Floats


def linuxcnc(blocks: MotionBlocks, settings: Settings | None = None) -> BlockTimes:
    """How long LinuxCNC takes over each block."""
    settings = settings or Settings()
    s = segments(blocks, settings.override, settings.rapid)
    row = in_a_row(s, settings.cycle)
    block, length = s.block, s.length if len(s) == len(blocks) else block_lengths(blocks)
    del s  # a long program's columns, here and below
    return _timed(blocks, block, length, row, settings)


def in_a_row(s: PlannerSegments, cycle: float) -> Row:
    """Every corner decided, blend arcs put in, lengths trimmed, accelerations shared out."""
    count = len(s)
    ends = np.where(s.blocks.path == CornerMode.BLEND, np.int8(OVERLAP), np.int8(STOP))
    joined = ~s.fresh[1:]
    change = joined & (s.blocks.rapid[1:] != s.blocks.rapid[:-1])
    ends[:-1][change] = STOP
    free = joined & ~change & (s.blocks.path[:-1] != CornerMode.STOP)
    c = corners(s, free, cycle)
    ends[:-1][c.back] = STOP
    ends[:-1][c.tangent] = TANGENT
    at = np.flatnonzero(c.kinked & (ends[:-1] == OVERLAP))
    arcs = blends(s, at, cycle)
    blended, tangent = _choice(s, c, at, arcs, cycle)
    ends[at[blended | tangent]] = TANGENT
    return _put_together(s, c, ends, at, arcs, blended, tangent, joined, count, cycle)


def _choice(s: PlannerSegments, c: Corners, at: Ints, arcs: BlendArcs, cycle: float) -> tuple[Bools, Bools]:
    """(K,) where the blend arc, where passing as tangent wins; else two ramps overlap (`tpChooseBestBlend`).

    The decision falls while both segments may still lose half of their length to the next blends.
    """
    most = clamped(s.length, s.most, cycle)
    share = np.full(len(s), 0.5 * (1.0 - KINK))
    rate = s.acceleration * share * np.where(s.blocks.arc, TANGENTIAL, 1.0)
    arc_speed = np.where(arcs.good, clamped(arcs.length, arcs.most, cycle), 0.0)
    better = arc_speed > c.speed[at]
    for _ in range(2):
        trimmed = s.length.copy()
        trimmed[at[better] + 1] -= arcs.trim[better, 1]
        length = np.maximum(trimmed[at], NOTHING), s.length[at + 1]
        net = _overlap(s, at, length, (0.5, 0.5), np.minimum(s.asked, most), rate, share)[1] / 2.0
        better = (arc_speed > c.speed[at]) & (arc_speed > net)
    return better, ~better & (c.speed[at] > net)


def _overlap(s: PlannerSegments, one: Ints, length: tuple[Floats, Floats], part: tuple[Floats | float, Floats | float],
             target: Floats, rate: Floats, share: Floats) -> tuple[Floats, Floats]:
    """(speed below which the next begins, speed along the blend) (K,) of overlapping ramps (`tpComputeBlendVelocity`).

    `length`, `part`: of the segments `one` and of those behind; how much of each may be counted on. Where rotary axes
    move alone the tolerance counts as degrees.
    """
    two = one + 1
    reach = [np.minimum(np.sqrt(rate[k] * travel * much), target[k])
             for k, travel, much in zip((one, two), length, part, strict=True)]
    longest = np.minimum(length[0] / reach[0], length[1] / reach[1])
    seconds = np.minimum(longest, np.maximum(reach[0] / rate[one], reach[1] / rate[two]))
    speed, following = (np.minimum(v, seconds * rate[k]) for k, v in zip((one, two), reach, strict=True))
    theta = np.arccos(np.clip(-(_flat(s, s.shape.last, one) * _pull(s, two, share)).sum(axis=1), -1.0, 1.0)) / 2.0
    alone = (s.shape.last[one] == 0.0).all(axis=1)
    tolerance = s.blocks.tolerance[one] * np.where(alone, DEG, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = np.where((np.cos(theta) > 1e-3) & np.isfinite(tolerance),
                         2.0 * np.sqrt(rate[one] * tolerance / np.cos(theta)), np.inf)
    speed, following = np.minimum(speed, limit), np.minimum(following, limit)
    return speed, np.sin(theta) * (speed + following) / 2.0


def _pull(s: PlannerSegments, rows: Ints, share: Floats) -> Floats:
    """(K, 3) unit direction of the acceleration at the begin of segments: that of the tangent, on arcs with
    half the asked speed's centripetal part (`tcCircleStartAccelUnitVector`)."""
    tangent = _flat(s, s.shape.first, rows)
    radius = np.where(s.blocks.arc[rows], s.shape.radius[rows], 1.0)
    spoke = s.blocks.xyz_before(rows) - s.blocks.center[rows]
    inward = -spoke / np.maximum(np.linalg.norm(spoke, axis=1, keepdims=True), 1e-300)
    normal = np.where(s.blocks.arc[rows], (0.5 * s.asked[rows]) ** 2 / radius, 0.0)
    pull = tangent * (s.acceleration[rows] * share[rows])[:, None] + inward * normal[:, None]
    return np.asarray(pull / np.maximum(np.linalg.norm(pull, axis=1, keepdims=True), 1e-300))


def _flat(s: PlannerSegments, tangent: Floats, rows: Ints) -> Floats:
    """(K, 3) tangents of segments; those of helices in the plane; along X where X, Y, Z stand still, as
    LinuxCNC has it for a line without length."""
    own, normal = tangent[rows], s.blocks.normal[rows]
    own = np.where(s.blocks.arc[rows][:, None], own - (own * normal).sum(axis=1)[:, None] * normal, own)
    size = np.linalg.norm(own, axis=1, keepdims=True)
    return np.where(size > 0.0, own / np.maximum(size, 1e-300), np.array([1.0, 0.0, 0.0]))


def _put_together(s: PlannerSegments, c: Corners, ends: Array, at: Ints, arcs: BlendArcs, blended: Bools, tangent: Bools,
                  joined: Bools, count: int, cycle: float) -> Row:
    """Segments and blend arcs as one row."""
    arc_at, arc = at[blended], np.flatnonzero(blended)
    length = s.length.copy()
    length[arc_at] -= arcs.trim[arc, 0]
    length[arc_at + 1] -= arcs.trim[arc, 1]
    length = np.maximum(length, NOTHING)
    load = c.load.copy()
    load[at[~tangent]] = 0.0
    load[at] = np.where(tangent, load[at], 0.0)
    share = 1.0 - np.maximum(np.append(load, 0.0), np.concatenate([[0.0], load]))
    del load
    share[(ends == OVERLAP) | np.concatenate([[False], (ends[:-1] == OVERLAP) & c.straight])] *= 0.5
    most = clamped(s.length, s.most, cycle)
    np.minimum(most, length / cycle, out=most, where=np.append(joined, False))
    rate, most = _along_arcs(s, s.acceleration * share, most, np.append(joined, False))
    used = (length[arc_at] < GAP_CYCLES * cycle * arcs.most[arc]) & ~s.blocks.arc[arc_at]
    used &= ~np.concatenate([[False], halved_before(ends, c)])[arc_at]
    keep = np.ones(count, dtype=bool)
    keep[arc_at[used]] = False
    blend_length = arcs.length[arc] + np.where(used, length[arc_at], 0.0)
    order = np.argsort(np.concatenate([2 * np.flatnonzero(keep), 2 * arc_at + 1]), kind="stable") if len(arc) else arc

    def both(segment: Array, blend: Array) -> Array:
        return np.concatenate([segment[keep], blend])[order] if len(arc) else segment
    kink = np.where(ends == TANGENT, np.append(np.where(c.tangent | _mask(at[tangent], count - 1), c.speed, np.inf), np.inf),
                    np.inf)
    here = np.flatnonzero((ends[:-1] == OVERLAP) & joined)
    overlap = np.zeros(count)
    last = np.append(~joined[1:], True)[here]
    target = np.minimum(s.asked, most)
    for first in range(0, len(here), _TOGETHER):
        one, part = here[first:first + _TOGETHER], np.where(last[first:first + _TOGETHER], 0.5, 1.0)
        overlap[one] = _overlap(s, one, (length[one], length[one + 1]), (1.0, part), target, rate, share)[0]
    fresh = s.fresh.copy()
    fresh_blend = fresh[arc_at] & used
    return Row(both(np.arange(count), arc_at), both(length, blend_length), both(s.asked, arcs.asked[arc]),
               both(most, clamped(blend_length, arcs.most[arc], cycle)),
               both(rate, TANGENTIAL * arcs.acceleration[arc]), both(ends, np.full(len(arc), TANGENT, np.int8)),
               both(kink, np.full(len(arc), np.inf)), both(fresh, fresh_blend),
               both(s.blocks.rapid, s.blocks.rapid[arc_at]), both(overlap, np.zeros(len(arc))))


def halved_before(ends: Array, c: Corners) -> Bools:
    """(N-1,) where the segment behind shares a parabolic blend that was chosen for its corner."""
    return np.asarray((ends[:-1] == OVERLAP) & c.straight)


def _mask(rows: Ints, count: int) -> Bools:
    result = np.zeros(count, dtype=bool)
    result[rows] = True
    return result


def _along_arcs(s: PlannerSegments, rate: Floats, most: Floats, finished: Bools) -> tuple[Floats, Floats]:
    """Rate along arcs and their largest speed: what centripetal acceleration leaves (`pmCircleActualMaxVel`)."""
    arc = s.blocks.arc
    if not arc.any():
        return rate, most
    radius = np.where(arc, s.shape.radius, 1.0)
    climb = np.where(arc, s.shape.climb / np.where(arc, s.blocks.sweep, 1.0), 0.0)
    radius = radius + climb**2 * s.blocks.sweep**2 / radius
    inward = most**2 / radius
    with np.errstate(invalid="ignore"):
        part = np.where(inward > NORMAL_SHARE * rate, TANGENTIAL,
                        np.sqrt(np.maximum(1.0 - (inward / rate) ** 2, 0.0)))
    part = np.where(finished, part, TANGENTIAL)
    slower = np.where(arc & finished, np.minimum(most, np.sqrt(NORMAL_SHARE * rate * radius)), most)
    return np.where(arc, rate * part, rate), slower


def _timed(blocks: MotionBlocks, segment_of: Ints, length: Floats, row: Row, settings: Settings) -> BlockTimes:
    """Speeds by look-ahead, ramps, and everything put on the clock; last block (N,) of segments, `length` (E,) of blocks."""
    through = (row.ends == TANGENT) & ~np.append(row.fresh[1:], True)
    behind = np.concatenate([[False], through[:-1]])
    inside = behind & ~np.append(row.fresh[1:], True)
    most = np.where(inside, clamped(row.length, row.most, LEAST_CYCLES * settings.cycle), row.most)
    target = np.minimum(row.asked, most)
    ahead = _ahead(row, settings.depth)
    loop = chosen(speeds, len(row.length), KERNEL_FROM)
    first, last = loop(row.length, target, most, row.rate, through, row.kink, ahead)
    gentle = through & ~row.traverse & (2.0 * row.length < RAMP_TIME * (first + np.minimum(last, target))) & (last > 0.0)
    r = ramps(row.length, first, last, target, row.rate, gentle)
    stops = ~through
    overlap = _overlapping(row, r, settings, target, first)
    settling = np.where(stops & (overlap == 0.0), settings.stop_cycles * settings.cycle, 0.0)
    pause, resting = _pauses(blocks, segment_of, row)
    clock = chosen(timeline, len(row.length), KERNEL_FROM)
    begin, end = clock(r.seconds + settling, overlap, resting, row.fresh)
    end[-1:] += SETTLED
    ramp, steady, peak = r.up + r.down, r.steady.copy(), r.peak
    del behind, inside, most, target, ahead, gentle, overlap, settling, resting, r
    return _by_block(segment_of, length, row, ramp, steady, begin, end, pause, stops, first, last, peak)


def _overlapping(row: Row, r: Ramps, settings: Settings, target: Floats, first: Floats) -> Floats:
    """(M,) s before the end of a segment at which the next begins.

    Segments begin with a servo cycle, the next one with the cycle in which the speed falls below that of the blend
    (`next_begins`). Of segments that are entered at speed, as much before that moment as it is behind the begin of its
    cycle, half a cycle on average and nothing where it falls on one; of those that only gain and lose speed the part that
    does not overlap (measured: the rounded peak takes the rest).
    """
    overlap = np.where(row.ends == OVERLAP, np.minimum(row.overlap_speed / row.rate, r.down), 0.0)
    part = np.maximum(np.minimum(r.steady / settings.cycle, 1.0), 1.0 - overlap / np.maximum(r.down, 1e-300))
    within = np.mod((r.seconds - overlap) / settings.cycle + ON_CYCLE, 1.0) - ON_CYCLE
    early = 2.0 * settings.blend_cycles * settings.cycle * within * part
    overlap += np.where(overlap > 0.0, np.maximum(early, 0.0), 0.0)
    rows = np.flatnonzero((overlap > 0.0) & (first == 0.0))
    loop = chosen(next_begins, len(rows), COMPILED_FROM)
    begins = loop(row.length[rows], target[rows], row.rate[rows], row.overlap_speed[rows], settings.cycle)
    overlap[rows] = np.maximum(r.seconds[rows] - begins, 0.0)
    return np.asarray(overlap)


def _ahead(row: Row, depth: int) -> Floats:
    """(M,) speed at the end of each segment from which the next `depth` segments can stop (`tpRunOptimization`)."""
    gained = np.concatenate([[0.0], np.cumsum(2.0 * row.rate * row.length)])
    count = len(row.length)
    k = np.arange(count)
    stop = np.minimum(k + depth, count - 1)
    window = gained[stop] - gained[np.minimum(k + 1, count)] + row.rate[stop] * row.length[stop]
    return np.asarray(np.sqrt(np.maximum(window, 0.0)))


def _pauses(blocks: MotionBlocks, segment_of: Ints, row: Row) -> tuple[Floats, Floats]:
    """(P,) s of each pause, and (M,) s of rest behind each segment of the row."""
    p = blocks.pauses
    seconds = p.seconds + np.array([COMMAND[Cause(k)] for k in range(len(Cause))])[p.cause]
    segment = np.minimum(np.searchsorted(segment_of, np.maximum(p.block, 0)), len(segment_of) - 1)
    position = np.searchsorted(row.owner, segment, side="right") - 1
    inside = p.block >= 0
    return seconds, summed(seconds[inside], position[inside], len(row.length))


def _by_block(segment_of: Ints, own: Floats, row: Row, ramp: Floats, steady: Floats, begin: Floats, end: Floats,
              pause: Floats, stops: Bools, first: Floats, last: Floats, peak: Floats) -> BlockTimes:
    """Segments' times shared out to the blocks that they stand for, by length `own` (E,), written over times."""
    count, segments = len(own), len(segment_of)
    _apart(begin, end, ramp, steady)
    merged_end = np.zeros(segments)
    np.maximum.at(merged_end, row.owner, end)
    merged_begin = np.full(segments, np.inf)
    np.minimum.at(merged_begin, row.owner, begin)
    missing = ~np.isfinite(merged_begin)
    merged_begin[missing] = merged_end[missing] = 0.0
    owner = np.searchsorted(segment_of, np.arange(count)).astype(np.int32)
    total = summed(own, owner, segments)
    part = own / np.where(total[owner] > 0.0, total[owner], 1.0)
    done = np.cumsum(part)
    first_of = np.searchsorted(owner, np.arange(segments, dtype=np.int32))
    done -= (done - part)[first_of][owner]
    span = merged_end - merged_begin
    finish = merged_begin[owner] + done * span[owner]
    start = finish - part * span[owner]
    del begin, end, merged_begin, merged_end, missing, total, done, first_of, span
    loss_first, loss_last = ((peak - v) ** 2 / (2.0 * row.rate * np.maximum(peak, 1e-300)) for v in (first, last))
    stopped_before = np.concatenate([[True], stops[:-1]])
    lost_stop = np.where(stopped_before, loss_first, 0.0) + np.where(stops, loss_last, 0.0)
    lost_corner = np.where(stopped_before, 0.0, loss_first) + np.where(stops, 0.0, loss_last)

    def shared(values: Floats) -> Floats:
        return summed(values, row.owner, segments)[owner] * part
    return BlockTimes(start, finish, shared(ramp), shared(steady), repeated(0.0, count), _peak(row, peak, segments)[owner],
                      shared(lost_stop), shared(lost_corner), pause)


def _apart(begin: Floats, end: Floats, ramp: Floats, steady: Floats) -> None:
    """Begins and ends so that overlapping segments share the time between them, and their phases shortened alike."""
    over = np.flatnonzero(begin[1:] < end[:-1])
    middle = (begin[over + 1] + end[over]) / 2.0
    begin[over + 1], end[over] = middle, middle
    scale = np.minimum(1.0, (end - begin) / np.maximum(ramp + steady, 1e-300))
    ramp *= scale
    steady *= scale


def _peak(row: Row, peak: Floats, count: int) -> Floats:
    result = np.zeros(count)
    np.maximum.at(result, row.owner, peak)
    return result
