"""What a stop of the program does to the machine."""

from __future__ import annotations

from typing import Literal

Stop = Literal["spindle and coolant", "spindle", "nothing"]
"""what it switches off"""
