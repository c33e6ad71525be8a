"""Values as JSON files hold them."""

from __future__ import annotations

from typing import Any


def plain(value: object) -> object:
    """JSON of what is no JSON by itself: a number or truth of an array as what it is, all else (paths) in words."""
    item = getattr(value, "item", None)
    return item() if callable(item) and getattr(value, "ndim", None) == 0 else str(value)


def rounded(value: Any) -> Any:
    """JSON values with numbers of at most 9 decimals, no -0."""
    if isinstance(value, float):
        return round(value, 9) + 0.0
    if isinstance(value, dict):
        return {key: rounded(v) for key, v in value.items()}
    return [rounded(v) for v in value] if isinstance(value, (list, tuple)) else value
