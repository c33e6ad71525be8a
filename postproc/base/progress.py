"""How far long work is, as stages report it."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""is called with the name of what runs, how much of it is done, and how much there is; with "" before somebody is asked"""
