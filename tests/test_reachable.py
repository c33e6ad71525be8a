"""Reachable or gone: no public function of the packages is called by tests alone, but for those that are listed."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.source import ROOT, nodes, product, tree

PRODUCT = product()
OTHERS = sorted((ROOT / "samples").rglob("*.py"))
LISTED = {
    "machine_path": "one stretch alone: the plain form of `machine_paths`, which a test compares with it",
    "transport": "the matrix of C 1.25 itself, which a test compares the sensitivities with",
}
"""name: why it stays"""


def public(path: Path) -> list[str]:
    """Functions at the top of a file, without decorators that register them."""
    return [node.name for node in tree(path).body
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and not node.decorator_list]


def used(path: Path) -> Iterator[str]:
    """Names that a file uses, imports not counted; texts too, as packages look names up by `__getattr__`."""
    for node in nodes(path):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.isidentifier():
            yield node.value


def test_public_functions_are_called() -> None:
    calls = Counter(name for path in (*PRODUCT, *OTHERS) for name in used(path))
    alone = {name: str(path.relative_to(ROOT)) for path in PRODUCT for name in public(path) if not calls[name]}
    assert {name: file for name, file in alone.items() if name not in LISTED} == {}
    assert set(LISTED) <= set(alone)
