"""What every kinematics promises. Points first, xyz last; mm and rad; NaN where there is no solution.

Kinematics work in the table frame (the frame that carries the part, at the machine origin when q = 0), at the gauge
point of the spindle unless `with_tool(length)` was asked for. The tool axis points from the tip to the spindle.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Self

import numpy as np

from toolpaths.arrays import Bools, Floats


class Kinematics(ABC):
    """Inverse and forward of one machine, vectorised; frozen: `with_tool` gives a changed copy."""

    axis_names: tuple[str, ...]
    """one letter per joint, the order of q"""
    rotary: tuple[bool, ...]
    """True for joints in rad"""
    tool_length: float = 0.0
    """mm from the gauge point to the tip, along the tool axis"""
    branches: int
    """B of `inverse`"""
    slides_affine: bool = False
    slides_square: bool = False
    """True where, at fixed rotary joints, the tip is an affine function of the linear joints (serial machines)"""

    @abstractmethod
    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Joints (B, N, J) that put the tip and axis (N, 3) there; NaN rows where a branch has no solution.

        Rotary joints come as principal values (-pi, pi], branches in a fixed order. Where the solution is a family
        (`singular`), the free joint takes the value in `near` (N, J) or (J,), 0 without it.
        `spin` only matters to machines that can turn the tool about itself under command.
        """

    @abstractmethod
    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, J).

        Spin is the angle about the axis from the reference (the x direction carried by the least rotation that
        takes z to the axis) to the tool's own x direction. Parallel machines take the assembly mode nearest
        `near`, a pose (N, 6) or (6,) as (tip, axis); without it the home mode.
        """

    @abstractmethod
    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq as (N, 6, J), analytic."""

    @abstractmethod
    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v, omega) of the tool relative to the part per joint rate, (N, 6, J), v at the tip, in the table frame."""

    @abstractmethod
    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool direction lies along a rotary axis, so that the inverse is a family."""

    @abstractmethod
    def with_tool(self, length: float) -> Self:
        """The same kinematics at the tip of a tool of that length (mm)."""

    @abstractmethod
    def nearest_axis(self, axis: Floats) -> Floats:
        """The tool directions (N, 3) that the machine can take nearest to `axis` (N, 3); the same where reachable."""

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) of joints q (N, J); see `pose` for `near`."""
        tip, axis, _ = self.pose(q, near)
        return tip, axis

    def carried(self, pose: Floats, q0: Floats, q1: Floats) -> Floats:
        """The pose (N, 6) at joints q0 (N, J) as the rotary joints outside the closed loops turn it on the path to q1 (N,
        J).

        On parallel machines it is what `forward` at q1 takes as `near`: what is left between the two is the slides' part.
        """
        return pose

    @property
    def joints(self) -> int:
        """J"""
        return len(self.axis_names)


def as_points(values: Floats, width: int, name: str) -> Floats:
    """`values` as float64 (N, width).

    Raises:
        ValueError: where the shape differs.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} has shape {array.shape}, expected (N, {width})")
    return array
