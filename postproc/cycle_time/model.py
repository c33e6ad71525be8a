"""The model of a control as a file: which planner, its parameters, how sure each is."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from machines.machine import Machine
from machines.user_file import load_toml
from machines.user_model import UserModel
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic

PARAMETERS = ("corner_tolerance", "block_time", "rapid", "override", "stop_time", "acceleration_share", "jerk_share",
              "spindle_time")
"""what a log can say, in the order of `CalibrationRecord.covariance`"""
ASSUMED = {"corner_tolerance": 0.7, "block_time": 0.7, "rapid": 0.05, "override": 0.02, "stop_time": 0.7,
           "spindle_time": 0.7, "level_share": 0.2, "stated_share": 0.25,
           "velocity": 0.15, "acceleration": 0.3, "jerk": 0.5, "tool_change": 0.3, "clamp": 0.3,
           "unclamp": 0.3}
"""standard deviation of the logarithm of a value that no document states. Of a tolerance that the program states only how
much of it a control uses is open: it is kept, and half of it to all of it is what curves and corners of controls take"""

AssumedName = Literal["corner_tolerance", "stated_share", "block_time", "rapid", "override", "stop_time", "spindle_time",
                      "level_share"]
"""parameters of a model that ASSUMED has a deviation of"""


class CalibrationRecord(UserModel):
    """Where the parameters of a calibrated model come from."""

    log: str
    """file of the measured run"""
    samples: int = Field(ge=1)
    machine: str = ""
    rms_before: float = Field(ge=0.0)
    """s, of the sections' times with the model that the fit began with"""
    rms_after: float = Field(ge=0.0)
    """s, of the sections' times with the fitted model"""
    relative: float = Field(ge=0.0)
    """standard deviation of the whole time over the model's that the sections leave, as a share"""
    covariance: tuple[tuple[float, ...], ...]
    """of the logarithms of `parameters`"""
    parameters: tuple[str, ...] = PARAMETERS[:5]
    """rows and columns of the covariance"""
    kinds: dict[str, float] = Field(default_factory=dict)
    """kind of motion to its share of the run's time in motion"""
    structure: dict[str, float] = Field(default_factory=dict)
    """kind of motion to the standard deviation of its time over the model's, as a share: from sections of that kind when the
    model is fitted without them; of kinds that the run does not hold from those that it holds"""
    axes: tuple[str, ...] = ()
    """whose accelerations the run shows; assumed limits of others count as they did before"""
    period: float = Field(default=0.0, ge=0.0)
    """s at which the log was polled; 0: it has every change of the line"""
    not_identifiable: tuple[str, ...] = ()
    """parameters that the run says nothing about; they keep their assumed uncertainty"""


class LevelShare(UserModel):
    """What a level of the control's smoothing takes of the axes' limits; levels between two that are stated lie between."""

    level: float
    """as the program states it: R of G05.1, P of G187, HSC-MODE of Cycle 32; of CYCLE832 1 roughing, 2 semi-finishing,
    3 finishing"""
    acceleration: float = Field(default=1.0, gt=0.0, le=2.0)
    jerk: float = Field(default=1.0, gt=0.0, le=2.0)


class WithoutSmoothing(UserModel):
    """A control whose smoothing the program has not switched on."""

    block_time: float = Field(default=0.001, ge=0.0, le=1.0)
    """s that it takes for a block at least"""
    corner_step: float = Field(default=1e4, gt=0.0, le=1e4)
    """mm/s by which each axis' velocity may jump at a corner"""
    smoothing: float = Field(default=0.0, ge=0.0, le=1.0)
    """s over which the set points of the axes are averaged"""


class CycleTimeModel(UserModel):
    """How a control plans."""

    description: str = ""
    kind: Literal["ideal", "lookahead", "control", "formulas", "linuxcnc"] = "lookahead"
    """ideal: as fast as the limits allow inside the corner tolerance; lookahead: a control that sees a number of blocks;
    control: look-ahead and jerk executed cycle by cycle; formulas: what such a control takes about; linuxcnc: LinuxCNC's
    planner"""
    corner_tolerance: float = Field(default=0.01, gt=0.0, le=10.0)
    """mm that corners may be rounded off where the program does not say"""
    stated_share: float = Field(default=1.0, gt=0.0, le=1000.0)
    """share of a tolerance that the program states which corners use; a fit of the corner tolerance scales both"""
    block_time: float = Field(default=0.001, ge=0.0, le=1.0)
    """s that the control takes for a block at least"""
    lookahead: int = Field(default=200, ge=1)
    """blocks that it sees"""
    jerk: bool = True
    """the machine's jerk limits hold"""
    rapid: float = Field(default=1.0, gt=0.0, le=2.0)
    """share of the axes' velocity that rapids reach"""
    override: float = Field(default=1.0, gt=0.0, le=3.0)
    """of feeds"""
    acceleration_share: float = Field(default=1.0, gt=0.0, le=10.0)
    """share of the machine's accelerations that the control uses"""
    jerk_share: float = Field(default=1.0, gt=0.0, le=100.0)
    """share of the machine's jerks that the control uses"""
    stop_time: float = Field(default=0.005, ge=0.0, le=10.0)
    """s in position before motion goes on after a stop"""
    spindle_time: float = Field(default=0.0, ge=0.0, le=60.0)
    """s at rest at each M3 or M4: what the spindle takes to come up to speed where the control waits for it"""
    spindle_first: float = Field(default=1.0, ge=0.0, le=100.0)
    """times spindle_time that the program's first start takes; a fit of spindle_time scales both"""
    cycle: float = Field(default=0.002, ge=0.0001, le=0.1)
    """s of interpolation, of kind control"""
    bend_acceleration: float = Field(default=0.75, gt=0.0, le=0.95)
    """share of the axes' accelerations that bends may take, of kind control"""
    bend_jerk: float = Field(default=0.75, gt=0.0, le=0.95)
    """share of the axes' jerks that bends may take, of kind control"""
    corner_step: float | None = Field(default=None, gt=0.0, le=1e4)
    """mm/s by which each axis' velocity may jump at a corner, instead of a corner rounded off; of kind control"""
    smoothing: float = Field(default=0.0, ge=0.0, le=1.0)
    """s over which the set points of the axes are averaged, of kind control"""
    levels: tuple[LevelShare, ...] = ()
    """of its smoothing, of kind control; a program that states none runs without their shares"""
    level_share: float = Field(default=1.0, gt=0.0, le=10.0)
    """times the shares of a level that is stated"""
    off: WithoutSmoothing | None = None
    """of kind control: where the program has not switched its smoothing on; None: that changes nothing"""
    servo_cycle: float = Field(default=0.001, gt=0.0, le=0.1)
    """s, of LinuxCNC"""
    own_share: float | None = Field(default=None, ge=0.0, le=1.0)
    """standard deviation of the time over the model's own, as a share, where every parameter is known; None: by kind of
    motion (OWN of kinds.py)"""
    assumed: tuple[AssumedName, ...] = ()
    """parameters that no document states and no run has shown"""
    calibration: CalibrationRecord | None = None

    def of_machine(self, machine: Machine) -> CycleTimeModel:
        """With what the machine file says of its control ([control] look_ahead, block_time); a block time that was measured
        stays. Only of a control with look-ahead."""
        stated = {"lookahead": machine.look_ahead, "block_time": None if self.calibration else machine.block_time}
        known = {name: value for name, value in stated.items() if value is not None}
        if self.kind not in ("lookahead", "control", "formulas") or not known:
            return self
        return self.model_copy(update={**known, "assumed": tuple(name for name in self.assumed if name not in known)})

    def quick(self) -> CycleTimeModel:
        """The model whose times are formulas, with the same parameters, where this one executes a control."""
        return self.model_copy(update={"kind": "formulas"}) if self.kind == "control" else self

    def values(self) -> Floats:
        """(8,) logarithms of PARAMETERS."""
        return np.log(np.maximum([getattr(self, name) for name in PARAMETERS], 1e-6))

    def with_values(self, logarithms: Floats) -> CycleTimeModel:
        """The model with other PARAMETERS (8,); the share of stated tolerances goes with the corner tolerance, and by its
        square root, as speeds at corners do, the step at corners."""
        new = {name: float(np.exp(v)) for name, v in zip(PARAMETERS, logarithms, strict=True)}
        factor = new["corner_tolerance"] / self.corner_tolerance
        step = None if self.corner_step is None else self.corner_step * factor**0.5
        return self.model_copy(update={**new, "stated_share": self.stated_share * factor, "corner_step": step})


def builtin_files() -> dict[str, Path]:
    """Model files of the product by name."""
    folder = Path(str(resources.files("postproc.cycle_time")))
    return {p.stem: p for p in sorted(folder.glob("*.toml"))}


def load_model(source: str | Path) -> tuple[CycleTimeModel | None, list[Diagnostic]]:
    """The model of a built-in name or a path."""
    return load_toml(source, CycleTimeModel, builtin=builtin_files(), kind="cycle-time model")


def model_name(controller: str, writer: str) -> str:
    """The built-in model of a controller: its own where there is one, that of its dialect, else "control"."""
    known = builtin_files()
    stem = Path(controller).stem
    return stem if stem in known else writer if writer in known else "control"
