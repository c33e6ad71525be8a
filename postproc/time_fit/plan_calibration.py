"""The test program that narrows the band of a program's time most: moves in air, chosen by what they show of the control.

Each candidate (`candidate_moves.py`) is timed by the model at its parameters and next to them; with J the derivatives of its
sections' times in prior deviations over the uncertainty of a section, J'J is what the moves say of the parameters
(information, V. V. Fedorov, Theory of Optimal Experiments, 1972). The time of the program at hand has the variance
c'(I + sum J'J)^-1 c, c its own derivatives (c-optimality), and with it what the model is off on kinds of motion that no
run has shown. Moves are taken one after the other, those that lower this variance most for a second of the run, until the
time is spent or nothing is gained.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import toolpaths
from machines.machine import Machine
from postproc.base.options import Options
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import Estimate, estimate, timed, total
from postproc.cycle_time.kinds import KINDS, NOT_SEEN, time_by_kind
from postproc.cycle_time.model import PARAMETERS, CycleTimeModel
from postproc.cycle_time.source import from_conversion, from_gcode
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.time_fit.calibrate import Runs, begin_of, expected, free_parameters, prior_of, slopes
from postproc.time_fit.candidate_moves import SPEED, CandidateMoves, candidates, cl_text
from postproc.time_fit.left_out import KEPT, LEAST_SHARE, MOSTLY
from postproc.time_fit.log import RunLog
from postproc.time_fit.runs import MeasuredRun, run_of_log
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, DiagnosticError, Severity, error, read_value
from toolpaths.shapes import arrays

SIZES = (100.0, 60.0, 40.0, 20.0, 10.0)
"""mm of the box of air that are tried, largest first"""
LENGTH = 100.0
"""mm, gauge length of the test's tool where the set-up states none"""
ABOVE = 20.0
"""mm between home and the safe plane over the box, at least"""
SCATTER = 0.01
"""share of a section's time that a run scatters, of sections of the mean length"""
SHORTER = 0.95
"""by which a test is made shorter at least that takes too long with its linking moves"""
MARGIN = 2.5
"""times the share of a run that a kind of motion needs which it is given: on the control it takes another time"""
GAIN = 0.01
"""share of the variance that is left which a further move must take away"""


@dataclass(frozen=True)
@arrays(low="3", high="3")
class CalibrationPlan:
    """A test program, and what is expected of it.

    Attributes:
        low, high (3,): mm, the box of air in the work offset; moves: names
        shown: parameter to its standard deviation (of the logarithm) before and as expected after; setup: file of the test
        seconds: of the test as the model has it; now, after: the estimate of the program at hand, after as expected
    """

    text: str
    setup: str
    moves: tuple[str, ...]
    low: Floats
    high: Floats
    seconds: float
    shown: dict[str, tuple[float, float]]
    now: Estimate
    after: Estimate


@dataclass(frozen=True)
@arrays(information="M F F", seconds="M", kinds="M K", wanted="F", share="K")
class Knowledge:
    """What M candidates say of F parameters, and what the program at hand asks.

    Attributes:
        information (M, F, F): in prior deviations; seconds (M,): of each; kinds (M, K): s of sections that are of a kind
        wanted (F,): s of the program's time for a prior deviation of each parameter; share (K,): s of it by kind
    """

    information: Floats
    seconds: Floats
    kinds: Floats
    wanted: Floats
    share: Floats

    def variance(self, chosen: list[int]) -> float:
        """s2 of the program's time after a run of some candidates."""
        inner = np.eye(len(self.wanted)) + self.information[chosen].sum(axis=0)
        seen = self.kinds[chosen].sum(axis=0)
        held = (seen > 0.0) & (seen >= MARGIN * LEAST_SHARE * self.seconds[chosen].sum())
        of_kind = np.array([NOT_SEEN[name] for name in KINDS]) * np.where(held, KEPT, 1.0)
        return float(self.wanted @ np.linalg.solve(inner, self.wanted) + (self.share @ of_kind) ** 2)


def chosen_moves(known: Knowledge, budget: float) -> list[int]:
    """Candidates in the order in which they are taken, together within `budget` s."""
    result: list[int] = []
    here = known.variance(result)
    while True:
        left = budget - float(known.seconds[result].sum())
        gains = {k: here - known.variance([*result, k]) for k in range(len(known.seconds))
                 if k not in result and known.seconds[k] <= left}
        best = max(gains, key=lambda k: gains[k] / max(float(known.seconds[k]), 1e-3), default=-1)
        if best < 0 or max(gains.values()) <= GAIN * here:
            return result
        if gains[best] <= 0.1 * GAIN * here:
            best = max(gains, key=lambda k: gains[k])
        result.append(best)
        here = known.variance(result)


def plan_calibration(blocks: MotionBlocks | None, machine: Machine, controller: str, model: CycleTimeModel, setup: SetupFile,
                     budget: float, name: str) -> CalibrationPlan:
    """The test for a program at hand.

    Args:
        blocks: of the program; None: every kind of move that a test may hold, for what it shows of the control
        setup: of it, for tools and the form of the output; budget: s that the test may take
        name: of the test program's file

    Raises:
        DiagnosticError: why the smallest box of air is not within reach, or that no move shows anything within the time.
    """
    model = model.quick().of_machine(machine)
    all_moves, box = _box(machine, controller, setup, model)
    blocks, anyhow = (from_conversion(box), True) if blocks is None else (blocks, False)
    known = knowledge(blocks, box, machine, model, len(all_moves))
    left, low, high = budget, *_extents(box)
    notes = _notes(low, high, machine, controller, name)
    while rows := sorted(chosen_moves(known, left)):
        made = _converted([all_moves[k] for k in rows], machine, controller, box.setup, Path(name).stem, notes)
        if not made.ok:
            raise DiagnosticError([d for d in made.diagnostics if d.severity is Severity.ERROR])
        test = read_value(from_gcode(made.text.encode(), machine, made.controller, box.setup))
        if (taken := total(test, timed(test, model))) <= budget:
            plan = _expected(blocks, machine, model, made, test, taken, low, high)
            if anyhow or plan.after.band[1] - plan.after.band[0] < plan.now.band[1] - plan.now.band[0]:
                return plan
            raise DiagnosticError([error("time.test", "the band of this program is as narrow as a test would leave it",
                                         hint="log a run of the program itself, and give it with --calibrate")])
        alone = float(known.seconds[rows].sum())
        left = min(budget - (taken - alone), SHORTER * alone)
    raise DiagnosticError([error("time.test", f"no test within {budget:g} s narrows the band of this program",
                                 hint="give it more time with --plan-seconds")])


def _expected(blocks: MotionBlocks, machine: Machine, model: CycleTimeModel, made: PostResult, test: MotionBlocks,
              taken: float, low: Floats, high: Floats) -> CalibrationPlan:
    """The plan with what a run would leave uncertain, where it goes as the model has it."""
    run = _run(test, model)
    fit = expected(run, model, SCATTER, machine)
    prior, free = prior_of(machine), free_parameters(Runs.of([run]), model)
    shown = {PARAMETERS[k]: (float(prior[k]), float(fit.values[PARAMETERS[k]][1])) for k in free}
    return CalibrationPlan(made.text, _setup_text(made.setup), tuple(op.name for op in made.toolpath.operations), low, high,
                           taken, shown, estimate(blocks, machine, model), estimate(blocks, machine, fit.model))


def knowledge(blocks: MotionBlocks, box: PostResult, machine: Machine, model: CycleTimeModel, count: int) -> Knowledge:
    """What the candidates of a conversion say of the parameters that the program `blocks` depends on."""
    test = from_conversion(box)
    run = _run(test, model)
    free, prior = free_parameters(Runs.of([run]), model), prior_of(machine)
    begin, start = begin_of(model), begin_of(model).values()

    def moved(x: Floats) -> CycleTimeModel:
        values = start.copy()
        values[free] += x * prior[free]
        return begin.with_values(values)

    zero = np.zeros(len(free))
    weighted = slopes(lambda x: run.modelled(moved(x)), zero) / Runs.of([run]).uncertainty(SCATTER)[:, None]
    wanted = slopes(lambda x: np.array([total(blocks, timed(blocks, moved(x)))]), zero)[0]
    owner = test.operation[run.row[:-1]]
    times, here = timed(test, model), timed(blocks, model)
    information = np.stack([0.5 * weighted[owner == k].T @ weighted[owner == k] for k in range(count)])
    by_kind = run.by_kind(times)
    by_kind = np.where(by_kind > MOSTLY * by_kind.sum(axis=1, keepdims=True), by_kind, 0.0)
    kinds = np.stack([by_kind[owner == k].sum(axis=0) for k in range(count)])
    seconds = np.array([run.modelled(model)[owner == k].sum() for k in range(count)])
    return Knowledge(information, seconds, kinds, wanted, time_by_kind(blocks, here))


def simulated_log(blocks: MotionBlocks, model: CycleTimeModel) -> RunLog:
    """What a log of the run holds where the control is as the model: every change of the line."""
    line, first = np.unique(blocks.line, return_index=True)
    begin = np.maximum.accumulate(timed(blocks, model).begin[first])
    return RunLog(line, begin, np.full((len(line), len(blocks.axes.letters)), np.nan), line)


def _run(blocks: MotionBlocks, model: CycleTimeModel) -> MeasuredRun:
    return read_value(run_of_log(blocks, simulated_log(blocks, model)))


def _box(machine: Machine, controller: str, setup: SetupFile,
         model: CycleTimeModel) -> tuple[tuple[CandidateMoves, ...], PostResult]:
    """The candidates and their conversion in the largest box of air within reach, with turning axes if it can."""
    linear = ~np.array(machine.rotary)
    fastest = float(machine.cutting_limits.velocity[linear].min()) * 60.0
    fastest = min(fastest, machine.largest_feed * 60.0)
    why: list[Diagnostic] = []
    for size in SIZES:
        origin = _corner(machine, size, setup)
        for turns in ((True, False) if not linear.all() else (False,)):
            moves = candidates(size, float(np.floor(fastest)), turns, model.spindle_time > 0.0)
            made = _converted(moves, machine, controller, _shop(setup, origin), "candidates", ())
            if made.ok:
                return moves, made
            why = [d for d in made.diagnostics if d.severity is Severity.ERROR]
    raise DiagnosticError(why)


def _corner(machine: Machine, size: float, setup: SetupFile) -> Floats:
    """(3,) table frame: the corner of a box in the middle of the travel, as high as the safe plane above it leaves."""
    lower, upper = machine.limits.lower, machine.limits.upper
    bounded = ~np.array(machine.rotary) & np.isfinite(lower) & np.isfinite(upper)
    q = np.where(machine.rotary, np.clip(0.0, lower, upper), machine.home)
    q[bounded] = 0.5 * (lower[bounded] + upper[bounded])
    if machine.retract_axis >= 0:
        q[machine.retract_axis] = machine.home[machine.retract_axis]
    tip = machine.kinematics.with_tool(_tool(setup)[1]).forward(q[None, :])[0][0]
    return np.asarray(tip - [0.5 * size, 0.5 * size, size + ABOVE]).round(1)


def _tool(setup: SetupFile) -> tuple[int, float]:
    """Number and gauge length (mm) of the test's tool: the first of the set-up whose length is stated."""
    known = sorted((int(n), t.gauge_length) for n, t in setup.tools.items() if t.gauge_length is not None)
    return known[0] if known else (1, LENGTH)


def _shop(setup: SetupFile, origin: Floats) -> SetupFile:
    """The set-up of the test: its box is the part."""
    number, length = _tool(setup)
    return SetupFile.model_validate({"part": {"origin": tuple(origin.tolist())}, "clearance": {"margin": 10.0},
                                     "tools": {str(number): {"gauge_length": length}}})


def _setup_text(shop: SetupFile) -> str:
    """The set-up as a file."""
    number, tool = next(iter(shop.tools.items()))
    where = ", ".join(f"{v:.6g}" for v in shop.part.origin)
    return (f"# Set-up of the test program: its work offset, its tool\n[part]\norigin = [{where}]\n\n[clearance]\n"
            f"margin = {shop.clearance.margin:g}\n\n[tools.{number}]\ngauge_length = {tool.gauge_length:g}\n")


def _converted(moves: tuple[CandidateMoves, ...] | list[CandidateMoves], machine: Machine, controller: str, shop: SetupFile,
               name: str, notes: tuple[str, ...]) -> PostResult:
    tool = int(next(iter(shop.tools)))
    path, found = toolpaths.read_bytes(cl_text(moves, tool, notes), file=f"{name}.cls")
    return convert(path, machine, controller, shop, Options(name=name), found)


def _extents(box: PostResult) -> tuple[Floats, Floats]:
    """(low, high) (3,), mm: where the tip goes at most, between the linking moves."""
    tip = box.toolpath.tip
    return tip.min(axis=0), tip.max(axis=0)


def _notes(low: Floats, high: Floats, machine: Machine, controller: str,
           name: str) -> tuple[str, ...]:
    """What stands in the program for the operator: what is safe, what to log, how it is used."""
    stem = Path(name).stem
    box = ", ".join(f"{letter} {a:.1f} TO {b:.1f}" for letter, a, b in zip("XYZ", low, high, strict=True))
    return ("TEST OF THE CONTROL'S TIMES: NOTHING IS CUT, TABLE AND BOX EMPTY", f"BOX OF AIR IN THE WORK OFFSET: {box}",
            f"SPINDLE TURNS AT {SPEED:g}: A TOOL THAT MAY, LENGTH AS STATED ABOVE OR SHORTER",
            "FEED AND RAPID OVERRIDE AT 100, NO SINGLE BLOCK, NO FEED HOLD",
            "FIRST ONCE WITH RAPIDS SLOWED DOWN, THEN LOG A RUN",
            "LOG TIME IN S AND LINE OF THIS FILE AT EVERY CHANGE, CSV COLUMNS nc_line AND time_s",
            f"THEN postproc time {stem}.nc -m {machine.name} -c {controller} --setup {stem}.setup.toml --calibrate LOG.csv "
            "-o MODEL.toml")
