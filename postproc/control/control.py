"""What the words of a program mean on one machine: joints or tip, offsets, and the motion between two blocks.

Three laws. "axes": words are joint positions, straight in joints between blocks. "tcp": the control runs the
kinematics; X, Y, Z are the tip in the work offset, straight, rotary words linear. "tilted": rotary axes stand
still, X, Y, Z are the tip in the frame of a plane.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from machines.choices import Rapids
from machines.kinematics.base import Kinematics
from machines.kinematics.chain import ROTARY
from machines.kinematics.frames import reference_x
from machines.machine import Machine
from postproc.control.planes import Plane
from postproc.control.rollover import Rollover, parked
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross
from toolpaths.shapes import arrays
from toolpaths.units import DEG

XYZ = ("X", "Y", "Z")
InterpolationMode = Literal["axes", "tcp", "tilted"]
MODE_NAMES: dict[InterpolationMode, str] = {"axes": "machine coordinates without RTCP", "tcp": "tool-centre-point control",
                                            "tilted": "tilted work planes"}
"""as headers of programs, warnings and documents name them"""
FeedLength = Literal["xyz-first", "all", "geometry"]


@dataclass(frozen=True, eq=False)
@arrays(origin="3")
class Control:
    """The control of a machine as programs see it, under one law; `under` gives it under another.

    Attributes:
        machine: the machine
        law: what words mean
        origin (3,): origin of the work offset in the table frame, mm
        arc_limit: largest radius that may stay an arc, mm; 0 for no arcs
        helix_planes: planes in which an arc may rise along its axis
        arc_planes: planes in which an arc may stay an arc
        base: the law at the program's start; "tcp" where the control runs the kinematics for the whole program
        plane: of the law "tilted"
        rapids: "straight", or "dog-leg": each axis at its own rapid speed (not under "tcp")
        feed_rule: what a feed per minute refers to under the law "axes", see `feed_length`
        entry_frame: what the frame of the tip is where its mode is entered with turned tables, see `TcpMode.frame`
        own_kinematics: at the gauge point, as the control holds it; None: the machine's
        rolls: modulo axes by joint
        degree_is_inch: where a feed in inches refers to all axes, degrees count as inches, else as mm
        measured: mm of tool length that the work offset holds, where the program calls none
        place: number of the place whose work offset it is, where the part stands at several
        standing: degrees of rotary axes by letter with which the work offset is measured, where that is not with all at 0
    """

    machine: Machine
    law: InterpolationMode
    origin: Floats
    arc_limit: float = math.inf
    base: InterpolationMode = "axes"
    plane: Plane | None = None
    rapids: Rapids = "straight"
    feed_rule: FeedLength = "xyz-first"
    own_kinematics: Kinematics | None = None
    helix_planes: tuple[int, ...] = (17, 18, 19)
    arc_planes: tuple[int, ...] = (17, 18, 19)
    entry_frame: Literal["table", "entry", "either"] = "table"
    degree_is_inch: bool = False
    measured: float = 0.0
    place: int = 0
    standing: tuple[tuple[str, float], ...] = ()
    rolls: dict[int, Rollover] = field(default_factory=dict)

    def parked(self, q: Floats) -> Floats:
        """Home (J,) or (N, J) as axes stand there that come from joints q, see `rollover.parked`."""
        return parked(self.machine, self.rolls, q)

    @cached_property
    def _others(self) -> dict[tuple[object, ...], Control]:
        return {(self.law, self.plane.key if self.plane else ()): self}

    def under(self, law: InterpolationMode, plane: Plane | None = None) -> Control:
        """The same control under another law; equal questions get the same object."""
        key = law, plane.key if plane else ()
        if key not in self._others:
            other = replace(self, law=law, plane=plane)
            other.__dict__["_others"] = self._others
            self._others[key] = other
        return self._others[key]

    @property
    def tip_law(self) -> bool:
        """True where X, Y, Z are the tip in the work offset."""
        return self.law == "tcp"

    @cached_property
    def tips_straight(self) -> bool:
        """True where a block at standing rotary axes takes the tip along a straight line."""
        return self.law != "axes" or self.machine.kinematics.straight_slides

    @cached_property
    def kinematics(self) -> Kinematics:
        """The kinematics that the control computes with, at the gauge point."""
        return self.own_kinematics or self.machine.kinematics

    @cached_property
    def has_tip_modes(self) -> bool:
        """True where a controller's own tip and plane modes can be used on the machine.

        Three slides X, Y, Z along the axes of the machine frame, one rotary axis at least, tool along Z at q
        = 0: then one work offset serves every law.
        """
        kin = self.machine.kinematics
        if not kin.straight_slides or not any(kin.rotary) or (self.xyz < 0).any() or len(self.slides) != 3:
            return False
        zero = np.zeros((1, kin.joints))
        if not np.isfinite(kin.pose(zero)[2]).all():  # no frame of a plane without the tool's own x direction
            return False
        moved = kin.jacobian(zero)[0, :3][:, self.xyz]
        return bool(np.allclose(moved, np.eye(3), atol=1e-9)) and bool(
            np.allclose(kin.forward(zero)[1], [[0.0, 0.0, 1.0]], atol=1e-9))

    @cached_property
    def has_rotary_tables_only(self) -> bool:
        """True where every rotary axis carries the part: the slides then run along the tool's own axes at every pose."""
        kin = self.machine.kinematics
        if not self.has_tip_modes:
            return False
        q = np.zeros((8, kin.joints))
        q[:, self.rotary] = np.linspace(-1.0, 1.3, 8 * len(self.rotary)).reshape(8, -1)
        along = np.swapaxes(tool_frames(kin, q), 1, 2) @ kin.slide_directions(q, self.xyz)
        return bool(np.allclose(along, np.eye(3), atol=1e-9))

    @cached_property
    def rotary(self) -> Ints:
        """Joint numbers of the rotary axes."""
        return np.flatnonzero(np.array(self.machine.rotary))

    @cached_property
    def slides(self) -> Ints:
        """Joint numbers of the linear axes."""
        return np.flatnonzero(~np.array(self.machine.rotary))

    @cached_property
    def length_letters(self) -> Ints:
        """Columns of the words that controls take for lengths, by their letters: all but A, B, C."""
        return np.flatnonzero([name not in ROTARY for name in self.machine.axis_names])

    @cached_property
    def xyz(self) -> Ints:
        """Columns of the words X, Y, Z; -1 where the machine has no such letter."""
        names = self.machine.axis_names
        return np.array([names.index(k) if k in names else -1 for k in XYZ])

    def feed_length(self, step: Floats) -> Floats:
        """(K,) the length of word steps (K, J) that a feed per minute refers to, mm or degrees.

        "xyz-first": that of X, Y, Z where any of them moves, else of U, V, W, else of A, B, C (LinuxCNC,
        `find_straight_length`; NIST RS274/NGC 2.1.2.5 for X, Y, Z and A, B, C). "geometry": that of X, Y, Z
        where any of them moves, else of all other axes (Siemens, FGROUP of the geometry axes). "all": root of
        the squares of all mm and degrees. Where X, Y, Z are the tip the feed is that of the tip, by every rule.
        """
        names = self.machine.axis_names
        if self.law == "axes" and self.feed_rule == "all":
            return np.asarray(np.linalg.norm(step, axis=1))
        if self.law == "axes" and self.feed_rule == "geometry":
            own = [j for j, name in enumerate(names) if name in XYZ]
            length = np.linalg.norm(step[:, own], axis=1)
            return np.asarray(np.where(length > 0.0, length, np.linalg.norm(np.delete(step, own, axis=1), axis=1)))
        result = np.zeros(len(step))
        for letters in ("ABC", "UVW", "XYZ"):
            length = np.linalg.norm(step[:, [j for j, name in enumerate(names) if name in letters]], axis=1)
            result = np.where(length > 0.0, length, result)
        return result

    def feed_units(self, step: Floats, unit: float | Floats) -> Floats:
        """(K,) the same length in what F counts: degrees where no slide moves, else `unit` mm, (K,) or for all."""
        unit = np.broadcast_to(np.asarray(unit, dtype=np.float64), len(step))
        inches = (step[:, self.slides] != 0.0).any(axis=1) & (unit != 1.0)
        if not inches.any():
            return self.feed_length(step)
        if self.degree_is_inch:
            step = np.where(inches[:, None] & self.is_rotary, step * unit[:, None], step)
        return np.asarray(self.feed_length(step) / np.where(inches, unit, 1.0))

    @cached_property
    def is_rotary(self) -> Bools:
        """(J,) the rotary axes."""
        return np.array(self.machine.rotary)

    @cached_property
    def unit(self) -> Floats:
        """(J,) word units per joint unit: 1 for mm, degrees per radian for rotaries."""
        return np.where(self.machine.rotary, 1.0 / DEG, 1.0)

    @cached_property
    def length_on_z(self) -> bool:
        """True where a tool length offset on Z moves the controlled point from gauge point to tip: at q = 0,
        and where the slides do not move the tip straight, wherever the machine is looked at."""
        z = self.xyz[2]
        return self.base == "tcp" or (z >= 0 and self.machine.moves_along_tool(z))

    @cached_property
    def work_offset(self) -> Floats:
        """(J,) machine position of the program's zero: what the work offset register must hold (mm, deg), by every law."""
        kin = self.machine.kinematics
        if self.base == "tcp":
            offset = np.zeros(kin.joints)
            own = self.machine.control_kinematics
            offset[self.xyz] = self.origin - (own.legs.origin if own is not None and own.legs is not None else 0.0)
            return offset
        if not kin.straight_slides:
            return np.zeros(kin.joints)
        result: Floats = self.zero * self.unit
        result[self.rotary] = 0.0
        if self.measured:
            result[self.xyz[2]] += self.measured
        return result

    @property
    def zero(self) -> Floats:
        """(J,) joints at which the gauge point stands at the zero of the work offset, rotary axes as it is measured."""
        kin, names = self.machine.kinematics, self.machine.axis_names
        q = np.zeros((1, kin.joints))
        for letter, angle in self.standing:
            q[0, names.index(letter)] = angle * DEG
        return np.asarray(kin.at_tip(self.origin[None, :], q, self.slides)[0])

    def words(self, q: Floats, kin: Kinematics, length: float) -> Floats:
        """Program words (N, J) (mm, deg) of joints q under the work offset and, where used, the tool length offset.

        `kin` is the kinematics with the tool, `length` its gauge length.
        """
        result = q * self.unit
        if self.law != "axes":
            tip, _ = kin.forward(q)
            result[:, self.xyz] = tip - self.origin if self.plane is None else self.plane.to_plane(tip)
            return result
        result = result - self.work_offset
        if self.length_on_z:
            result[:, self.xyz[2]] -= length
        return result

    def joints(self, words: Floats, kin: Kinematics, length: float) -> Floats:
        """Joints (N, J) of program words (N, J): the inverse of `words`; NaN where the machine cannot go."""
        if self.law == "axes":
            result = words + self.work_offset
            if self.length_on_z:
                result[:, self.xyz[2]] += length
            return np.asarray(result / self.unit)
        q = words / self.unit
        xyz = words[:, self.xyz]
        tip = xyz + self.origin if self.plane is None else self.plane.to_table(xyz)
        q[:, self.xyz] = self.machine.home[self.xyz]
        return kin.at_tip(tip, q, self.xyz)

    def tip_to_words(self, kin: Kinematics, q: Floats) -> Floats:
        """(N, 3, 3): change of the words X, Y, Z per change of the tip at joints q (N, J), rotary joints fixed."""
        if self.law == "axes":
            return np.asarray(np.linalg.inv(kin.slide_directions(q, self.xyz)))
        return np.tile(np.eye(3) if self.plane is None else self.plane.rotation.T, (len(q), 1, 1))

    def between(self, q0: Floats, q1: Floats, t: Floats, kin: Kinematics,
                rapid: Bools | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip, axis (N, 3), joints (N, J)) at fraction t (N,) of the time of the blocks from q0 to q1 (N, J).

        Blocks are straight but for those of `rapid` (N,) where rapids are dog-legs.
        """
        if self.law != "tcp":
            q = self._toward(q0, q1, t, rapid)
            tip, axis = kin.forward(q, near=None)
            return tip, axis, q
        q = q0 + t[:, None] * (q1 - q0)
        tip0, _ = kin.forward(q0)
        tip1, _ = kin.forward(q1)
        tip = tip0 + t[:, None] * (tip1 - tip0)
        q = kin.at_tip(tip, q, self.xyz)
        return tip, kin.forward(q)[1], q

    def bent(self, q0: Floats, q1: Floats, places: Floats, kin: Kinematics) -> Iterator[Floats]:
        """Joints (N, J) at each of the fractions `places` of the path from q0 to q1 (N, J), under the law "tcp"."""
        tip0, tip1 = kin.forward(q0)[0], kin.forward(q1)[0]
        for t in places.tolist():
            yield kin.at_tip(tip0 + t * (tip1 - tip0), q0 + t * (q1 - q0), self.xyz)

    def _toward(self, q0: Floats, q1: Floats, t: Floats, rapid: Bools | None) -> Floats:
        """Joints at fraction t (N,) of the time: all at once, or each axis at its own rapid speed until it is there."""
        step = q1 - q0
        share = np.broadcast_to(t[:, None], step.shape)
        if rapid is not None and self.rapids == "dog-leg" and rapid.any():
            own = np.abs(step) / self.machine.limits.velocity
            with np.errstate(divide="ignore", invalid="ignore"):
                faster = np.minimum(t[:, None] * own.max(axis=1, keepdims=True) / own, 1.0)
            share = np.where(rapid[:, None] & (own > 0.0), faster, share)
        result: Floats = q0 + share * step
        return result


def tool_frames(kin: Kinematics, q: Floats) -> Floats:
    """(N, 3, 3): columns are the tool's own x, y and z (its axis) in the table frame at joints q (N, J)."""
    _, axis, spin = kin.pose(q)
    first = reference_x(axis)
    second = cross(axis, first)
    c, s = np.cos(spin)[:, None], np.sin(spin)[:, None]
    return np.stack([c * first + s * second, c * second - s * first, axis], axis=2)
