"""Dimensional errors of machines on slides and rods, and the exact closure of their six rods.

Rod r belongs to leg k. The rail of leg k is at P_k, its carriage at P_k + q u_k, the joint of the rod on the
carriage and on the platform as the machine file has them. With the errors of annex E (Company 2000, "T";
II-52 to II-58, E-1 to E-9):

    A_r = P_k + dP_k + G_k (q u_k + a_r) + R_k dA_r,     B_r = X + R (b_r + dB_r),     |B_r - A_r| = L_r + dl_r,

G_k: exact turn of the guide about x, y, z of the machine frame, a_r: from the rail's point to the joint, R_k: guide frame
(z along the slide, x from the rail to the joint). The six equations give the platform's place X and turn R,
which no longer only translates or tilts.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Self

import numpy as np

from machines.geometric_error.actual.rods_loop import COMPILE_FROM, close_all
from machines.geometric_error.actual.transforms import turns
from machines.kinematics.rod_platform import RodPlatform
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import compiled, wanted
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

RODS = 6
STEPS = 12
"""of the chord iteration at most; it gains about four digits each"""
CLOSED = 1e-13
"""largest (|AB|^2 - L^2) / 2 L^2 of a solved platform"""
LEAST_GAIN = 0.5
"""a step that leaves more of the error than this is the last: rounding is reached"""


@dataclass(frozen=True, eq=False)
@arrays(rail="#legs 3", guide="#legs 3", carriage="#rods 3", platform="#rods 3", length="#rods", drive="_",
        bearings="#bearing_names")
class RodErrors:
    """Errors of K legs and R rods, six but of kind "legs", mm and rad; the order of the parameters is that of E-14.

    Attributes:
        rail: (K, 3) dP, machine frame
        guide: (K, 3) turns of the slide about x, y, z of the machine frame
        carriage: (R, 3) dA, guide frame
        platform: (R, 3) dB, platform frame
        length: (R,) dl
        legs, rods: names of the legs, and of the rods ("X1", "X2" ...)
        pairs: (K,) mm, half the distance of the rods of each leg where the machine file gives none, else empty
        drive: (K,) by which the drive stands farther than it counts, mm or rad, of kind "legs"; else empty
        arms: legs whose drive counts an angle, by whatever letter
        bearings: mm or rad of what holds a platform besides its rods, by `bearing_names` (`bearings.py`)
    """

    rail: Floats
    guide: Floats
    carriage: Floats
    platform: Floats
    length: Floats
    legs: tuple[str, ...]
    rods: tuple[str, ...]
    pairs: tuple[float, ...] = ()
    drive: Floats = field(default_factory=lambda: np.zeros(0))
    arms: tuple[str, ...] = ()
    bearings: Floats = field(default_factory=lambda: np.zeros(0))
    bearing_names: tuple[str, ...] = ()

    @classmethod
    def none(cls, legs: tuple[str, ...], rods: tuple[str, ...], pairs: tuple[float, ...] = ()) -> Self:
        """All zero."""
        k, r = len(legs), len(rods)
        return cls(np.zeros((k, 3)), np.zeros((k, 3)), np.zeros((r, 3)), np.zeros((r, 3)), np.zeros(r), legs, rods, pairs)

    @property
    def names(self) -> list[str]:
        """X.rail.x ..., X.guide.x ..., X1.carriage.x ..., X1.platform.x ..., X1.length ..., X.drive ..."""
        return [f"{who}.{what}.{letter}" for what, group in (("rail", self.legs), ("guide", self.legs),
                                                             ("carriage", self.rods), ("platform", self.rods))
                for who in group for letter in "xyz"] + [f"{rod}.length" for rod in self.rods] + [
                                                                 f"{leg}.drive" for leg in self.legs[:len(self.drive)]] + [
                                                                 *self.bearing_names]

    @property
    def values(self) -> Floats:
        """(6 K + 7 R,), K of the drives, and bearings: 60 for three legs (E-14), 66 for four."""
        return np.concatenate([getattr(self, name).ravel() for name in ("rail", "guide", "carriage", "platform", "length",
                                                                        "drive", "bearings")])

    def with_values(self, values: Floats) -> Self:
        """The same machine with other parameters (P,)."""
        k, r = len(self.legs), len(self.rods)
        parts = np.split(np.asarray(values, dtype=np.float64), np.cumsum([3 * k, 3 * k, 3 * r, 3 * r, r, len(self.drive)]))
        rail, guide, carriage, platform, length, drive, bearings = parts
        return replace(self, rail=rail.reshape(k, 3), guide=guide.reshape(k, 3), carriage=carriage.reshape(r, 3),
                       platform=platform.reshape(r, 3), length=length, drive=drive, bearings=bearings)

    def bearing(self, name: str) -> Floats:
        """The errors (n,) of a bearing, mm or rad: of `name` itself, or along or about x, y and z."""
        found = (k for k, one in enumerate(self.bearing_names) if name in (one, one.rpartition(".")[0]))
        return np.asarray(self.bearings[list(found)])


@dataclass(frozen=True, eq=False)
@arrays(leg="6", rail="K 3", direction="K 3", arm="6 3", joint="6 3", length="6", guide="K 3 3")
class RodFrame:
    """Nominal geometry of six rods, mm, machine frame.

    Attributes:
        leg: (6,) leg of each rod
        rail, direction: (K, 3) point of the rail at q = 0 and unit direction of the slide
        arm: (6, 3) from the rail's point to the rod's joint on the carriage
        joint: (6, 3) joint on the platform, platform frame
        length: (6,)
        guide: (K, 3, 3) guide frames, columns x, y, z
    """

    leg: Ints
    rail: Floats
    direction: Floats
    arm: Floats
    joint: Floats
    length: Floats
    guide: Floats

    def carriage_joints(self, q: Floats, errors: RodErrors | None = None) -> Floats:
        """A (N, 6, 3) of slides q (N, K)."""
        base, along = self.carriage_lines(errors)
        return np.asarray(base + q[:, self.leg, None] * along)

    def carriage_lines(self, errors: RodErrors | None) -> tuple[Floats, Floats]:
        """(6, 3) each: the joints on the carriages at q = 0, and how they move with their slides."""
        if errors is None:
            return self.rail[self.leg] + self.arm, self.direction[self.leg]
        turned = turns(errors.guide)[self.leg]
        base, along = (np.einsum("rij,rj->ri", turned, v) for v in (self.arm, self.direction[self.leg]))
        own = np.einsum("rij,rj->ri", self.guide[self.leg], errors.carriage)
        return (self.rail + errors.rail)[self.leg] + base + own, along

    def solve(self, q: Floats, place: Floats, turned: Floats, errors: RodErrors) -> tuple[Floats, Floats]:
        """The platform (X (N, 3), R (N, 3, 3)) that closes the six rods with their errors, exactly.

        Chord iteration from the nominal platform `place` (N, 3), `turned` (N, 3, 3); NaN where it does not close.
        """
        if wanted(len(q), COMPILE_FROM, close_all):
            place, turned = np.array(place), np.array(turned)
            lengths = (self.length + errors.length) ** 2
            lines = (np.ascontiguousarray(part) for part in self.carriage_lines(errors))
            worst = compiled(close_all)(np.ascontiguousarray(q), self.leg, *lines,
                                        self.joint + errors.platform, lengths, place, turned, STEPS, CLOSED, LEAST_GAIN)
            return _where_closed(place, turned, worst)
        with np.errstate(over="ignore", invalid="ignore"):  # what does not close grows out of bounds
            return self._by_chords(q, place, turned, errors)

    def _by_chords(self, q: Floats, place: Floats, turned: Floats,
                   errors: RodErrors) -> tuple[Floats, Floats]:
        """`solve` without a compiler."""
        a, b, lengths = self.carriage_joints(q, errors), self.joint + errors.platform, self.length + errors.length
        inverse = inverted(self.twist_rows(self.carriage_joints(q), place, turned))
        turned, before = np.array(turned), np.full(len(q), np.inf)
        for _ in range(STEPS):
            rods = b @ np.swapaxes(turned, 1, 2) + (place[:, None] - a)
            gap = 0.5 * (np.sum(rods * rods, axis=2) - lengths**2)
            step = -(inverse @ gap[:, :, None])[:, :, 0]
            place = place + step[:, :3]
            turned = turned_by(step[:, 3:]) @ turned
            worst = np.abs(gap / lengths**2).max(axis=1)
            if not np.any((worst > CLOSED) & (worst < LEAST_GAIN * before)):
                break
            before = worst
        return _where_closed(place, turned, worst)

    def twist_rows(self, carriages: Floats, place: Floats, turned: Floats) -> Floats:
        """T (N, 6, 6), E-16: rows (AB, DB x AB) that act on the platform's displacement and turn about X."""
        ends = self.joint @ np.swapaxes(turned, 1, 2)
        rods = place[:, None] + ends - carriages
        result = np.empty((len(place), RODS, 6))
        result[:, :, :3] = rods
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1)), 3):
            result[:, :, i] = ends[:, :, j] * rods[:, :, k] - ends[:, :, k] * rods[:, :, j]
        return result

    def sensitivity(self, q: Floats, place: Floats, turned: Floats) -> Floats:
        """S (N, 6, P) of T (dX, dR) = S E, E-15 to E-31 as corrected: P parameters in the order of E-14."""
        carriages = self.carriage_joints(q)
        rods = place[:, None] + np.einsum("nij,rj->nri", turned, self.joint) - carriages
        n, k = len(q), len(self.rail)
        rail, guide = np.zeros((n, RODS, k, 3)), np.zeros((n, RODS, k, 3))
        own, ends, lengths = np.zeros((n, RODS, RODS, 3)), np.zeros((n, RODS, RODS, 3)), np.zeros((n, RODS, RODS))
        for r, leg in enumerate(self.leg):
            rail[:, r, leg] = rods[:, r]
            guide[:, r, leg] = np.cross(carriages[:, r] - self.rail[leg], rods[:, r])
            own[:, r, r] = rods[:, r] @ self.guide[leg]
            ends[:, r, r] = -np.einsum("ni,nij->nj", rods[:, r], turned)
            lengths[:, r, r] = self.length[r]
        return np.concatenate([part.reshape(n, RODS, -1) for part in (rail, guide, own, ends, lengths)], axis=2)

    def platform_sensitivity(self, q: Floats, place: Floats, turned: Floats) -> Floats:
        """d(X, turn)/dE (N, 6, P): T^-1 S."""
        rows = self.twist_rows(self.carriage_joints(q), place, turned)
        result: Floats = inverted(rows) @ self.sensitivity(q, place, turned)
        return result


def _where_closed(place: Floats, turned: Floats, worst: Floats) -> tuple[Floats, Floats]:
    """NaN where the worst relative gap (N,) is not closed."""
    bad = ~(worst < 1e-12)
    return np.where(bad[:, None], np.nan, place), np.where(bad[:, None, None], np.nan, turned)


def inverted(matrices: Floats) -> Floats:
    """Inverses (N, M, M), NaN where one is singular or not finite."""
    try:
        return np.asarray(np.linalg.inv(matrices), dtype=np.float64)  # NaN goes through
    except np.linalg.LinAlgError:
        bad = ~(np.abs(np.linalg.det(matrices)) > 0.0)
        result = np.asarray(np.linalg.inv(np.where(bad[:, None, None], np.eye(matrices.shape[1]), matrices)), np.float64)
        result[bad] = np.nan
        return result


def gives_rods(kinematics: RodPlatform) -> bool:
    """Whether the machine file says where the rods are; one that does not gives the middle lines of pairs."""
    return kinematics.clearance is not None and len(kinematics.clearance.leg) == RODS


def rod_frame(kinematics: RodPlatform, pairs: tuple[float, ...] = ()) -> RodFrame:
    """The rods of a machine; `pairs` as in `RodErrors`.

    The joints of a pair whose place the file does not give lie square to its slide and, in the middle of the
    workspace, to its rods.

    Raises:
        ValueError: where neither its file nor `pairs` give six rods.
    """
    platform = kinematics.platform_joints
    legs, rods = kinematics.legs, kinematics.clearance
    offset = np.zeros_like(legs.points) if rods is None or rods.rail_offset is None else rods.rail_offset
    if rods is not None and gives_rods(kinematics):
        leg, shift = rods.leg, rods.shift
    elif 2 * len(pairs) == RODS:
        leg, shift = np.repeat(np.arange(len(pairs)), 2), _pairs(kinematics, platform, pairs)
    else:
        raise ValueError(f"the machine file gives {0 if rods is None else len(rods.leg)} rods, a platform needs {RODS}; "
                         "write rods = [[x, y, z], [x, y, z]] in its leg tables")
    rail = legs.points + offset
    guide = np.stack([guide_frame(u, -o, kinematics.workspace.middle - p)
                      for u, o, p in zip(legs.directions, offset, rail, strict=True)])
    return RodFrame(leg, rail, legs.directions, shift - offset[leg], platform[leg] + shift,
                    legs.lengths[leg], guide)


def _pairs(kinematics: RodPlatform, platform: Floats, pairs: tuple[float, ...]) -> Floats:
    """(6, 3) from the middle line of each leg to its two rods."""
    legs, ends = kinematics.legs, kinematics.workspace.middle + platform
    rods = ends - legs.carriages(legs.inverse(ends[None]))[0]
    across = np.cross(legs.directions, rods)
    across *= (np.array(pairs) / np.linalg.norm(across, axis=1))[:, None]
    result: Floats = np.stack([across, -across], axis=1).reshape(RODS, 3)
    return result


def rod_names(frame: RodFrame, legs: tuple[str, ...]) -> tuple[str, ...]:
    """X1, X2, Y1 ... by leg and number in the leg."""
    count = [int(np.sum(frame.leg[:r] == leg)) + 1 for r, leg in enumerate(frame.leg)]
    return tuple(f"{legs[leg]}{number}" for leg, number in zip(frame.leg, count, strict=True))


def guide_frame(direction: Floats, *towards: Floats) -> Floats:
    """Columns x, y, z of a guide frame: z along the slide, x across it, from the rail to the joint, else to the middle."""
    across = [v - (v @ direction) * direction for v in (*towards, np.eye(3)[int(np.argmin(np.abs(direction)))])]
    x = next(v for v in across if np.linalg.norm(v) > 1e-9)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(direction, x), direction], axis=1)


def turned_by(vector: Floats) -> Floats:
    """Rotation matrices (N, 3, 3) of small rotation vectors (N, 3) (Rodrigues, with sin x / x and the like as series)."""
    square = np.sum(vector * vector, axis=1)
    s, c = 1.0 - square / 6.0 * (1.0 - square / 20.0), 0.5 - square / 24.0 * (1.0 - square / 30.0)
    result = np.empty((len(vector), 3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        result[:, i, i] = 1.0 - c * (square - vector[:, i] ** 2)
        result[:, i, j] = c * vector[:, i] * vector[:, j] - s * vector[:, k]
        result[:, j, i] = c * vector[:, i] * vector[:, j] + s * vector[:, k]
    return result
