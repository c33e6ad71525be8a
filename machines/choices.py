"""Closed lists of words that machine files choose from, and what they mean."""

from __future__ import annotations

from typing import Literal

Stop = Literal["spindle and coolant", "spindle", "nothing"]
"""what a stop of the program switches off"""
RolloverRule = Literal["shortest", "sign", "none"]
"""which path the control takes to a word of a modulo axis"""
Park = Literal["turn", "home"]
"""where an axis without end stops is parked"""
SplineBlocks = Literal["poly", "bspline"]
"""by which a control runs splines"""
BoughtOption = Literal["tilted_planes", "tip_control", "smoothing", "rigid_tapping", "helical", "splines"]
"""option of a control that a shop has bought or not"""
Rapids = Literal["straight", "dog-leg"]
"""path of a rapid of several axes: the straight line, or every axis at its own rapid speed"""
MotionOrder = Literal["velocity", "acceleration", "jerk"]
"""which derivative of a position a limit is of"""
