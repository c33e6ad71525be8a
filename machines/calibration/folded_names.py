"""Many names in few words: EXX[0]+ .. EXX[16]- (34)."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from itertools import groupby

NEAR = 3
"""names that are offered for one that there is not"""
MOST = 24
"""words of a list"""


def stem(name: str) -> str:
    """What a parameter is of: EXX of EXX[3]+, ECC of ECC.cos1; EC0Y is its own."""
    return re.split(r"[\[.]", name, maxsplit=1)[0]


def folded(names: Sequence[str]) -> str:
    """A list of names, neighbours of one stem as the first and the last of them."""
    words = []
    for _, group in groupby(names, stem):
        one = list(group)
        words.append(", ".join(one) if len(one) < NEAR else f"{one[0]} .. {one[-1]} ({len(one)})")
    return ", ".join(words[:MOST]) + (f" and {len(words) - MOST} more" if len(words) > MOST else "")


def near(name: str, known: Sequence[str]) -> str:
    """Which of the known names, or of their stems, are nearest to one that is none of them, and what there is."""
    stems = list(dict.fromkeys(stem(k) for k in known))
    close = difflib.get_close_matches(name, [*stems, *(k for k in known if k not in stems)],
                                      n=NEAR, cutoff=0.6)
    return (f"near it are {', '.join(close)}; " if close else "") + f"the model has {folded(known) or 'none'}"
