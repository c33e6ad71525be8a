"""Patterns that are compiled when something is first looked for, next to those of the standard library."""

from __future__ import annotations

import copy
import pickle
import re

import pytest

from toolpaths.pattern import pattern


@pytest.mark.parametrize("text, flags, within", [(r"a(?P<one>b+)", re.IGNORECASE, "xABBz"), (rb"(?m)^\d", 0, b"a\n1")])
def test_it_finds_what_re_finds(text: str, flags: int, within: str) -> None:
    one, other = pattern(text, flags), re.compile(text, flags)
    found, known = one.search(within), other.search(within)
    assert found is not None and known is not None and found.span() == known.span() and found.re is known.re
    assert one.match(within) is other.match(within) is None and one.pattern == text and one.groupindex == other.groupindex
    assert one.sub(within[:1], within) == other.sub(within[:1], within)
    assert pickle.loads(pickle.dumps(pattern(text, flags))).flags == copy.deepcopy(pattern(text, flags)).flags == other.flags


def test_it_is_not_compiled_before() -> None:
    late = pattern("(")  # wrong, and nobody has looked
    with pytest.raises(re.error, match="unterminated"):
        late.search("a")
    with pytest.raises(AttributeError):
        pattern("a").none_such  # noqa: B018  # asked for, as a method would be
