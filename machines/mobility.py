"""Whether a platform moves as its family says, over the whole declared workspace: reach, singularity, condition V-4.

A pair of parallel rods AB with its joints along b stops the platform's turn about AB x b. Three pairs (Delta) must stop
all turns: their (AB x b) span space. In the H4a two pairs leave one turn, about (A1B1 x b1) x (A2B2 x b2): it has the
fixed direction x only where b1 and b2 are along x, and exists only where that product is not 0 (Company 2000,
V-1 to V-5 and V.4.2, where "u_i" stands for b_i). The other condition is det Jx, which with it makes the
determinant of the full constraint matrix. None may vanish or change its sign anywhere in the workspace.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from machines.key_problem import KeyProblem
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.sliders import Legs, determinant
from machines.kinematics.workspace import Workspace
from machines.models import Vector
from toolpaths.arrays import Floats
from toolpaths.units import DEG

GRID = (7, 7, 7, 9)
"""points per direction and tilts at which the workspace is examined, its faces included"""
LEAST = 1e-3
"""least value of a normalised determinant; 0 is singular, a change of sign between grid points shows as one"""
ALONG = 1e-9
"""rad: how far the joints of a pair may be off x"""
X = np.array([1.0, 0.0, 0.0])


def reach_faults(legs: Legs, joints: Floats, space: Workspace, names: Sequence[str]) -> Iterator[KeyProblem]:
    """Corners out of reach, and a singular platform, of a machine that only translates."""
    place, _ = space.grid((*GRID[:3], 1))
    ends = place[:, None, :] + joints
    far = list(_out_of_reach(legs, ends, place, np.zeros(len(place)), names))
    yield from far
    if not far:
        rods = ends - legs.carriages(legs.inverse(ends))
        volume = determinant(rods / legs.lengths[:, None])
        yield from sign_fault("machine.singular", "det Jx (rods as unit vectors)", volume,
                              partial(place_words, place, np.zeros(len(place))), "the rods come into one plane: move "
                              "the slides, change a root or make the workspace "
                              "smaller")


def delta_faults(legs: Legs, joints: Floats, space: Workspace, across: Floats) -> Iterator[KeyProblem]:
    """Pairs of rods, their joints along `across` (3, 3), that leave the platform of a Delta a turn."""
    place, _ = space.grid((*GRID[:3], 1))
    ends = place[:, None, :] + joints
    q = legs.inverse(ends)
    if not np.isfinite(q).all():
        return
    stopped = np.cross((ends - legs.carriages(q)) / legs.lengths[:, None], across / _norm(across))
    yield from sign_fault("machine.mobility", "det (AB x b) of the three pairs", determinant(stopped),
                          partial(place_words, place, np.zeros(len(place))), "the pairs leave the platform a turn: "
                          "change the direction of `rods`")


def h4_faults(kinematics: OnLegs, rods: Sequence[Sequence[Vector]]) -> Iterator[KeyProblem]:
    """Condition V-4 (V.4.2 for the H4a) and det Jx over the workspace."""
    names, legs, platform = kinematics.leg_names, kinematics.legs.on_slides, kinematics.one_turn
    direction = list(_direction_faults(rods, names))
    yield from direction
    assert legs is not None and platform is not None
    place, tilt = kinematics.workspace.grid(GRID)
    p, joints = np.column_stack([place, tilt]), platform.loops.joints
    ends = platform.ends(p)
    far = list(_out_of_reach(legs, ends, place, tilt, names))
    yield from far
    if direction or far:
        return
    jx = platform.jx(p, legs.inverse(ends))
    pairs = [k for k, leg in enumerate(rods) if len(leg) == 2]
    lever = max(float(np.abs(joints[:, 1:]).max()), 1.0)
    scale = legs.lengths[:, None] * np.array([1.0, 1.0, 1.0, lever])
    yield from sign_fault(
        "machine.mobility", "condition V-4, [(A1B1 x b1) x (A2B2 x b2)].x of unit vectors",
        v4(jx[:, :, :3], legs, pairs), partial(place_words, place, tilt), "the rods of both pairs come into one "
        "plane with x, so that "
        "nothing holds the tilt axis along x: let the pairs reach the platform from opposite sides")
    yield from sign_fault("machine.singular", "det Jx (rods as unit vectors, moments by the largest arm)",
                          determinant(jx / scale), partial(place_words, place, tilt),
                          "the platform is singular there: move the slides or make the workspace smaller")


def v4(rods: Floats, legs: Legs, pairs: Sequence[int]) -> Floats:
    """[(A1B1 x x) x (A2B2 x x)].x (N,) of the two pairs, rods as unit vectors."""
    first, second = (np.cross(rods[:, k] / legs.lengths[k], X) for k in pairs)
    result: Floats = np.cross(first, second) @ X
    return result


def _direction_faults(rods: Sequence[Sequence[Vector]], names: Sequence[str]) -> Iterator[KeyProblem]:
    for name, leg in zip(names, rods, strict=True):
        path = ("legs", name, "rods")
        if len(leg) == 2:
            b = np.subtract(leg[0], leg[1])
            if float(np.linalg.norm(np.cross(b, X))) > ALONG * max(float(np.linalg.norm(b)), 1e-300):
                yield KeyProblem("machine.mobility", path, f"the joints of pair {name} lie along {b.tolist()}, not along "
                                 "x: the platform's turn would not keep its direction (V.4.2)",
                                 "write rods = [[s, 0, 0], [-s, 0, 0]]")
            elif not b.any():
                yield KeyProblem("machine.mobility", path, f"both rods of pair {name} are in one place",
                                 "write rods = [[s, 0, 0], [-s, 0, 0]]")
        elif leg and np.any(np.asarray(leg[0])[1:] != 0.0):
            yield KeyProblem("machine.geometry", path, f"{list(leg[0])}: the platform turns a shift off x, the carriage "
                             "does not", "shift single rods along x only")


def _out_of_reach(legs: Legs, ends: Floats, place: Floats, tilt: Floats,
                  names: Sequence[str]) -> Iterator[KeyProblem]:
    _, half = legs.solve(ends)
    for k, name in enumerate(names[: len(legs.lengths)]):
        bad = np.flatnonzero(~(half[:, k] > 0.0))
        if len(bad):
            yield KeyProblem("machine.workspace", ("workspace",), f"rod {name} ({legs.lengths[k]:g} mm) does not reach "
                             f"{place_words(place, tilt, int(bad[0]))} and {len(bad) - 1} of {len(place)} other places "
                             "examined",
                             "make the workspace smaller or the rod longer")


def sign_fault(code: str, what: str, value: Floats, at: Callable[[int], str], hint: str) -> Iterator[KeyProblem]:
    """Values (N,) that come near 0 or change their sign between places, of which `at` gives the words."""
    mostly = value if np.median(value) > 0.0 else -value
    worst, best = int(np.argmin(mostly)), int(np.argmax(mostly))
    if mostly[worst] < LEAST:
        yield KeyProblem(code, ("workspace",), f"{what} is {value[worst]:.3g} at {at(worst)} and "
                         f"{value[best]:.3g} at {at(best)}; it must keep its sign, at least {LEAST:g} off 0",
                         hint)


def place_words(place: Floats, tilt: Floats, k: int) -> str:
    """Place k of places (N, 3) mm and tilts (N,) rad."""
    x, y, z = place[k]
    return f"x {x:g}, y {y:g}, z {z:g} mm" + (f", tilt {tilt[k] / DEG:g} degrees" if tilt.any() else "")


def _norm(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=-1, keepdims=True), dtype=np.float64)
