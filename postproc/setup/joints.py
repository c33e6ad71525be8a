"""`[joints]` of a set-up: what joints are to do where several would."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from machines.user_model import UserModel

SpinChoice = Literal["needed", "planned", "zero"]


class Joints(UserModel):
    """Joints to be preferred where travel and rewinds leave a choice."""

    side: dict[Annotated[str, Field(pattern="^[ABC]$")], Literal["positive", "negative"]] = Field(default_factory=dict)
    """of a rotary axis, e.g. side = {A = "negative"}"""
    start: dict[Annotated[str, Field(pattern="^[ABC]$")], float] = Field(default_factory=dict)
    """where a rotary axis should stand when the program begins, degrees, e.g. start = {C = 180}; default: home"""
    singular_distance: float = Field(default=0.05, gt=0.0, lt=1.0)
    """that a parallel machine keeps from its singular positions: |cos| of rod and slide, least singular value of Jx"""
    spin: SpinChoice | Annotated[float, Field(ge=-75.0, le=75.0)] = "needed"
    """turn of the tool about its own axis on machines that can turn it under command, which a round tool does not notice.
    zero: none; planned: as reach, clearances, singular positions and time have it, along the whole program; needed: none
    where the program converts so, else planned; a number: that angle, degrees"""
    carriers: Literal["planned", "rest"] = "planned"
    """of axes that carry a platform which moves along them by itself too. planned: the path is split between both, so that
    together they take the least time; rest: the platform rests in the middle of its workspace, but for its tilt"""
