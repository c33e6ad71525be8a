"""No pattern has a text on which its search does not end: none in which a loop can share out the same signs in many ways.

`(?:[A-Z]\\d+\\.?\\d*)*` takes 1000 in four ways, and ten such words in a million: one wrong byte behind them, and a program
is searched for hours. In the body of a loop two open loops over one sign need something between them that must be there.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from re import _parser as sre
from typing import Any

import pytest

from tests.source import ROOT, nodes, product

Item = tuple[Any, Any]
LOOPS = (sre.MAX_REPEAT, sre.MIN_REPEAT)
SIGNS = [chr(k) for k in range(128)]
CALLS = frozenset({"pattern", "re.compile", "re.match", "re.fullmatch", "re.search", "re.sub", "re.findall", "re.finditer",
                   "re.split"})
MOST = 64
"""ways through the alternatives of one body that are looked at"""


def signs(item: Item) -> frozenset[str]:
    """What an item of one sign may stand for."""
    op, value = item
    if op is sre.IN:
        found = frozenset().union(*(signs(one) for one in value if one[0] is not sre.NEGATE))
        return frozenset(SIGNS) - found if (sre.NEGATE, None) in value else found
    if op is sre.CATEGORY:
        letter = {"DIGIT": "d", "SPACE": "s", "WORD": "w"}[str(value).rpartition("_")[2]]
        return frozenset(re.findall(rf"\{letter.upper() if '_NOT_' in str(value) else letter}", "".join(SIGNS)))
    if op is sre.RANGE:
        return frozenset(map(chr, range(value[0], min(value[1], 127) + 1)))
    if op is sre.ANY:
        return frozenset(SIGNS)
    if op is sre.NOT_LITERAL:
        return frozenset(SIGNS) - {chr(value)}
    return frozenset({chr(value)} if op is sre.LITERAL else ())


def open_loop(item: Item) -> frozenset[str]:
    """The signs of an item that takes any number of them."""
    op, value = item
    return signs(value[2][0]) if op in LOOPS and value[1] == sre.MAXREPEAT and len(value[2]) == 1 else frozenset()


def ways(body: Iterable[Item]) -> list[list[Item]]:
    """The ways through a body, groups and alternatives opened."""
    found: list[list[Item]] = [[]]
    for op, value in body:
        parts = ways(value[3]) if op is sre.SUBPATTERN else [
            one for branch in value[1] for one in ways(branch)] if op is sre.BRANCH else [[(op, value)]]
        found = [[*before, *one] for before in found for one in parts][:MOST]
    return found


def shared(way: list[Item]) -> bool:
    """Whether two open loops over one sign may meet, round the end of the body too."""
    for k in range(len(way)):
        for item in [*way[k + 1:], *way[:k + 1]] if open_loop(way[k]) else ():
            if open_loop(way[k]) & open_loop(item):
                return True
            if not (item[0] in LOOPS and item[1][0] == 0) and item[0] not in (sre.AT, sre.ASSERT, sre.ASSERT_NOT):
                break
    return False


def endless(items: Iterable[Item]) -> bool:
    """Whether a loop of a pattern has such a body."""
    for op, value in items:
        inner = [value[3]] if op is sre.SUBPATTERN else value[1] if op is sre.BRANCH else [value[2]] if op in LOOPS else []
        if op in LOOPS and value[1] == sre.MAXREPEAT and any(map(shared, ways(value[2]))):
            return True
        if any(endless(one) for one in inner):
            return True
    return False


def called(function: ast.expr) -> str:
    """`name`, or `module.name`."""
    if isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
        return f"{function.value.id}.{function.attr}"
    return function.id if isinstance(function, ast.Name) else ""


def patterns() -> Iterator[tuple[str, str | bytes]]:
    """(where, pattern) of the packages; not those that are put together from what a function is given."""
    for path in product():
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for node in nodes(path):
            if isinstance(node, ast.Call) and node.args and called(node.func) in CALLS:
                first, known = node.args[0], {}
                if not isinstance(first, ast.Constant):
                    known = vars(import_module(module))
                try:
                    text = eval(compile(ast.Expression(first), module, "eval"), known)
                except (NameError, SyntaxError):
                    continue
                yield f"{module}:{node.lineno}", getattr(text, "pattern", text)


def test_every_search_ends() -> None:
    found = list(patterns())
    assert len(found) > 300
    assert [f"{where} {text!r}" for where, text in found if endless(sre.parse(text))] == []


@pytest.mark.parametrize(("text", "wanted"), [
    (r"(?:[A-Z]\d+\.?\d*)*", True), (r"(?:[A-Z]\d+(?:\.\d*)?)*", False), (r"(?:\s*Q\d+\s*)*", True),
    (r"(?:Q\d+\s*)*", False), (r"[A-Z]\d+\.?\d*", False),
    (r"(?:(?:a+|b)c?)+", True), (r"(?:a+)+", True), (r"(?:\w+[ ]*,\s*)*", False)])
def test_a_search_without_end_is_noticed(text: str, wanted: bool) -> None:
    assert endless(sre.parse(text)) is wanted
