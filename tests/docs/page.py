"""Pages of the documentation as a test runs them.

A block ```console holds commands behind `$ ` and what they print; `...` stands for anything, as in doctest. Of other shell
blocks each line that begins with `postproc` is a command, which must end with 0. A line `<!-- file: NAME -->` before a block
makes that block a file. Blocks ```python with `>>>` are doctests, others are executed. All blocks of a page run in one
folder, in their order, with the project's `samples` and the files of `stages.py` in it.
"""

from __future__ import annotations

import doctest
import os
import re
import shlex
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from typer.testing import CliRunner

from postproc.cli.app import app
from tests.docs.stages import Stage, lay, stage

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"(?:<!-- file: (?P<file>\S+) -->\n+)?^```(?P<kind>\w*)[^\n]*\n(?P<text>.*?)^```$",
                   re.MULTILINE | re.DOTALL)
PLAIN = ("sh", "bash", "text")
"""blocks of commands whose output the page does not show"""


@dataclass(frozen=True)
class Block:
    """A fenced block: its word, its text, the file that it is ("" for none)."""

    kind: str
    text: str
    file: str


def blocks(page: str) -> list[Block]:
    """All fenced blocks of a page."""
    return [Block(m["kind"], m["text"], m["file"] or "") for m in BLOCK.finditer(page)]


def calls(text: str) -> Iterator[tuple[str, str]]:
    """(command, what it prints) of a block ```console."""
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, _, printed = part.replace("\\\n", " ").partition("\n")
        yield command, printed


def commands(text: str) -> list[str]:
    """Commands of a block without what they print; `...` stands for the words of the one before it that does the same."""
    found: list[str] = []
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line.removeprefix("$ "), comments=True)
        if words[:1] in (["postproc"], ["cd"]):
            if "..." in words:
                whole = next(w for one in reversed(found) if (w := shlex.split(one))[:2] == words[:2])
                words[2:3] = whole[2:]
            found.append(shlex.join(words))
    return found


def faults(page: Path, folder: Path) -> list[str]:
    """What does not come out as the page says."""
    found, given = [], stage(page)
    all_blocks = blocks(page.read_text("utf-8"))
    if given.instead or any((block.kind in PLAIN and commands(block.text)) or
                            (block.kind == "python" and ">>>" not in block.text) for block in all_blocks):
        lay(folder, given)
    if not (folder / "samples").exists():
        (folder / "samples").symlink_to(ROOT / "samples")
    with chdir(folder):
        for block in all_blocks:
            if block.file:
                Path(block.file).write_text(block.text, encoding="utf-8")
            elif block.kind == "console":
                found += [fault for call in calls(block.text) if (fault := _staged(*call, given))]
            elif block.kind in PLAIN:
                found += [fault for command in commands(block.text) if (fault := _staged(command, "...\n", given))]
            elif block.kind == "python":
                found += _doctest(block.text, page.name) if ">>>" in block.text else _run(block.text, given)
    return found


def _staged(command: str, printed: str, given: Stage) -> str:
    """A command as it runs here, behind what has to happen before."""
    words = shlex.split(command)
    if words[0] == "cd":
        os.chdir(words[1])
        return ""
    for start, prepare in given.before.items():
        if shlex.join(words[1:]).startswith(start):
            prepare()
    for long, short in given.instead.items():
        command = command.replace(long, short)
    return _fault(command, printed)


def _run(text: str, given: Stage) -> list[str]:
    """A block of Python without outputs."""
    try:
        with redirect_stdout(StringIO()):
            exec(compile(text, "page", "exec"), given.names())
    except Exception as fault:
        return [f"{text}\n{fault!r}"]
    return []


def _fault(command: str, printed: str) -> str:
    words = shlex.split(command)
    assert words[0] == "postproc", command
    ran = CliRunner().invoke(app, words[1:])
    if ran.exception is not None and not isinstance(ran.exception, SystemExit):
        return f"{command}: {ran.exception!r}"
    good = printed == "...\n" or doctest.OutputChecker().check_output(printed, ran.output, doctest.ELLIPSIS)
    return "" if good and ran.exit_code == 0 else (
        f"$ {command}\nexit code {ran.exit_code}\n--- says\n{printed}--- prints\n{ran.output}")


def _doctest(text: str, name: str) -> list[str]:
    """A block of Python; names are not kept from block to block."""
    said: list[str] = []
    test = doctest.DocTestParser().get_doctest(text, {}, name, name, 0)
    doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=said.append)
    return said
