"""The shape of the repository: one-way imports, light start-up, nothing stray at the top."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROAD = ("toolpaths", "machines", "postproc")
"""Each package may import itself and those before it."""
HEAVY = {"numpy", "numba", "scipy", "rich"}
TOP = {"README.md", "LICENSE", "CHANGELOG.md", "pyproject.toml", "requirements.lock", "Makefile",
       "postproc", "machines", "toolpaths", "tests", "samples"}


def imported(source: str) -> Iterator[str]:
    """Top-level names of all modules that the text imports, wherever the import stands; relative ones left out."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module.split(".")[0]


def against_the_road(package: str, source: str) -> set[str]:
    return {name for name in imported(source) if name == "tests" or name in ROAD[ROAD.index(package) + 1:]}


@pytest.mark.parametrize("package", ROAD)
def test_imports_go_one_way(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    wrong = {str(path.relative_to(ROOT)): against_the_road(package, path.read_text()) for path in files}
    assert files and {name: found for name, found in wrong.items() if found} == {}


def test_a_wrong_way_is_noticed() -> None:
    assert against_the_road("toolpaths", "def f():\n    from machines.load import x\n    import postproc.cli") == {
        "machines", "postproc"}
    assert against_the_road("postproc", "import machines, toolpaths, tests.linuxcnc") == {"tests"}


@pytest.mark.parametrize("module", [*ROAD, "postproc.cli"])
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
