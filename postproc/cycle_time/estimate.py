"""One program under one model: times, bound, band."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np

from machines.choices import MotionOrder
from machines.machine import Machine
from postproc.cycle_time.blocks import Cause, MotionBlocks
from postproc.cycle_time.bound import lower_bound
from postproc.cycle_time.kinds import own_share
from postproc.cycle_time.levels import by_level
from postproc.cycle_time.lookahead import lookahead
from postproc.cycle_time.model import ASSUMED, PARAMETERS, AssumedName, CycleTimeModel
from postproc.cycle_time.phases import BlockTimes, summed
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.units import DEG

COVERAGE = 1.96
"""standard deviations on both sides that hold 95 % of a normal distribution"""
_LIMITS: tuple[MotionOrder, ...] = get_args(MotionOrder)
_ORDERS = {"velocity": "", "acceleration": "2", "jerk": "3"}
NOT_EXECUTED = frozenset(("time.control", "time.plan"))
"""messages that say that the times of a model of an executed control are those of its formulas"""
_UNITS = {"corner_tolerance": " mm", "block_time": " s", "stop_time": " s", "spindle_time": " s"}
_TIMING = {"tool_change": Cause.TOOL_CHANGE, "clamp": Cause.INDEXING, "unclamp": Cause.INDEXING}


@dataclass(frozen=True)
class Estimate:
    """How long a program takes.

    Attributes:
        seconds: the model's time; lower_bound: no control is faster; band: 95 % of machines as described lie in it
        uncertainties: standard deviation of the time by what it comes from, s; assumed: of assumed values by their names
    """

    blocks: MotionBlocks
    model: CycleTimeModel
    timed: BlockTimes
    seconds: float
    lower_bound: float
    band: tuple[float, float]
    uncertainties: dict[str, float]
    assumed: dict[str, float]


@dataclass(frozen=True)
class Uncertain:
    """An assumed value, and what it does to the time.

    Attributes:
        value: "A.acceleration", "tool_change", "corner_tolerance"
        assumed: with its unit
        seconds: standard deviation of the time that it alone gives
    """

    value: str
    assumed: str
    seconds: float


def as_used(blocks: MotionBlocks, model: CycleTimeModel) -> MotionBlocks:
    """The blocks with the accelerations and jerks that the control uses of the machine's."""
    if model.acceleration_share == 1.0 and model.jerk_share == 1.0:
        return blocks
    axes = replace(blocks.axes, acceleration=blocks.axes.acceleration * model.acceleration_share,
                   jerk=blocks.axes.jerk * model.jerk_share)
    return replace(blocks, axes=axes)


def timed(blocks: MotionBlocks, model: CycleTimeModel) -> BlockTimes:
    """The blocks under a model."""
    blocks = as_used(blocks, model)
    if model.spindle_time > 0.0:
        p = blocks.pauses
        starts = p.cause == Cause.SPINDLE
        factor = np.where(np.cumsum(starts) == 1, model.spindle_first, 1.0)
        runs_up = np.where(starts, factor * model.spindle_time, 0.0)
        blocks = replace(blocks, pauses=replace(p, seconds=p.seconds + runs_up))
    if model.kind == "linuxcnc":
        from postproc.cycle_time.linuxcnc import Settings, linuxcnc  # its segments, which other models do without

        return linuxcnc(blocks, Settings(cycle=model.servo_cycle, override=model.override, rapid=model.rapid))
    if model.kind == "control":
        from postproc.cycle_time.control import control  # SciPy, which other models do without

        return by_level(blocks, model, control)
    return by_level(blocks, model, lookahead) if model.kind == "formulas" else lookahead(blocks, model)


def executed_by(times: BlockTimes) -> bool:
    """Whether the times of a model of an executed control are the control's, not its formulas'."""
    return NOT_EXECUTED.isdisjoint(one.code for one in times.found)


def total(blocks: MotionBlocks, times: BlockTimes) -> float:
    """s of the whole program, pauses before the first and behind the last block included."""
    outside = (blocks.pauses.block < 0) | (blocks.pauses.block == len(blocks) - 1)
    moving = float(times.end.max() - times.begin.min()) if len(blocks) else 0.0
    return moving + float(times.pause[outside].sum())


def slowed(times: BlockTimes, blocks: MotionBlocks, factor: Floats) -> BlockTimes:
    """Times whose blocks take (E,) times as long; rests stay."""
    p = blocks.pauses
    inside = p.block >= 0
    seconds = factor * times.seconds
    rest = summed(times.pause[inside], p.block[inside], len(blocks))
    end = float(times.begin[0]) + np.cumsum(seconds) + np.concatenate([[0.0], np.cumsum(rest)[:-1]])
    columns = {name: factor * getattr(times, name) for name in ("ramp", "steady", "jerk", "lost_stop", "lost_corner")}
    return replace(times, begin=end - seconds, end=end, **columns)


def estimate(blocks: MotionBlocks, machine: Machine, model: CycleTimeModel, with_band: bool = True,
             times: BlockTimes | None = None, off: float | None = None) -> Estimate:
    """Time, bound and band of a program.

    Args:
        with_band: False leaves the band at the time itself, for many programs in a row
        times: of a motion that is planned already, instead of the model's; the uncertainties stay the model's
        off: standard deviation of `times` over the executed control's, as a share; None: what the formulas are off by kind
    """
    model = model.of_machine(machine)
    times = times or timed(blocks, model)
    seconds = total(blocks, times)
    bound = lower_bound(as_used(blocks, model), model)
    if model.kind == "formulas" and seconds < bound:  # formulas add up what blocks take, and know less than their bound
        lacks = (bound - seconds) / max(float(times.seconds.sum()), 1e-9)
        times = slowed(times, blocks, np.full(len(blocks), 1.0 + lacks))
        seconds = bound
    if not with_band:
        return Estimate(blocks, model, times, seconds, bound, (seconds, seconds), {}, {})
    down, up, uncertainties, assumed = _uncertainties(
        blocks, machine, model if executed_by(times) else model.quick(), seconds, off)
    low = seconds - down if machine.limits.assumed else max(seconds - down, min(bound, seconds))
    return Estimate(blocks, model, times, seconds, bound, (max(low, 0.0), seconds + up), uncertainties,
                    assumed)


def _uncertainties(blocks: MotionBlocks, machine: Machine, model: CycleTimeModel,
                   seconds: float, off: float | None) -> tuple[float, float, dict[str, float], dict[str, float]]:
    """(s below, s above, standard deviation by origin, that of assumed values by name): every uncertain value is moved by
    one standard deviation, by formulas, whose times change by the same share."""
    known, model = model, model.quick()
    here = timed(blocks, model)
    begin = total(blocks, here)
    own, scale = own_share(blocks, here, known, begin, off), seconds / max(begin, 1e-9)
    low = high = (COVERAGE * own * seconds) ** 2
    assumed, fitted = _assumed_changes(blocks, machine, model), _fitted_changes(blocks, model)
    deviation: dict[str, float] = {}
    for name, changed in (*assumed, *fitted):
        moved = sorted(scale * (total(b, timed(b, m)) - begin) for b, m in changed)
        low += (COVERAGE * min(moved[0], 0.0)) ** 2
        high += (COVERAGE * max(moved[-1], 0.0)) ** 2
        deviation[name] = (moved[-1] - moved[0]) / 2.0
    of_assumed = {name: deviation[name] for name, _ in assumed}
    uncertainties = {"the model itself": own * seconds, **{f"assumed {name}": s for name, s in of_assumed.items()},
                     **{name: deviation[name] for name, _ in fitted}}
    return float(np.sqrt(low)), float(np.sqrt(high)), uncertainties, of_assumed


def measure_first(e: Estimate, machine: Machine) -> Uncertain | None:
    """The one assumed value that widens the band most: limits axis by axis, timing and parameters of the control alone; None
    where nothing is assumed.

    All axes slower take no less than one of them, so limits are moved axis by axis only while all of them together move the
    time by more than the worst value so far.
    """
    known, model = e.assumed, e.model.quick()
    alone = {name: s for name, s in known.items() if name not in _LIMITS}
    begin = total(e.blocks, timed(e.blocks, model))
    for limit in sorted((one for one in _LIMITS if one in known), key=lambda name: -known[name]):
        if alone and max(alone.values()) >= known[limit]:
            break
        for axis, name in enumerate(machine.axis_names):
            if f"{name}.{limit}" in machine.limits.assumed and not _shown(name, limit, e.model):
                which = np.arange(len(machine.axis_names)) == axis
                changed = [scaled(e.blocks, limit, which, np.exp(sign * ASSUMED[limit])) for sign in (-1, 1)]
                moved = sorted(total(b, timed(b, model)) - begin for b in changed)
                alone[f"{name}.{limit}"] = (moved[-1] - moved[0]) / 2.0
    worst = max(alone, key=lambda name: alone[name], default="")
    return Uncertain(worst, _assumed_value(worst, machine, e.model), alone[worst]) if worst and alone[worst] > 0.0 else None


def _assumed_value(name: str, machine: Machine, model: CycleTimeModel) -> str:
    """The value as it stands in its file, with its unit."""
    axis, _, limit = name.partition(".")
    if limit:
        j = machine.axis_names.index(axis)
        value = float(getattr(machine.limits, limit)[j]) / (DEG if machine.rotary[j] else 1.0)
        return f"{value:.6g} {'deg' if machine.rotary[j] else 'mm'}/s{_ORDERS[limit]}"
    if name in _TIMING:
        return f"{getattr(machine.timing, name):g} s"
    return f"{getattr(model, name):g}{_UNITS.get(name, '')}"


Change = tuple[MotionBlocks, CycleTimeModel]


def _assumed_changes(blocks: MotionBlocks, machine: Machine, model: CycleTimeModel) -> list[tuple[str, list[Change]]]:
    """Assumed values: name, and the program and model with it lower and higher by one standard deviation."""
    result: list[tuple[str, list[Change]]] = []
    for limit in _LIMITS:
        if limit != "jerk" or (model.kind != "linuxcnc" and model.jerk):
            which = np.array([f"{name}.{limit}" in machine.limits.assumed and not _shown(name, limit, model)
                              for name in machine.axis_names])
            if which.any():
                result.append((limit, [(scaled(blocks, limit, which, np.exp(sign * ASSUMED[limit])), model)
                                       for sign in (-1, 1)]))
    for name, cause in _TIMING.items():
        here = (blocks.pauses.cause == cause) & (blocks.pauses.seconds > 0.0)
        if name in machine.timing.assumed and here.any():
            own = getattr(machine.timing, name)
            result.append((name, [(_longer(blocks, here, own * sign * ASSUMED[name]), model) for sign in (-1, 1)]))
    alone = [name for name in model.assumed if model.calibration is None or name not in PARAMETERS]
    return result + [(name, [(blocks, _another(model, name, np.exp(sign * ASSUMED[name]))) for sign in (-1, 1)])
                     for name in alone]


def _another(model: CycleTimeModel, name: AssumedName, factor: float) -> CycleTimeModel:
    """The model with a value times the factor: a corner tolerance that is assumed is none that the program states, and how
    much corners use of one that it states is an uncertainty of its own."""
    if name not in PARAMETERS:
        return model.model_copy(update={name: getattr(model, name) * factor})
    moved = with_values(model, {name: np.log(factor)})
    return moved.model_copy(update={"stated_share": model.stated_share})


def _shown(axis: str, limit: MotionOrder, model: CycleTimeModel) -> bool:
    """True where the run that the model was fitted to shows the limit, so that the covariance of the fit holds it."""
    record = model.calibration
    if record is None:
        return False
    return limit == "velocity" or axis in record.axes


def _fitted_changes(blocks: MotionBlocks, model: CycleTimeModel) -> list[tuple[str, list[Change]]]:
    """The same of parameters fitted to a log, along the principal axes of their covariance."""
    result: list[tuple[str, list[Change]]] = []
    if model.calibration is None:
        return result
    values, vectors = np.linalg.eigh(np.array(model.calibration.covariance))
    for k, (size, direction) in enumerate(zip(np.sqrt(np.maximum(values, 0.0)), vectors.T, strict=True)):
        moves = [dict(zip(model.calibration.parameters, sign * size * direction, strict=True)) for sign in (-1, 1)]
        result.append((f"fit {k + 1}", [(blocks, with_values(model, move)) for move in moves]))
    return result


def with_values(model: CycleTimeModel, logarithms: dict[str, float]) -> CycleTimeModel:
    """The model with parameters moved by differences of their logarithms."""
    moved = model.with_values(model.values() + np.array([logarithms.get(name, 0.0) for name in PARAMETERS]))
    others = {name: getattr(model, name) * float(np.exp(v)) for name, v in logarithms.items() if name not in PARAMETERS}
    return moved.model_copy(update=others)


def scaled(blocks: MotionBlocks, limit: MotionOrder, which: Bools, factor: float) -> MotionBlocks:
    """The blocks on a machine whose axes `which` (A,) have that limit times the factor."""
    changed = getattr(blocks.axes, limit) * np.where(which, factor, 1.0)
    return replace(blocks, axes=replace(blocks.axes, **{limit: changed}))


def _longer(blocks: MotionBlocks, which: Floats, seconds: float) -> MotionBlocks:
    p = blocks.pauses
    return replace(blocks, pauses=replace(p, seconds=np.maximum(p.seconds + np.where(which, seconds, 0.0), 0.0)))
