"""Pages of the documentation as a test runs them.

A block ```console holds commands behind `$ ` and what they print; `...` stands for anything, as in doctest. A line
`<!-- file: NAME -->` before a block makes that block a file. Blocks ```python with `>>>` are doctests. All blocks of a page
run in one folder, in their order, with the project's `samples` in it.
"""

from __future__ import annotations

import doctest
import re
import shlex
from collections.abc import Iterator
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

from typer.testing import CliRunner

from postproc.cli.app import app

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"(?:<!-- file: (?P<file>\S+) -->\n+)?^```(?P<kind>\w*)[^\n]*\n(?P<text>.*?)^```$",
                   re.MULTILINE | re.DOTALL)


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


def faults(page: Path, folder: Path) -> list[str]:
    """What does not come out as the page says."""
    found = []
    if not (folder / "samples").exists():
        (folder / "samples").symlink_to(ROOT / "samples")
    with chdir(folder):
        for block in blocks(page.read_text("utf-8")):
            if block.file:
                Path(block.file).write_text(block.text, encoding="utf-8")
            elif block.kind == "console":
                found += [fault for call in calls(block.text) if (fault := _fault(*call))]
            elif block.kind == "python" and ">>>" in block.text:
                found += _doctest(block.text, page.name)
    return found


def _fault(command: str, printed: str) -> str:
    words = shlex.split(command)
    assert words[0] == "postproc", command
    ran = CliRunner().invoke(app, words[1:])
    if ran.exception is not None and not isinstance(ran.exception, SystemExit):
        return f"{command}: {ran.exception!r}"
    good = doctest.OutputChecker().check_output(printed, ran.output, doctest.ELLIPSIS)
    return "" if good and ran.exit_code == 0 else (
        f"$ {command}\nexit code {ran.exit_code}\n--- says\n{printed}--- prints\n{ran.output}")


def _doctest(text: str, name: str) -> list[str]:
    """A block of Python; names are not kept from block to block."""
    said: list[str] = []
    test = doctest.DocTestParser().get_doctest(text, {}, name, name, 0)
    doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=said.append)
    return said
