"""Examples of `postproc explain` from tests: what a test of the suite was told, kept in `said.toml`, and held to it.

    pytest --said FILE ...                 adds all that those tests were told to FILE
    python tests/said.py FILE              takes the codes without another example from it into tests/said.toml

A test that is named there must be told the same again, figures apart, whenever it is told anything by that code.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from collections.abc import Generator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from toolpaths.diagnostics import Diagnostic

TABLE = Path(__file__).with_suffix(".toml")
KEYS = ("test", "command", "record", "text", "hint")
WIDE, LONG = 160, 700
"""characters of a command or a record that is shown, and of what is said of it"""
_FOLDER = re.compile(r"(?<![\w.])/(?:[^\s/'\",;:]+/)+")
_FIGURE = re.compile(r"[-+]?\d[\d.,e+-]*|\bnan\b")
_SAMPLE = re.compile(r"(?:^|/)samples/")
Said = dict[str, Any]
"""code, text, command, record, test of something said"""


@cache
def said() -> dict[str, Said]:
    """What is kept, by code."""
    return tomllib.loads(TABLE.read_text("utf-8")) if TABLE.exists() else {}


@cache
def _told() -> dict[str, dict[str, str]]:
    """What tests must be told, by test and code."""
    found: dict[str, dict[str, str]] = {}
    for code, one in said().items():
        found.setdefault(one["test"], {})[code] = one["text"]
    return found


def shown(one: Said) -> str:
    """The example: the command, the record that it is about, what is said."""
    lines = [f"$ {one['command']}"] if one.get("command") else []
    lines += [f"  {one['record']}"] if one.get("record") else []
    return "\n".join([*lines, *one["text"].splitlines()])


def _bare(text: str) -> str:
    """A text without the folders of files."""
    return _FOLDER.sub("", text)


def _alike(text: str) -> str:
    return _FIGURE.sub("0", text)


def _record(one: Diagnostic) -> str:
    """The line of the file that it names, "" where there is none."""
    if not one.lines or not Path(one.file).is_file():
        return ""
    try:
        lines = Path(one.file).read_bytes().decode("utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return ""
    text = lines[one.lines[0] - 1].strip() if one.lines[0] <= len(lines) else ""
    return text if len(text) <= WIDE and text.isprintable() else ""


def _command(words: list[str]) -> str:
    kept = [Path(word).name if "/" in word and not _SAMPLE.search(word) else word for word in words]
    text = _bare(" ".join(["postproc", *kept]).replace(" --json -", ""))
    return text if len(text) <= WIDE and text.isprintable() else ""


class Hearing:
    """What is said while a test runs."""

    def __init__(self) -> None:
        self.made: list[tuple[Diagnostic, str, str]] = []
        self.command = ""

    def __enter__(self) -> Hearing:
        from typer.testing import CliRunner

        self._runner = CliRunner
        init, call = self._before = Diagnostic.__init__, CliRunner.invoke

        def heard(one: Diagnostic, *given: Any, **named: Any) -> None:
            init(one, *given, **named)
            self.made.append((one, _record(one), self.command))

        def called(runner: Any, app: Any, args: list[str] | None = None, **named: Any) -> Any:
            self.command = _command([str(word) for word in args or ()])
            try:
                return call(runner, app, args, **named)
            finally:
                self.command = ""

        self._put(heard, called)
        return self

    def __exit__(self, *_: object) -> None:
        self._put(*self._before)

    def _put(self, init: Any, invoke: Any) -> None:
        for of, name, value in ((Diagnostic, "__init__", init), (self._runner, "invoke", invoke)):
            setattr(of, name, value)

    def texts(self) -> dict[str, set[str]]:
        """What was said, figures apart, by code."""
        found: dict[str, set[str]] = {}
        for one, *_ in self.made:
            found.setdefault(one.code, set()).add(_alike(_bare(str(one))))
        return found

    def kept(self, test: str) -> list[Said]:
        """All of it as it may stand in the table."""
        return [{"code": one.code, "text": _bare(str(one)), "record": record, "test": test, "hint": one.hint,
                 "command": command} for one, record, command in self.made]


def pytest_addoption(parser: pytest.Parser) -> None:
    """For `tests/conftest.py`."""
    parser.addoption("--said", default="", help="a file to which all diagnostics are added that the tests are told")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    """What the test must be told it is told; what it is told is kept where that is asked for."""
    file, must = item.config.getoption("--said"), _told().get(item.nodeid, {})
    if not file and not must:
        return (yield)
    with Hearing() as hearing:
        result = yield
    heard = hearing.texts()
    other = missing(must, heard)
    if file:
        with Path(file).open("a", encoding="utf-8") as out:
            out.writelines(json.dumps(one) + "\n" for one in hearing.kept(item.nodeid))
    else:
        assert not other, f"tests/said.toml has {other}, the test was told {[sorted(heard.get(code, ())) for code in other]}"
    return result


def missing(must: dict[str, str], heard: dict[str, set[str]]) -> dict[str, str]:
    """What was heard otherwise than it must be, figures apart, by code; what tests share is told to the first alone."""
    return {code: text for code, text in must.items() if code in heard and _alike(text) not in heard[code]}


def _best(some: list[Said]) -> Said | None:
    """What shows most: a remedy, a command, the record, few words; of a test without parameters where there is one."""
    short = [one for one in some if len(one["text"]) <= LONG and all(c.isprintable() or c == "\n" for c in one["text"])]
    return min(short, key=lambda one: (not one["hint"], not one["command"], not one["record"], "[" in one["test"],
                                       len(one["text"]), one["test"]), default=None)


def choose(records: Path, wanted: set[str]) -> dict[str, Said]:
    """An example for each code that is wanted and said."""
    some: dict[str, list[Said]] = {}
    for line in records.read_text("utf-8").splitlines():
        one = json.loads(line)
        if one["code"] in wanted:
            some.setdefault(one["code"], []).append(one)
    return {code: best for code, told in sorted(some.items()) if (best := _best(told))}


def text(examples: dict[str, Said]) -> str:
    """The file."""
    lines = ["# Written by tests/said.py: what tests are told, as examples of codes that no case of a hint shows."]
    for code, one in sorted(examples.items()):
        lines.append(f'\n["{code}"]')
        lines += [f"{key} = {json.dumps(one[key], ensure_ascii=False)}" for key in KEYS if one[key]]
    return "\n".join(lines) + "\n"




def main(file: str) -> None:
    """Choose."""
    from tests.explained_codes import codes

    known = codes(with_said=False)
    wanted = {code for code, one in known.items() if "example" not in one or not one["remedies"]}
    found = {code: one | {"hint": "" if known[code]["remedies"] else one["hint"]}
             for code, one in choose(Path(file), wanted).items() if "example" not in known[code] or one["hint"]}
    TABLE.write_text(text(found), "utf-8")
    without = sorted(code for code, one in known.items() if "example" not in one and code not in found)
    sys.stdout.write(f"{len(found)} examples; none of {', '.join(without)}\n")


if __name__ == "__main__":
    main(sys.argv[1])
