"""Words one edit apart: what a damaged byte, or two letters typed in the wrong order, make of a word."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache

_ANY = "\0"
"""in the place of one letter"""


def one_edit(a: str, b: str) -> bool:
    """True where one letter more, less or another, or two neighbours exchanged, make `b` of `a`; False where they are the
    same."""
    if len(a) < len(b):
        a, b = b, a
    if a == b or len(a) - len(b) > 1:
        return False
    at = next((i for i in range(len(b)) if a[i] != b[i]), len(b))
    exchanged = len(a) == len(b) and a[at:at + 2] == b[at:at + 2][::-1] and a[at + 2:] == b[at + 2:]
    return exchanged or a[at + 1:] == b[at + (len(a) == len(b)):]


def nearest(word: str, vocabulary: Iterable[str]) -> str:
    """The first word of the vocabulary that is one edit away, "" where there is none."""
    words = tuple(vocabulary)
    known = _by_form(words)
    return next((words[k] for k in sorted({k for form in _forms(word) for k in known.get(form, ())})
                 if one_edit(word, words[k])), "")


@lru_cache(maxsize=64)
def _by_form(words: tuple[str, ...]) -> dict[str, tuple[int, ...]]:
    """Which words have a form: of those one edit apart one is shared, so that a word is not held against them all."""
    result: dict[str, tuple[int, ...]] = {}
    for k, word in enumerate(words):
        for form in _forms(word):
            result[form] = (*result.get(form, ()), k)
    return result


def _forms(word: str) -> Iterator[str]:
    """The word, with any one letter another, and without it."""
    yield word
    for i in range(len(word)):
        yield word[:i] + _ANY + word[i + 1:]
        yield word[:i] + word[i + 1:]
