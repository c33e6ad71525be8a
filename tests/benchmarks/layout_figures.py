"""Figures of the layout: `python tests/benchmarks/layout_figures.py [REVISION ...]`; of the working tree without one.

Circles of files and of rooms by imports (those in functions and for the type checker too; the front doors
`__init__.py` left out), files per room, lines of files and functions (median, 90 %, largest), lines of product and of tests;
of the working tree also the rows of files in each recipe of CONTRIBUTING.md, without those that are only read.
"""

from __future__ import annotations

import ast
import io
import statistics
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
TOPS = ("toolpaths", "machines", "postproc")


def circles(edges: dict[str, set[str]]) -> list[list[str]]:
    """Strongly connected parts of more than one node (Tarjan)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in sorted(edges.get(node, set())):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            part = [stack.pop()]
            while part[-1] != node:
                part.append(stack.pop())
            if len(part) > 1:
                found.append(sorted(part))

    for node in sorted(edges):
        if node not in index:
            visit(node)
    return found


def module(root: Path, path: Path) -> str:
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(tree: ast.Module, known: set[str]) -> set[str]:
    """Modules of the project that a file imports anywhere."""
    result = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            result |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            result |= {f"{node.module}.{one.name}" if f"{node.module}.{one.name}" in known else node.module
                       for one in node.names}
    return result & known


def spread(values: list[int]) -> str:
    ranked = sorted(values)
    return f"median {statistics.median(ranked):g}, 90 % {ranked[int(0.9 * len(ranked))]}, largest {ranked[-1]}"


def figures(root: Path) -> str:
    files = {module(root, p): p for top in TOPS for p in sorted((root / top).rglob("*.py"))}
    texts = {name: p.read_text("utf-8") for name, p in files.items()}
    trees = {name: ast.parse(text) for name, text in texts.items()}
    edges = {name: imported(tree, set(files)) - {name} for name, tree in trees.items()}  # front doors too
    room = {name: p.parent.relative_to(root).as_posix() for name, p in files.items()}
    rooms: dict[str, set[str]] = {one: set() for one in room.values()}
    doors = {name for name, p in files.items() if p.name == "__init__.py"}
    for name, others in edges.items():
        if name not in doors:
            rooms[room[name]] |= {room[other] for other in others - doors} - {room[name]}
    count = Counter(room[name] for name, p in files.items() if p.name != "__init__.py")
    functions = [node.end_lineno - node.lineno + 1 for tree in trees.values() for node in ast.walk(tree)
                 if isinstance(node, ast.FunctionDef) and node.end_lineno]
    lines = {name: text.count("\n") for name, text in texts.items()}
    tests = [p.read_text("utf-8").count("\n") for p in (root / "tests").rglob("*.py")]
    of_files, of_rooms = circles(edges), circles(rooms)
    return "\n".join([
        f"circles of files: {len(of_files)} {[len(one) for one in of_files]}, of rooms: {len(of_rooms)} "
        f"{[one if len(one) < 4 else len(one) for one in of_rooms]}",
        f"rooms: {len(count)}, files per room: {spread(list(count.values()))}; most: "
        + ", ".join(f"{name} {n}" for name, n in count.most_common(6)),
        f"functions: {len(functions)}, lines of each: {spread(functions)}",
        f"files: {len(files)}, lines of each: {spread(list(lines.values()))}",
        f"lines: product {sum(lines.values())}, tests {sum(tests)} in {len(tests)} files"])


def recipes(text: str) -> str:
    """Rows of files of each recipe."""
    found = []
    for part in text.split("\n### ")[1:]:
        rows = [row for row in part.splitlines() if row.startswith("| ") and not row.startswith("| file |")]
        found.append(f"{part.splitlines()[0]} {sum('read only' not in row for row in rows) or 1}")
    return "files to touch: " + ", ".join(found)


def main() -> None:
    sys.setrecursionlimit(10_000)
    for revision in sys.argv[1:] or [""]:
        print(revision or "working tree")
        if not revision:
            print(figures(ROOT), recipes((ROOT / "CONTRIBUTING.md").read_text("utf-8")), sep="\n")
            continue
        made = subprocess.run(["git", "archive", revision, *TOPS, "tests"], cwd=ROOT, check=True,
                              capture_output=True)
        with tempfile.TemporaryDirectory() as folder, tarfile.open(fileobj=io.BytesIO(made.stdout)) as archive:
            archive.extractall(folder)  # our own, of git
            print(figures(Path(folder)))


if __name__ == "__main__":
    main()
