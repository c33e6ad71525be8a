"""A handful of each fault on the cheapest commands; `make faults` runs them all, 200 moments each."""

from __future__ import annotations

import os
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.faults.commands import Ended, commands, place, run, state
from tests.faults.kinds import KINDS, OLD, Bench, bench

pytestmark = pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="a system without fork")


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """`machine new`, which writes three files, in a folder that every user may enter."""
    folder = tmp_path_factory.mktemp("faults")
    base = tmp_path_factory.getbasetemp()
    for each in (folder, base, *base.parents):
        if each.stat().st_uid == os.geteuid() and each != Path(tempfile.gettempdir()) and len(each.parts) > 2:
            each.chmod(each.stat().st_mode | 0o055)
    yield bench(commands(folder)["machine new"], folder / "bench")


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "nobody reads"])
def test_no_fault_leaves_half_of_what_is_written(kind: str, shop: Bench) -> None:
    assert sorted(shop.new) == ["m.svg", "m.toml", "s.json"]
    assert list(KINDS[kind](shop, 1, random.Random(kind))) == []


def test_a_command_that_writes_in_place_is_found(shop: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The laws fail where a writer opens its files as they stand."""

    def plain(outputs: dict[Path, str | bytes]) -> list[object]:
        for path, content in outputs.items():
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return []

    monkeypatch.setattr("toolpaths.transaction.write_together", plain)
    assert list(KINDS["full disk"](shop, 1, random.Random(1)))


def test_what_is_said_of_a_sheet_that_cannot_be_written(tmp_path: Path) -> None:
    """Answers on the terminal are written as outputs are: a folder in the way is a message, no trace of Python."""
    from tests.postproc.cli.test_machine_new import ANSWERS

    def answered() -> None:
        import io
        import sys
        sys.stdin = io.StringIO("\n".join(ANSWERS) + "\n")

    (tmp_path / "work").mkdir()
    place(tmp_path / "work", {"file": OLD})
    got: Ended = run(("machine", "new", "file/s.toml", "-o", "m.toml"), tmp_path / "work", tmp_path / "said", answered)
    assert got.code == 1 and "[file.write]" in got.text and got.clean, got.text
    assert state(tmp_path / "work") == {"file": OLD}
