"""What the reader shares with the writers is listed, all of it, and every golden that the list names is there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.source import nodes

ROOM = Path(__file__).parents[3] / "postproc"
LISTED = (ROOM / "readback" / "SHARED.md").read_text("utf-8")
WRITERS = ("compile", "word_rows", "rounding", "feed", "commands", "canned", "cycle_refusals", "sections", "block_delete",
           "coolant",
           "modes", "planes", "zero_entry", "word_arcs", "program", "program_header", "blocks", "split_operations")
"""stages that a program goes through on its path to the text, next to controllers/ and writing/"""
OTHERS = ("text", "execution", "comparison", "dialects", "cycle_time", "witness", "orientation", "joints", "feedrate",
          "collision",
          "correction", "placement", "proof")
PROJECT = ("postproc", "machines", "toolpaths")
BOTH = re.compile(r"[A-Z][A-Z0-9_]*")
KEYS = re.compile(r"(?:controller|codes_of|spec)\.([a-z_]+)(?:\.([a-z_]+))?")
TABLES = {"codes", "program", "start", "stops", "cutter_compensation", "cycles", "feed", "format", "kinematics", "modes",
          "tools", "arcs", "comment", "subprograms", "writer", "grain",
          "known_smoothing"}


def imported(files: list[Path]) -> set[tuple[str, str]]:
    """(module, name) of all that files import from the project."""
    found = set()
    for file in files:
        for node in nodes(file):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in PROJECT:
                found |= {(node.module, name.name) for name in node.names}
    return found


def writer_files() -> list[Path]:
    found = sorted([*(ROOM / "controllers").glob("*.py"), *(ROOM / "writing").glob("*.py")])
    for stem in WRITERS:
        files = [f for f in ROOM.rglob(f"{stem}.py") if f.parent.name not in OTHERS]
        assert len(files) == 1, (stem, files)
        found += files
    return found


def readers() -> list[Path]:
    return [*sorted((ROOM / "readback").rglob("*.py")), ROOM / "verification" / "read_back.py"]


def shared() -> set[str]:
    """Names that the reader imports from a writer's module, and capital names that both import from anywhere."""
    theirs, ours = imported(writer_files()), imported(readers())
    modules = {".".join(file.relative_to(ROOM.parent).with_suffix("").parts) for file in writer_files()}
    return {name for module, name in ours if module in modules} | {
        name for module, name in theirs & ours if BOTH.fullmatch(name)}


def listed(part: int) -> set[str]:
    """What stands in the first column of a table of the list."""
    rows = re.findall(r"(?m)^\| (`[^|]*?) \|", LISTED.split("\n## ")[part])
    return {name for row in rows for name in re.findall(r"`([^`]+)`", row)}


def asked() -> set[str]:
    """Keys of the controller file in the reader's code: `table`, or `table.key`."""
    found = set()
    for file in readers():
        for table, key in KEYS.findall(file.read_text("utf-8")):
            if table in TABLES:
                found.add(f"{table}.{key}" if key and not key.startswith("get") else table)
    return found


def test_every_name_that_both_sides_import_is_listed() -> None:
    assert shared() - listed(1) == set(), "not in readback/SHARED.md: list it, with a golden from the maker's page"
    assert {"PLANE_COLUMNS", "switched_by", "table_axes"} <= shared(), "the walk finds nothing any more"


def test_every_key_of_the_controller_file_that_the_reader_asks_for_is_listed() -> None:
    known = set(listed(2))
    known |= {key.split(".")[0] for key in known}
    assert asked() - known == set(), "not in readback/SHARED.md: list it, with a golden from the maker's page"
    assert {"codes.machine_coordinates", "cycles.peck_relief"} <= asked(), "the walk finds nothing any more"


def test_nothing_is_listed_that_is_not_shared() -> None:
    assert listed(1) - shared() == set()
    tables = {key.split(".")[0] for key in asked()}
    assert {key for key in listed(2) if key.split(".")[0] not in tables} == set()


@pytest.mark.parametrize("golden", sorted(set(re.findall(r"`(test_\w+)`", LISTED))))
def test_every_golden_that_is_named_is_there(golden: str) -> None:
    own = [Path(__file__), Path(__file__).with_name("test_maker_pages.py")]
    assert any(f"def {golden}(" in file.read_text("utf-8") for file in own), golden
