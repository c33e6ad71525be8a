"""`pattern(text, flags)`: what `re.compile` gives, compiled when something is first looked for; a small conversion imports
two hundred patterns, 20 ms to compile, and looks for few of them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from re import compile as pattern
else:
    class pattern:
        """Methods and attributes of the compiled pattern, once one is asked for; no argument of functions of `re`."""

        def __init__(self, text: str | bytes, flags: int = 0) -> None:
            self._asked = text, flags

        def __getattr__(self, name: str) -> object:
            if name.startswith("_"):
                raise AttributeError(name)
            value = getattr(re.compile(*self._asked), name)
            setattr(self, name, value)
            return value

__all__ = ["pattern"]
