"""Forces in rods and drives under a force at the tool, and the compliance of the tool, of machines on legs.

With the rows T = (e, OB x e) of the rods (e from the drive to the platform, O the tip), forces f that push the platform and
a wrench w on it: T^t f + w = 0. A drive carries g = G^t f with G = e.A' of the rods that it holds (of a leg of changing
length 1). Rods yield by f / k (body and joints), drives by g / K: rods shorten by M f, M = diag(1 / k) + G diag(1 / K) G^t,
and the tip moves by C w, C = (T^t M^-1 T)^-1. Source: Company 2000, II-34 to II-38, II-43 to II-51, III-18 to III-22.
"""

from __future__ import annotations

import numpy as np

from machines.tolerances.influence import PlatformPoses
from machines.tolerances.sensitivity import RodsOfLegs, rod_rows
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
class Springs:
    """Stiffness, N/mm: of a rod's body, of each of its two joints along it, of a drive along its motion (arms: at their
    ends); infinite what does not yield."""

    rod: float
    joint: float = np.inf
    drive: float = np.inf


@dataclass(frozen=True, eq=False)
@arrays(rods="N R 6", drives="N R K", columns="C")
class ForceRows:
    """T and G of N poses; `columns` of T are the motions that the rods hold."""

    rods: Floats
    drives: Floats
    columns: Ints


def force_rows(rods: RodsOfLegs, poses: PlatformPoses, point: Floats) -> ForceRows:
    """At poses of the platform, for a `point` (3,) of it."""
    legs, loops = rods.legs, rods.loops
    motions = rod_rows(rods, poses.place, poses.turn, point).motions
    q = loops.drives.solve(loops.ends(poses.place, poses.turn), loops.drives.roots)
    along = loops.drives.moved(q) / loops.drives.size[:, None]
    own = np.einsum("nri,nri->nr", motions[:, :, :3], along[:, rods.leg])
    own = np.where(loops.drives.stretch[rods.leg] > 0.0, 1.0, own)
    drives = np.zeros((len(q), len(rods.leg), len(legs.names)))
    drives[:, np.arange(len(rods.leg)), rods.leg] = own
    return ForceRows(motions, drives, np.array(rods.solved))


def rod_forces(rows: ForceRows, force: Floats) -> Floats:
    """f (N, R), N: rods under a force (3,) N at the point; positive pushes. Of more rods than motions the least squares."""
    wrench = np.concatenate([force, np.zeros(3)])[rows.columns]
    return np.asarray(-np.linalg.pinv(np.swapaxes(rows.rods[:, :, rows.columns], 1, 2)) @ wrench, dtype=np.float64)


def drive_forces(rows: ForceRows, force: Floats) -> Floats:
    """g (N, K), N: what the drives give in their positive direction to hold that force, arms at their ends."""
    return np.asarray(np.einsum("nrk,nr->nk", rows.drives, rod_forces(rows, force)), dtype=np.float64)


def compliance(rows: ForceRows, springs: Springs) -> Floats:
    """C (N, 3, 3) mm/N of the point: its move under a force there."""
    rod = 1.0 / springs.rod + 2.0 / springs.joint
    yielding = rod * np.eye(rows.rods.shape[1]) + rows.drives @ np.swapaxes(rows.drives, 1, 2) / springs.drive
    t = rows.rods[:, :, rows.columns]
    if t.shape[1] == t.shape[2]:
        back = np.linalg.inv(t)
        whole = back @ yielding @ np.swapaxes(back, 1, 2)
    else:
        whole = np.linalg.inv(np.swapaxes(t, 1, 2) @ np.linalg.solve(yielding, t))
    free = rows.columns < 3
    result = np.zeros((len(t), 3, 3))
    at = np.ix_(np.arange(len(t)), rows.columns[free], rows.columns[free])
    result[at] = whole[:, free][:, :, free]
    return result


def tip_stiffness(c: Floats) -> Floats:
    """(N,) N/mm: least over all directions of the force, of compliances (N, 3, 3)."""
    return np.asarray(1.0 / np.linalg.norm(c, ord=2, axis=(1, 2)), dtype=np.float64)
