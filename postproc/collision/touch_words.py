"""A pair of tool and body that comes too near, in words."""

from __future__ import annotations

import math

from postproc.collision.form import PARTS


def touch_words(tool: int, part: int, body: str, distance: float, limit: float) -> str:
    """Number of the tool, which part of it, name of the body, mm between them (-inf: the tool is inside) and allowed."""
    who = f"{PARTS[part]} of T{tool}"
    if distance == -math.inf:
        return f"{who} is inside {body}"
    if limit < 0.0:
        return f"{who} cuts {-distance:.3f} mm into {body}, allowed {-limit:.3f}"
    if distance <= 0.0:
        return f"{who} touches {body} by {-distance:.2f} mm"
    return f"{who} comes within {distance:.2f} mm of {body}, allowed {limit:.2f}"
