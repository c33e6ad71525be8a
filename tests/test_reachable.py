"""Reachable or gone: what the packages define is used by the packages, by the samples' scripts or by an
example of a README, not by tests alone, but for what is listed."""

from __future__ import annotations

import ast
import importlib
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from machines.kinds import BUILT_IN
from tests.source import ROOT, product, tree, walked

PRODUCT = product()
SAMPLES = sorted((ROOT / "samples").rglob("*.py"))
PAGES = [p for p in sorted(ROOT.glob("*.md")) + sorted(p for top in ("toolpaths", "machines", "postproc") for p in
                                                       (ROOT / top).rglob("*.md")) if "```python" in p.read_text("utf-8")]
LISTED = {
    "_Packer.persistent_id": "called by pickle", "_Unpacker.persistent_load": "called by pickle",
    "Toolpath.from_arrays": "paths of other programs, for users of the package (docs/python.md)",
    "Toolpath.equals": "what a round trip means; for users of the package",
    "CorrectedCommands.tip_residual": "a result of `correct`, for users of the package",
    "CorrectedCommands.axis_residual": "likewise",
    "PlannedMotion.trajectories": "samples of what is planned, for users of the package (postproc/README.md)",
    "StretchSpeeds.lowest": "a result of `Plan.blocks`, in the example of feedrate/README.md",
    "__getattr__": "called by Python",
    "Argument.get_usage_pieces": "called by typer", "Argument.display_type_rich": "likewise",
    "Option._get_number_range_help_str": "likewise", "Group.list_commands": "likewise",
    "declared": "what a class declares of its arrays: tests/toolpaths/test_shapes.py looks at every dataclass",
}
"""name: why it stays"""
BLOCK_ENDS = ("by_approach", "tip_rates", "later", "goes_on", "like")
"""fields that are handed to a compiled loop all together"""


def module(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(found: ast.AST) -> Iterator[tuple[str, str]]:
    """(module, name) of each import, and of each attribute of an imported module."""
    alias: dict[str, str] = {}
    for node in walked(found):
        if isinstance(node, ast.ImportFrom) and node.module:
            for one in node.names:
                alias[one.asname or one.name] = f"{node.module}.{one.name}"
                yield node.module, one.name
        elif isinstance(node, ast.Import):
            for one in node.names:
                alias[one.asname or one.name.split(".")[0]] = one.name if one.asname else one.name.split(".")[0]
    for node in walked(found):
        if isinstance(node, ast.Attribute):
            names, inner = [node.attr], node.value
            while isinstance(inner, ast.Attribute):
                names.insert(0, inner.attr)
                inner = inner.value
            if isinstance(inner, ast.Name) and inner.id in alias:
                whole, _, last = ".".join((alias[inner.id], *names)).rpartition(".")
                yield whole, last


def examples(path: Path) -> list[ast.Module]:
    """The Python examples of a page."""
    return [ast.parse(text) for text in re.findall(r"```python\n(.*?)```", path.read_text("utf-8"), re.DOTALL)]


def words(found: ast.AST) -> Iterator[str]:
    """Attributes, and texts that may name one."""
    for node in walked(found):
        if isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.isidentifier():
            yield node.value


@cache
def users() -> list[ast.AST]:
    return [*map(tree, (*PRODUCT, *SAMPLES)), *(one for page in PAGES for one in examples(page))]


def defined(node: ast.stmt) -> list[str]:
    """Names that a statement at the top of a file defines, but for functions that a decorator registers."""
    if isinstance(node, ast.FunctionDef):
        return [] if node.decorator_list else [node.name]
    if isinstance(node, ast.ClassDef):
        return [node.name]
    return [name for name in _targets(node) if not name.startswith("__")]


def _targets(node: ast.stmt) -> Iterator[str]:
    """Names that an assignment gives a value."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return (one.id for one in targets if isinstance(one, ast.Name))


def unused(file: ast.Module, imported: set[str]) -> Iterator[str]:
    """Names of a file that nobody imports, and that no other statement of the file uses."""
    body = [node for node in file.body if "__all__" not in set(_targets(node))]
    inside = [{n.id if isinstance(n, ast.Name) else n.value for n in walked(node)
               if isinstance(n, ast.Name | ast.Constant)} for node in body]
    uses = Counter(name for names in inside for name in names)
    for node, own in zip(body, inside, strict=True):
        yield from (name for name in defined(node) if uses[name] == (name in own) and name not in imported)


@cache
def all_unused() -> dict[str, str]:
    """Name to file of what is unused."""
    imported: dict[str, set[str]] = {}
    for found in users():
        for owner, name in imports(found):
            imported.setdefault(owner, set()).add(name)
    for owner, name in (entry.split(":") for entry in BUILT_IN.values()):
        imported.setdefault(owner, set()).add(name)
    return {name: str(path.relative_to(ROOT)) for path in PRODUCT
            for name in unused(tree(path), imported.get(module(path), set()))}


def test_what_a_file_defines_is_used() -> None:
    assert {name: file for name, file in all_unused().items() if name not in LISTED} == {}


def members(path: Path) -> Iterator[tuple[str, str]]:
    """(class, name) of methods, properties and annotated fields."""
    for found in walked(tree(path)):
        if not isinstance(found, ast.ClassDef):
            continue
        for node in found.body:
            if isinstance(node, ast.FunctionDef):
                by = [ast.unparse(one) for one in node.decorator_list]
                if not node.name.startswith("__") and not any("validator" in one or "serializer" in one for one in by):
                    yield found.name, node.name
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                yield found.name, node.target.id


@cache
def uncalled() -> set[str]:
    """Class.name of members that nobody names."""
    calls = Counter(word for found in users() for word in words(found))
    return {f"{owner}.{name}" for path in PRODUCT for owner, name in members(path) if not calls[name]}


def test_members_are_used() -> None:
    assert uncalled() - set(LISTED) - {f"BlockEnds.{name}" for name in BLOCK_ENDS} == set()


def test_what_is_listed_is_there() -> None:
    """Nothing is excused that is used, or gone."""
    assert set(LISTED) - set(all_unused()) - uncalled() == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_examples_of_a_page_import_what_is_there(page: Path) -> None:
    found = [(owner, name) for one in examples(page) for owner, name in imports(one)
             if owner.split(".")[0] in ("toolpaths", "machines", "postproc")]
    assert found
    assert [one for one in found if not hasattr(importlib.import_module(one[0]), one[1])] == []


def test_a_function_that_only_tests_call_is_noticed() -> None:
    text = "__all__ = ['LEFT']\nLEFT = 1\nUSED = 2\n" \
           "def alone() -> int:\n    return USED + alone()\ndef called() -> int:\n    return 1\n"
    assert set(unused(ast.parse(text), {"called"})) == {"LEFT", "alone"}
