"""Words one edit apart: what a damaged byte makes of a word."""

from __future__ import annotations

from collections.abc import Iterable


def one_edit(a: str, b: str) -> bool:
    """True where one letter more, less or another makes `b` of `a`; False where they are the same."""
    if len(a) < len(b):
        a, b = b, a
    if a == b or len(a) - len(b) > 1:
        return False
    at = next((i for i in range(len(b)) if a[i] != b[i]), len(b))
    return a[at + 1:] == b[at + (len(a) == len(b)):]


def nearest(word: str, vocabulary: Iterable[str]) -> str:
    """The first word of the vocabulary that is one edit away, "" where there is none."""
    return next((known for known in vocabulary if one_edit(word, known)), "")
