"""The page that says what is proved: every test, file and planted fault that it names is there."""

from __future__ import annotations

import ast
import re

import pytest

from tests.source import ROOT, nodes

PAGE = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
FAULTS = ROOT / "tests" / "mutants"


def rows(heading: str) -> list[list[str]]:
    """Cells of the table under a heading, without its head."""
    part = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in part.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[1:]]


def test_every_test_that_is_named_is_there() -> None:
    table = rows("Rules of the controls")
    assert len(table) > 20
    for rule, _, test, _ in table:
        file, _, name = test.strip("`").partition("::")
        found = nodes(ROOT / file)
        assert any(isinstance(node, ast.FunctionDef) and node.name == name for node in found), (rule, test)


def test_every_rule_has_its_page_and_its_planted_fault() -> None:
    assert all(all(cells) and len(cells) == 4 for cells in rows("Rules of the controls"))
    faults = [cells[3] for cells in rows("Rules of the controls") if cells[3] != "-"]
    assert len(set(faults)) == len(faults), "a fault of its own for each rule"


@pytest.mark.skipif(not FAULTS.is_dir(), reason="the table of planted faults is not there")
def test_every_planted_fault_that_is_named_is_in_the_table() -> None:
    known = {node.value for file in FAULTS.glob("faults*.py") for node in nodes(file)
             if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    assert {cells[3] for cells in rows("Rules of the controls")} - known == {"-"}


def test_assumptions_are_numbered_and_the_statement_names_them_all() -> None:
    numbers = [cells[0] for cells in rows("What it rests on")]
    assert numbers == [f"A{k}" for k in range(1, len(numbers) + 1)] and f"Under A1 to A{len(numbers)}" in PAGE
    assert all(all(cells) for cells in rows("What it rests on"))


def test_every_file_and_diagnostic_that_is_named_is_there() -> None:
    for path in re.findall(r"`((?:postproc|machines|toolpaths)/[\w/.-]+)`", PAGE):
        assert (ROOT / path).exists(), path
    code = "\n".join(f.read_text("utf-8") for f in (ROOT / "postproc").rglob("*.py"))
    for name in re.findall(r"`((?:gcode|verify|pivot|opskip)\.[a-z_]+)`", PAGE):
        assert f'"{name}"' in code or f'"{name.split(".")[1]}"' in code, name
    for link in re.findall(r"\]\(([^)]+)\)", PAGE):
        assert (ROOT / link).exists(), link
