"""The shape of the repository: one-way imports without circles, light start-up, sizes, nothing stray at the top."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.source import ROOT, nodes, written

ROAD = ("toolpaths", "machines", "postproc")
"""Each package may import itself and those before it."""
HEAVY = {"numpy", "numba", "scipy", "rich"}
TOP = {"README.md", "ARCHITECTURE.md", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md", "docs", "pyproject.toml",
       "requirements.lock", "MANIFEST.in", "Makefile", "postproc", "machines", "toolpaths", "tests", "samples"}


MOST_LINES, MOST_IN_FUNCTION = 400, 60


@dataclass(frozen=True)
class Text:
    """What is looked at of a file."""

    imports: frozenset[str]
    """all modules and names that it imports, wherever the import stands (in a function, for the type checker
    alone); `from a import b` gives a and a.b"""
    lines: int
    functions: dict[str, int]
    """lines by name"""


def looked_at(source: str, package: str, path: Path | None = None) -> Text:
    """A file of a package, from which relative imports count; its path where it stands on disk."""
    imports, functions = set[str](), dict[str, int]()
    for node in ast.walk(ast.parse(source)) if path is None else nodes(path):
        if isinstance(node, ast.Import):
            imports |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[:len(package.split(".")) + 1 - node.level] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            imports |= {base, *(f"{base}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            functions[f"{node.name}:{node.lineno}"] = (node.end_lineno or 0) - node.lineno + 1
    return Text(frozenset(imports), source.count("\n"), functions)


@cache
def texts() -> Mapping[str, Text]:
    """Every module of the three packages by its dotted name."""
    found = {}
    for package in ROAD:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            folder = ".".join(parts[:-1])
            found[folder if parts[-1] == "__init__" else ".".join(parts)] = looked_at(
                path.read_text("utf-8"), folder, path)
    return found


def graph(found: Mapping[str, Text]) -> dict[str, set[str]]:
    """By module, the modules that it imports."""
    return {name: {other for other in text.imports if other in found and other != name} for name, text in found.items()}


def circle(links: Mapping[str, set[str]]) -> list[str]:
    """One circle of a graph; empty where there is none."""
    try:
        TopologicalSorter(links).prepare()
    except CycleError as fault:
        return list(fault.args[1])
    return []


def against_the_road(package: str, text: Text) -> set[str]:
    tops = {name.split(".")[0] for name in text.imports}
    return {name for name in tops if name == "tests" or name in ROAD[ROAD.index(package) + 1:]}


def test_imports_go_one_way() -> None:
    wrong = {name: against_the_road(name.split(".")[0], text) for name, text in texts().items()}
    assert wrong.keys() >= set(ROAD) and {name: found for name, found in wrong.items() if found} == {}


def test_no_circle_of_files() -> None:
    """Imports in functions and for the type checker count too."""
    assert circle(graph(texts())) == []


def test_a_circle_is_noticed() -> None:
    found = {name: looked_at(text, name.rpartition(".")[0]) for name, text in {
        "a": "from b import c", "a.x": "def f():\n    from a import y",
        "a.y": "if TYPE_CHECKING:\n    from .x import g", "b": "", "b.c": ""}.items()}
    links = graph(found)
    assert links["a"] == {"b", "b.c"} and circle({name: links[name] - {"a"} for name in links})[1:] in (
        ["a.x", "a.y"], ["a.y", "a.x"])


def handed_through() -> Iterator[str]:
    """Names that a file takes from a file of the packages which does not define them: it would hand them through."""
    for path in sorted(p for top in (*ROAD, "tests", "samples") for p in (ROOT / top).rglob("*.py")):
        for node in nodes(path):
            there = ROOT / f"{(node.module or '').replace('.', '/')}.py" if isinstance(node, ast.ImportFrom) else None
            if isinstance(node, ast.ImportFrom) and there and there.is_file() and (node.module or "").startswith(ROAD):
                yield from (f"{path.relative_to(ROOT)}: {node.module}.{one.name}" for one in node.names
                            if one.name not in own_names(there))


@cache
def own_names(path: Path) -> frozenset[str]:
    """What a file defines."""
    return frozenset(node.name if isinstance(node, ast.FunctionDef | ast.ClassDef) else node.id for node in nodes(path)
                     if isinstance(node, ast.FunctionDef | ast.ClassDef)
                     or (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)))


def test_names_come_from_the_file_that_defines_them() -> None:
    """No shims: what has moved is taken from where it is."""
    assert list(handed_through()) == []


def test_a_name_that_is_handed_through_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "shim.py").write_text("from postproc.joints.tracks import TRAVEL_SLACK\nOWN = 1\n")
    assert own_names(tmp_path / "shim.py") == {"OWN"}


def test_commands_given_by_path_find_the_tests_that_they_import() -> None:
    """`python tests/benchmarks/x.py` looks for packages in its own folder: what imports `tests` puts the tree first."""
    lost = [path for path in sorted((ROOT / "tests").rglob("*.py"))
            if f"python {path.relative_to(ROOT).as_posix()}" in (text := written(path)) and "\nfrom tests" in text
            and "sys.path.insert" not in text]
    assert lost == []


def test_files_and_functions_are_short() -> None:
    long = {name: text.lines for name, text in texts().items() if text.lines > MOST_LINES}
    longer = {f"{name}.{function}": lines for name, text in texts().items() for function, lines in text.functions.items()
              if lines > MOST_IN_FUNCTION}
    assert long == {} and longer == {}


def test_a_wrong_way_is_noticed() -> None:
    upwards = looked_at("def f():\n    from machines.load import x\n    import postproc.cli.app", "toolpaths")
    assert against_the_road("toolpaths", upwards) == {"machines", "postproc"}
    assert against_the_road("postproc", looked_at("import machines, toolpaths, tests.linuxcnc", "postproc")) == {"tests"}


@pytest.mark.parametrize("module", [*ROAD, "postproc.cli.app"])
def test_importing_is_light(module: str) -> None:
    """Help and messages must not wait for numerical libraries."""
    code = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert HEAVY & {name.split(".")[0] for name in done.stdout.split()} == set()


def test_nothing_stray_at_the_top() -> None:
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a git work tree")
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    top = {line.strip('"').split("/")[0] for line in listed.splitlines()}
    assert {name for name in top if not name.startswith(".")} - TOP == set()


def test_what_benchmarks_import_of_tests_is_there() -> None:
    """No run of the tests imports them: one had a module that had been moved."""
    gone = []
    for path in sorted((ROOT / "tests" / "benchmarks").glob("*.py")):
        for node in nodes(path):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tests."):
                there = ROOT.joinpath(*(node.module or "").split("."))
                file = there.with_suffix(".py")
                text = file.read_text(encoding="utf-8") if file.exists() else ""
                room = {one.stem for one in there.glob("*")}
                gone += [f"{path.name}: {node.module}.{alias.name}" for alias in node.names
                         if alias.name not in text and alias.name not in room]
    assert not gone
