"""Closed lists of words about tables of errors. Light: the command line reads it."""

from __future__ import annotations

from typing import Literal

TableRule = Literal["linear", "spline"]
"""between the rows of a table"""
MapDirections = Literal["machine", "table"]
"""whose directions the values of a map are along: table, those that turn with the rotary axes under the part"""
TableSign = Literal[1, -1]
"""-1: the numbers say how the part moves relative to the tool"""
