"""Output files, all of one command together: every one is replaced, or none is.

All texts are written next to their places and synced, then renamed one after another, the last one given (the
program) last. A fault at any step puts back what stood there. A run that is killed between the first rename
and the last leaves a
journal: the next run that writes into one of its folders puts everything back before it begins. One output alone is one
rename, so that at any moment the old or the new file stands there, whole.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import stat
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import toolpaths.interrupted_runs as leftovers
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error

READ_ONLY = "it is read-only"
HELD = "another program holds it open"
_HELD_BY_OTHERS = (5, 32, 33)
"""numbers of Windows: access denied, sharing violation, lock violation"""
_PIECE = 1 << 20
"""characters of a text that are written at a time"""
_PATIENCE = (0.05, 0.1, 0.2, 0.4)
"""s between tries"""


@dataclass(frozen=True)
class _Output:
    """One output: `path` as it was given, `target` behind all links, `staged` next to it, `old` what stands there."""

    path: Path
    target: Path
    staged: Path
    old: os.stat_result | None


def write_together(outputs: Mapping[Path, str | bytes]) -> list[Diagnostic]:
    """Replace all files, or none; folders are made as needed, links and modes of files are kept.

    Args:
        outputs: path -> text (UTF-8, or bytes as they are), in the order in which they are put into their places

    Returns:
        What a killed run had left in the folders and was put back.

    Raises:
        DiagnosticError: where one cannot be written; everything stands as before.
    """
    run = leftovers.run_name()
    todo = _checked(outputs, run)
    made: list[Path] = []
    try:
        for one in todo:
            with _for(one.path):
                _make_folder(one.target.parent, made)
        noted = [d for folder in dict.fromkeys(one.target.parent for one in todo) for d in leftovers.clean(folder)]
        todo = [_output(one.path, run) for one in todo]  # as cleaning has left them
        for one, content in zip(todo, outputs.values(), strict=True):
            with _for(one.path):
                _stage(one, content)
        with _uninterrupted(), _alone({one.target.parent for one in todo}):
            _put(todo, run)
    except BaseException:
        for one in todo:
            _remove(one.staged)
        for folder in reversed(made):
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise
    return noted


def _checked(outputs: Mapping[Path, str | bytes], run: str) -> list[_Output]:
    """The outputs with their places.

    Raises:
        DiagnosticError: where one is read-only or no regular file, or two are the same file.
    """
    todo = []
    for path in outputs:
        with _for(path):
            todo.append(_output(path, run))
    seen: dict[object, Path] = {}
    for one in todo:
        for place in (one.target, *([] if one.old is None else [(one.old.st_dev, one.old.st_ino)])):
            if place in seen:
                raise DiagnosticError([error("file.twice", f"two outputs of this command are one file, the other one is "
                                             f"{seen[place]}", file=str(one.path), hint="give them different names")])
        seen |= dict.fromkeys([one.target, *([] if one.old is None else [(one.old.st_dev, one.old.st_ino)])], one.path)
    return todo


def _output(path: Path, run: str) -> _Output:
    try:
        target = path.resolve()
    except ValueError as fault:
        raise OSError(errno.EINVAL, "no file can have this name") from fault
    except RuntimeError as fault:
        raise OSError(errno.ELOOP, "its links lead in a circle") from fault
    try:
        old = target.stat()
    except FileNotFoundError:
        old = None
    if old is not None and not stat.S_ISREG(old.st_mode):
        raise OSError(errno.EINVAL, "it is not a regular file")
    if old is not None and not (old.st_mode & 0o222 and os.access(target, os.W_OK)):
        raise OSError(errno.EACCES, READ_ONLY)
    return _Output(path, target, leftovers.temporary(target, run, leftovers.NEW), old)


def _make_folder(folder: Path, made: list[Path]) -> None:
    """Make a folder and those above it; `made` takes those that were not there."""
    if folder.is_dir():
        return
    if folder != folder.parent:
        _make_folder(folder.parent, made)
    try:
        folder.mkdir()
    except FileExistsError:  # another run was faster
        if not folder.is_dir():
            raise
    else:
        made.append(folder)


def _stage(one: _Output, content: str | bytes) -> None:
    """Write one text next to its place, with the mode (and owner, where that is allowed) of the file that it replaces."""
    with os.fdopen(os.open(one.staged, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        for at in range(0, len(content), _PIECE):  # a long text is never held in bytes besides
            piece = content[at:at + _PIECE]
            file.write(piece.encode("utf-8") if isinstance(piece, str) else piece)
        file.flush()
        if one.old is not None and hasattr(os, "chown"):
            now = os.fstat(file.fileno())
            if (now.st_uid, now.st_gid) != (one.old.st_uid, one.old.st_gid):
                with contextlib.suppress(OSError):
                    os.chown(one.staged, one.old.st_uid, one.old.st_gid)
        one.staged.chmod(0o666 & ~_umask() if one.old is None else stat.S_IMODE(one.old.st_mode))
        os.fsync(file.fileno())


def _put(todo: Sequence[_Output], run: str) -> None:
    """Rename all into their places; where one fails what stood there is put back."""
    if len(todo) == 1:
        with _for(todo[0].path):
            _into_place(todo[0])
        _sync_folder(todo[0].target.parent)
        return
    folder, folders = todo[-1].target.parent, {one.target.parent for one in todo}
    journal = leftovers.temporary(todo[-1].target, run, leftovers.JOURNAL)
    entries, notes = list[leftovers.Entry](), list[Path]()
    try:
        for one in todo:
            with _for(one.path):
                entries.append(_entry(one, folder, run))
        with _for(journal):
            for other in folders - {folder}:
                notes.append(leftovers.temporary(other / todo[-1].target.name, run, leftovers.POINTER))
                _write_note(notes[-1], os.path.relpath(journal, other))
            notes.append(journal)
            _write_note(journal, leftovers.journal_text(entries))
        for one in todo:
            with _for(one.path):
                _into_place(one)
        for each in folders:
            _sync_folder(each)
        with _for(journal):
            journal.unlink()  # from here on the new files count
    except BaseException as fault:
        left = leftovers.undo(folder, entries)[1]
        if left:  # backups and journal stay for the next run
            raise DiagnosticError([*getattr(fault, "diagnostics", ()), _mixed(todo[-1].path, left[0])]) from fault
        _tidy(folder, entries, notes)
        raise
    _tidy(folder, entries, notes)


def _into_place(one: _Output) -> None:
    """The new file in the place of the old one; where another program holds that open, as viewers do on Windows, a little
    later.

    Raises:
        OSError: where it stays held, or for any other reason.
    """
    for wait in _PATIENCE:
        try:
            one.staged.replace(one.target)
            return
        except PermissionError as fault:
            if getattr(fault, "winerror", None) not in _HELD_BY_OTHERS:
                raise
            time.sleep(wait)
    try:
        one.staged.replace(one.target)
    except PermissionError as fault:
        raise OSError(fault.errno, HELD) from fault


def _entry(one: _Output, folder: Path, run: str) -> leftovers.Entry:
    """What the journal says of an output, its old file kept under a second name."""
    backup = None if one.old is None else leftovers.temporary(one.target, run, leftovers.OLD)
    if backup is not None:
        try:
            backup.hardlink_to(one.target)
        except OSError:  # a file system without links
            shutil.copy2(one.target, backup)
            _sync(backup)
    names = [None if p is None else os.path.relpath(p, folder) for p in (one.target, one.staged, backup)]
    return leftovers.Entry(str(names[0]), str(names[1]), names[2], leftovers.mark_of(one.staged))


def _tidy(folder: Path, entries: Sequence[leftovers.Entry], notes: Sequence[Path]) -> None:
    """Remove the journal first, then what it needed."""
    for path in (*reversed(notes), *(folder / e.backup for e in entries if e.backup is not None)):
        _remove(path)


def _write_note(path: Path, text: str) -> None:
    """A file that is there whole or not at all."""
    whole = path.with_name(f".{path.name.removesuffix(path.suffix)}.{leftovers.NEW}")
    try:
        whole.write_text(text, encoding="utf-8")
        _sync(whole)
        whole.replace(path)
    except BaseException:
        _remove(whole)
        raise
    _sync_folder(path.parent)


def _sync(path: Path, how: int = os.O_RDWR) -> None:
    """To the disk. Windows does that for files which are open to be written alone, other systems for folders read alone."""
    handle = os.open(path, how)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _sync_folder(folder: Path) -> None:
    """Names of a folder to the disk, where its file system can."""
    with contextlib.suppress(OSError):
        _sync(folder, os.O_RDONLY)


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """An interrupt from the keyboard waits until all files stand in their places, and then counts no more."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, lambda *_: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextlib.contextmanager
def _alone(folders: set[Path]) -> Iterator[None]:
    """Runs that write into the same folder put their files into place one after the other, where the system has locks."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with contextlib.ExitStack() as held:
        for folder in sorted(folders):
            with contextlib.suppress(OSError):
                handle = os.open(folder, os.O_RDONLY)
                held.callback(os.close, handle)
                fcntl.flock(handle, fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def _for(path: Path) -> Iterator[None]:
    """A fault of the system as a diagnostic about an output."""
    try:
        yield
    except OSError as fault:
        raise DiagnosticError([_cannot(path, fault)]) from fault


def _cannot(path: Path, fault: OSError) -> Diagnostic:
    hints = {HELD: "close it there, or choose another place",
             READ_ONLY: "make it writable (chmod u+w), or choose another place",
             os.strerror(errno.ENOSPC): "make room on the disk, or choose another place"}
    hint = hints.get(str(fault.strerror), "choose another place")
    return error("file.write", f"cannot be written: {fault.strerror or fault}", file=str(path), hint=hint)


def _mixed(path: Path, fault: OSError) -> Diagnostic:
    return error("file.mixed", "some files of this command are new, some old: what stood there cannot be put back: "
                 f"{fault.strerror}", file=str(path),
                 hint="nothing is to be done: the next run that writes here puts the old ones back")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
