"""A hint that is obeyed: files and a command with a fault, what the hint says, and the edit that it asks for.

The edit takes its values from the hint itself, where it has some: groups of `says`. The law is in `test_hints_obeyed.py`;
`tests/explained_codes.py` takes the examples of `postproc explain` from here.
"""

from __future__ import annotations

import difflib
import json
import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from postproc.cli.app import app

COMMAND = ""
"""in the place of a file's name: the command line itself"""


@dataclass(frozen=True)
class Edit:
    """A text of a file, or of the command line, in the place of another; `old` "" puts it at the end.

    `new` may hold groups of the hint, as `re.Match.expand` has them.
    """

    file: str
    old: str
    new: str


@dataclass(frozen=True)
class HintCase:
    """One code, one hint.

    Attributes:
        command: as it is typed behind `postproc`
        files: texts by name
        says: what the hint says, a regular expression
        does: what it asks for
        first: commands before it, which must succeed, such as the conversion whose program is looked at
        harm: what is done to the files that they write
        code_left: the code may still be said, of another thing; the message is gone
        stops: errors of other codes that are left: what else is wrong in the same files
        packages: the folder is one in which packages are installed
        stands_in: a fault that no small file makes, by what stands in the place of a name: (module.name, value)
        ends: what the hint asks for ends it, as installing a package does, or running once more
    """

    code: str
    command: str
    files: dict[str, str]
    says: str
    does: tuple[Edit, ...]
    first: tuple[str, ...] = ()
    harm: tuple[Edit, ...] = ()
    code_left: bool = False
    stops: tuple[str, ...] = field(default=())
    packages: bool = False
    stands_in: tuple[tuple[str, Any], ...] = ()
    ends: bool = False

    @property
    def plain(self) -> bool:
        """Whether nothing but its files and commands makes what is said."""
        return not (self.stands_in or self.packages)

    def begin(self, folder: Path) -> None:
        """The files, and what the first commands write."""
        for name, text in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(text.encode("utf-8", "surrogateescape"))
        for command in self.first:
            code, found = called(command, folder, self.plain)
            assert code == 0, [f"{d['code']} {d['message']}" for d in found]
        for edit in self.harm:
            write(folder, edit, None)

    def obey(self, folder: Path, hint: str) -> str:
        """Do what the hint says; the command that is called then."""
        match = re.search(self.says, hint)
        assert match, f"the hint says: {hint}"
        command = self.command
        for edit in self.does:
            if edit.file == COMMAND:
                command = replaced(command, edit, match)
            else:
                write(folder, edit, match)
        return command


def replaced(text: str, edit: Edit, match: re.Match[str] | None) -> str:
    """The text after an edit."""
    new = match.expand(edit.new) if match else edit.new
    if not edit.old:
        return text + new
    assert edit.old in text, f"{edit.old!r} is not there"
    return text.replace(edit.old, new)


def write(folder: Path, edit: Edit, match: re.Match[str] | None) -> None:
    """An edit of a file; a file that is not there is written."""
    place = folder / edit.file
    before = place.read_bytes().decode("utf-8", "surrogateescape") if place.exists() else ""
    place.write_bytes(replaced(before, edit, match).encode("utf-8", "surrogateescape"))


def called(command: str, folder: Path, shared: bool = False) -> tuple[int, list[dict[str, Any]]]:
    """Exit code and diagnostics of a command in a folder (the working directory is that folder).

    `shared`: where the same command was called for the same files before, it does and says what it did then.
    """
    key = (command, _files(folder)) if shared else None
    if key in _CALLED:
        code, found, written = _CALLED[key]
        for name, content in written.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        return code, found
    got = CliRunner().invoke(app, [*shlex.split(command), "--json", "-"])
    assert got.exit_code in (0, 1), f"{command}: {got.exit_code} {got.stderr}\n{got.exception!r}"
    found = json.loads(got.stdout).get("diagnostics", [])
    if key is not None:
        new = _files(folder) - key[1]
        _CALLED[key] = got.exit_code, found, {name: content for name, content in new if content is not None}
    return got.exit_code, found


_CALLED: dict[object, tuple[int, list[dict[str, Any]], dict[str, bytes]]] = {}


def _files(folder: Path) -> frozenset[tuple[str, bytes | None]]:
    """What is in a folder: names and bytes, None of a folder."""
    return frozenset((one.relative_to(folder).as_posix(), one.read_bytes() if one.is_file() else None)
                     for one in folder.rglob("*"))


def example(case: HintCase) -> str:
    """What is wrong and what puts it right, as lines - and + of the file; "" where a case is no short one."""
    begin = {COMMAND: case.command, **case.files}
    end = dict(begin)
    for edit in case.does:
        if edit.file not in end or (edit.old and edit.old not in end[edit.file]):
            return ""
        new = _filled(edit.new, case.says)
        end[edit.file] = end[edit.file].replace(edit.old, new) if edit.old else end[edit.file] + new
    shown: list[str] = []
    for name, before in begin.items():
        if name == COMMAND and before != end[name]:
            shown += [f"-postproc {before}", f"+postproc {end[name]}"]
        elif before != end[name]:
            shown += [f"{name}:", *_difference(before, end[name])]
    return "\n".join(shown) if len(shown) <= 24 and all(len(x) < 160 and x.isprintable() for x in shown) else ""


def _filled(new: str, says: str) -> str:
    """The text of an edit with what the hint says in it, ... where that differs from case to case."""
    groups = [re.sub(r"\\(.)", r"\1", body) if not re.search(r"(?<!\\)[.*+?|\[]", body) else "..."
              for body in re.findall(r"(?<!\\)\((?!\?)((?:\\.|[^()\\])*)\)", says)]
    text = re.sub(r"\\(?:g<)?([0-9])>?", lambda m: groups[int(m[1]) - 1] if int(m[1]) <= len(groups) else "...", new)
    return text.replace("\\n", "\n")


def _difference(before: str, after: str) -> list[str]:
    lines = list(difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=2))[2:]
    return [line.rstrip() for line in lines if line.strip() and not line.startswith("@@")]
