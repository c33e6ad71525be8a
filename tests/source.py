"""Source files of the project, read and taken apart once for all tests that look at them."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]


@cache
def tree(path: Path) -> ast.Module:
    """The syntax of a file; nobody changes it."""
    return ast.parse(written(path))


@cache
def written(path: Path) -> str:
    """A file as it stands."""
    return path.read_text("utf-8")


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of a file, in the order of `ast.walk`."""
    return walked(tree(path))


@cache
def walked(top: ast.AST) -> tuple[ast.AST, ...]:
    """All nodes at and below one, in the order of `ast.walk`, which takes twice as long; nobody changes them."""
    found = [top]
    for node in found:
        for name in node._fields:
            value = getattr(node, name, None)
            if isinstance(value, ast.AST):
                found.append(value)
            elif isinstance(value, list):
                found += [one for one in value if isinstance(one, ast.AST)]
    return tuple(found)


@cache
def product() -> tuple[Path, ...]:
    """Every module of the three packages."""
    return tuple(sorted(p for top in ("toolpaths", "machines", "postproc") for p in (ROOT / top).rglob("*.py")))
