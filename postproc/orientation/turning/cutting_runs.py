"""Cuts between rapids whose tool axis may be turned along it, or why it may not."""

from __future__ import annotations

from dataclasses import field, replace
from itertools import pairwise

import numpy as np

from postproc.feedrate.feed import StepFeed
from postproc.orientation.passes.contact import Contact
from postproc.orientation.passes.passes import Pass, PassContext
from postproc.orientation.passes.poses import poses
from postproc.orientation.turning.kept_contact import corner_centre, kept_tip
from postproc.orientation.turning.run_contact import contact_along
from postproc.planning.geometry_sites import sites
from postproc.planning.pass_geometry import stops_of
from postproc.reference.cutter import CutterEnd, cutter_end
from postproc.reference.events import compensation_states
from postproc.setup.orientation import OrientationLimits
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shapes import arrays
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth_all
from toolpaths.toolpath import Kind, Role
from toolpaths.units import DEG

TURNS = 1e-6
"""rad: axes that differ by less are one"""
UNKNOWN_SURFACE = "lead, tilt and distance from the centre need surface normals, and none is known"
LEAN = (1.0 * DEG, 85.0 * DEG)
"""rad between axis and normal within which a corner touches the surface at one point, with a margin"""
PLANE = 1e-4, 1e-3
"""rad between normals, mm between contacts across: within both a cut is on a plane"""
PLAIN = 40
"""G40: no compensation of the radius"""


@dataclass(frozen=True)
@arrays(s="N", tip="N 3", axis="N 3", q="N J")
class TurningStretch:
    """Motion from stop to stop: sites s (N,) along the run, the smoothed tip and axis (N, 3) there, the joints (N, J) of
    the CL file's own axes, and the feed along s."""

    s: Floats
    tip: Floats
    axis: Floats
    q: Floats
    feed: StepFeed


@dataclass(frozen=True)
@arrays(s="N", tip="N 3", axis="N 3", line="N", normal="N 3")
class CuttingRun:
    """Cuts between two rapids, the pose they begin at with them, in the table frame.

    Attributes:
        number: 0, 1, ... in the order of the file
        rows: [first, last) of Moves of the cuts
        s (N,): mm along the run at the pose it begins at and at the end of every cut
        tip, axis (N, 3): these poses
        line (N,): of the CL file
        whole: the pass that it belongs to
        cone: rad by which an axis may be turned
        limits: of the operation
        end: of the cutter
        normal (N, 3): of the surface at the poses, where the cutter is no ball
        fixed: why its axes stay, "" where they may be turned
        contact: where the surface is known, `line` the number of the pose; looked at where the axes may turn
        stretches: between stops; none where `fixed`
    """

    number: int
    rows: tuple[int, int]
    s: Floats
    tip: Floats
    axis: Floats
    line: Ints
    whole: Pass
    cone: float
    limits: OrientationLimits
    end: CutterEnd
    normal: Floats
    fixed: str = ""
    contact: Contact = field(default_factory=Contact.none)
    stretches: tuple[TurningStretch, ...] = ()

    @property
    def length(self) -> float:
        """mm along the run, turns of the axis with it"""
        return float(self.s[-1])

    def normal_at(self, s: Floats) -> Floats:
        """(M, 3) normals of the surface at s (M,), turned evenly from pose to pose; 0 of a ball, which needs none."""
        if self.end.flat == 0.0:
            return np.zeros((len(s), 3))
        found = np.stack([np.interp(s, self.s, column) for column in self.normal.T], axis=1)
        return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))

    def kept(self, tip: Floats, axis: Floats, turned: Floats, normal: Floats) -> Floats:
        """(M, 3) tips along axes `turned` (M, 3) that touch where `tip`, `axis` (M, 3) do."""
        return kept_tip(tip, axis, turned, self.end, normal)

    @property
    def turns(self) -> float:
        """rad that its axis turns in all"""
        return float(angle_between(self.axis[:-1], self.axis[1:]).sum())


def runs_of(work: PassContext, tolerance: Tolerance, most: float) -> list[CuttingRun]:
    """All runs of a toolpath; `most`: rad that no axis is turned by more."""
    found = _rows(work)
    stops = stops_of(work.toolpath, work.moves)
    first = np.array([one.rows[0] for one in work.passes])
    result = []
    for number, (low, high) in enumerate(found):
        whole = work.passes[int(np.searchsorted(first, low, side="right")) - 1]
        limits = work.setup.orientation.of(_operation(work, low))
        cone = min(np.radians(limits.cone or 0.0), most)
        tool = work.toolpath.tools[whole.tool] if whole.tool >= 0 else None
        end, normal = cutter_end(tool), _normals(work, low, high)
        run = CuttingRun(number, (low, high), np.zeros(high - low + 1), work.moves.tip[low - 1:high],
                         work.moves.axis[low - 1:high], work.moves.line[low - 1:high], whole, cone, limits,
                         end or CutterEnd(0.0, 0.0), normal)
        if not (why := _fixed(work, run) or _by_cutter(work, run, end)):
            run = replace(run, contact=_contact(work, run))
            why = UNKNOWN_SURFACE if limits.need_normals and not len(run.contact) else ""
        result.append(replace(run, fixed=why) if why else _with_stretches(work, run, stops, tolerance))
    return result


def _contact(work: PassContext, run: CuttingRun) -> Contact:
    rows = work.moves.row[run.rows[0] - 1:run.rows[1]]
    return contact_along(work, rows, run.tip + corner_centre(run.axis, run.end, run.normal), run.whole.radius)


def _normals(work: PassContext, low: int, high: int) -> Floats:
    """(N, 3) normals that the file states at the pose before rows [low, high) of Moves and at their ends, else NaN."""
    if work.toolpath.normal is None:
        return np.full((high - low + 1, 3), np.nan)
    return work.placement.directions(work.toolpath.normal[work.moves.row[low - 1:high]])


def _rows(work: PassContext) -> list[tuple[int, int]]:
    """[first, last) of cuts between rapids, links and holes."""
    moves = work.moves
    cuts = (moves.kind != Kind.RAPID) & ~moves.link & (moves.hole < 0)
    cuts[:1] = False
    edges = np.flatnonzero(np.diff(np.concatenate(([False], cuts, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _operation(work: PassContext, row: int) -> str:
    return work.toolpath.operations[int(work.toolpath.operation[work.moves.row[row]])].name


def _fixed(work: PassContext, run: CuttingRun) -> str:
    """Why the axes of a run stay as they are; "" where they need not."""
    moves, (low, high) = work.moves, run.rows
    here, rows = slice(low, high), work.moves.row[low:high]
    if run.cone <= 0.0:
        return "[orientation] of the set-up states no cone for it"
    if _operation(work, low) in work.setup.orientation.fixed_operations:
        return f"the set-up keeps the axis of operation {_operation(work, low)!r}"
    if bool((moves.arc[here] >= 0).any()):
        return "it has arcs: the tip of a ball whose axis turns leaves them"
    if bool((work.toolpath.role[rows] == Role.CUBIC).any()):
        return "it has splines that the control runs itself"
    if bool((np.diff(moves.row[low - 1:high]) != 1).any()) or bool((moves.tool[here] != moves.tool[low]).any()):
        return "its records are not one cut"
    if bool((moves.link[low - 1:low] & (moves.hole[low - 1:low] >= 0)).any()) or moves.hole[low - 1] >= 0:
        return "it begins at a hole"
    if bool(np.isfinite(moves.spin[low - 1:high]).any()):
        return "the tool is held about its axis"
    if bool((compensation_states(work.toolpath)[rows] != PLAIN).any()):
        return "the control compensates the radius of the cutter there"
    return "packages limit its axis (criteria)" if run.limits.criteria else ""


def _by_cutter(work: PassContext, run: CuttingRun, end: CutterEnd | None) -> str:
    """Why its cutter holds the axes of a run: turned, it would touch elsewhere, or cut what nobody compares; "" if not.

    Cutters that touch a plane touch it along every axis between `LEAN`. On a curved surface what is next to the
    contact may reach into a toroid that leans otherwise: the program's proof looks for that where the part is stated.
    """
    if end is None:
        return "the cutter is not known to end in a ball, or in a corner round a flat: turned, it would touch elsewhere"
    if end.flat == 0.0:
        return "" if run.whole.radius > 0.0 else "the cutter has no size"
    if not np.isfinite(run.normal).all():
        return "the cutter is not a ball: turned, it keeps its contact only where the file states surface normals"
    lean = angle_between(run.axis, run.normal)
    if lean.min() < LEAN[0] or lean.max() > LEAN[1]:
        return "the cutter is not a ball, and stands square to the surface or along it: it does not touch at one point"
    contact = run.tip + corner_centre(run.axis, end, run.normal) - end.corner * run.normal
    across = np.abs((contact - contact[0]) @ run.normal[0])
    if float(angle_between(run.normal, run.normal[:1]).max()) <= PLANE[0] and float(across.max()) <= PLANE[1]:
        return ""
    if end.corner == 0.0:
        return "a flat end keeps its contact on planes alone"
    bodies = work.setup.bodies
    return "" if bodies is not None and bodies.part is not None else (
        "a toroid on a curved surface is turned only where the part is stated, with which its program is compared: "
        "[bodies] part")


def _with_stretches(work: PassContext, run: CuttingRun, stops: Ints, tolerance: Tolerance) -> CuttingRun:
    """With its motion between stops on the joints of its own axes, or why it has none."""
    low, high = run.rows
    inside = stops[(stops > low) & (stops < high)]
    parts = list(pairwise([low, *inside.tolist(), high]))
    begin = np.concatenate(([0], np.cumsum([last - first for first, last in parts])))
    smoothed = smooth_all(work.moves.curves().take(np.arange(low, high)), begin, tolerance)
    s, found, at = [np.zeros(1)], list[tuple[Smooth, StepFeed, float, float, float]](), 0.0
    for (first, last), path in zip(parts, smoothed, strict=True):
        if path is None:
            s.append(np.full(last - first, at))
            continue
        feed = _feed(work, path, (first, last), at)
        if feed is None:
            return replace(run, fixed="its cuts have no feed")
        ends = np.unique(np.concatenate((path.s[:1], path.stops, path.s[-1:])))
        found += [(path, feed, at, begins, end) for begins, end in pairwise(ends.tolist())]
        s.append(path.s[1:] + at)
        at += float(path.s[-1])
    if not found:
        return replace(run, fixed="its cuts have no length")
    return _on_joints(work, replace(run, s=np.concatenate(s)), found)


def _feed(work: PassContext, path: Smooth, rows: tuple[int, int], shift: float) -> StepFeed | None:
    """Largest ds/dt along s, so that every cut takes the time that the file gives it; None where it gives none."""
    moves, here = work.moves, slice(*rows)
    travel, tips = np.diff(path.s), np.linalg.norm(np.diff(moves.tip[rows[0] - 1:rows[1]], axis=0), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        seconds = np.where(np.isnan(moves.feed[here]), moves.seconds[here],
                           np.where(tips > 0.0, tips, travel) / moves.feed[here])
    moving: Bools = (travel > 0.0) & (seconds > 0.0)
    if not moving.any():
        return None
    edges = np.append(path.s[0], path.s[1:][moving]) + shift
    return StepFeed(edges, travel[moving] / seconds[moving])


def _on_joints(work: PassContext, run: CuttingRun, found: list[tuple[Smooth, StepFeed, float, float, float]]) -> CuttingRun:
    """With its stretches, all on one branch."""
    kin = run.whole.kin
    at = [sites(path, first, last) for path, _, _, first, last in found]
    posed = [path.at(s) for (path, *_), s in zip(found, at, strict=True)]
    tips, axes = [tip for tip, _ in posed], [kin.nearest_axis(axis) for _, axis in posed]
    q, refused = poses(run.whole, work.machine, np.concatenate(tips), np.concatenate(axes))
    if refused is not None:
        return replace(run, fixed=f"its own axes cannot be run in one go: {refused}")
    joints = np.split(q, np.cumsum([len(s) for s in at])[:-1])
    columns = zip(found, at, tips, axes, joints, strict=True)
    return replace(run, stretches=tuple(TurningStretch(s + shift, tip, axis, own, feed)
                                        for (_, feed, shift, _, _), s, tip, axis, own in columns))
