"""Output files of one command: all are replaced or none, at every fault and at every kill."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from toolpaths import interrupted_runs, transaction
from toolpaths.diagnostics import DiagnosticError
from toolpaths.transaction import write_together

ROOT = Path(__file__).parents[2]


def state(folder: Path) -> dict[str, tuple[str, int]]:
    """Every file and folder with text and mode."""
    return {str(p.relative_to(folder)): (p.read_text() if p.is_file() else "", stat.S_IMODE(p.stat().st_mode))
            for p in sorted(folder.rglob("*"))}


@pytest.fixture
def shop(tmp_path: Path) -> tuple[Path, dict[Path, str]]:
    """A folder with two old files of a program of four, one of them in another folder, one in a folder to be made."""
    (tmp_path / "subs").mkdir()
    (tmp_path / "subs" / "O1").write_text("old O1")
    (tmp_path / "main.nc").write_text("old main")
    (tmp_path / "main.nc").chmod(0o640)
    places = [tmp_path / "subs" / "O1", tmp_path / "O2", tmp_path / "made" / "deep" / "O3", tmp_path / "main.nc"]
    return tmp_path, {place: f"new {place.name}" for place in places}


def test_all_are_written_and_modes_kept(shop: tuple[Path, dict[Path, str]]) -> None:
    folder, outputs = shop
    assert write_together(outputs) == []
    assert {p: p.read_text() for p in outputs} == outputs
    found = state(folder)
    assert found["main.nc"][1] == 0o640 and len(found) == 7  # three folders, four files, nothing else
    mask = os.umask(0o027)
    try:
        write_together({folder / "fresh": b"\x00\xff"})
    finally:
        os.umask(mask)
    assert stat.S_IMODE((folder / "fresh").stat().st_mode) == 0o640 and (folder / "fresh").read_bytes() == b"\x00\xff"


def counted(call: Callable[..., Any], fails_at: int) -> tuple[Callable[..., Any], list[int]]:
    """`call`, whose call number `fails_at` finds the disk full, and the count of its calls."""
    calls = [0]

    def wrapped(*args: Any, **more: Any) -> Any:
        calls[0] += 1
        if calls[0] == fails_at:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return call(*args, **more)

    return wrapped, calls


STEPS: dict[str, tuple[Any, str]] = {
    "open": (os, "open"), "fdopen": (os, "fdopen"), "fsync": (os, "fsync"), "rename": (Path, "replace"),
    "mkdir": (Path, "mkdir"), "link": (Path, "hardlink_to"), "chmod": (Path, "chmod"),
    "journal": (Path, "write_text"), "remove": (Path, "unlink")}


@pytest.mark.parametrize("step", STEPS)
def test_a_fault_at_any_step_leaves_everything_as_it_was(shop: tuple[Path, dict[Path, str]], step: str,
                                                         monkeypatch: pytest.MonkeyPatch) -> None:
    folder, outputs = shop
    before, failed = state(folder), 0
    owner, name = STEPS[step]
    for number in range(1, 60):
        wrapped, calls = counted(getattr(owner, name), number)
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, wrapped)
            try:
                write_together(outputs)
            except DiagnosticError as fault:
                failed += 1
                assert "No space left" in str(fault) and ("make room on the disk" in str(fault) or step == "remove")
                assert state(folder) == before, number
                continue
        assert {p: p.read_text() for p in outputs} == outputs
        if calls[0] < number:
            break
        with monkeypatch.context() as patch:  # a fault that costs nothing: the next one again, as another process
            patch.setattr(interrupted_runs, "_alive", lambda path, name: False)
            assert not any(interrupted_runs.clean(place) for place in (folder, folder / "subs", folder / "made" / "deep"))
        (folder / "O2").unlink()
        shutil.rmtree(folder / "made")
        (folder / "subs" / "O1").write_text("old O1")
        (folder / "main.nc").write_text("old main")
        write_together({folder / "main.nc": "old main"})
        assert state(folder) == before, number
    else:
        pytest.fail("the step is reached again and again")
    assert failed or step == "link", "the step is never reached"


def test_what_cannot_be_put_back_is_put_back_by_the_next_run(shop: tuple[Path, dict[Path, str]],
                                                            monkeypatch: pytest.MonkeyPatch) -> None:
    folder, outputs = shop
    before = state(folder)
    rename, calls = Path.replace, [0]

    def dying(self: Path, target: Path) -> Path:
        """The disk fails for good with the last rename."""
        if self.suffix == ".new" and target.name == "main.nc":
            calls[0] = 1
        if calls[0]:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return rename(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", dying)
        with pytest.raises(DiagnosticError, match=r"file\.mixed.*the next run that writes here"):
            write_together(outputs)
    assert (folder / "subs" / "O1").read_text() == "new O1"
    monkeypatch.setattr(interrupted_runs, "_alive", lambda path, name: False)
    noted = interrupted_runs.clean(folder)
    assert [d.code for d in noted] == ["file.recovered"]
    interrupted_runs.clean(folder / "subs")
    assert {k: v for k, v in state(folder).items() if not k.startswith("made")} == before


def held(times: int, number: int) -> Callable[[Path, Path], Path]:
    """`Path.replace` as on Windows while a viewer holds the old file: refused so often with the number of the fault."""
    real, calls = Path.replace, [0]

    def replace(self: Path, target: Path) -> Path:
        if target.name == "main.nc" and self.suffix == ".new" and calls[0] < times:
            calls[0] += 1
            fault = PermissionError(errno.EACCES, "Permission denied")
            fault.winerror = number
            raise fault
        return real(self, target)

    return replace


@pytest.mark.parametrize("alone", [True, False])
def test_a_viewer_that_holds_the_file_for_a_moment_is_waited_for(shop: tuple[Path, dict[Path, str]], alone: bool,
                                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    folder, outputs = shop
    outputs = {folder / "main.nc": "new main.nc"} if alone else outputs
    waits = list[float]()
    monkeypatch.setattr(transaction.time, "sleep", waits.append)
    monkeypatch.setattr(Path, "replace", held(2, 32))
    assert write_together(outputs) == [] and len(waits) == 2
    assert {p: p.read_text() for p in outputs} == outputs


@pytest.mark.parametrize(("number", "tries", "words", "hint"), [
    (32, 4, transaction.HELD, "close it there"), (5, 4, transaction.HELD, "close it there"),
    (1, 0, "Permission denied", "")])
def test_a_viewer_that_keeps_the_file_is_named_and_all_stays(shop: tuple[Path, dict[Path, str]], number: int, tries: int,
                                                             words: str, hint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, outputs = shop
    before, waits = state(folder), list[float]()
    monkeypatch.setattr(transaction.time, "sleep", waits.append)
    monkeypatch.setattr(Path, "replace", held(99, number))
    with pytest.raises(DiagnosticError) as fault:
        write_together(outputs)
    (found,) = fault.value.diagnostics
    assert words in found.message and hint in found.hint and len(waits) == tries and state(folder) == before


def test_files_are_synced_open_to_be_written_as_windows_needs_it(shop: tuple[Path, dict[Path, str]],
                                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    import fcntl

    def fsync(handle: int) -> None:
        read_only = fcntl.fcntl(handle, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY
        if read_only or stat.S_ISDIR(os.fstat(handle).st_mode):
            raise OSError(errno.EBADF, "Bad file descriptor")

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(Path, "hardlink_to", lambda self, target: (_ for _ in ()).throw(OSError(errno.ENOTSUP, "no links")))
    assert write_together(shop[1]) == []


def test_read_only_files_are_refused(shop: tuple[Path, dict[Path, str]]) -> None:
    folder, outputs = shop
    (folder / "subs" / "O1").chmod(0o444)
    before = state(folder)
    with pytest.raises(DiagnosticError, match=r"O1: error \[file.write\] cannot be written: it is read-only; make it writ"):
        write_together(outputs)
    assert state(folder) == before
    (folder / "subs" / "O1").chmod(0o644)  # the hint
    write_together(outputs)


@pytest.mark.parametrize("how", ["same", "dots", "symlink", "hard link"])
def test_two_outputs_in_one_place_are_refused(tmp_path: Path, how: str) -> None:
    one, other = tmp_path / "a.nc", tmp_path / ("b.nc" if "link" in how else "x/../a.nc" if how == "dots" else "a.nc")
    one.write_text("old")
    (tmp_path / "x").mkdir()
    if how == "symlink":
        other.symlink_to(one)
    elif how == "hard link":
        other.hardlink_to(one)
    outputs = {one: "1", other: "2"}
    if how == "same":
        return write_once(outputs)
    with pytest.raises(DiagnosticError, match=r"\[file.twice\] two outputs of this command are one file"):
        write_together(outputs)
    assert one.read_text() == "old"
    return write_once({one: "1", tmp_path / "c.nc": "2"})  # the hint


def write_once(outputs: dict[Path, str]) -> None:
    write_together(outputs)
    assert all(path.read_text() == text for path, text in outputs.items())


def test_links_are_kept(tmp_path: Path) -> None:
    (tmp_path / "store").mkdir()
    for name in ("a.nc", "b.nc"):
        (tmp_path / name).symlink_to(Path("store") / name)  # b.nc leads to no file yet
    (tmp_path / "store" / "a.nc").write_text("old")
    write_together({tmp_path / "a.nc": "A", tmp_path / "b.nc": "B"})
    assert all((tmp_path / n).is_symlink() for n in ("a.nc", "b.nc"))
    assert [(tmp_path / "store" / n).read_text() for n in ("a.nc", "b.nc")] == ["A", "B"]
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(DiagnosticError, match="links"):
        write_together({tmp_path / "loop": ""})


def test_a_file_where_a_folder_is_needed_and_no_regular_files(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    os.mkfifo(tmp_path / "pipe")
    for wrong in (tmp_path / "file" / "a.nc", tmp_path / "pipe", tmp_path, tmp_path / ("x" * 300)):
        with pytest.raises(DiagnosticError, match=r"\[file.write\]"):
            write_together({tmp_path / "b.nc": "B", wrong: "A"})
    assert sorted(state(tmp_path)) == ["file", "pipe"]


@pytest.fixture
def interrupts() -> Iterator[None]:
    """Ctrl-C as Python has it: shells start what runs in the background with interrupts ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interrupts")
def test_an_interrupt_waits_for_the_renames(shop: tuple[Path, dict[Path, str]],
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    folder, outputs = shop
    before, link = state(folder), Path.hardlink_to

    def interrupted(self: Path, target: Path) -> None:
        signal.raise_signal(signal.SIGINT)
        link(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(transaction, "_stage", lambda *_: signal.raise_signal(signal.SIGINT))
        with pytest.raises(KeyboardInterrupt):
            write_together(outputs)
    assert state(folder) == before
    monkeypatch.setattr(Path, "hardlink_to", interrupted)
    write_together(outputs)
    assert {p: p.read_text() for p in outputs} == outputs
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


KILLED = """
import os, signal, sys
from pathlib import Path
import toolpaths.transaction as t
folder, first, at = Path(sys.argv[1]), int(sys.argv[2]), 0
steps = 0
def counted(call):
    def wrapped(*a, **k):
        global steps
        steps += 1
        if steps == at:
            os.kill(os.getpid(), signal.SIGKILL)
        return call(*a, **k)
    return wrapped
Path.replace, Path.unlink, Path.hardlink_to, Path.write_text = map(counted, (Path.replace, Path.unlink, Path.hardlink_to,
                                                                             Path.write_text))
os.fsync, os.fdopen = counted(os.fsync), counted(os.fdopen)
for k in range(int(sys.argv[3])):
    pid = os.fork()
    if not pid:
        at, steps = first + k, 0
        t.write_together({folder / name: "new " + name for name in ("subs/O1", "O2", "main.nc")})
        os._exit(0)
    os.waitpid(pid, 0)
    here = {n: (folder / n).read_text() if (folder / n).exists() else None for n in ("subs/O1", "O2", "main.nc")}
    for one in (folder, folder / "subs"):
        t.leftovers.clean(one)
    now = {n: (folder / n).read_text() if (folder / n).exists() else None for n in ("subs/O1", "O2", "main.nc")}
    left = sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))
    print(list(here.values()), "|", list(now.values()), "|", left)
    for name in ("subs/O1", "O2", "main.nc"):
        (folder / name).unlink(missing_ok=True)
    (folder / "subs/O1").write_text("old O1")
    (folder / "main.nc").write_text("old main")
"""


def test_a_kill_at_any_step_leaves_old_or_new_files_for_the_next_run(tmp_path: Path) -> None:
    (tmp_path / "subs").mkdir()
    (tmp_path / "subs" / "O1").write_text("old O1")
    (tmp_path / "main.nc").write_text("old main")
    got = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path), "1", "45"], cwd=ROOT, capture_output=True, text=True,
                         check=True)
    lines = [line.split(" | ") for line in got.stdout.splitlines()]
    old, new = str(["old O1", None, "old main"]), str(["new subs/O1", "new O2", "new main.nc"])
    assert {line[1] for line in lines} == {old, new} and len(lines) == 45
    kept = {line[0] for line in lines} - {old, new}
    assert kept, "no kill between two renames: the journal is not tried"
    assert all("new main.nc" not in line for line in kept), "the program comes last"
    assert {line[2] for line in lines} == {"['main.nc', 'subs', 'subs/O1']", "['O2', 'main.nc', 'subs', 'subs/O1']"}


@pytest.fixture
def dead() -> Iterator[int]:
    """The number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    yield process.pid


def test_only_temporary_files_of_dead_runs_are_swept(tmp_path: Path, dead: int) -> None:
    mine, here = interrupted_runs.run_name(), interrupted_runs._where()
    names = {"dead": f".a.nc.postproc-{here}-{dead}-1-00000000.new", "live": f".a.nc.{mine}.new",
             "reused": f".a.nc.postproc-{here}-{os.getpid()}-1-00000000.old",
             "far": f".a.nc.postproc-00000000-{dead}-1-00000000.new",
             "far old": f".b.nc.postproc-00000000-{dead}-1-00000000.new",
             "user": ".a.nc.postproc-notes.new", "user 2": "a.nc.postproc-1-1-1-1.new", "vim": ".a.nc.swp"}
    for name in names.values():
        (tmp_path / name).write_text("")
    made = time.time
    interrupted_runs.time.time = lambda: made() + 86000.0
    try:
        write_together({tmp_path / "a.nc": "A"})
        assert {k for k, name in names.items() if not (tmp_path / name).exists()} == {"dead", "reused"}
        interrupted_runs.time.time = lambda: made() + 90000.0
        write_together({tmp_path / "a.nc": "A"})
        assert {k for k, name in names.items() if not (tmp_path / name).exists()} == {"dead", "reused", "far", "far old"}
    finally:
        interrupted_runs.time.time = made


def test_what_was_changed_since_a_kill_stays(tmp_path: Path, dead: int) -> None:
    run = f"postproc-{interrupted_runs._where()}-{dead}-1-00000000"
    entries = []
    for name in ("a.nc", "b.nc", "c.nc"):
        (tmp_path / name).write_text(f"new {name}")
        backup = interrupted_runs.temporary(tmp_path / name, run, interrupted_runs.OLD)
        backup.write_text(f"old {name}")
        entries.append(interrupted_runs.Entry(name, "gone", backup.name, interrupted_runs.mark_of(tmp_path / name)))
    journal = interrupted_runs.temporary(tmp_path / "c.nc", run, interrupted_runs.JOURNAL)
    journal.write_text(interrupted_runs.journal_text(entries))
    (tmp_path / "b.nc").write_text("by hand, in place")
    assert interrupted_runs.interrupted(tmp_path) == journal
    noted = write_together({tmp_path / "d.nc": "D"})
    assert ["replaced 2 of 3 files" in str(d) for d in noted] == [True] and interrupted_runs.interrupted(tmp_path) is None
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a.nc": "old a.nc", "b.nc": "by hand, in place",
                                                                   "c.nc": "old c.nc", "d.nc": "D"}
