"""The whole of the second witness: read, place, walk, compare, and say what was not compared."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from time import process_time

import numpy as np

from postproc.witness.clamps import check_clamps, other_limits
from postproc.witness.clfile import commanded
from postproc.witness.commanded import LINE, RAPID, Commanded, tools_of, unit, with_spindle
from postproc.witness.errors import ErrorChain, error_chain
from postproc.witness.evidence import Aspect, Case, Compared, ExecutedBlocks, Finding, NotCompared, Testimony
from postproc.witness.machine import ROD, Chain, Rods, kinematics_of, largest_feed, merged
from postproc.witness.motion import Walked, check_arcs, check_path
from postproc.witness.place import CHUNK, Cut, Poses, Unplaced, cut_of, placement, zero_of
from postproc.witness.sides import check_sides
from postproc.witness.splines import check_curves
from postproc.witness.states import check_feeds, check_holes, check_states, check_velocities
from postproc.witness.stretches import BOTTOM, Targets, is_cut, matched, targets_of, turns_of
from postproc.witness.text import Array
from postproc.witness.turning import check_turning

REST = 2e-3
"""s"""
ZERO = 1e-6
"""mm that reckoning may move the zero of the work offset"""


def testify(case: Case, executed: ExecutedBlocks) -> Testimony:
    """What this witness says of an executed program; it never raises for what it does not understand."""
    began = process_time()
    try:
        c = with_spindle(commanded(case.cl(), case.units, case.dialect, case.cl_lines), case.setup)
        place = placement(case.setup, c)
        c = c if case.chosen is None else _reoriented(c, case.chosen)
    except Unplaced as fault:
        return _nothing(f"system {fault} was not found", began)
    except ValueError:
        return _nothing("the tool axes were chosen, and the file has more or fewer positions for this reading", began)
    table = merged(case.machine)
    if (turn := case.setup.get("turn")) and isinstance(nominal := kinematics_of(table), Chain):
        place = nominal.turned(place, turn)
    missing = [NotCompared("record", what, line) for what, line in c.unread.items()]
    missing += [] if case.chosen is None else [NotCompared("choice of tool axes", "--orient")]
    if not len(c) or not c.known.any():
        return _nothing("no position was understood", began, missing)
    machine = _machine(case, table)
    if machine is None:
        missing.append(NotCompared("kinematics", "rods with such geometric errors: poses of the read-back"
                                   if case.errors else "no machine file of a known kind: poses of the read-back"))
    poses = Poses(case, executed, machine, [], max(int(tools_of(c, case.setup).max(initial=0)), 0))
    with np.errstate(all="ignore"):
        targets, cut = _targets(case, c, place)
        c = c.without_poses()
        found, worst, counts, silent = _compare(case, executed, c, place, targets, cut, poses, table)
    compared = tuple(Compared(what, n) for what, n in counts.items() if n)
    return Testimony(compared, (*missing, *silent), tuple(found), int(c.known.sum()), *worst, process_time() - began)


def _reoriented(c: Commanded, axes: Array) -> Commanded:
    """With other tool axes: balls and corners touch where they did, arcs stay where they are; a tool that is turned and ends
    otherwise is not known. A straight cut whose tip goes farther or less far for it takes the time that it had."""
    turned = np.abs(axes - c.axis).max(axis=1) > 1e-12
    surface = _surface(c, axes, turned & (c.flat > 0.0))
    move = np.where(turned[:, None], _corner(c, c.axis, surface) - _corner(c, axes, surface), 0.0)
    centre, arcs = c.centre.copy(), np.flatnonzero(c.arc >= 0)
    centre[c.arc[arcs]] += move[arcs]
    return replace(c, tip=c.tip + move, axis=np.where(turned[:, None], axes, c.axis), centre=centre,
                   known=c.known & np.isfinite(move).all(axis=1), feed=c.feed * _longer(c, turned, move))


def _corner(c: Commanded, axes: Array, surface: Array) -> Array:
    """(N, 3) from tips along `axes` to the centre of ball or corner next to where it touches a surface of such normals."""
    centre = c.corner[:, None] * axes
    cornered = np.flatnonzero(c.flat > 0.0)
    if len(cornered):
        a, n = axes[cornered], surface[cornered]
        centre[cornered] += c.flat[cornered, None] * unit(a * (a * n).sum(axis=1, keepdims=True) - n)
    return centre


def _surface(c: Commanded, axes: Array, wanted: Array) -> Array:
    """(N, 3) normals: a rapid without one that turns with a cut has that of the cut it draws back from, or of the next."""
    lacking = np.flatnonzero(wanted & np.isnan(c.surface[:, 0]) & (c.kind == RAPID))
    stated = np.flatnonzero(~np.isnan(c.surface[:, 0]))
    if not len(lacking) or not len(stated):
        return c.surface
    surface, at = c.surface.copy(), np.searchsorted(stated, lacking)
    before, behind = stated[np.maximum(at - 1, 0)], stated[np.minimum(at, len(stated) - 1)]
    drawn = (before == lacking - 1) & (c.kind[before] != RAPID) & (np.abs(axes[before] - axes[lacking]).max(axis=1) < 1e-9)
    surface[lacking] = c.surface[np.where(drawn, before, behind)]
    return surface


def _longer(c: Commanded, turned: Array, move: Array) -> Array:
    """(N,) how far the tip goes over how far it went in straight cuts between poses that are turned, else 1."""
    ratio, now = np.ones(len(c)), c.tip + move
    old, new = (np.sqrt((np.diff(tip, axis=0) ** 2).sum(axis=1)) for tip in (c.tip, now))
    cuts = (c.kind[1:] == LINE) & (turned[1:] | turned[:-1]) & ~c.inverse[1:] & (np.minimum(old, new) > 1e-6)
    ratio[1:][cuts] = new[cuts] / old[cuts]
    return np.where(np.abs(ratio - 1.0) > 1e-9, ratio, 1.0)


def _machine(case: Case, table: dict[str, object]) -> Chain | ErrorChain | Rods | None:
    """With its errors where the program corrects them; None where this witness does not know it."""
    if not case.errors:
        return kinematics_of(table)
    return error_chain(table, case.error_model, case.error_tables) if case.error_model else None


def _nothing(why: str, began: float, missing: Sequence[NotCompared] = ()) -> Testimony:
    return Testimony((), (NotCompared("all", why), *missing), seconds=process_time() - began)


def _targets(case: Case, c: Commanded, place: tuple[Array, Array]) -> tuple[Targets, Cut | None]:
    """What the program has to come to, and what is cut, in the table frame."""
    rotation, origin = place
    turn = np.ascontiguousarray(rotation.T)
    tip, axis = _behind_itself(c.tip, turn, origin), _behind_itself(c.axis, turn, np.zeros(3))
    centre, normal = c.centre @ turn + origin, c.normal @ turn
    splines = {row: points @ turn + origin for row, points in c.splines.items()}
    targets = targets_of(c, tip, axis, centre, normal, splines)
    return targets, cut_of(case, c, tip[1:], axis[1:], centre, normal, splines, place) if len(targets) else None


def _behind_itself(values: Array, turn: Array, origin: Array) -> Array:
    """(N + 1, 3) points or directions (N, 3) turned and moved, and before them the first once more."""
    result = np.empty((len(values) + 1, 3))
    for first in range(0, len(values), CHUNK):
        x, y, z = values[first:first + CHUNK].T[:, :, None]
        result[first + 1:first + 1 + CHUNK] = x * turn[0] + y * turn[1] + z * turn[2] + origin
    result[:1] = result[1:2]
    return result


def _compare(case: Case, executed: ExecutedBlocks, c: Commanded, place: tuple[Array, Array], targets: Targets,
             cut: Cut | None, poses: Poses, table: dict[str, object],
             ) -> tuple[list[Finding], tuple[float, float], dict[Aspect, int], list[NotCompared]]:
    if not len(targets):
        return [], (0.0, 0.0), {}, []
    there, along = poses.at(np.arange(len(executed)), 1.0)
    turns = turns_of(poses)
    match, owner = matched(targets, there, along, turns, case.tolerance + 1e-6, case.axis_tolerance + 1e-6)
    found: list[Finding] = []
    lost = np.flatnonzero(match < 0)
    if len(lost):
        i = int(lost[0])
        last = int(match[i - 1]) if i else 0
        x, y, z = targets.tip[i]
        found.append(Finding("position", f"the program does not come to ({x:.4f}, {y:.4f}, {z:.4f}) mm of the table frame"
                             + _arriving(targets.axis[i]), int(c.line[targets.row[i]]), int(executed.line[last]), len(lost)))
    w = Walked(poses, targets, owner, there, along, (case.tolerance, case.axis_tolerance))
    w.measure()
    clearance = case.setup.get("clearance") or {}
    flat = clearance.get("in_plane") is True and isinstance(rods := kinematics_of(table), Rods) and rods.flat
    if not len(lost):
        found += check_path(w, c.line, cut, float(clearance.get("margin", 50.0)), float(clearance.get("link_angle", 5.0)),
                            case.bent_rapids, table, bool((case.setup.get("output") or {}).get("rapids_as_feed")), flat)
        found += check_arcs(w, turns, c.line)
    faults, rests = check_rests(w, c, match) if not len(lost) else ([], 0)
    found += faults
    faults, holes = check_holes(w, c, case, match, largest_feed(table))
    found += faults
    faults, feeds = check_feeds(w, c, case, table, match)
    found += faults
    found += check_velocities(w, c, table)
    faults, states, silent = check_states(w, c, case)
    found += faults
    faults, sides = check_sides(w, c, case)
    found += faults
    found += _misfits(poses)
    checks = check_turning(case, executed), check_curves(case, executed), _held_spins(w, c, case)
    (_, turned), (_, curves), (_, held) = checks
    found += [fault for faults, _ in checks for fault in faults]
    faults, clamped = check_clamps(case, executed, w.inside & (w.code > 0) & is_cut(w.kind) & (w.on_path() | w.returns))
    found += faults
    if case.limits is not None:
        found += [Finding("limits", what, 0, 0) for what in other_limits(table, executed.letters, case.limits)]
    faults, zeros = _zero(case, c, place, poses)
    found += faults
    good = w.on_path() & is_cut(w.kind)
    worst = float(w.away[good].max(initial=0.0)), float(w.tilt[good].max(initial=0.0))
    counts: dict[Aspect, int] = {
        "positions": int((match >= 0).sum()), "arcs": int((targets.sweep != 0.0).sum()), "holes": holes, "feeds": feeds,
        **states, "cutter compensation": sides, "rests and stops": rests, "work offset": zeros,
        "turns of modulo axes": turned, "clamps": clamped, "curves": curves, "turns of tools about themselves": held}
    return found, worst, counts, silent


def _zero(case: Case, c: Commanded, place: tuple[Array, Array], poses: Poses) -> tuple[list[Finding], int]:
    """The zero of the work offset, and the joints that it holds, against set-up and CL file; 1 where it was compared."""
    wanted = zero_of(case.setup, c, place)
    if wanted is None or case.origin is None:
        return [], 0
    off = float(np.abs(case.origin - wanted).max())
    if off <= ZERO and case.work_offset is not None and isinstance(poses.machine, Chain):
        there = poses.machine.pose(case.work_offset[None], poses.executed.letters, np.zeros(1))[0]
        held = [math.degrees(q) - case.setup.get("measured", {}).get(name, 0.0) for name, q in zip(
            poses.executed.letters, case.work_offset.tolist(), strict=True) if name in "ABC"]
        off = float(np.abs([*(there[0] - wanted), *held]).max())
    if off <= ZERO:
        return [], 1
    return [Finding("offset", f"the work offset is {off:.6f} mm off the system of the CL file that it is for", 0, 0)], 1


def _arriving(axis: Array) -> str:
    return "" if axis[2] == 1.0 else f" along ({axis[0]:.6f}, {axis[1]:.6f}, {axis[2]:.6f})"


def _held_spins(w: Walked, c: Commanded, case: Case) -> tuple[list[Finding], int]:
    """Cuts with a tool that `keeps_spin` whose platform turns it about itself; how many blocks were compared."""
    e, machine, tools = w.poses.executed, w.poses.machine, case.setup.get("tools", {})
    keeps = [int(n) for n, tool in tools.items() if (tool or {}).get("keeps_spin")]
    if not keeps or not isinstance(machine, Rods) or machine.turns != "abc":
        return [], 0
    rows = np.flatnonzero(w.on_path() & is_cut(w.kind) & np.isin(e.tool, keeps))
    if not len(rows):
        return [], 0
    spins = np.abs(machine.spins(w.poses.joints(rows, 1.0), e.letters, w.tip[rows], w.axis[rows], w.poses.lengths(rows)))
    bad = np.flatnonzero(~(spins <= case.axis_tolerance))
    if not len(bad):
        return [], len(rows)
    k = int(rows[bad[0]])
    said = f"the tool is turned by {np.degrees(spins[bad[0]]):.4f} degrees about itself, and keeps_spin holds it"
    return [Finding("spin", said, int(c.line[w.targets.row[w.owner[k]]]), int(e.line[k]), len(bad))], len(rows)


def _misfits(poses: Poses) -> list[Finding]:
    """Rods that miss their length where the tool is said to be; a machine with errors that has it elsewhere."""
    worst = max(poses.misfits, default=(0.0, 0))
    if worst[0] <= ROD:
        return []
    if isinstance(poses.machine, ErrorChain):
        return [Finding("errors", f"the machine with its geometric errors has the tool {worst[0]:.6f} mm from where "
                        "it is said to be", 0, int(poses.executed.line[worst[1]]))]
    said = f"rods miss their length by {worst[0]:.6f} mm"
    if math.isinf(worst[0]):
        said = "a carriage stands on the wrong side of its rod"
    return [Finding("rods", f"{said} where the tool is said to be", 0, int(poses.executed.line[worst[1]]))]


def check_rests(w: Walked, c: Commanded, match: Array) -> tuple[list[Finding], int]:
    """Rests of another length and stops that the program lacks; how many were compared."""
    e, found, count = w.poses.executed, list[Finding](), len(c.stops)
    where = np.array([at for at, _ in e.stops])
    rests, asked, taken = dict[tuple[int, int], float](), dict[tuple[int, int], int](), set[int]()
    for row, seconds, line in c.rests:
        here = _between(w, match, row)
        rests[here] = rests.get(here, 0.0) + seconds
        asked.setdefault(here, line)
    for (first, last), seconds in rests.items():
        drilled = first >= 0 and w.targets.kind[np.searchsorted(match, first, side="right") - 1] == BOTTOM
        given = float(e.dwell[max(first + int(drilled), 0):last].sum())
        count += seconds == seconds
        if abs(given - seconds) > REST + 0.01 * seconds:
            found.append(Finding("rest", f"the tool rests for {given:g} s here, the CL file says {seconds:g} s",
                                 asked[first, last], int(e.line[max(first, 0)])))
    for row, kind, line in c.stops:
        first, last = _between(w, match, row)
        own = [k for k in range(*np.searchsorted(where, (first, last), "right")) if e.stops[k][1] == kind and k not in taken]
        taken.update(own[:1])
        if not own:
            found.append(Finding("rest", f"the program has no M{kind:g} here, where the CL file stops", line,
                                 int(e.line[max(first, 0)])))
    return found, count


def _between(w: Walked, match: Array, row: int) -> tuple[int, int]:
    """(block that ends at the last position before a row, -1; block that ends at the first one behind it, or all)."""
    at = int(np.searchsorted(w.targets.row, row))
    first = int(match[at - 1]) if at else -1
    behind = int(np.searchsorted(match, first, side="right"))
    return first, int(match[behind]) if behind < len(match) else len(w.owner)
