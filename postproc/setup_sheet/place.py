"""A place of the part that travel allows: where [part] has it, else the place of most margin, proved by a conversion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from machines.machine import Machine
from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.control.modes import table_axes
from postproc.orientation.passes.passes import PassContext, work_of
from postproc.path.links import safe_space
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.placement.region import region_of
from postproc.placement.space import ANGLES, Space, angles_of, space_of
from postproc.setup.model import PartPlacement, Placement, SetupFile
from postproc.setup.place import PlacementLimits
from postproc.setup.system import BEYOND
from postproc.setup_sheet.attitudes import Attitude, attitudes_of
from postproc.setup_sheet.odd_record import odd_record
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, info
from toolpaths.rotations import squared
from toolpaths.toolpath import Kind, Toolpath
from toolpaths.units import DEG

PLACES = frozenset({*BEYOND, "link.blocked", "link.home", "path.jump", "reach.axis", "singular.distance", "verify.link",
                    "verify.travel", "collision.clear"})
"""codes of errors that another place or attitude may put right"""
_ATTITUDES, _PROOFS = 12, 6
"""attitudes that are looked at; conversions before giving up"""
_ROUND, _NOISE = 2.0, 1e-6
"""mm of margin from which a place is rounded to whole mm, below it where that costs none; margins that are one"""
_MOST = 20_000
"""rows of a path for which a refusal looks for a place by itself"""


@dataclass(frozen=True)
class FoundPlace:
    """[part] with its attitude, and mm that every axis stays inside travel there (NaN where none was computed)."""

    part: PartPlacement
    attitude: Attitude
    margin: float
    stated: bool = False
    """True: somebody has said where the part stands"""

    @property
    def why(self) -> str:
        """Why the part stands there."""
        if self.stated:
            return f"{self.attitude.why}; where it was said to stand"
        where = "origin on the table's origin" if np.isnan(self.margin) else (
            f"all axes stay {self.margin:.0f} mm inside travel" if self.margin >= 1.0 else "where travel allows it")
        return f"{self.attitude.why}; {where}"


@dataclass(frozen=True)
class Fit:
    """The set-up with a place that was proved, or the best that was tried with what stands against it.

    Attributes:
        place: None where [part] is that of the set-up
        tried: places that were converted
        lacks: of attitudes in which no place fits, why; what lacks least first
        nowhere: what was looked at, where that shows that no place is inside travel
    """

    setup: SetupFile
    result: PostResult
    place: FoundPlace | None
    tried: int
    lacks: tuple[str, ...]
    nowhere: str = ""


def fitted(toolpath: Toolpath, machine: Machine, controller: str | Path, setup: SetupFile, options: Options,
           found: list[Diagnostic], progress: Progress | None = None,
           origin: tuple[float, float, float] | None = None) -> Fit:
    """The first place that a conversion proves; arguments as of `convert`, `found` is what reading found, `origin` (mm) is
    where the part stands, where that is known: then only how it is turned is looked for."""
    def converted(one: SetupFile) -> PostResult:
        return convert(toolpath, machine, controller, one, options, list(found), progress)

    attitudes = attitudes_of(toolpath, machine, options.axis_tolerance * DEG)
    at = np.zeros(3) if origin is None else np.array(origin)
    begin = FoundPlace(_part(attitudes[0], at), attitudes[0], np.nan, origin is not None)
    first = converted(placed_at(setup, begin))
    if first.ok or not beyond(first):
        return Fit(placed_at(setup, begin), first, begin, 1, ())
    tried, lacks = 1, list[str]()
    turned = (FoundPlace(_part(one, at), one, np.nan, True) for one in attitudes[1:] if one.unreachable == 0.0)
    for place in turned if origin is not None else _places(toolpath, machine, setup, options, attitudes, lacks):
        result = converted(placed_at(setup, place))
        tried += 1
        if result.ok:
            return Fit(placed_at(setup, place), result, place, tried, tuple(lacks))
        if tried > _PROOFS:
            break
    nowhere = _nowhere(machine, attitudes) if tried == 1 and lacks and origin is None else ""
    return Fit(placed_at(setup, begin), first, begin, tried, tuple(lacks), nowhere)


def _nowhere(machine: Machine, attitudes: list[Attitude]) -> str:
    """What has been looked at where no attitude had a place: of slides along lines all places at once, by a linear
    program, so that it is proved; "" for other machines and where no attitude is reached."""
    count = min(sum(one.unreachable == 0.0 for one in attitudes), _ATTITUDES)
    if count == 0 or not machine.kinematics.straight_slides:
        return ""
    some = f"each of the {count} attitudes" if count > 1 else "the one attitude"
    return f"wherever the part stands, in {some} looked at it is outside travel"


def below_origin(fit: Fit) -> float:
    """mm that cuts reach below the origin of a table that turns, where the part was put on it; 0 elsewhere: a part on a
    table that does not turn is found by its work offset alone."""
    job = fit.result.job
    if job is None or not _turning_table(fit) or fit.place is None or fit.place.stated:
        return 0.0
    if not np.isnan(fit.place.margin):
        return 0.0
    cuts = job.moves.tip[job.moves.kind != Kind.RAPID]
    return max(0.0, -float((cuts @ job.machine.home_axis).min(initial=0.0)))


def _turning_table(fit: Fit) -> bool:
    """True where the program depends on where the part stands on the table."""
    return fit.result.job is not None and len(table_axes(fit.result.job.control)) > 0


def looked_for(fit: Fit) -> bool:
    """True where travel alone has chosen a place on a table that turns."""
    return fit.place is not None and not fit.place.stated and not np.isnan(fit.place.margin) and _turning_table(fit)


def placed_at(setup: SetupFile, place: FoundPlace) -> SetupFile:
    """The set-up with another [part]."""
    return setup.model_copy(update={"part": place.part})


def beyond(result: PostResult) -> bool:
    """True where every error may be one of the place."""
    return all(d.code in PLACES for d in result.diagnostics if d.severity is Severity.ERROR)


def odd_one(result: PostResult, toolpath: Toolpath) -> list[Diagnostic]:
    """The one record that no place puts right, where every error may be one of the place and there is one."""
    odd = odd_record(toolpath, _largest(result.machine)) if beyond(result) else None
    return [] if odd is None else [odd]


def found_place(result: PostResult, toolpath: Toolpath) -> list[Diagnostic]:
    """What `place` would find for a conversion that is refused by travel or reach: a note with [part], or why no place fits,
    or the one record that no place puts right; nothing for other refusals. `toolpath` is as it was read."""
    if result.ok or not beyond(result):
        return []
    if odd := odd_one(result, toolpath):
        return odd
    if len(toolpath) > _MOST:
        return [_note("postproc setup new looks for a place that fits", "")]
    setup = result.setup
    lacks = list[str]()
    attitudes = attitudes_of(toolpath, result.machine, result.options.axis_tolerance * DEG)
    options = replace(result.options, error_model="", orient="keep")
    place = next(_places(toolpath, result.machine, setup, options, attitudes, lacks), None)
    if place is None:
        reached = any(one.unreachable == 0.0 for one in attitudes)
        other = "a machine with more travel" if reached else "a machine whose rotary axes reach them"
        said = _nowhere(result.machine, attitudes) or "no place of the part was found that travel allows"
        return [_note(said + "".join(f"; {why}" for why in lacks[:3]),
                      f"{other}, or a file for each side of the part")]
    p = place.part
    origin, x, y = ([round(v, 9) for v in vector] for vector in (p.origin, p.x_axis, p.y_axis))
    turns = any(result.machine.rotary)
    then = "postproc place finds the fastest near it, " if turns else "clamp it so and set the work offset there: "
    return [_note(f"travel allows another place: {place.why}", f"[part] origin = {origin}, x_axis = {x}, y_axis = {y} "
                  f"in the set-up; {then}postproc setup new writes and proves it")]


def _largest(machine: Machine) -> float:
    """mm: the longest travel of a slide; of a machine without slides the diagonal of its workspace, where it has one."""
    limits, slides, box = machine.limits, ~np.array(machine.rotary), machine.kinematics.workspace
    if slides.any():
        return float((limits.upper - limits.lower)[slides].max())
    return np.inf if box is None else float(np.linalg.norm(box.upper - box.lower))


def _note(message: str, hint: str) -> Diagnostic:
    return info("place.found", message, hint=hint)


def _places(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options, attitudes: list[Attitude],
            lacks: list[str]) -> Iterator[FoundPlace]:
    """Places of most margin, the likely attitudes first; why an attitude has none goes to `lacks`."""
    reached = [one for one in attitudes if one.unreachable == 0.0]
    if not reached:
        best = attitudes[0]
        lacks.append(f"however the part is turned, {machine.name} cannot take every tool axis of the cuts: at best (the "
                     f"part {best.why}) {100.0 * best.unreachable:.0f} % of them are beyond its rotary axes")
        return
    work, _ = work_of(toolpath, machine, setup.model_copy(update={"part": PartPlacement()}), options, turning=False)
    if work is None:
        return
    space = _space(work, setup, machine)
    known = dict[str, float]()
    for one in reached[:_ATTITUDES]:
        place, margin, why = _deepest(work, space, one, setup.joints.singular_distance)
        if place is not None:
            yield place
        else:
            known[why] = max(margin, known.get(why, -np.inf))
            lacks[:] = sorted(known, key=lambda reason: -known[reason])


def _space(work: PassContext, setup: SetupFile, machine: Machine) -> Space:
    """Everywhere within reach of the machine."""
    safe = safe_space(work.moves, setup, work.placement)
    size = float(np.abs(safe.corners).max())
    limits = np.concatenate([machine.limits.lower, machine.limits.upper])[np.tile(~np.array(machine.rotary), 2)]
    far = float(np.abs(limits[np.isfinite(limits)]).max(initial=1000.0)) + size
    box = machine.kinematics.workspace
    if not machine.kinematics.straight_slides and box is not None:
        far = float(np.abs([box.lower, box.upper]).max()) + size + 2.0 * float(np.linalg.norm(_platform_to_tip(work)))
    low, high = np.full(3, -far), np.full(3, far)
    x, y, z = ((float(a), float(b)) for a, b in zip(low, high, strict=True))
    return space_of(PlacementLimits(x=x, y=y, z=z), Placement(np.eye(3), np.zeros(3)),
                    (safe.corners.min(axis=0), safe.corners.max(axis=0)))


def _deepest(work: PassContext, space: Space, one: Attitude, least: float) -> tuple[FoundPlace | None, float, str]:
    """The place of most margin in an attitude with that margin, mm, or why there is none (-inf where none is known)."""
    angles = angles_of(one.turn)
    region, refused = region_of(work, space, angles, least)
    if region is None:
        return None, -np.inf, str(refused)
    try:
        place, margin, lack = region.deepest(*_room(work, space, one))
    except ArithmeticError as fault:
        return None, -np.inf, str(fault)
    if not margin >= -_NOISE:
        return None, -np.inf if np.isnan(margin) else margin, f"at best {lack}"
    near = np.round(place)
    at = float(region.margins(near[None, :])[0])
    if at >= (0.0 if margin > _ROUND else margin - _NOISE):
        place, margin = near, at
    return FoundPlace(_part(one, place[:ANGLES]), one, margin), margin, ""


def _platform_to_tip(work: PassContext) -> Floats:
    """(3,) mm from the point of which a workspace is stated to the tip of the longest tool, at home."""
    home, kin = work.machine.home[None], work.machine.kinematics
    longest = max((one.kin.tool_length for one in work.passes), default=0.0)
    rig = kin.rig(home)
    return np.asarray(rig.gauge[0] - rig.place[0] - longest * rig.axis[0])


def _room(work: PassContext, space: Space, one: Attitude) -> tuple[Floats, Floats]:
    """Ends (3,) of where the part may stand in an attitude; with a workspace, where all of its tips come into that, its
    middle first: rods on their other sides reach places far from there too, in which the machine never is."""
    low, high = space.room(angles_of(one.turn))
    kin = work.machine.kinematics
    if kin.straight_slides or kin.workspace is None:
        return low, high
    away = _platform_to_tip(work)
    tips = work.space.corners @ one.turn.T
    axes = np.concatenate([each.axes for each in work.passes]) @ one.turn.T
    slack = float(np.linalg.norm(away)) * float(np.linalg.norm(axes - work.machine.home_axis, axis=1).max())
    least, most = kin.workspace.lower + away - tips.min(axis=0), kin.workspace.upper + away - tips.max(axis=0)
    return np.clip(np.minimum(least, most) - slack, low, high), np.clip(np.maximum(least, most) + slack, low, high)


def _part(one: Attitude, origin: Floats) -> PartPlacement:
    """[part] of an attitude; quarter turns as 0, 1, -1."""
    x, y = (squared(one.turn)[:, k].tolist() for k in (0, 1))
    at = (np.round(origin, 6) + 0.0).tolist()
    return PartPlacement(origin=(at[0], at[1], at[2]), x_axis=(x[0], x[1], x[2]), y_axis=(y[0], y[1], y[2]))
