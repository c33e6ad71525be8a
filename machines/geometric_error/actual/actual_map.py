"""A machine with an error map: the nominal machine, its tool displaced and turned by what the map says."""

from __future__ import annotations

import numpy as np

from machines.geometric_error.actual.actual import EDGE, Actual, ToolPlace
from machines.geometric_error.actual.error_rates import ErrorRates, arms_of
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.tables.lattice import POINT, ErrorMap
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation

STILL = 1e-6
"""of a slide's motion: by so little it does not move a coordinate"""


@dataclass(frozen=True, eq=False)
class ActualByMap(Actual):
    """A machine with an error map; `nominal` gives its coordinates (a model with no errors)."""

    nominal: Actual
    map: ErrorMap

    @property
    def kinematics(self) -> Kinematics:  # type: ignore[override]  # nothing assigns it
        """Of the nominal machine."""
        return self.nominal.kinematics

    @property
    def turns(self) -> int:  # type: ignore[override]  # nothing assigns it
        """Of the nominal machine."""
        return self.nominal.turns

    @property
    def held(self) -> int:
        """Of the nominal machine."""
        return self.nominal.held

    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        return self.nominal.coordinates(q, near)

    def joints(self, w: Floats) -> Floats:
        """See the base class."""
        return self.nominal.joints(w)

    def rates(self, w: Floats) -> Floats:
        """See the base class."""
        return self.nominal.rates(w)

    @property
    def arm(self) -> float:
        """mm along the tool from the tip to the point that the map displaces."""
        return self.kinematics.tool_length - self.map.length

    def directions(self, q: Floats) -> Floats:
        """(N, 3, 3) that take the map's directions into those of the table at joints q (N, J)."""
        turned, names = np.broadcast_to(np.eye(3), (len(q), 3, 3)), self.kinematics.axis_names
        for letter in self.map.bed:
            turned = turned @ rotation(self.kinematics.axis_line(letter)[0], q[:, names.index(letter)])
        return turned

    def lattice_places(self, w: Floats) -> Floats:
        """Coordinates of the lattice (N, D)."""
        tip, axis, _ = self.nominal.place(w)
        q, names = self.joints(w), self.kinematics.axis_names
        point = tip + self.arm * axis
        return np.stack([point[:, POINT.index(letter)] if letter in POINT else q[:, names.index(letter)]
                         for letter in self.map.letters], axis=1)

    def place(self, w: Floats, direction: Floats | None = None) -> ToolPlace:
        """See the base class."""
        tip, axis, side = self.nominal.place(w)
        error = self.map.at(self.lattice_places(w))
        if self.map.bed:
            turned = self.directions(self.joints(w))
            error = np.concatenate([np.einsum("nij,nj->ni", turned, v) for v in (error[:, :3], error[:, 3:])], axis=1)
        arm = -self.arm * axis
        return (tip + error[:, :3] + (spun(arm, error[:, 3:]) - arm), spun(axis, error[:, 3:]),
                spun(side, error[:, 3:]))

    def error_rates(self, q: Floats, reach: Floats) -> ErrorRates | None:
        """See the base class: by the slopes of the map, along its coordinates, times how fast a joint moves those."""
        kin = self.kinematics
        if not kin.chain:
            return None
        arms = arms_of(kin, SerialErrors(), q, reach)
        (shift, turn), arm = self.map.most, abs(self.arm)
        none = np.zeros(q.shape)
        tip, axis = np.zeros(q.shape), np.zeros(q.shape)
        for joint, own in zip(kin.chain, arms, strict=True):
            j = kin.axis_names.index(joint.name)
            speed = own + arm if joint.rotary else np.ones(len(q))  # of the point, mm per mm or rad
            by = [np.where(letter == joint.name, 1.0, speed if letter in POINT else 0.0) for letter in self.map.letters]
            shifts, turns = (sum(x * slope[k] for x, slope in zip(by, self.map.steepest, strict=True)) for k in (0, 1))
            turned = 1.0 if joint.name in self.map.bed else 0.0  # with the directions of the bed
            axis[:, j] = turns + turn * (turned + joint.rotary)
            tip[:, j] = shifts + shift * turned + arm * axis[:, j]
        return ErrorRates(tip, axis, none, none)

    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """See the base class."""
        _, axis, _ = self.nominal.place(w)
        turned, arm = self.directions(self.joints(w)), -self.arm * axis
        columns = np.zeros((len(w), 6, 6))
        columns[:, :3, :3] = columns[:, 3:, 3:] = turned
        columns[:, :3, 3:] = np.cross(np.swapaxes(turned, 1, 2), arm[:, None, :]).swapaxes(1, 2)
        node, weight = self.map.weights(self.lattice_places(w))
        result = np.zeros((len(w), 6, len(self.map.values) // 6, 6))
        rows = np.arange(len(w))
        for k in range(node.shape[1]):
            result[rows, :, node[:, k], :] += weight[:, k, None, None] * columns
        return result.reshape(len(w), 6, -1)

    def outside(self, w: Floats, margin: float = EDGE) -> Bools:
        """See the base class; a coordinate of the point counts for the slides that move it."""
        found = self.map.outside(self.lattice_places(w), margin)
        names, rotary = self.kinematics.axis_names, np.array(self.kinematics.rotary)
        result = np.zeros((len(w), len(names)), dtype=np.bool_)
        for letter, column in zip(self.map.letters, found.T, strict=True):
            if letter in POINT:
                rows = np.flatnonzero(column)
                result[np.ix_(rows, ~rotary)] |= self._moving(w[rows], POINT.index(letter))
            else:
                result[:, names.index(letter)] |= column
        return result

    def _moving(self, w: Floats, coordinate: int) -> Bools:
        """(N, slides) True for slides that move a coordinate of the point; all of a machine whose w are not its joints."""
        slides = int(np.sum(~np.array(self.kinematics.rotary)))
        if not self.kinematics.chain:
            return np.ones((len(w), slides), dtype=np.bool_)
        return np.asarray(np.abs(self.rates(w)[:, coordinate, :slides]) > STILL)


def part_side(kinematics: Kinematics, structure: str) -> tuple[str, ...]:
    """Rotary axes between the part and the bed, from the part on; `structure` as in the machine file."""
    rotary = dict(zip(kinematics.axis_names, kinematics.rotary, strict=True))
    order = [joint.name for joint in kinematics.chain] or kinematics.axis_names
    return tuple(name for name in order if rotary[name] and (f"{name}'" in structure or kinematics.carries_part(name)))


def spun(v: Floats, by: Floats) -> Floats:
    """Vectors (N, 3) turned by rotation vectors (N, 3) (Rodrigues); a zero vector leaves them to the last digit."""
    angle = np.linalg.norm(by, axis=1)
    safe = np.where(angle > 0.0, angle, 1.0)
    half = np.sin(0.5 * angle) / safe
    across = np.cross(by, v)
    result: Floats = v + (np.where(angle > 0.0, np.sin(angle) / safe, 1.0)[:, None] * across
                          + (2.0 * half**2)[:, None] * np.cross(by, across))
    return result
