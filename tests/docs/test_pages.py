"""Commands and Python blocks of the documentation and of READMEs do what the page says."""

from __future__ import annotations

import re
import runpy
import shlex
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, get_args

import pytest
from pygments.lexers import get_lexer_by_name
from typer.main import get_command

from postproc.cli.app import app
from postproc.cli.batch import wrong_use
from postproc.cli.shared.schemas import FILES, file_schema
from postproc.explain.pages import pages
from postproc.page import what_if
from postproc.setup.model import load_setup
from tests.docs.page import PLAIN, ROOT, blocks
from tests.docs.page import faults as faults_of
from tests.hints.test_hints_obeyed import FEW_PLACES, FEW_ROUNDS
from toolpaths.plug_ins import PlugInGroup

PAGES = sorted(p for p in (ROOT / "docs").rglob("*.md") if "generated" not in p.parts and p.name != "python.md")
READMES = sorted(p for p in (*ROOT.glob("*.md"), *(p for top in ("toolpaths", "machines", "postproc", "samples", "tests")
                 for p in (ROOT / top).rglob("*.md")), *PAGES) if p.name != "CHANGELOG.md")
ELSEWHERE = {"samples/plugins/README.md": "tests/plugins/test_sample_plug_ins.py",
             "docs/explanation/live-reports.md": "tests/docs/test_live_reports.py"}
"""pages whose commands another test runs: with the package installed; as the site is built"""
EXECUTED = [page for page in READMES if page.relative_to(ROOT).as_posix() not in ELSEWHERE
            and any(block.kind in ("console", "python", *PLAIN) for block in blocks(page.read_text("utf-8")))]
HOW_TOS = 20


@pytest.mark.parametrize("page", EXECUTED, ids=[str(p.relative_to(ROOT)) for p in EXECUTED])
def test_a_page_does_what_it_says(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(what_if, "EXECUTED_MOST", 1)  # limits that a report of an executed control tries
    for name, value in FEW_PLACES.items():
        monkeypatch.setattr(f"machines.analysis.{name}", value)
    for name, value in FEW_ROUNDS.items():
        monkeypatch.setattr(f"postproc.time_fit.{name}", value)
    assert faults_of(page, tmp_path) == []


def test_no_command_and_no_python_is_left_out() -> None:
    """Commands stand in blocks that run, not in indented text; what runs elsewhere is named there."""
    for page in READMES:
        text = page.read_text("utf-8")
        fenced = "".join(block.text for block in blocks(text))
        assert not re.search(r"^(?: {4}|\t)(?:\$ )?postproc ", text.replace(fenced, ""), re.MULTILINE), page
        kinds = {block.kind for block in blocks(text) if not block.file and "postproc " in block.text}
        assert kinds <= {"console", "python", "toml", "ini", *PLAIN}, page
    for page, test in ELSEWHERE.items():
        assert Path(page).name in (ROOT / test).read_text("utf-8"), page


LINKED = runpy.run_path(str(ROOT / "docs" / "linked_pages.py"))
REPORTS = "../reports/"
"""where the site has reports, from pages of explanations (docs/conf.py)"""


@pytest.mark.parametrize("page", PAGES, ids=[p.name for p in PAGES])
def test_links_of_pages_lead_somewhere(page: Path) -> None:
    """To a page, or to a document of the tree, which the site has as a page; a link to what only the site has is HTML."""
    text = page.read_text("utf-8")
    for found in LINKED["LINK"].finditer(text):
        place = LINKED["_place"](found["target"], page)
        assert place is None or "generated" in place.parts or place.is_file(), found[0]
    assert f"]({REPORTS}" not in text
    assert not [words for words in LINKED["LINK"].findall(LINKED["linked"](text, page)) if not words[1]]


def test_documents_of_the_tree_are_pages_of_the_site(tmp_path: Path) -> None:
    linked, source, page = LINKED["linked"], ROOT / "postproc" / "x.md", ROOT / "docs" / "how-to" / "page.md"
    assert linked("[a](../../ARCHITECTURE.md#rooms)", page) == "[a](../reference/generated/tree/ARCHITECTURE.md#rooms)"
    same = "[a](rewinds.md), [b](https://x.org/y.md), [c](#d)"
    assert linked(same, page) == same
    assert linked("[a](cli/app.py), ![p](../samples/blade.svg)", source, page) == "a, ![p](../samples/blade.svg)"
    assert linked("[a](../docs/glossary.md)", source, page) == "[a](../glossary.md)"


def test_a_command_of_a_readme_that_fails_is_noticed(tmp_path: Path) -> None:
    page = tmp_path / "README.md"
    page.write_text("```sh\npostproc inspect part.cls   # what it holds\npostproc inspect ... --json -\n```\n", "utf-8")
    assert faults_of(page, tmp_path) == []
    page.write_text("```sh\npostproc machine show no-such-machine\n```\n", encoding="utf-8")
    assert len(faults_of(page, tmp_path)) == 1
    page.write_text("```python\nimport toolpaths\ntoolpaths.raed('part.cls')\n```\n", encoding="utf-8")
    assert len(faults_of(page, tmp_path)) == 1


def test_a_page_that_is_wrong_is_noticed(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```console\n$ postproc inspect samples/pocket.cls\n...7 points...\n```\n", encoding="utf-8")
    assert len(faults_of(page, tmp_path)) == 1
    page.write_text("```console\n$ postproc inspect samples/pocket.cls\n...96 points...\n```\n", encoding="utf-8")
    assert faults_of(page, tmp_path) == []
    page.write_text("```python\n>>> 1 + 1\n3\n```\n", encoding="utf-8")
    assert len(faults_of(page, tmp_path)) == 1


def commands(text: str) -> list[list[str]]:
    """Commands of the shell blocks of a page, as words; what is cut short with ... is left out."""
    found = []
    for block in blocks(text):
        if block.kind in ("sh", "bash", "console", "text"):
            for line in block.text.replace("\\\n", " ").splitlines():
                words = shlex.split(line.removeprefix("$ "), comments=True)
                if words[:1] == ["postproc"] and "..." not in words:
                    found.append(words[1:])
    return found


@cache
def tree() -> Any:
    """All commands."""
    return get_command(app)


def wrong(words: list[str]) -> str:
    """What a command line has that there is not; "" where it is one."""
    group = tree()
    while hasattr(group, "commands"):
        if not words or words[0] not in group.commands:
            return "" if words[:1] in ([], ["--help"], ["--version"]) else f"no command {words[:1]}"
        if not hasattr(group.commands[words[0]], "commands"):
            return wrong_use(group, words)
        group, words = group.commands[words[0]], words[1:]
    return ""


@pytest.mark.parametrize("page", READMES, ids=[str(p.relative_to(ROOT)) for p in READMES])
def test_commands_of_readmes_are_such_as_there_are(page: Path) -> None:
    lines = commands(page.read_text("utf-8"))
    assert [(words, said) for words in lines if (said := wrong(words))] == []


OTHER_FILES = {"machine-files.md": "machine-file", "control-rules.md": "controller-file", "error-models.md": "",
               "machine-kind.md": ""}
"""pages whose TOML is no set-up: the schema of its keys, "" where another test reads it or it is a package's"""


def leaves(table: dict[str, Any]) -> set[str]:
    """Keys that hold values; those of tables may be names that users choose."""
    return {key for key, value in table.items() if not isinstance(value, dict)}.union(
        *(leaves(value) for value in table.values() if isinstance(value, dict)))


def keys_of(schema: Any) -> set[str]:
    """Every key that a schema has anywhere."""
    parts = schema.values() if isinstance(schema, Mapping) else schema if isinstance(schema, list) else ()
    own = schema.get("properties", {}) if isinstance(schema, Mapping) else {}
    return set(own).union(*(keys_of(part) for part in parts))


def test_lines_of_files_are_such_as_there_are(tmp_path: Path) -> None:
    """TOML that a page shows without making it a file of its commands."""
    found = [(page.name, block) for page in PAGES for block in blocks(page.read_text("utf-8"))]
    shown = [(name, block.text) for name, block in found if block.kind == "toml" and not block.file]
    known = {kind: keys_of(file_schema(kind)) for kind in FILES}
    assert len(shown) >= 12 and "travel" in known["machine-file"] and "rods" in known["machine-file"]
    for name, text in shown:
        if name in OTHER_FILES:
            assert not OTHER_FILES[name] or leaves(tomllib.loads(text)) - known[OTHER_FILES[name]] == set(), (name, text)
            continue
        (tmp_path / "s.toml").write_text(text, encoding="utf-8")
        setup, faults = load_setup(str(tmp_path / "s.toml"))
        assert setup is not None, [str(d) for d in faults]


def test_a_command_that_is_none_is_noticed() -> None:
    assert wrong(["convert", "a.cls", "-m", "x", "-c", "y"]) != "" and wrong(["convrt"]) != ""
    assert wrong(["machine", "show", "x", "--figur", "y"]) != ""
    assert wrong(["convert", "a.cls", "-m", "x", "-c", "y", "-o", "z"]) == ""


def test_there_is_a_page_for_what_shops_ask() -> None:
    names = [p.stem for p in (ROOT / "docs" / "how-to").glob("*.md")]
    assert len(names) >= HOW_TOS and len(list((ROOT / "docs" / "tutorials").glob("*.md"))) == 4
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    assert all(f"tutorials/{p.stem}" in index for p in (ROOT / "docs" / "tutorials").glob("*.md"))
    assert re.search(r"^how-to/\*$", index, re.MULTILINE)


def test_every_page_stands_in_a_table_of_contents() -> None:
    """One that stands in none is not in the navigation, and `make docs` ends with an error."""
    index, folder = (ROOT / "docs" / "index.md").read_text("utf-8"), ROOT / "docs"
    named = {found for block in re.findall(r"```\{toctree\}(.*?)```", index, re.S) for line in block.splitlines()
             if line and not line.startswith(":") for found in folder.glob(f"{line}.md")}
    assert sorted({*PAGES, folder / "python.md"} - named - {folder / "index.md"}) == []


def test_codes_of_messages_on_pages_are_such_as_there_are() -> None:
    """First columns of tables and `postproc explain`: what a user looks up by them must be there."""
    known = pages()
    how_tos = [page for page in PAGES if page.parent.name == "how-to"]
    named = [(page.name, code) for page in how_tos for row in re.findall(r"^\| (`[^|]*`) \|", page.read_text("utf-8"), re.M)
             for code in re.findall(r"`([a-z-]+\.[a-z_-]+)`", row)]
    groups = get_args(PlugInGroup)  # names of that form that are no codes
    assert len(named) >= 8 and [each for each in named if each[1] not in known and each[1] not in groups] == []


def test_blocks_are_of_languages_that_the_documentation_colours() -> None:
    """Sphinx warns of others, and a warning ends the documentation."""
    kinds = {block.kind for page in PAGES for block in blocks(page.read_text("utf-8"))} - {""}
    assert len(kinds) >= 4
    for kind in kinds:
        get_lexer_by_name(kind)
