"""What a run that was killed while writing left behind: temporary files of its own, distinguished by their names.

A temporary file is called `.NAME.postproc-WHERE-PID-START-RANDOM.KIND`: WHERE is the computer (and its space
of process numbers), PID and START name the process beyond the reuse of its number. `new` is an output not yet
in its place, `old` what stood in that place before, `journal` says which files a run was replacing, `pointer`
where the journal of another folder is.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import secrets
import socket
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, info, warning

NEW, OLD, JOURNAL, POINTER = "new", "old", "journal", "pointer"
_NAME = re.compile(r"\..*\.(?P<run>postproc-(?P<where>[0-9a-f]{8})-(?P<pid>\d+)-(?P<start>\d+)-[0-9a-f]{8})"
                   r"\.(?P<kind>new|old|journal|pointer)", re.DOTALL)
_ROOM = 120
"""bytes of the output's own name in that of a temporary file; a name has at most 255"""
_FOREIGN = 86400.0
"""seconds after which temporary files of another computer are left over: whether its process lives cannot be seen"""


@dataclass(frozen=True)
class Entry:
    """One output of a run: names relative to the folder of the journal, and the mark of the new file."""

    target: str
    staged: str
    backup: str | None
    mark: tuple[int, int, int]
    """inode, bytes and time of change (ns), which a rename keeps: only what this run has put there is taken back"""


def run_name() -> str:
    """The name of this run in its temporary files; another one at each call."""
    return f"postproc-{_where()}-{os.getpid()}-{_started(os.getpid())[0]}-{secrets.token_hex(4)}"


def temporary(target: Path, run: str, kind: str) -> Path:
    """The temporary file of an output, next to it."""
    own = os.fsencode(target.name)[:_ROOM].decode("utf-8", "ignore")
    return target.parent / f".{own}.{run}.{kind}"


def mark_of(path: Path) -> tuple[int, int, int]:
    """What a file is known by after a rename."""
    found = path.lstat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def journal_text(entries: Sequence[Entry]) -> str:
    """The text of a journal."""
    return json.dumps({"files": [asdict(entry) for entry in entries]}, indent=1) + "\n"


def undo(folder: Path, entries: Iterable[Entry]) -> tuple[int, list[OSError]]:
    """Put back what a run had replaced, the last first; how many files, and what could not be done.

    What has been replaced or changed again since then stays. Doing it twice does no harm.
    """
    count, faults = 0, list[OSError]()
    for entry in reversed(list(entries)):
        target = folder / entry.target
        try:
            if _is(target, entry.mark):
                if entry.backup is None:
                    target.unlink()
                else:
                    (folder / entry.backup).replace(target)
                count += 1
        except OSError as fault:
            faults.append(fault)
    return count, faults


def clean(folder: Path) -> list[Diagnostic]:
    """Take back unfinished replacements of runs that are dead, then remove their temporary files from a folder."""
    found = _leftovers(folder)
    noted: list[Diagnostic] = []
    for path, _ in [x for x in found if x[1] == JOURNAL]:
        noted += _recovered(path)
    for path, _ in [x for x in found if x[1] == POINTER]:
        with contextlib.suppress(OSError, UnicodeDecodeError):
            journal = folder / path.read_text(encoding="utf-8")
            noted += _recovered(journal) if journal.exists() else []
            if not journal.exists():
                path.unlink()
    kept = {_run_of(p) for p, kind in _leftovers(folder) if kind in (JOURNAL, POINTER)}
    for path, _ in [x for x in found if x[1] in (NEW, OLD)]:
        if _run_of(path) not in kept:
            with contextlib.suppress(OSError):
                path.unlink()
    return noted


def _run_of(path: Path) -> str:
    """The run that a temporary file is of."""
    found = _NAME.fullmatch(path.name)
    return found["run"] if found else ""


def interrupted(folder: Path) -> Path | None:
    """The journal of a dead run that was replacing files of a folder, None where there is none; nothing is changed."""
    return next((path for path, kind in _leftovers(folder) if kind in (JOURNAL, POINTER)), None)


def _leftovers(folder: Path) -> list[tuple[Path, str]]:
    """Temporary files of dead runs in a folder, with their kinds."""
    try:
        with os.scandir(folder) as entries:
            names = [entry.name for entry in entries if ".postproc-" in entry.name]
    except OSError:
        return []
    matches = [(folder / name, m) for name in sorted(names) if (m := _NAME.fullmatch(name))]
    return [(path, m["kind"]) for path, m in matches if not _alive(path, m)]


def _recovered(journal: Path) -> list[Diagnostic]:
    """Undo what a journal says and remove it."""
    try:
        raw = json.loads(journal.read_text(encoding="utf-8"))["files"]
        entries = [_entry(one) for one in raw]
    except OSError as fault:
        return [_not_recovered(journal, fault)]
    except (ValueError, KeyError, TypeError):
        journal.unlink(missing_ok=True)
        return []
    count, faults = undo(journal.parent, entries)
    if faults:
        return [_not_recovered(journal, faults[0])]
    with contextlib.suppress(OSError):
        journal.unlink()
    for entry in entries:
        for name in (entry.staged, entry.backup):
            if name is not None:
                with contextlib.suppress(OSError):
                    (journal.parent / name).unlink()
    return [info("file.recovered", f"a run that was killed had replaced {count} of {len(entries)} files of one program "
                 "here: they were put back before anything else",
                 file=str(journal.parent / entries[-1].target))] if count else []


def _entry(values: dict[str, Any]) -> Entry:
    inode, size, changed = values["mark"]
    return Entry(str(values["target"]), str(values["staged"]), None if values["backup"] is None else str(values["backup"]),
                 (int(inode), int(size), int(changed)))


def _not_recovered(journal: Path, fault: OSError) -> Diagnostic:
    return warning("file.not_recovered", "a run that was killed has replaced only some of its files here, and what stood "
                   f"there before cannot be put back: {fault.strerror}", file=str(journal),
                   hint="files of two programs may stand side by side: write the program again, all its files")


def _is(path: Path, mark: tuple[int, int, int]) -> bool:
    try:
        return mark_of(path) == mark
    except FileNotFoundError:
        return False


def _alive(path: Path, name: re.Match[str]) -> bool:
    """True where the run of a temporary file may still be at work."""
    if name["where"] != _where():
        try:
            found = path.lstat()
        except OSError:
            return True
        return time.time() - max(found.st_mtime, found.st_ctime) < _FOREIGN
    start, state = _started(int(name["pid"]))
    return start == name["start"] and state != "Z"


def _started(pid: int) -> tuple[str, str]:
    """When a process began and its state, by the system; ("", "") where there is none. Without /proc all begin at 0."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        return fields[19], fields[0]
    except (OSError, IndexError):
        pass
    if Path("/proc/self/stat").exists() or os.name != "posix":
        return ("", "") if os.name == "posix" else ("0", "R")
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return "", ""
    except OSError:
        pass
    return "0", "R"


@cache
def _where() -> str:
    """The computer, and in a container its space of process numbers, as eight hex digits."""
    try:
        space = str(Path("/proc/self/ns/pid").readlink())
    except OSError:
        space = ""
    return hashlib.sha256(f"{socket.gethostname()} {space}".encode()).hexdigest()[:8]
