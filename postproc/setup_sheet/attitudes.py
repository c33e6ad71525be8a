"""How the part may be turned on the table, by the tool axes of its cuts: never by the names of systems alone."""

from __future__ import annotations

import numpy as np

from machines.machine import Machine
from postproc.setup.system import placed
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, rotation
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind, Role, Toolpath
from toolpaths.units import DEG

_SAME = 1e-6
"""by which entries of two rotations that are one may differ"""
_MANY = 400
"""directions that are looked at, more are thinned out evenly"""
_QUARTER = 0.5 * np.pi


@dataclass(frozen=True)
@arrays(turn="3 3")
class Attitude:
    """A rotation of the part frame on the table, and why.

    Attributes:
        turn (3, 3): part to table
        unreachable: share of the tool axes of the cuts that the machine cannot take
        below: share that come from below the table
    """

    turn: Floats
    why: str
    unreachable: float
    below: float


def attitudes_of(toolpath: Toolpath, machine: Machine, axis_tolerance: float) -> list[Attitude]:
    """Attitudes, the likely ones first: those in which the machine can take every tool axis of the cuts, and the
    tool comes from above; among them the part as CAM has it, then by the systems of the file, then by the mean axis.

    Args:
        axis_tolerance: rad
    """
    axes = _axes(toolpath)
    home = machine.home_axis
    found = [_judged(turn, why, axes, home, machine, axis_tolerance) for turn, why in _quarters(
        _candidates(toolpath, axes, home), home)]
    return sorted(found, key=lambda one: (one.unreachable > 0.0, one.below > 0.5, one.unreachable))


def _quarters(candidates: list[tuple[Floats, str]], up: Floats) -> list[tuple[Floats, str]]:
    """Each with its quarter turns about the direction `up` (3,) of the table."""
    turns = [(np.round(rotation(up, np.array([n * _QUARTER]))[0], 15), n) for n in (0, 1, 3, 2)]
    return [(np.asarray(turn @ by), f"{why}, turned by {90 * n} degrees on the table" if n else why)
            for by, why in candidates for turn, n in turns]


def _axes(toolpath: Toolpath) -> Floats:
    """(K, 3) tool axes of the cuts, each direction once; of all moves where nothing cuts."""
    cuts = ((toolpath.kind != Kind.RAPID) | (toolpath.role == Role.HOLE)) & (toolpath.role != Role.START)
    axes = toolpath.axis[cuts] if cuts.any() else toolpath.axis
    _, first = np.unique(np.round(axes, 6), axis=0, return_index=True)
    first = np.sort(first)
    picked = np.unique(np.linspace(0, len(first) - 1, min(len(first), _MANY)).astype(int))
    return np.asarray(axes[first[picked]])


def _candidates(toolpath: Toolpath, axes: Floats, home: Floats) -> list[tuple[Floats, str]]:
    found: list[tuple[Floats, str]] = [(np.eye(3), "as the CAM system has it")]
    for frame in toolpath.frames:
        found.append((placed(frame).rotation.T, f"system {frame.name} of the CL file stands upright"))
    mean = axes.mean(axis=0)
    if np.linalg.norm(mean) > 0.1:
        found.append((_least(mean / np.linalg.norm(mean), home), "the mean tool axis of the cuts stands upright"))
    found.append((_least(axes[0], home), "the tool axis of the first cut stands upright"))
    result: list[tuple[Floats, str]] = []
    for turn, why in found:
        if not any(np.abs(turn - other).max() < _SAME for other, _ in result):
            result.append((turn, why))
    return result


def _least(a: Floats, b: Floats) -> Floats:
    """(3, 3) the least rotation that takes the unit direction a (3,) to b (3,)."""
    across, cosine = np.cross(a, b), float(a @ b)
    size = float(np.linalg.norm(across))
    if size < 1e-9:
        if cosine > 0.0:
            return np.eye(3)
        across = np.cross(a, np.eye(3)[int(np.abs(a).argmin())])
        return np.asarray(rotation(across / np.linalg.norm(across), np.array([np.pi]))[0])
    return np.asarray(rotation(across / size, np.array([np.arctan2(size, cosine)]))[0])


def _judged(turn: Floats, why: str, axes: Floats, home: Floats, machine: Machine, tolerance: float) -> Attitude:
    turned = axes @ turn.T
    good = _reached(machine, turned, tolerance)
    return Attitude(turn, why, 1.0 - float(good.mean()), float((turned @ home < -1e-6).mean()))


def _reached(machine: Machine, axes: Floats, tolerance: float) -> Bools:
    """(K,) tool axes that the machine takes somewhere with its rotary joints inside travel."""
    kin = machine.kinematics
    near = kin.nearest_axis(axes)
    good = np.asarray(angle_between(near, axes) <= max(tolerance, 1e-6 * DEG))
    if not kin.straight_slides:
        return good
    rotary = np.array(machine.rotary)
    if not rotary.any():
        return good
    tip = np.tile(kin.forward(machine.home[None, :])[0], (len(axes), 1))
    q = kin.inverse(tip, near, near=machine.home)[:, :, rotary]
    low, high = machine.limits.lower[rotary], machine.limits.upper[rotary]
    turns = 2.0 * np.pi * np.arange(-1, 2)[:, None, None, None]
    inside = ((q + turns >= low - 1e-9) & (q + turns <= high + 1e-9)).any(axis=0).all(axis=-1).any(axis=0)
    return np.asarray(good & inside)
