"""What the second witness rests on: the standard library and numpy, nothing of the project, and few lines."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
ROOM = ROOT / "postproc" / "witness"
ALLOWED = {"numpy", "numba", *sys.stdlib_module_names}
MOST_LINES = 4973
"""400 of them for the forms that are no APT text (`other_forms`), 160 for platforms on legs with their errors, for tools
turned about themselves, for splines as blocks, for paths offset back, for links in one plane, for lines of plug-ins, for
platforms that hinges and passive legs hold, 110 for bars and errors of hinges; 30 for long files, whose rows it reads and
holds few at a time, 19 for registers of the tools that the set-up numbers, 13 for decks of cards,
124 for long files: a loop over their characters, a quarter of the time of this room, and columns that it lets go, 50 for
states and feeds that it compares few rows at a time: a fifth less memory"""


def imported(tree: ast.AST) -> Iterator[str]:
    """Every module that is imported, wherever the import stands; also by name through importlib or __import__."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")
        elif isinstance(node, ast.Name) and node.id in ("__import__", "import_module", "exec", "eval"):
            yield f"by {node.id}"
        elif isinstance(node, ast.Attribute) and node.attr == "import_module":
            yield "by import_module"


def foreign(source: str) -> set[str]:
    return {name for name in imported(ast.parse(source))
            if name.split(".")[0] not in ALLOWED and not f"{name}.".startswith("postproc.witness.")}


@pytest.mark.parametrize("path", sorted(ROOM.glob("*.py")), ids=lambda p: p.stem)
def test_the_witness_imports_nothing_of_the_project(path: Path) -> None:
    assert foreign(path.read_text("utf-8")) == set()


@pytest.mark.parametrize("line", ["from toolpaths.units import DEG", "def f():\n    import machines",
                                  "import postproc.job.job",
                                  "from .. import job", "import importlib\nimportlib.import_module('machines')"])
def test_a_foreign_import_is_noticed(line: str) -> None:
    assert foreign(line)


def test_running_the_witness_loads_nothing_of_the_project() -> None:
    """Read and placed: the modules that are then loaded. (The package above it names its own version and loads nothing.)"""
    code = ("import sys; from postproc.witness.clfile import commanded; from postproc.witness import machine;"
            "import postproc.witness.second_reading; commanded(b'GOTO/1,2,3\\nCYCLE/DRILL,FEDTO,1,RAPTO,2,MMPM,3\\n');"
            "print(*(m for m in sys.modules if m.split('.')[0] in ('toolpaths', 'machines', 'postproc')))")
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert {m for m in done.stdout.split() if not m.startswith("postproc.witness")} == {"postproc"}


def test_the_witness_stays_small() -> None:
    assert sum(len(path.read_text("utf-8").splitlines()) for path in ROOM.glob("*.py")) <= MOST_LINES
