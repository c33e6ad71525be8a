"""What the time would be with one limit of one axis changed: counted again by the time model, not guessed."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from machines.choices import MotionOrder
from postproc.cycle_time.estimate import Estimate, scaled, timed, total
from postproc.cycle_time.shares import shares

FACTORS = (0.5, 0.75, 1.0, 1.5, 2.0)
"""of the limit"""
MOST = 6
"""limits that are looked at: those that hold longest"""
LEAST = 0.002
"""share of the time that a limit must hold to be looked at"""
BLOCKS = 50_000
"""blocks up to which times are counted again"""
ORDERS: tuple[MotionOrder, ...] = get_args(MotionOrder)


def what_if(e: Estimate) -> dict[str, Any]:
    """For the limits that hold longest the times at FACTORS of each; none for programs of more than BLOCKS blocks."""
    held = sorted(((seconds, letter, order) for letter, values in shares(e).limiting.items()
                   for order, seconds in zip(ORDERS, values, strict=True) if seconds > LEAST * e.seconds), reverse=True)
    counted = len(e.blocks) <= BLOCKS
    return {"counted": counted, "factors": list(FACTORS), "largest_program_blocks": BLOCKS,
            "limits": [{"axis": letter, "limit": order, "held_s": seconds,
                        "seconds": [_seconds(e, letter, order, factor) for factor in FACTORS]}
                       for seconds, letter, order in held[:MOST]] if counted else []}


def _seconds(e: Estimate, letter: str, order: MotionOrder, factor: float) -> float:
    if factor == 1.0:
        return e.seconds
    blocks = scaled(e.blocks, order, np.array([name == letter for name in e.blocks.axes.letters]), factor)
    return float(total(blocks, timed(blocks, e.model)))
