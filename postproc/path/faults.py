"""What stands against a path, as diagnostics."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.control.control import Control
from postproc.joints.spin import spins_off
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.reference.moves import Moves
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Kind
from toolpaths.units import DEG

_ELSEWHERE = 1e-3
"""mm: a tip that its joints miss by more is not reached"""

_ASIDE = 1e-6
"""mm off the plane of a machine that moves in one"""


def merged(diagnostics: list[Diagnostic]) -> list[Diagnostic]:
    """Diagnostics of the same code and message as one, with the lines of all."""
    groups: dict[tuple[object, ...], list[Diagnostic]] = {}
    for d in diagnostics:
        groups.setdefault((d.severity, d.code, d.message, d.file, d.hint), []).append(d)
    result = []
    for group in groups.values():
        head = group[0]
        lines = tuple(n for d in group for n in d.lines)[:6]
        result.append(Diagnostic(head.severity, head.code, head.message, head.file, lines,
                                 sum(d.count for d in group), head.hint))
    return result


def moved_axes(moves: Moves, rows: Ints, moved: Floats, file: str) -> list[Diagnostic]:
    """What is reported of tool axes that were moved by `moved` (K,) rad onto directions that the machine can take."""
    if not bool((moved > 1e-6).any()):
        return []
    where = rows[moved > 1e-6]
    return [info("axis.moved", "tool axis moved onto the directions that the machine can take, within the axis "
                 "tolerance", file=file, lines=moves.line[where][:6].tolist(), count=len(where))]


def unreachable(control: Control, kin: Kinematics, moves: Moves, rows: Ints, axis: Floats, q: Floats,
                 file: str) -> list[Diagnostic]:
    """Errors at poses `rows` (K,) for which q (K, J) is no solution."""
    bad = np.flatnonzero(~np.isfinite(q).all(axis=1) | _elsewhere(kin, moves.tip[rows], q))
    if not len(bad):
        return []
    name = control.machine.name
    nearest = kin.nearest_axis(axis[bad])
    off = angle_between(nearest, axis[bad])
    worst = int(off.argmax())
    lines = moves.line[rows[bad]]
    if off[worst] > 1e-9:
        i, j, k = axis[bad][worst]
        hint = "turn the part in the set-up (part.x_axis, part.y_axis)" + (
            "" if any(kin.turns_tool) else f"; {name} has no rotary axis, so every operation needs its own set-up")
        return [error("reach.axis", f"{name} cannot take the tool axis ({i:.6f}, {j:.6f}, {k:.6f}): its nearest "
                      f"direction is {off[worst] / DEG:.4f} degrees away", file=file,
                      lines=[int(lines[worst]), *lines[:5].tolist()], count=len(bad), hint=hint)]
    x, y, z = moves.tip[rows[bad[0]]]
    if off_plane := _off_plane(control.machine, kin, moves.tip[rows], lines[:6].tolist(), len(bad), file):
        return off_plane
    return [error("reach.position", f"{name} cannot reach the tip position ({x:.4f}, {y:.4f}, {z:.4f}) mm of the table "
                  "frame with that tool axis", file=file, lines=lines[:6].tolist(), count=len(bad),
                  hint="move the part in the set-up (part.origin)")]


def _off_plane(machine: Machine, kin: Kinematics, tip: Floats, lines: list[int], count: int, file: str) -> list[Diagnostic]:
    """The error where tips (N, 3) are off the one plane in which a machine moves them."""
    if kin.plane is None:
        return []
    gap = (kin.forward(machine.home[None])[0] - tip) @ kin.plane
    worst = int(np.abs(gap).argmax())
    if abs(gap[worst]) <= _ASIDE:
        return []
    (x, y, z), across = tip[worst], float(np.ptp(gap))
    shift = (np.round(gap[worst] * kin.plane, 4) + 0.0).tolist()
    return [error("reach.plane", f"the tip position ({x:.4f}, {y:.4f}, {z:.4f}) mm of the table frame is "
                  f"{abs(gap[worst]):.4f} mm off the plane in which {machine.name} moves the tip of this tool", file=file,
                  lines=lines, count=count, hint=f"add {shift} to part.origin of the set-up; tools of other gauge lengths "
                  "are then off that plane" if across <= _ASIDE else
                  f"the path leaves every plane, by {across:.4f} mm: take a machine with a slide that leaves it")]


def spun(kin: Kinematics, moves: Moves, rows: Ints, axis: Floats, q: Floats, tolerance: float,
         file: str) -> list[Diagnostic]:
    """Poses at which the tool should be held about its axis, and no rotary joint can do so; `tolerance` in rad."""
    off = spins_off(kin, q, moves.tip[rows], axis, moves.spin[rows])
    bad = np.flatnonzero(off > tolerance)
    if not len(bad):
        return []
    return [error("axis.spin", f"the tool is to be turned about its own axis, which no rotary axis can do here: it is "
                  f"{off[bad].max() / DEG:.4f} degrees off", file=file, lines=moves.line[rows[bad]][:6].tolist(),
                  count=len(bad), hint="leave Toolpath.spin out where the tool is not along a rotary axis all the pass")]


def _elsewhere(kin: Kinematics, tip: Floats, q: Floats) -> Bools:
    """(N,) True where a parallel machine is assembled so that its joints bring the tool to another place than the tip."""
    if kin.straight_slides:
        return np.zeros(len(tip), dtype=np.bool_)
    there, _ = kin.forward(q)
    return np.asarray(~(np.linalg.norm(there - tip, axis=1) <= _ELSEWHERE))


def no_path(machine: Machine, moves: Moves, row: int, file: str, lower: str, home: Floats | None = None) -> Diagnostic:
    """The error where no linking move leads to row `row` of the moves; `home` (3,): tip at home, if that is in the part;
    `lower`: what brings linking moves down."""
    if machine.kinematics.plane is not None:
        return error("link.in_plane", f"{machine.name} moves the tool in one plane alone, so no linking move leaves what is "
                     "cut", file=file, lines=[int(moves.line[row])], hint="write in_plane = true under [clearance] of "
                     "the set-up where the tool is lifted or switched off by other means: linking moves then go straight in "
                     "that plane; or give the machine file a slide that leaves it ([kinematics.carriers.Z])")
    if home is not None:
        x, y, z = np.round(home, 3) + 0.0
        return error("link.home", f"home of {machine.name} is inside what is cut: there the tip of the tool is at ({x:.3f}, "
                     f"{y:.3f}, {z:.3f}) mm of the table frame, and tool changes and both ends of the program go by home",
                     file=file, lines=[int(moves.line[row])],
                     hint="move the part away from home (part.origin), or state another home in the machine file")
    return error("link.blocked", "no linking move stays above the safe planes", file=file, lines=[int(moves.line[row])],
                 hint=f"move the part in the set-up (part.origin), or {lower}")


def broken(machine: Machine, moves: Moves, rows: Ints, q: Floats, file: str) -> list[Diagnostic]:
    """Moves `rows` (K,) that no number of points keeps on their path; `q` (2, K, J) joints where they begin and end.

    Outside travel the plan takes whatever comes: there it is travel that is short.
    """
    excess = np.maximum(machine.limits.lower - q, q - machine.limits.upper).max(axis=0)
    short = excess.max(axis=1, initial=0.0) > TRAVEL_SLACK
    result = []
    for name, at, rotary, lower, upper, over in zip(machine.axis_names, np.moveaxis(q, 2, 0), machine.rotary,
                                                    machine.limits.lower, machine.limits.upper, excess.T, strict=True):
        bad = np.flatnonzero(over > TRAVEL_SLACK)
        if len(bad):
            unit, what = (1.0 / DEG, "degrees") if rotary else (1.0, "mm")
            worst = bad[over[bad].argmax()]
            value = max(at[:, worst].tolist(), key=lambda v: max(lower - v, v - upper))
            result.append(error("travel.exceeded", f"axis {name} goes to {value * unit:.4f} {what}, allowed "
                                f"{lower * unit:.4f} to {upper * unit:.4f} {what}", file=file,
                                lines=moves.line[rows[bad]][:6].tolist(), count=len(bad),
                                hint="turn or move the part in the set-up, or split the operation"))
    jumps = rows[~short]
    if len(jumps):
        result.append(error("path.jump", "the rotary axes jump here: no points between keep the tool on its path",
                            file=file, lines=moves.line[jumps][:6].tolist(), count=len(jumps),
                            hint="retract before this point, or change the tool axis"))
    return result


def off_line(code: Array, u: Floats, move: Ints, seconds: Floats, moves: Moves, file: str,
             rapids_as_feed: bool, by_tip: bool) -> list[Diagnostic]:
    """Rapids that are feed moves (code 1, no time of their own), as the control would leave their line; an error where that
    is not asked for. `u` (K,) is NaN for linking blocks; `by_tip`: control and machine have the tip's mode."""
    rows = np.flatnonzero((code == 1) & (seconds == 0.0) & ((moves.kind[move] == Kind.RAPID) | np.isnan(u)))
    if not len(rows):
        return []
    lines = np.unique(moves.line[move[rows]])
    if rapids_as_feed:
        return [info("feed.rapid_as_feed", "G0 of several axes output as G1 (dog-leg rapids), at the speed of the slowest "
                     "axis: the control's rapids would leave the straight line", file=file, lines=lines[:6].tolist(),
                     count=len(lines))]
    return [error("rapid.off_line", "a rapid of several axes would leave its line, each axis running at its own speed "
                  "(dog-leg), and no safe path of single axes is known", file=file, lines=lines[:6].tolist(),
                  count=len(lines), hint='write rapids = "straight" under [control] of the machine file where the control '
                  "keeps rapids straight (Fanuc 1401#1 LRP = 1, Haas setting 335), or rapids_as_feed = true under [output] "
                  "of the set-up for G1 at the speed of the slowest axis"
                  + ", or convert with --output-mode tcp" * by_tip)]
