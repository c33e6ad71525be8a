"""Words of the trade: what a reader cannot search for does not come back, in texts, names and documents; the
glossary is kept."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from postproc.orientation.candidates.rejections import KINDS
from tests.source import ROOT, nodes, product, tree, written

PAGES = sorted(path for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *(
    p for top in ("toolpaths", "machines", "postproc", "samples") for p in (ROOT / top).rglob("*.md")))
    if path.name != "CHANGELOG.md")
CODE = product()
INSTEAD = {
    "told": "reported, warned, printed", "tell": "say, report, determine", "tells": "says, reports", "telling": "saying",
    "doubt": "uncertainty", "doubts": "uncertainties", "doubtful": "uncertain",
    "beside": "next to, compared with, in addition to", "anew": "again", "dearer": "more expensive",
    "at the least": "down to, at least", "mend": "fix", "mends": "fixes", "mended": "fixed", "cure": "remedy",
    "way": "path, travel, direction, approach direction, method", "ways": "paths, directions",
    "loser": "rejected candidate", "losers": "rejected candidates", "wishes": "preferences", "manner": "options",
    "slip": "wrong unit, sign or order", "slips": "wrong units, signs or order", "slipped": "is wrong",
    "machines on rods": "parallel-kinematic machines", "turned plane": "tilted work plane",
    "arcs resolved": "arcs split into lines", "no control is below": "lower bound",
    "goes to:": "time by activity:", "held by the feed": "limited by programmed feed", "lost by": "rejected:",
    "sense of the arcs": "arc direction", "axis positions": "machine coordinates", "best alone": "fastest for this pass",
    "head of the program": "header of the program (a head carries the spindle)", "head of a program": "header of a program",
    "head of programs": "header of programs", "heads of programs": "headers of programs", "at the head": "in the header",
    "on and on": "without end stops", "pretend": "have the same effect as",
}
WORDS = re.compile(r"(?<![\w.-])(" + "|".join(sorted(INSTEAD, key=len, reverse=True)) + r")(?![\w-])",
                   re.IGNORECASE)
PLACES = {
    ("machines/calibration/README.md", "X way"): "column of measurement tables that shops have",
    ("machines/calibration/measurement_file.py", "X way"): "that column",
    ("machines/geometric_error/tables/readings.py", "(?P<way>[+-]?)"): "group of a regular expression",
    ("machines/calibration/machine_run.py", "X way"): "that column",
    ("machines/calibration/run.py", "way"): "that column",
    ("postproc/explain/codes.toml", "X way"): "that column", ("postproc/explain/codes.toml", "x way"): "that column",
    ("machines/geometric_error/tables/readings.py", "way"): "group of a regular expression",
    ("postproc/time_fit/log.py", "position (S, A): axis positions, mm and degrees"): "columns of a log, no output mode",
    ("samples/calibration/make_measurements.py", "X way"): "that column",
    ("samples/surfaces.py", "One way, along +y"): "passes that are all cut in one direction",
    ("samples/make_joints.py", '("BESIDE", 0.01, 0.0)'): "name of an operation in a sample",
    ("postproc/cli/error_files.py", "told"): "key of JSON",
    ("postproc/cli/error_text.py", "told"): "key of JSON",
}
"""(file, text around the word): why it stays"""
NAME = re.compile(r"(?:^|_)(told|tells?|doubts?|doubtful|beside|anew|dearer|mend|ways?|losers?|wishes|manner|slips?)(?:_|$)",
                  re.IGNORECASE)
NAMES = {"ways_at_mean": "key of JSON", "doubts_s": "key of JSON"}


def texts(path: Path) -> Iterator[tuple[int, str]]:
    """(line, text) of every string of a file, docstrings too."""
    for node in nodes(path):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            for k, line in enumerate(node.value.split("\n")):
                yield node.lineno + k, line


def found(name: str, line: str) -> list[str]:
    """Banned words of a line that no place excuses; `this way` and `half the way` are English that is
    searched for by nobody."""
    if not WORDS.search(line):
        return []
    line = re.sub(r"(?:this|half the|six) ways?\b|`[^`]*`", "", line)
    for (file, text), _ in PLACES.items():
        if file == name and (text == line.strip() or len(text) > 4):
            line = line.replace(text, "")
    return [m[1].lower() for m in WORDS.finditer(line)]


@pytest.mark.parametrize("path", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_documents(path: Path) -> None:
    name = str(path.relative_to(ROOT))
    wrong = [f"{name}:{number}: {word}: write {INSTEAD[word]}" for number, line in enumerate(
        path.read_text("utf-8").splitlines(), 1) for word in found(name, line)]
    assert wrong == []


def test_comments_of_files_that_shops_copy() -> None:
    """Machines, controllers, samples, builds: all that their files say, and comments of the code."""
    files = [ROOT / "Makefile", ROOT / "pyproject.toml", *sorted((ROOT / "samples").rglob("*.py"))]
    files += [path for top in ("machines", "postproc", "samples") for path in sorted((ROOT / top).rglob("*.toml"))]
    whole = set(files)
    lines = [(path, number, line if path in whole else line.partition("#")[2]) for path in (*files, *CODE)
             if WORDS.search(written(path)) for number, line in enumerate(written(path).splitlines(), 1)]
    assert [f"{path.relative_to(ROOT)}:{number}: {word}: write {INSTEAD[word]}" for path, number, line in lines
            for word in found(str(path.relative_to(ROOT)), line)] == []


def test_texts_of_the_code() -> None:
    wrong = [f"{path.relative_to(ROOT)}:{number}: {word}: write {INSTEAD[word]}"
             for path in CODE if WORDS.search(written(path))
             for number, line in texts(path) for word in found(str(path.relative_to(ROOT)), line)]
    assert wrong == []


def test_names_of_the_code() -> None:
    wrong = set()
    for path in CODE:
        for node in nodes(path):
            for key in ("id", "attr", "arg", "name"):
                name = getattr(node, key, None)
                if isinstance(name, str) and NAME.search(name) and name not in NAMES:
                    wrong.add(f"{path.relative_to(ROOT)}: {name}")
    assert wrong == set()


def test_a_banned_word_is_noticed() -> None:
    assert found("x.py", "the loss is told, at the least") == ["told", "at the least"]
    assert found("x.py", "turned this way") == [] and NAME.search("is_told") and not NAME.search("always")


SAME = {
    "Array": "alias of numpy's array; the second witness imports nothing of the project",
    "Bytes": "alias of an array of bytes", "Word": "number or text of a record",
    "Progress": "callback with (stage, done, of)", "ReadProgress": "callback with (done, of)",
}
"""names of types that stand in several files for the same thing"""


def test_one_name_one_meaning() -> None:
    """A public type has one definition."""
    where: dict[str, list[str]] = {}
    for path in CODE:
        for node in tree(path).body:
            target = node.targets[0] if isinstance(node, ast.Assign) else None
            name = node.name if isinstance(node, ast.ClassDef) else target.id if isinstance(target, ast.Name) else ""
            if name[:1].isupper() and not name.isupper():
                where.setdefault(name, []).append(str(path.relative_to(ROOT)))
    assert {name: files for name, files in where.items() if len(files) > 1 and name not in SAME} == {}


def terms() -> list[list[str]]:
    """Rows of the glossary."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in
            (ROOT / "docs/glossary.md").read_text("utf-8").splitlines() if line.startswith("| ")]
    return rows[1:]


def test_the_glossary_is_whole_and_in_order() -> None:
    rows = terms()
    assert len(rows) > 30 and all(len(row) == 5 and all(row) for row in rows)
    names = [row[0].lower() for row in rows]
    assert names == sorted(names) and len(set(names)) == len(names)


@pytest.mark.parametrize("file", ["postproc/cycle_time/report.py", "postproc/orientation/report/text.py",
                                  "postproc/cycle_time/conversion.py"])
def test_words_of_reports_are_in_the_glossary(file: str) -> None:
    """Each term that a report's headings use is explained."""
    text = (ROOT / file).read_text("utf-8")
    used = [name for row in terms() for name in row[0].split(", ") if name in text]
    wanted = {"postproc/cycle_time/report.py": {"lower bound", "time by activity", "programmed feed"},
              "postproc/orientation/report/text.py": {"runner-up", "rejected", "vertex-aligned"},
              "postproc/cycle_time/conversion.py": {"lower bound", "band"}}[file]
    assert wanted <= set(used) and KINDS
