"""The drilling cycles of a controller file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from machines.user_model import UserModel
from postproc.controllers.texts import CYCLE_VALUES, placeholders


class CannedCycle(UserModel):
    """One drilling cycle of the controller."""

    code: Annotated[str, placeholders(*CYCLE_VALUES)]
    """its code, or its whole text with values in braces (`CYCLE_VALUES`), a line each"""
    peck: str = ""
    """word of the peck depth"""
    less: str = ""
    """word of what each next peck is less"""
    least: str = ""
    """word of the least peck"""
    dwell: str = ""
    """word of the dwell"""

    @property
    def states_retract(self) -> bool:
        """True where it names the level that it retracts to."""
        return "{retract}" in self.code or "{second}" in self.code


class Cycles(UserModel):
    """Canned cycles by the kind of the CL file.

    Where a kind is missing, DRILL, THRU, CSINK, FACE, DEEP, BRKCHP, BORE and REAM become single moves; others
    are refused. TAP_LEFT stands for taps that turn anti-clockwise.
    """

    enabled: bool = True
    """canned cycles are written, else single moves"""
    table: dict[str, CannedCycle] = Field(default_factory=dict)
    """by kind"""
    with_dwell: dict[str, CannedCycle] = Field(default_factory=dict)
    """used instead where the cycle dwells"""
    falling: dict[str, CannedCycle] = Field(default_factory=dict)
    """used instead where the pecks behind the first are smaller (DEEP2: 1STPECK, SUBPECK); missing: single moves"""
    falling_relies_on: str = ""
    """what is assumed of the control's falling pecks: a comment in the header of programs that have them"""
    to_initial: str = "G98"
    """retract to the level that the tool came from"""
    to_plane: str = "G99"
    """retract to the R plane"""
    cancel: str = "G80"
    """ends a canned cycle; empty: it ends by itself"""
    planes: tuple[int, ...] = (17,)
    """planes in which cycles may run"""
    rigid_only: tuple[str, ...] = ("TAP",)
    """kinds that must not become single moves, next to those that never do"""
    rigid_option: str = ""
    """the option that rigid tapping needs: a comment in the header of programs that tap, where the machine file does not
    confirm it"""
    floating: str = ""
    """what taps need where rigid tapping is not fitted, and `codes.rigid_tap` is left out: a comment in the header; empty:
    the control's cycles are rigid alone, taps are then refused"""
    dwell_milliseconds: bool = False
    """the dwell of a cycle is a whole number of ms, else s"""
    rises_first: bool = False
    """before a hole that ends at the first level of its sequence, a tool that stands at the plane of the hole is brought to
    that level on the path there (RS274/NGC)"""
    plane_at_start: bool = False
    """cycles return to the R plane until the program states the level (LinuxCNC when it is switched on)"""
    peck_relief: float = Field(default=0.254, ge=0.0)
    """mm before the last depth to which the tool returns rapidly"""
