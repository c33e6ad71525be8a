"""Values have types: `dict[str, Any]` stands where JSON and TOML begin and end, each `# type: ignore` has its reason."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.test_imports import ROAD, ROOT

UNTYPED = re.compile(r"dict\[\w+, (?:dict\[str, )?Any\]|Mapping\[str, Any\]")
IGNORED = re.compile(r"# type: ignore")
WITH_A_REASON = re.compile(r"# type: ignore\[[a-z-]+\]  # \w")
RULE_WITH_A_REASON = re.compile(r"# noqa: [A-Z]+[0-9]+  # \w")
FIGURES = "figures of --json, and text made of them"
SCHEMA = "a JSON schema"
TABLES = "tables of a TOML file"
COLUMNS = "columns of a table by their names, for replace() or its own class"
BORDERS = {
    "machines/__init__.py": SCHEMA, "machines/loader.py": SCHEMA, "machines/calibration/measurement_file.py": SCHEMA,
    "machines/user_file.py": TABLES, "machines/value_words.py": "what pydantic says of a fault",
    "machines/analysis/report.py": FIGURES, "machines/geometric_error/exchange/survey.py": FIGURES,
    "postproc/report/summary.py": FIGURES, "postproc/report/trace.py": FIGURES, "postproc/report/unwinding.py": FIGURES,
    "postproc/placement/report.py": FIGURES, "postproc/cycle_time/report.py": FIGURES,
    "postproc/cycle_time/conversion.py": FIGURES, "postproc/orientation/report/figures_of_choice.py": FIGURES,
    "postproc/proof/file.py": "the proof file, JSON", "postproc/proof/changes.py": FIGURES,
    "postproc/cli/time.py": FIGURES, "postproc/cli/place.py": FIGURES, "postproc/cli/orient.py": FIGURES,
    "postproc/cli/console.py": FIGURES, "postproc/cli/error_text.py": FIGURES, "postproc/cli/error_files.py": FIGURES,
    "postproc/cli/catalogue.py": FIGURES, "postproc/cli/setup_new.py": FIGURES,
    "postproc/cli/job_defaults.py": "defaults of options", "postproc/setup_sheet/text.py": TABLES,
    "postproc/verification/second_witness.py": TABLES, "postproc/witness/states.py": TABLES,
    "postproc/witness/place.py": TABLES, "postproc/witness/errors.py": TABLES,
    "postproc/witness/machine.py": TABLES, "postproc/witness/evidence.py": TABLES,
    "toolpaths/interrupted_runs.py": "the journal, JSON",
    "toolpaths/compiled.py": "keywords of numba", "toolpaths/drawing.py": "keywords of matplotlib",
    "toolpaths/shapes.py": "names of a function that is made",
    "toolpaths/cl/tools.py": "fields of Tool as records state them", "postproc/setup/files.py": TABLES,
    "postproc/pipeline/result.py": COLUMNS, "postproc/joints/refined_moves.py": COLUMNS,
    "postproc/reference/moves.py": COLUMNS, "postproc/cycle_time/blocks.py": COLUMNS,
    "postproc/readback/execution/rows.py": COLUMNS}
"""files with dictionaries of anything, and what comes in or goes out there"""


def files() -> dict[str, str]:
    return {path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
            for top in ROAD for path in sorted((ROOT / top).rglob("*.py"))}


def unreasoned(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if IGNORED.search(line) and not WITH_A_REASON.search(line)]


def test_dictionaries_of_anything_stand_at_borders() -> None:
    found = {file for file, text in files().items() if UNTYPED.search(text)}
    assert found - set(BORDERS) == set()
    assert set(BORDERS) - found == set(), "no longer there"


def test_no_value_of_a_stage_is_a_dictionary_of_anything() -> None:
    """A field of a class is typed, but for what the second witness has from files."""
    fields = {(file, line.strip()) for file, text in files().items() for line in text.splitlines()
              if re.match(r"    \w+: ", line) and UNTYPED.search(line) and " = {" not in line}
    assert {file for file, _ in fields} <= {"postproc/witness/evidence.py", "toolpaths/cl/tools.py"}, fields


def test_a_type_that_is_passed_over_has_its_reason() -> None:
    found = {file: lines for file, text in files().items() if (lines := unreasoned(text))}
    assert found == {}
    assert sum(len(IGNORED.findall(text)) for text in files().values()) <= 30


def test_nothing_is_silenced_where_types_are_not_checked() -> None:
    """Tests and samples are not type-checked, so that they pass nothing over; rules of ruff have their reasons there too."""
    found = {path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
             for top in ("tests", "samples") for path in sorted((ROOT / top).rglob("*.py")) if path != Path(__file__)}
    assert {file for file, text in found.items() if IGNORED.search(text)} == set()
    everywhere = found | files()
    assert {file for file, text in everywhere.items() for line in text.splitlines()
            if "# noqa" in line and not RULE_WITH_A_REASON.search(line)} == set()


@pytest.mark.parametrize(("line", "known"), [
    ("x = 1  # type: ignore", False), ("x = 1  # type: ignore[arg-type]", False),
    ("x = 1  # type: ignore[arg-type]  # by names of fields", True)])
def test_a_reason_is_known(line: str, known: bool) -> None:
    assert (unreasoned(line) == []) == known
