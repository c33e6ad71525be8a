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
EXECUTED_FACTORS, EXECUTED_MOST, EXECUTED_BLOCKS = (0.5, 1.0, 2.0), 3, 10_000
"""the same where the control is executed, about 0.3 ms a block each time"""
ORDERS: tuple[MotionOrder, ...] = get_args(MotionOrder)


def what_if(e: Estimate) -> dict[str, Any]:
    """For the limits that hold longest the times at some factors of each; none for programs of more than BLOCKS blocks, and
    of EXECUTED_BLOCKS where the control is executed."""
    held = sorted(((seconds, letter, order) for letter, values in shares(e).limiting.items()
                   for order, seconds in zip(ORDERS, values, strict=True) if seconds > LEAST * e.seconds), reverse=True)
    factors, most, largest = (EXECUTED_FACTORS, EXECUTED_MOST, EXECUTED_BLOCKS) if e.model.kind == "control" else (
        FACTORS, MOST, BLOCKS)
    counted = len(e.blocks) <= largest
    return {"counted": counted, "factors": list(factors), "largest_program_blocks": largest,
            "limits": [{"axis": letter, "limit": order, "held_s": seconds,
                        "seconds": [_seconds(e, letter, order, factor) for factor in factors]}
                       for seconds, letter, order in held[:most]] if counted else []}


def _seconds(e: Estimate, letter: str, order: MotionOrder, factor: float) -> float:
    if factor == 1.0:
        return e.seconds
    blocks = scaled(e.blocks, order, np.array([name == letter for name in e.blocks.axes.letters]), factor)
    return float(total(blocks, timed(blocks, e.model)))
