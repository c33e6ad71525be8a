"""Where the part stands, which poses a program takes, and what is cut: all in the table frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from postproc.witness.commanded import ARC, HOLE, LINE, Commanded, unit
from postproc.witness.errors import ErrorChain
from postproc.witness.evidence import Case, ExecutedBlocks
from postproc.witness.machine import Chain, Rods
from postproc.witness.text import Array

CHUNK = 20_000
PLAY = 0.5
"""mm or rad that no axis loses by turning back"""


class Unplaced(Exception):
    """The set-up names a system that this witness has not found in the CL file."""


def placement(setup: dict[str, Any], c: Commanded) -> tuple[Array, Array]:
    """(rotation (3, 3), origin (3,)) that take the file's absolute frame to the table.

    Raises:
        Unplaced: where [part] stands by a system that is not known.
    """
    part = setup.get("part", {})
    x = unit(np.array(part.get("x_axis", (1.0, 0.0, 0.0)), np.float64))
    y = np.array(part.get("y_axis", (0.0, 1.0, 0.0)), np.float64)
    y = unit(y - (x @ y) * x)
    rotation, origin = np.stack([x, y, np.cross(x, y)], axis=1), np.array(part.get("origin", (0.0, 0.0, 0.0)), np.float64)
    system = part.get("system", False)
    if not system:
        return rotation, origin
    name = system if isinstance(system, str) else setup.get("work_offset") or next(iter(c.systems), "")
    found = next((v for k, v in c.systems.items() if k.lower() == name.lower()), None)
    if found is None:
        raise Unplaced(name)
    matrix, there = found
    return rotation @ matrix.T, origin - rotation @ matrix.T @ there


def zero_of(setup: dict[str, Any], c: Commanded, place: tuple[Array, Array]) -> Array | None:
    """(3,) origin in the table frame of the system that is the work offset: the set-up's, else the first
    position's; None where that is not known."""
    name = setup.get("work_offset") or c.first
    if name is None:
        return None
    rotation, origin = place
    there = next((at for k, (_, at) in c.systems.items() if k.lower() == name.lower()), None) if name else np.zeros(3)
    return None if there is None else rotation @ there + origin


@dataclass(frozen=True)
class Poses:
    """Poses of a program's blocks by this witness's own kinematics; on rods those of the reader, held against the rods,
    and without a machine those of the reader alone.

    `misfits`: how far poses of the reader are off, where they are looked at: mm (axis by 1000) and the block.
    `uncalled`: number of the tool in the spindle where the set-up lets the program call none.
    """

    case: Case
    executed: ExecutedBlocks
    machine: Chain | ErrorChain | Rods | None
    misfits: list[tuple[float, int]]
    uncalled: int = 0

    def lengths(self, rows: Array) -> Array:
        """(K,) gauge length of the tool in the spindle: of a tool that the program does not call, its length
        is in the work offset, and the joints hold it too; 0 where the set-up states none."""
        tools, number = self.case.setup.get("tools", {}), self.executed.tool[rows]
        if not (self.case.setup.get("output") or {}).get("tool_call", True):
            number = np.full(len(rows), self.uncalled)
        if len(rows) and (number == number[0]).all():
            number = number[:1]
        result = np.zeros(len(number))
        for n in sorted(set(number.tolist())):
            result[number == n] = float((tools.get(str(int(n))) or {}).get("gauge_length") or 0.0)
        return np.broadcast_to(result, len(rows)) if len(result) == 1 else result

    def before(self, rows: Array) -> Array:
        """(K, J) joints where blocks begin."""
        return self.executed.before(rows)

    def joints(self, rows: Array, t: float) -> Array:
        """(K, J) joints of blocks at a fraction."""
        e = self.executed
        if t == 1.0:
            return e.joints(rows)
        q = np.empty((len(rows), len(e.letters)))
        straight = e.straight[rows]
        here = rows[straight]
        q[straight] = (1.0 - t) * self.before(here) + t * e.joints(here)
        if not straight.all():
            q[~straight] = e.joints_at(rows[~straight], t)
        return q

    def at(self, rows: Array, t: float) -> tuple[Array, Array]:
        """(tip, axis) (K, 3) of blocks at a fraction of each."""
        tip, axis = np.empty((len(rows), 3)), np.empty((len(rows), 3))
        for first in range(0, len(rows), CHUNK):
            part = slice(first, first + CHUNK)
            tip[part], axis[part] = self._some(rows[part], t)
        return tip, axis

    def _some(self, rows: Array, t: float) -> tuple[Array, Array]:
        e, length = self.executed, self.lengths(rows)
        if isinstance(self.machine, Chain):
            return self.machine.pose(self.joints(rows, t), e.letters, length)
        tip, axis = e.poses_at(rows, t)
        if isinstance(self.machine, Rods):
            self._note(rows, self.machine.misfit(self.joints(rows, t), e.letters, tip, axis, length))
        elif isinstance(self.machine, ErrorChain):
            q = self.joints(rows, t)
            own = self.machine.pose(q, e.letters, length, self._approach(rows, t, q))
            self._note(rows, np.fmax(np.abs(own[0] - tip).max(axis=1), 1000.0 * np.abs(own[1] - axis).max(axis=1)))
            return own
        return tip, axis

    def _approach(self, rows: Array, t: float, q: Array) -> Array:
        """(K, J) approach directions: by the motion of joints that go straight by more than any play, else those of the
        reader."""
        if self.executed.approach_at is None:
            return np.zeros(q.shape)
        step, said = q - self.before(rows), self.executed.approach_at(rows, t)
        sure = (np.abs(step) > PLAY) & self.executed.straight[rows][:, None]
        return np.asarray(np.where(sure, np.sign(step), said))

    def _note(self, rows: Array, off: Array) -> None:
        worst = int(np.nan_to_num(off, nan=np.inf).argmax())
        self.misfits.append((float(np.nan_to_num(off[worst], nan=np.inf)), int(rows[worst])))


@dataclass(frozen=True)
class Cut:
    """The box (8, 3) and the sphere of what is cut; `whole` (K, 3): corners of that box and of the set-up's stock."""

    corners: Array
    centre: Array
    radius: float
    whole: Array

    def top(self, axis: Array) -> Array:
        """(N,) mm along axes (N, 3) of the highest of what is cut and of the stock."""
        return np.asarray((axis @ self.whole.T).max(axis=1))

    def clear(self, tip: Array, axis: Array, margin: float) -> Array:
        """(N,) True where the half line from a tip along its axis keeps `margin` mm from the box seen along
        the axis, or from the sphere."""
        rise = np.einsum("ni,ni->n", tip, axis)
        above = rise - (axis @ self.corners.T).max(axis=1) >= margin
        offset = tip - self.centre
        along = np.minimum(np.einsum("ni,ni->n", offset, axis), 0.0)
        apart = np.sqrt(np.maximum((offset * offset).sum(axis=1) - along * along, 0.0))
        return np.asarray(above | (apart >= self.radius + margin))


def cut_of(case: Case, c: Commanded, tip: Array, axis: Array, centre: Array, normal: Array, splines: dict[int, Array],
           place: tuple[Array, Array]) -> Cut | None:
    """What the CL file cuts; tips, axes, centres, normals and points of splines in the table frame. None where it cuts
    nothing."""
    points = list(splines.values())
    holes = np.flatnonzero(c.known & (c.kind == HOLE))
    if len(holes):
        depth = np.array([x.depth for x in c.cycles])[c.cycle[holes]]
        points.append(tip[holes] - np.nan_to_num(depth)[:, None] * axis[holes])
    arcs = np.flatnonzero(c.known & (c.arc >= 0))
    arcs = arcs[arcs > 0]
    if len(arcs):
        k = c.arc[arcs]
        for share in np.linspace(0.05, 0.95, 19):
            points.append(on_arc(tip[arcs - 1], tip[arcs], centre[k], normal[k], c.sweep[k], share))
    cutting = c.known & ((c.kind == LINE) | (c.kind == ARC))

    def some() -> Iterator[Array]:
        for rows in chain((tip[k:k + CHUNK][cutting[k:k + CHUNK]] for k in range(0, len(c), CHUNK)), points):
            if len(rows := rows[np.isfinite(rows).all(axis=1)]):
                yield rows

    ends = [(rows.min(axis=0), rows.max(axis=0)) for rows in some()]
    if not ends:
        return None
    corners = _box(np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0))
    given, stock = case.setup.get("clearance", {}).get("centre"), (case.setup.get("rewind") or {}).get("stock")
    middle = 0.5 * (corners[0] + corners[-1]) if given is None else place[0] @ np.array(given, np.float64) + place[1]
    whole = [corners, _box(stock["low"], stock["high"]) @ place[0].T + place[1]] if stock else [corners]
    far = max(((rows - middle) ** 2).sum(axis=1).max() for rows in some())
    return Cut(corners, middle, float(np.sqrt(far)), np.concatenate(whole))


def _box(low: Array, high: Array) -> Array:
    """(8, 3) corners of the box between two points."""
    return np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(8, 3)


def on_arc(start: Array, end: Array, centre: Array, normal: Array, sweep: Array, share: float | Array) -> Array:
    """(N, 3) places on arcs and helices from `start` about (centre, normal) by `sweep`, at a share of each."""
    share = np.broadcast_to(share, sweep.shape)
    offset = start - centre
    height = np.einsum("ni,ni->n", offset, normal)
    flat = offset - height[:, None] * normal
    rise = np.einsum("ni,ni->n", end - start, normal)
    c, s = np.cos(share * sweep)[:, None], np.sin(share * sweep)[:, None]
    return np.asarray(centre + (height + share * rise)[:, None] * normal + c * flat + s * np.cross(normal, flat))
