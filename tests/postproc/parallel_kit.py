"""An own look at programs for parallel machines: dense joints, assembly followed, distance from the CL path.

The executor is peer.Peer, the path geometry is written out here; of the product only the kinematics' forward
model is used, without a hint, and what it gives must hang together from home on.
"""

from __future__ import annotations

from functools import cache

import numpy as np

import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile, load_setup
from tests.postproc.kit import SAMPLES, Peer, Step, angle, few_sides, machine
from toolpaths.toolpath import Kind, Role

DENSE = 100
"""points per block"""
JUMP = 40.0
"""mm between neighbouring dense points: two assembly modes are much farther apart, a step is much shorter"""


@cache
def setup(name: str) -> SetupFile:
    found, diagnostics = load_setup(SAMPLES / f"{name}.setup.toml")
    assert found is not None and not diagnostics
    return found


@cache
def converted(file: str, name: str, setup_name: str, **options: object) -> PostResult:
    path = few_sides(file) if file == "h4a_dome.cls" else toolpaths.read(SAMPLES / file)[0]
    return postproc.convert(path, machine(name), "linuxcnc", setup(setup_name), postproc.Options(**options))


def poses(result: PostResult) -> tuple[list[Step], np.ndarray, np.ndarray]:
    """(steps, tip, axis (K, DENSE, 3)) in the table frame, straight in the joints between blocks, continuous from home."""
    m, tools = result.machine, {int(k): v.gauge_length for k, v in result.setup.tools.items()}
    unit = np.where(np.array(m.rotary), np.pi / 180.0, 1.0)
    steps = execute_dense(result)
    q = np.stack([s.points for s in steps]) * unit
    gauge, axis = m.kinematics.forward(q.reshape(-1, len(unit)))
    home, _ = m.kinematics.forward(m.home[None])
    turned = q[..., -1].ravel() if m.axis_names[-1] == "C" else np.zeros(len(gauge))
    fixed = in_machine(gauge, turned)  # a turning table moves the pose, not the platform
    assert np.isfinite(gauge).all()
    assert np.linalg.norm(np.diff(np.vstack([home, fixed]), axis=0), axis=1).max() < JUMP
    length = np.repeat([tools[s.tool] if s.tool else 0.0 for s in steps], DENSE)[:, None]
    return steps, (gauge - length * axis).reshape(q.shape[0], DENSE, 3), axis.reshape(q.shape[0], DENSE, 3)


def execute_dense(result: PostResult) -> list[Step]:
    """Steps, each with DENSE points; there is no work offset and no length offset where words are joints."""
    m = result.machine
    unit = np.where(np.array(m.rotary), 180.0 / np.pi, 1.0)
    steps = Peer(m.axis_names, np.zeros(len(unit)), {}, m.home * unit, on_z=False).run(result.text, DENSE)
    assert all(len(s.points) == DENSE for s in steps)
    return steps


def in_machine(points: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Points (N, 3) of a table at `turned` (N,) rad, in the machine frame: +C of the tool is -C of the table."""
    c, s = np.cos(-turned), np.sin(-turned)
    return np.column_stack([c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1], points[:, 2]])


def reference(result: PostResult) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(rows of the Toolpath, tip, axis, cut) of the commanded positions but holes, tip and axis in the table frame.

    `cut` is True where a cutting move ends whose start is the row before.
    """
    t, part = result.toolpath, result.setup.part
    rows = np.flatnonzero((t.role != Role.START) & (t.role != Role.HOLE))
    x, y = np.array(part.x_axis), np.array(part.y_axis)
    frame = np.column_stack([x, y, np.cross(x, y)])
    cut = (t.kind[rows] != Kind.RAPID) & (np.diff(rows, prepend=-9) == 1)
    return rows, t.tip[rows] @ frame.T + np.array(part.origin), t.axis[rows] @ frame.T, cut


def deviations(result: PostResult) -> tuple[float, float, int]:
    """(worst tip mm, worst axis deg, cutting moves compared) of the dense poses from the CL's cutting moves."""
    steps, tip, axis = poses(result)
    rows, want, want_axis, cut = reference(result)
    at = matched(tip[:, -1], axis[:, -1], want, want_axis)
    worst = np.zeros(2)
    compared = 0
    for i in np.flatnonzero(cut):
        blocks = slice(at[i - 1] + 1, at[i] + 1)
        if blocks.start >= blocks.stop:
            assert np.linalg.norm(want[i] - want[i - 1]) < 1e-3
            continue
        assert all(s.kind == "feed" for s in steps[blocks])
        p, a = tip[blocks].reshape(-1, 3), axis[blocks].reshape(-1, 3)
        off = off_arc(result, int(rows[i]), want[i - 1], want[i], p)
        worst = np.maximum(worst, [off.max(), np.degrees(off_circle(want_axis[i - 1], want_axis[i], a).max())])
        compared += 1
    return float(worst[0]), float(worst[1]), compared


def matched(tip: np.ndarray, axis: np.ndarray, want: np.ndarray, want_axis: np.ndarray) -> np.ndarray:
    """The block that ends at each position, in order."""
    at, k = [], -1
    for w, a in zip(want, want_axis, strict=True):
        near = np.flatnonzero((np.linalg.norm(tip[max(k, 0):] - w, axis=1) < 1e-3)
                              & (np.linalg.norm(axis[max(k, 0):] - a, axis=1) < 1e-4))
        assert len(near), f"no block ends at {w} with axis {a} after block {k}"
        k = max(k, 0) + int(near[0])
        at.append(k)
    return np.array(at)


def off_arc(result: PostResult, row: int, start: np.ndarray, end: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Distance (K,) from the segment, or from the arc or helix that ends at `row`."""
    t = result.toolpath
    k = int(t.arc[row])
    if k < 0:
        along = end - start
        share = np.clip((p - start) @ along / max(along @ along, 1e-300), 0.0, 1.0)
        return np.linalg.norm(p - start - share[:, None] * along, axis=1)
    assert result.setup.part.x_axis == (1.0, 0.0, 0.0)
    center, normal = t.arcs.center[k] + np.array(result.setup.part.origin), t.arcs.normal[k]
    n = (p - center) @ normal
    radial = np.linalg.norm(p - center - n[:, None] * normal, axis=1)
    assert (np.diff(turned(start, p, center, normal)) > -1e-6).all()
    share = turned(start, p, center, normal) / t.arcs.sweep[k]
    rise = (start - center) @ normal + share * ((end - start) @ normal)
    return np.hypot(radial - t.arcs.radius[k], n - rise)


def turned(start: np.ndarray, p: np.ndarray, center: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Angle (K,) that the points have gone round from `start`, growing."""
    first = start - center - ((start - center) @ normal) * normal
    side = np.cross(normal, first)
    angles = np.arctan2((p - center) @ side, (p - center) @ first)
    return np.unwrap(np.concatenate([[0.0], angles]))[1:]


def off_circle(a: np.ndarray, b: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Angle (K,) rad from the great circle arc between two directions."""
    normal = np.cross(a, b)
    if np.linalg.norm(normal) < 1e-9:
        return angle(axes, np.broadcast_to(a, axes.shape))
    normal = normal / np.linalg.norm(normal)
    across = np.cross(normal, a)
    share = np.clip(np.arctan2(axes @ across, axes @ a), 0.0, np.arctan2(b @ across, b @ a))
    near = np.cos(share)[:, None] * a + np.sin(share)[:, None] * across
    return angle(axes, near)
