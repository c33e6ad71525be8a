"""Coordinates that the words of a block are in, and the machine position that the control makes of them.

Under "axes" both are the same. Under "tcp" X, Y, Z are the tip in the work offset fixed to the table, under
"tilted" the tip in the frame of a plane; rotary words are rotary positions under every law.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from functools import cached_property

import numpy as np

from machines.kinematics.base import Kinematics
from machines.kinematics.frames import tool_x
from postproc.control.control import Control, InterpolationMode
from postproc.control.modes import table_axes
from postproc.readback.execution.frames_loop import in_frames, on_table
from postproc.readback.text.canonical import WordMeaning
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import angle_between, cross, whole_turns
from toolpaths.shapes import arrays
from toolpaths.units import DEG

ANGLE_SLACK = 0.01
"""degrees by which the rotary axes may stand off the plane, or off the control's own choice: rounding of the angles"""
ENTRY_SLACK = 1e-3
"""degrees or mm by which the frames of both readings may differ: the last decimal of words"""
_CHUNK = 50_000
_TURN = 360.0


@dataclass(frozen=True, eq=False)
@arrays(rotation="3 3", origin="3")
class ExecutionFrame:
    """One law in force: its plane, and the kinematics at the tip of the tool that the control reckons with."""

    law: InterpolationMode
    control: Control | None = None
    kinematics: Kinematics | None = None
    rotation: Floats = field(default_factory=lambda: np.eye(3))
    origin: Floats = field(default_factory=lambda: np.zeros(3))

    def coordinates(self, position: Floats) -> Floats:
        """(N, J) what the words would say at machine positions (N, J) (mm, degrees)."""
        return self._alone.coordinates(np.zeros(len(position), dtype=np.int64), position)

    def position(self, coordinates: Floats) -> Floats:
        """(N, J) machine positions of coordinates (N, J): the slides that bring the tip there at the rotary positions."""
        return self._alone.position(np.zeros(len(coordinates), dtype=np.int64), coordinates)

    @cached_property
    def _alone(self) -> FrameTable:
        return FrameTable.of((self,))


@dataclass(frozen=True, eq=False)
@arrays(owner="F", rotation="F 3 3", origin="F 3")
class FrameTable:
    """F frames side by side: the blocks of all that share control and tool length are placed at once."""

    owner: Ints
    """(F,) the first frame with the same control and tool length"""
    frames: tuple[ExecutionFrame, ...]
    rotation: Floats
    """(F, 3, 3)"""
    origin: Floats
    """(F, 3)"""

    @cached_property
    def plain(self) -> bool:
        """True where the words of all are machine positions."""
        return all(frame.kinematics is None or frame.control is None for frame in self.frames)

    @classmethod
    def of(cls, frames: tuple[ExecutionFrame, ...]) -> FrameTable:
        first: dict[tuple[int, float], int] = {}
        keys = [(id(f.control), f.kinematics.tool_length) if f.kinematics is not None else (0, 0.0) for f in frames]
        owner = [first.setdefault(key, k) for k, key in enumerate(keys)]
        return cls(np.array(owner), frames, np.stack([f.rotation for f in frames]),
                   np.stack([f.origin for f in frames]))

    def coordinates(self, number: Ints, position: Floats) -> Floats:
        """(N, J) what the words would say at machine positions (N, J) (mm, degrees) in the frames `number` (N,)."""
        if self.plain:
            return position
        result = np.array(position)
        for control, kin, k in self._parts(number):
            tip, _ = kin.forward(position[k] / control.unit)
            here = result[k]
            here[:, control.xyz] = in_frames(number[k], self.rotation, self.origin, tip)
            result[k] = here
        return result

    def position(self, number: Ints, coordinates: Floats) -> Floats:
        """(N, J) machine positions of coordinates (N, J) in the frames `number` (N,)."""
        if self.plain:
            return coordinates
        result = np.array(coordinates)
        for control, kin, k in self._parts(number):
            here = result[k]
            tip = on_table(number[k], self.rotation, self.origin, here[:, control.xyz])
            here[:, control.slides] = kin.at_tip(tip, here / control.unit, control.slides)[:, control.slides]
            result[k] = here
        return result

    def _parts(self, number: Ints) -> Iterator[tuple[Control, Kinematics, Ints | slice]]:
        """Rows of one control and tool length at a time, not too many; none where the words are machine positions."""
        owners = self.owner[number]
        one = len(owners) > 0 and bool((owners == owners[0]).all())
        for owner in owners[:1].tolist() if one else np.flatnonzero(np.bincount(owners)).tolist():
            control, kin = self.frames[owner].control, self.frames[owner].kinematics
            if control is None or kin is None:
                continue
            if one and len(number) <= _CHUNK:
                yield control, kin, slice(None)
                continue
            rows = np.flatnonzero(owners == owner)
            for at in range(0, len(rows), _CHUNK):
                yield control, kin, rows[at:at + _CHUNK]


AXES = ExecutionFrame("axes")


def tool_frame(kin: Kinematics, q: Floats) -> Floats:
    """(3, 3) columns are the tool's x, y, z seen from the table at joints q (J,), upside down too."""
    _, axis, spin = kin.pose(q[None, :])
    x = tool_x(axis, spin)
    return np.stack([x[0], cross(axis[0], x[0]), axis[0]], axis=1)


def frame_of(law: WordMeaning, control: Control | None, length: float, position: Floats, at: tuple[str, int],
             found: list[Diagnostic] | None) -> ExecutionFrame:
    """The frame of a law entered at machine position (J,), with a tool of that length; `at` is file and line.

    A law that the machine cannot have, and rotary axes that do not stand as the control would put them, are
    errors; None for `found` asks for the frame alone.
    """
    checked, (file, line) = found is not None, at
    found = [] if found is None else found
    if law.name == "axes":
        return AXES
    kin = control.kinematics if control is not None else None
    if control is None or kin is None or not kin.straight_slides or (control.xyz < 0).any():
        found.append(error("gcode.mode", f"{law.code}: the control does not have the kinematics of this machine", file=file,
                           lines=[line], hint="machine coordinates are all that it can run"))
        return AXES
    kin = kin.with_tool(length)
    if law.name == "tcp":
        rotation, origin = entered(control, kin, position / control.unit)
        off = max(float(np.abs(rotation - np.eye(3)).max()) / DEG,
                  float(np.abs(origin - control.origin).max()))
        if control.entry_frame == "either" and off > ENTRY_SLACK:
            found.append(_two_frames(law, control, position, file, line))
        if control.entry_frame != "entry":
            rotation, origin = np.eye(3), control.origin
        return ExecutionFrame("tcp", control, kin, rotation, origin)
    q = position / control.unit
    rotation = tool_frame(kin, q) if law.rotation is None else law.rotation
    if checked and law.rotation is not None:
        found += _wrong_pose(law, rotation, control, kin, q, file, line)
    return ExecutionFrame("tilted", control, kin, rotation, control.origin + law.shift)


def _wrong_pose(law: WordMeaning, rotation: Floats, control: Control, kin: Kinematics, q: Floats, file: str,
                line: int) -> list[Diagnostic]:
    """The rotary positions that the control picks for the plane against those in force."""
    names = control.machine.axis_names
    stands = q[control.rotary] / DEG
    picked = _picked(rotation, law.choice, control, kin, q)
    if picked is None:
        return [error("gcode.plane", f"{law.code}: no position of {', '.join(names[j] for j in control.rotary)} brings the "
                      "tool square to the plane", file=file, lines=[line], hint="write a plane that the rotary axes reach")]
    if (np.abs(picked - stands) > ANGLE_SLACK).any():
        return [_pose_error(law, control, stands, picked, file, line)]
    spin = angle_between(tool_frame(kin, q)[:, :1].T, rotation[:, :1].T)[0] / DEG
    if bool(kin.singular(q[None, :])[0]) and spin > ANGLE_SLACK:
        return [error("gcode.plane_pose", f"{law.code}: the plane's X stands {spin:.4f} degrees off the machine's at the "
                      "rotary position in force, where the tool lies along a rotary axis", file=file, lines=[line],
                      hint="state the plane by the position of that axis")]
    return []


def entered(control: Control, kin: Kinematics, q: Floats) -> tuple[Floats, Floats]:
    """(rotation (3, 3), origin (3,) mm) seen from the table of the work offset's frame as it lies in the
    machine with the tables at zero, where the tables stand as in joints q (J,): of the mode by the tip under
    the reading "entry".

    The slides run along the axes of the machine; the tip is t0(rotaries) + R s as the table sees it, t1 + s
    as the machine does, t1 being t0 with the tables at zero.
    """
    at = np.stack([q, q])
    at[:, control.slides] = 0.0
    at[1, table_axes(control)] = 0.0
    seen, machine = kin.forward(at)[0]
    rotation = kin.slide_directions(at[:1], control.xyz)[0]
    return np.asarray(rotation), np.asarray(seen + rotation @ (control.origin - machine))


def _two_frames(law: WordMeaning, control: Control, position: Floats, file: str, line: int) -> Diagnostic:
    where = " ".join(f"{control.machine.axis_names[j]}{position[j]:.4f}" for j in table_axes(control))
    return error("gcode.tcp_frame", f"{law.code} is switched on with the tables at {where}: by the maker's pages its frame "
                 "is that of the part, or that of the work offset turned on from there, and the program is right under one "
                 "of them only", file=file, lines=[line], hint="switch it on with the tables at zero; or state which of "
                 'both the control has: [modes.tcp] frame = "table" or "entry" in the controller file')


def _picked(rotation: Floats, choice: str, control: Control, kin: Kinematics, q: Floats) -> Floats | None:
    """Rotary positions (R,), degrees, that the control takes for the plane's Z; None where there are none."""
    tip, _ = kin.forward(q[None, :])
    branches = kin.inverse(tip, rotation[:, 2][None, :], near=q[None, :])[:, 0][:, control.rotary] / DEG
    branches = branches[np.isfinite(branches).all(axis=1)]
    here = q[control.rotary] / DEG
    branches = branches + whole_turns(here - branches, _TURN)
    lower = control.machine.limits.lower[control.rotary] / DEG - ANGLE_SLACK
    upper = control.machine.limits.upper[control.rotary] / DEG + ANGLE_SLACK
    branches = branches + _TURN * ((branches < lower) & (branches + _TURN <= upper))
    branches = branches - _TURN * ((branches > upper) & (branches - _TURN >= lower))
    inside = branches[((branches >= lower) & (branches <= upper)).all(axis=1)]
    if choice in ("+", "-") and len(inside) > 1:
        lead = _lead(control)
        sign = 1.0 if choice == "+" else -1.0
        asked = inside[sign * inside[:, lead] >= -ANGLE_SLACK]
        inside = asked if len(asked) else inside
    if not len(inside):
        return None
    nearest: Floats = inside[np.abs(inside - here).sum(axis=1).argmin()]
    return nearest


def _lead(control: Control) -> int:
    """The rotary axis whose sign distinguishes the solutions: the first that tilts the tool at the zero position."""
    kin = control.machine.kinematics
    tilts = np.abs(kin.jacobian(np.zeros((1, kin.joints)))[0, 3:6][:, control.rotary]).max(axis=0) > 1e-9
    return int(tilts.argmax())


def _pose_error(law: WordMeaning, control: Control, stands: Floats, picked: Floats, file: str,
                line: int) -> Diagnostic:
    letters = [control.machine.axis_names[j] for j in control.rotary]

    def text(values: Floats) -> str:
        return " ".join(f"{a}{v:.4f}" for a, v in zip(letters, values, strict=False))
    return error("gcode.plane_pose", f"{law.code}: the control takes {text(picked)} for this plane, the axes stand at "
                 f"{text(stands)}", file=file, lines=[line], hint=f"allowed is a difference of {ANGLE_SLACK:g} degrees: "
                 "index to the position of the plane before it is entered")
