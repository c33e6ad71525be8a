"""A machine: kinematics, axis names, limits, workspace, home, timing; what the post needs and nothing of G-code."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from machines.choices import BoughtOption, Park, Rapids, RolloverRule, Stop
from machines.dynamics_models import DynamicsModel, StiffnessModel
from machines.figures import Document
from machines.hooks import HooksModel
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from machines.kinematics.legs.module_pins import ModulePins
    from machines.kinematics.legs.tip_axes import TipAxes

PLACES = 200
"""of a machine's travel at which `Machine.moves_along_tool` looks"""


@dataclass(frozen=True)
@arrays(lower="J", upper="J", velocity="J", acceleration="J", jerk="J")
class Limits:
    """Per joint (J,): travel (mm, rad), velocity, acceleration, jerk (mm/s.., rad/s..).

    Finite unless the machine file says unlimited (+-inf travel). `assumed` names the entries that no document states.
    """

    lower: Floats
    upper: Floats
    velocity: Floats
    acceleration: Floats
    jerk: Floats
    assumed: frozenset[str] = frozenset()
    """e.g. "X.velocity" """


@dataclass(frozen=True)
class Timing:
    """Seconds for what no axis limit says."""

    tool_change: float = 0.0
    clamp: float = 0.0
    unclamp: float = 0.0
    assumed: frozenset[str] = frozenset()
    """names of the entries that no document states"""


@dataclass(frozen=True)
class Turns:
    """How a rotary axis counts its turns.

    Attributes:
        modulo: it is counted modulo 360 degrees, in the turn that begins at `low` (degrees)
        rollover: which path the control takes to a word, "shortest", "sign", "none", "" where the machine file does not say
        park: "turn", at the whole turn nearest to home, or "home", all turns unwound
    """

    modulo: bool = False
    low: float = 0.0
    rollover: RolloverRule | Literal[""] = ""
    park: Park = "turn"


@dataclass(frozen=True)
class ClampCodes:
    """M codes, e.g. "M10", that clamp and release a rotary axis; "" where the machine does so by itself."""

    clamp: str = ""
    unclamp: str = ""


@dataclass(frozen=True)
class ControlOptions:
    """What the machine file says of the options of the control, each with the file and line that say so.

    Attributes:
        fitted: True or False by option; what is not in it is not confirmed
        stated: file and line by option
        tip_frame: "table" or "entry" as in [modes.tcp] frame, "" where the file does not say
        power_on: codes in force before every program
        settings: words of what programs rely on and the file confirms
        control_points: splines go by their control points, not by coefficients of their pieces
    """

    fitted: Mapping[BoughtOption, bool] = field(default_factory=dict)
    stated: Mapping[BoughtOption, tuple[str, int]] = field(default_factory=dict)
    tip_frame: Literal["table", "entry", ""] = ""
    power_on: tuple[str, ...] = ()
    settings: tuple[str, ...] = ()
    control_points: bool = False

    def absent(self, option: BoughtOption) -> bool:
        """True where the file says that the control has it not."""
        return not self.fitted.get(option, True)

    def confirmed(self, option: BoughtOption) -> bool:
        """True where it says that it has."""
        return self.fitted.get(option, False)

    def unconfirmed(self, needs: tuple[str, ...]) -> tuple[str, ...]:
        """Of what programs need, as their headers say it, what `settings` do not confirm."""
        return tuple(text for text in needs if not any(words.lower() in text.lower() for words in self.settings))


@dataclass(frozen=True)
class ControlKinematics:
    """A kinematics module that the control itself runs, so that programs hold tip coordinates in the part.

    `module` and `pins` name LinuxCNC's module and its HAL pins; `tool_length_pin` receives the tool length. `idle` are
    letters of joints that the module has and the machine has not, `sum_to` the pins that a sum of both connects (out, to).
    `legs`: the module as it stands for a platform on legs whose drives are other axes than those of its program, `axes`.
    """

    module: str
    pins: Mapping[str, float] = field(default_factory=dict)
    tool_length_pin: str = ""
    idle: str = ""
    sum_to: tuple[str, str] = ("", "")
    legs: ModulePins | None = None
    axes: TipAxes | None = None


@dataclass(frozen=True)
@arrays(home="#axis_names")
class Machine:
    """One machine as loaded from its file.

    Attributes:
        name: file stem or `name` key
        description: one line
        structure: ISO 10791-6 code, or the parallel family
        kinematics: at the gauge point
        axis_names: letters, the order of q
        rotary: per joint
        limits: travel and dynamics per joint
        home: (J,) joints where programs start and tool changes happen
        retract_axis: index of the linear joint that lifts the tool at home (approach goes there last), or -1
        control_kinematics: set where the control owns the kinematics (programs in tip coordinates)
        stop: what a stop of the program switches off: "spindle and coolant", "spindle", "nothing", or ""
            where the machine file does not say
        turns: per joint, how it counts its turns; () as by `Turns()`
        clamps: per joint, the codes that clamp and release it; () as by `ClampCodes()`
        length_register, radius_register: what H and D of a tool are more than its number where the CL file
            names none; None: D is no rule of its own
        rapids: path of rapids of several axes, "" where the machine file does not say
        largest_feed: mm/s, the largest cutting feed; infinite where the machine file does not say
        largest_spindle_speed: rev/min; infinite where the machine file does not say
        cutting_velocity: per joint, mm/s or rad/s, largest at feed; () where that is the velocity of rapids
        options: what the file says of the options of the control
        look_ahead, block_time: blocks that the control sees ahead, s that it takes for a block; None: not stated
        hooks: blocks of the shop at certain places of a program
        figures: where a figure of the file comes from, by name ("X.velocity", "timing.clamp"): document and place, or
            "assumed"; what is not in it is stated by whoever wrote the file
        documents: those that figures come from
        certificate: file that proves that the declared workspace is reached and free of singular positions, "" where that
            was sampled, or nobody asks it of the machine
        dynamics: masses, and what the motors can give; None where the machine file does not say
        stiffness: what its parts yield by; None likewise
        kind_code: whose code its kinematics is, with the first digits of its hash; "" for a kind of this project
        stated: the limits as the machine file has them; `limits` is another object where they were changed in memory
        by_drives: the machine as its drives move it, where this one has the axes of the control's kinematics (`on_control`)
    """

    name: str
    description: str
    structure: str
    kinematics: Kinematics
    axis_names: tuple[str, ...]
    rotary: tuple[bool, ...]
    limits: Limits
    home: Floats
    retract_axis: int = -1
    timing: Timing = field(default_factory=Timing)
    control_kinematics: ControlKinematics | None = None
    file: str = ""
    stop: Stop | Literal[""] = ""
    stated: Limits | None = None
    by_drives: Machine | None = None
    turns: tuple[Turns, ...] = ()
    clamps: tuple[ClampCodes, ...] = ()
    length_register: int = 0
    radius_register: int | None = None
    rapids: Rapids | Literal[""] = ""
    largest_feed: float = math.inf
    largest_spindle_speed: float = math.inf
    cutting_velocity: tuple[float, ...] = ()
    options: ControlOptions = field(default_factory=ControlOptions)
    look_ahead: int | None = None
    block_time: float | None = None
    hooks: HooksModel = field(default_factory=HooksModel)
    figures: Mapping[str, str] = field(default_factory=dict)
    documents: tuple[Document, ...] = ()
    certificate: str = ""
    dynamics: DynamicsModel | None = None
    stiffness: StiffnessModel | None = None
    kind_code: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "turns", self.turns or (Turns(),) * len(self.axis_names))
        object.__setattr__(self, "clamps", self.clamps or (ClampCodes(),) * len(self.axis_names))

    def moves_along_tool(self, joint: int) -> bool:
        """True where a joint moves the tip along the tool by as much: at q = 0, without straight slides wherever the machine
        is looked at (`PLACES`). On legs these are two forwards of many poses, made once."""
        if joint not in self._along_tool:
            kin = self.kinematics
            at = np.zeros((1, kin.joints)) if kin.straight_slides else self._places()
            tip, axis = kin.forward(at)
            moved = kin.forward(at + np.eye(kin.joints)[joint])[0] - tip
            good = np.isfinite(moved).all(axis=1)
            self._along_tool[joint] = bool(good.any() and np.allclose(moved[good], axis[good], atol=1e-9))
        return self._along_tool[joint]

    @cached_property
    def _along_tool(self) -> dict[int, bool]:
        """What `moves_along_tool` has found, by joint."""
        return {}

    def joints_over_workspace(self, platform: Floats) -> Floats:
        """Joints (N, J) at places and tilts (N, 4) of the platform of a machine on legs, rotary axes outside the legs at 0;
        NaN where a leg does not reach."""
        legs, over = self.kinematics.leg_geometry, self.kinematics.over_workspace
        assert over is not None
        own = 0 if legs is None else len(legs.names) + len(legs.carrier_names)
        drives = own or int((~np.array(self.rotary)).sum())
        return over.joints_at(platform, np.zeros((len(platform), len(self.axis_names) - drives)))

    def _places(self) -> Floats:
        """Joints (N, J) all over the travel, a turn of axes that go round, and home."""
        limits = self.limits
        low, high = (np.where(np.isfinite(v), v, travel * np.pi)
                     for v, travel in ((limits.lower, -1.0), (limits.upper, 1.0)))
        spread = np.random.default_rng(0).random((PLACES, len(low)))
        return np.concatenate([self.home[None], low + spread * (high - low)])

    def on_control(self) -> Machine:
        """The machine with the axes that the module of its control has, where those are not its drives; else as it is.

        Axes go as fast as one alone may at home without a drive above its own limits.
        """
        control = self.control_kinematics
        if control is None or control.axes is None or self.by_drives is not None:
            return self
        from machines.kinematics.legs.tip_axes import axis_limits

        axes = replace(control.axes, travel=np.column_stack([self.limits.lower, self.limits.upper]))
        home, own = axes.axes_at(self.home[None])[0], self.limits
        velocity, acceleration, jerk, cutting = axis_limits(axes, home, np.stack([own.velocity, own.acceleration, own.jerk,
                                                             self.cutting_limits.velocity]))
        ends = np.where(axes.rotary, np.pi, np.inf)
        made = Limits(-ends, ends, velocity, acceleration, jerk, own.assumed)
        return replace(self, kinematics=axes, axis_names=axes.axis_names, rotary=axes.rotary, limits=made, stated=made,
                       home=home, retract_axis=-1, turns=(), clamps=(), by_drives=self,
                       cutting_velocity=tuple(cutting.tolist()) if self.cutting_velocity else ())

    @cached_property
    def cutting_limits(self) -> Limits:
        """The limits of motion at feed: velocities no greater than `cutting_velocity`."""
        if not self.cutting_velocity:
            return self.limits
        return replace(self.limits, velocity=np.minimum(self.limits.velocity, self.cutting_velocity))

    @property
    def home_axis(self) -> Floats:
        """(3,) tool axis in the table frame with all joints at home."""
        return np.asarray(self.kinematics.forward(self.home[None, :])[1][0])

    @property
    def clamp_codes(self) -> dict[str, ClampCodes]:
        """The codes of the axes that the program clamps, by letter."""
        return {name: codes for name, codes in zip(self.axis_names, self.clamps, strict=True) if codes.clamp}

    @property
    def clamp_groups(self) -> list[tuple[str, ...]]:
        """Letters of those axes, the ones that share a code together: what frees one frees the others of its group."""
        codes, groups = self.clamp_codes, list[tuple[str, ...]]()
        for name, one in codes.items():
            linked = [group for group in groups if any({one.clamp, one.unclamp} & {codes[other].clamp, codes[other].unclamp}
                                                       for other in group)]
            groups = [group for group in groups if group not in linked] + [(*sum(linked, ()), name)]
        return groups

    @property
    def endless(self) -> Bools:
        """(J,) rotary joints whose travel has no end."""
        return np.asarray(np.array(self.rotary) & ~np.isfinite(self.limits.upper - self.limits.lower))
