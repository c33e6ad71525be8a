"""The journey: passes once -> places that travel allows -> the one of least planned time -> a conversion that proves it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from machines.machine import Machine
from postproc.base.options import Options
from postproc.base.program_time import ProgramTime
from postproc.base.progress import Progress
from postproc.controllers.model import load_controller
from postproc.cycle_time.conversion import program_clock
from postproc.job.job import prepare
from postproc.orientation.candidates.ranking import load_compiler
from postproc.orientation.passes.passes import PassContext, work_of
from postproc.orientation.turning.turning_report import unused
from postproc.path.links import safe_space
from postproc.pipeline.feeds_by_clock import ProgramClock, measured
from postproc.placement.bodies import StationaryBodies, adjacent
from postproc.placement.oriented_times import OrientedTimer
from postproc.placement.place_times import TimedPlace, Timer
from postproc.placement.search import FoundPlaces, PlaceSearch
from postproc.placement.space import ANGLES, Space, space_of
from postproc.setup.model import PartPlacement, SetupFile, part_placement
from postproc.setup.places import one_part
from postproc.setup.system import standing
from toolpaths.diagnostics import Diagnostic, error, has_errors, info, read_value, warning
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

LIMITS = ("state in the set-up where the part may stand, e.g. [placement] x = [-100, 100], y = [-100, 100] (mm, of the part "
          "frame's origin or `point`), turn = [0, 360] or turns = [0, 90, 180, 270]; step = 25 where the table has bores or "
          "slots; a range shorter than step leaves one place")
_PROOFS = 6
"""places that are converted before giving up"""
_LIFT = 1e-3
"""mm"""
_FEW, _NEAR = 2, 1.05
"""places besides the best whose programs are timed, and how much longer they may take by their plans"""
_APART = (10.0, 5.0 * DEG)
"""mm, rad from a place whose conversion failed to the next that is tried"""


@dataclass(frozen=True)
class PlacementChoice:
    """What was found.

    Attributes:
        work: the file with its part frame on the table frame
        best: the place that is taken
        planned, looked, pruned, refused: cuts that were planned; places that were looked at, rejected by
            their bound alone, and where the part cannot stand
    """

    work: PassContext
    space: Space
    found: FoundPlaces
    best: TimedPlace
    planned: int
    looked: int
    pruned: int
    refused: int
    known: tuple[TimedPlace, ...]
    program: tuple[float, float]
    """seconds of the program on the control at [part] and at the best place; NaN where it cannot be written"""
    times: tuple[ProgramTime | None, ProgramTime | None]
    """the same with model and band"""

    @property
    def part(self) -> PartPlacement:
        """[part] of the set-up."""
        return self.space.part(self.best.place)


def place(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options | None = None,
          controller: str | Path = "linuxcnc", progress: Progress | None = None,
          model: str = "") -> tuple[PlacementChoice | None, list[Diagnostic]]:
    """The place of least time inside [placement] of the set-up; None where a diagnostic is an ERROR.

    Places are found by their planned time. The best few of them are converted for the controller and read back, and the one
    whose program takes the least time on the control is taken, links included, where [part] does not take less.

    Args:
        model: cycle-time model of the control, a name or a file; default: the controller's
    """
    options = options or Options()
    setup, stands = standing(setup, toolpath, options.setup)
    if has_errors(stands):
        return None, stands
    work, space, found = _begun(toolpath, machine, setup, options, controller)
    found = [*stands, *found]
    if work is None or space is None:
        return None, found
    bodies, more = adjacent(work, options.setup)
    found += more
    if has_errors(found):
        return None, found
    try:
        timer, result = _searched(work, space, setup, options, bodies, progress)
    except (ValueError, ArithmeticError) as fault:
        return None, [*found, error("place.plan", f"no motion could be planned: {fault}", file=toolpath.file)]
    if timer.unsolved:
        found.append(warning("place.unsolved", "the least time of these passes was not found at every place; the times "
                             "compared are longer than necessary, within all limits", file=toolpath.file,
                             lines=sorted(timer.unsolved)[:6], count=len(timer.unsolved)))
    if result.now.refused:
        found.append(warning("place.now", f"the part cannot stand where [part] places it: {result.now.refused}",
                             file=options.setup))
    if result.best is None:
        return None, [*found, _nowhere(result, timer, options)]
    proof = _Proof(toolpath, machine, setup, options, controller, space, progress, program_clock(model))
    best, more = _proved(proof, timer, result.best, result.now)
    if best is None:
        return None, [*found, *more]
    best = _fastest(proof, timer, best)
    program = proof.seconds(result.now), proof.seconds(best)
    if best is not result.now and space.holds(result.now.place) and program[1] >= program[0]:
        more.append(info("place.kept", f"at the best place found the program takes {program[1]:.3f} s, where [part] has the "
                         f"part {program[0]:.3f} s: the part stays there", file=options.setup))
        best, program = result.now, (program[0], program[0])
    times = proof.time(result.now), proof.time(best)
    more += _lifted(space, best, options.setup)
    if options.orient != "keep":
        more += unused(setup.orientation, "places are compared by 3+2 passes alone", options.setup)
    return PlacementChoice(work, space, result, best, timer.planned, timer.looked, timer.pruned, timer.refused,
                           tuple(timer.known()), program, times), [*found, *more]


def _searched(work: PassContext, space: Space, setup: SetupFile, options: Options, bodies: StationaryBodies | None,
              progress: Progress | None) -> tuple[Timer, FoundPlaces]:
    """The places that were found, and what has timed them; with `options.orient` axes are chosen at the likely ones."""
    timers: list[Timer] = [Timer(work, space, setup.joints.singular_distance, bodies)]
    try:
        search = PlaceSearch(timers[0], space, progress)
        result = search.run()
        if options.orient != "keep":
            timers.append(OrientedTimer(work, space, setup, options, bodies))
            result = replace(PlaceSearch(timers[1], space, progress).among(_likely(search)), lacks=result.lacks,
                             attitudes=result.attitudes, screened=result.screened)
    finally:
        for timer in timers:
            timer.close()
    return timers[-1], result


def _lifted(space: Space, best: TimedPlace, file: str) -> list[Diagnostic]:
    """What must go under a part that is placed higher than it stands, or come away where it is lower."""
    here, there = (space.placement(place).points(space.corners)[:, 2].min() for place in (space.now, best.place))
    lift = float(there - here)
    if abs(lift) < _LIFT:
        return []
    what = "higher than [part] has it: it needs a support of that height" if lift > 0.0 else (
        "lower than [part] has it: what it stands on must be as much lower")
    return [info("place.lifted", f"the part stands {abs(lift):.3f} mm {what}", file=file,
                 hint="nothing is to be done: fix z in [placement] (leave it out) where the part stays on its support")]


def _begun(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options,
           controller: str | Path) -> tuple[PassContext | None, Space | None, list[Diagnostic]]:
    """The passes with the part frame on the table frame, and the places that are allowed."""
    spec = read_value(load_controller(controller))
    now, found = part_placement(setup, options.setup)
    found += one_part(setup.places, "the choice of a place", options.setup)
    if now is None or has_errors(found):
        return None, None, found
    _, found = prepare(toolpath, machine, spec, setup, options)
    if has_errors(found):
        return None, None, found
    load_compiler()
    work, more = work_of(toolpath, machine, setup.model_copy(update={"part": PartPlacement()}), options,
                         turning=options.orient != "keep")
    if work is None:
        return None, None, [*found, *more]
    safe = safe_space(work.moves, setup, work.placement)
    space = space_of(setup.placement, now, (safe.corners.min(axis=0), safe.corners.max(axis=0)))
    if not space.free:
        return None, None, [error("place.limits", "[placement] of the set-up allows no other place for the part",
                                  file=options.setup, hint=LIMITS)]
    return work, space, found


def _likely(search: PlaceSearch) -> list[TimedPlace]:
    """Places to choose tool axes at: the best of each attitude with the axes of the file; where these cannot
    be run, the middle of what is allowed."""
    space = search.space
    found = search.likely()
    known = [one.place[ANGLES:] for one in found]
    for angles in space.attitudes():
        low, high = space.room(angles)
        if not any(np.abs(angles - other).max() < 1e-9 for other in known) and not bool((low > high).any()):
            middle = space.snapped(np.append(0.5 * (low + high), angles))
            found.append(replace(search.found.now, place=middle))
    return found


def _nowhere(result: FoundPlaces, timer: Timer, options: Options) -> Diagnostic:
    """Why the part can stand nowhere: the attitude that lacks least."""
    known = [lack for lack in result.lacks if np.isfinite(lack[1])]
    if known:
        angles, _, what = max(known, key=lambda lack: lack[1])
        why = f"at best (turn {angles[0] / DEG:.3f} degrees) {what}"
    else:
        reasons = [why for _, _, why in result.lacks] + [one.refused for one in timer.known() if one is not result.now]
        why = Counter(map(str, reasons or [result.now.refused])).most_common(1)[0][0]
    return error("place.none", f"no place inside [placement] is possible: {why}", file=options.setup,
                 hint="wider limits, another tool length, a lower clearance.margin or a machine with more travel")


class _Proof:
    """Conversions at places, each made once; only their seconds and what stood against them is kept."""

    def __init__(self, toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options, controller: str | Path,
                 space: Space, progress: Progress | None, clock: ProgramClock) -> None:
        self.toolpath, self.machine, self.setup, self.options = toolpath, machine, setup, options
        self.controller, self.space, self.progress = controller, space, progress
        self.clock, self.done = clock, dict[int, tuple[ProgramTime | None, Diagnostic | None]]()

    def of(self, one: TimedPlace) -> tuple[ProgramTime | None, Diagnostic | None]:
        """The time of the program there (None where none is written), and the worst that stands against it."""
        from postproc.pipeline.convert import convert

        if id(one) not in self.done:
            here = self.setup.model_copy(update={"part": self.space.part(one.place)})
            result = convert(self.toolpath, self.machine, self.controller, here, self.options,
                             progress=self.progress, clock=self.clock)
            why = None if result.ok else max(result.diagnostics, key=lambda d: d.severity)
            self.done[id(one)] = measured(self.clock, result) if result.ok else None, why
        return self.done[id(one)]

    def time(self, one: TimedPlace) -> ProgramTime | None:
        """Of the program there; None where the part cannot stand there."""
        return None if one.refused else self.of(one)[0]

    def seconds(self, one: TimedPlace) -> float:
        """The same in s; NaN where there is none."""
        made = self.time(one)
        return np.nan if made is None else made.seconds


def _fastest(proof: _Proof, timer: Timer, best: TimedPlace) -> TimedPlace:
    """The place whose program takes the least time on the control: `best`, or one of the next best that are apart."""
    tried = [best]
    for one in _candidates(timer, best)[1:]:
        if len(tried) > _FEW or one.seconds > _NEAR * best.seconds:
            break
        apart = min(float((np.abs(one.place - other.place) / np.repeat(_APART, ANGLES)).max()) for other in tried)
        if apart >= 1.0 and proof.of(one)[1] is None:
            tried.append(one)
    return min(tried, key=proof.seconds)


def _proved(proof: _Proof, timer: Timer, best: TimedPlace,
            now: TimedPlace) -> tuple[TimedPlace | None, list[Diagnostic]]:
    """The best place whose conversion is proved; what stood against better ones is reported.

    After a failure come in turn the place farthest from all that failed and the fastest that is left: what
    stands against one place (a link that leaves the workspace) stands against its neighbours too. At last the
    part may stay where it is.
    """
    failed: list[tuple[TimedPlace, Diagnostic]] = []
    left = _candidates(timer, best)
    while left and len(failed) < _PROOFS:
        one = min(left, key=lambda one: -_off(one, failed)) if len(failed) % 2 else left[0]
        why = proof.of(one)[1]
        if why is None:
            return one, [_passed_over(*each, proof.options) for each in failed]
        failed.append((one, why))
        left = [other for other in left if _off(other, [(one, why)]) >= 1.0]
    if not now.refused and timer.space.holds(now.place) and proof.of(now)[1] is None:
        return now, [_passed_over(*each, proof.options) for each in failed]
    return None, [error("place.proof", f"no place of {len(failed)} could be converted: {failed[0][1].message}",
                        file=failed[0][1].file, lines=failed[0][1].lines, hint=failed[0][1].hint)]


def _candidates(timer: Timer, best: TimedPlace) -> list[TimedPlace]:
    """The best, then all others that are timed, in order."""
    good = [one for one in timer.known() if np.isfinite(one.seconds) and timer.space.holds(one.place) and one is not best]
    return [best, *sorted(good, key=lambda one: one.seconds)]


def _off(one: TimedPlace, failed: list[tuple[TimedPlace, Diagnostic]]) -> float:
    """Least distance from places that failed, 1 where they count as another place."""
    scale = np.repeat(_APART, ANGLES)
    return min((float((np.abs(one.place - other.place) / scale).max()) for other, _ in failed),
               default=np.inf)


def _passed_over(one: TimedPlace, why: Diagnostic, options: Options) -> Diagnostic:
    return info("place.passed_over", f"a place of {one.seconds:.3f} s was passed over, its conversion fails: {why.message}",
                file=options.setup)
