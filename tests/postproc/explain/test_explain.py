"""postproc explain: every code of the source has a page, no page is without a code; a wrong one is named."""

from __future__ import annotations

import json
import re

from postproc.explain.pages import pages
from tests.explained_codes import MADE, NONE, ROOT, codes, said_codes
from tests.postproc.cli.test_cli import run
from tests.said import Hearing, missing, said
from tests.source import written
from toolpaths.diagnostics import error

HOW = "run python tests/explained_codes.py"


def test_every_code_has_a_page_and_every_page_a_code() -> None:
    found, known = set(codes()), set(pages())
    assert found - known == set(), HOW
    assert known - found == set(), HOW


def test_no_area_is_left_out() -> None:
    """Codes by the calls that make them: one with an area that no page knows is a code without a page."""
    assert said_codes() - NONE - set(pages()) == set(), "add its area to postproc/explain/areas.toml"


def test_messages_and_remedies_are_those_of_the_source() -> None:
    changed = [code for code, one in codes().items() if tuple(one["messages"]) != pages()[code].messages
               or tuple(one["remedies"]) != pages()[code].remedies]
    assert changed == [], HOW


def test_codes_of_the_examples_of_bad_files_have_pages() -> None:
    """Codes by what is raised, not by how the source is read."""
    raised = {said[1] for file in (ROOT / "tests" / "bad").glob("*.*")
              if (said := re.match(r"\$\$ expect: \w+ (\S+)", file.read_bytes().decode("latin-1")))}
    assert len(raised) >= 50 and raised <= set(pages())


def test_codes_put_together_are_codes_of_the_source() -> None:
    for area in {code.split(".")[0] for code in MADE}:
        assert any(f'f"{area}.{{' in path.read_text("utf-8") for path in (ROOT / "postproc").rglob("*.py")), area


def test_each_page_says_what_to_do() -> None:
    for page in pages().values():
        assert len(page.about) > 10 and len(page.first) > 20 and page.text().startswith(page.code)


def test_each_page_has_an_example_that_a_test_is_told() -> None:
    assert [code for code, page in pages().items() if not page.example] == [], (
        "give it a test; pytest --said FILE TESTS, python tests/said.py FILE, python tests/explained_codes.py")


def test_what_is_said_with_a_hint_has_it_as_a_remedy() -> None:
    """A hint passed by a name is found in the source, or taken from what a test is told."""
    hinted = {code for code, one in said().items() if "; " in one["text"] and one.get("hint")}
    assert hinted and all(pages()[code].remedies for code in hinted)


def test_examples_are_of_tests_that_there_are() -> None:
    """Each is compared with what the test is told whenever that runs (`tests/said.py`)."""
    for code, one in said().items():
        file, _, name = one["test"].partition("::")
        assert code in pages() and f"def {name.partition('[')[0]}(" in written(ROOT / file), code


def test_a_test_that_is_told_otherwise_fails() -> None:
    with Hearing() as hearing:
        error("cl.cutter", "CUTTER/-3: a diameter is above 0", file="/some/folder/part.apt", lines=[4])
    assert "part.apt:0: error [cl.cutter] CUTTER/0: a diameter is above 0" in hearing.texts()["cl.cutter"]
    assert missing({"cl.cutter": "part.apt:9: error [cl.cutter] CUTTER/-1: a diameter is above 0"}, hearing.texts()) == {}
    assert missing({"cl.cutter": "part.apt:9: error [cl.cutter] a diameter"}, hearing.texts()) != {}


def test_the_command() -> None:
    got = run("explain", "[travel.exceeded]")
    assert got.exit_code == 0 and "axis ... goes to" in got.stdout and "place.found" in got.stdout
    assert run("explain").stdout.split() == sorted(pages())
    wrong = run("explain", "travel.exceded", "--json", "-")
    assert wrong.exit_code == 1 and "travel.exceeded" in json.loads(wrong.stdout)["diagnostics"][0]["hint"]
    assert "codes begin with" in run("explain", "nonsense").stderr
    assert json.loads(run("explain", "cl.cycle", "--json", "-").stdout)["example"]
