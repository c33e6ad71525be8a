"""Every input file is opened here: regular files, or standard input, up to a stated size."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from toolpaths.diagnostics import Diagnostic, error

STANDARD_INPUT = ("-", "/dev/stdin", "/dev/fd/0", "/proc/self/fd/0")
"""names under which a file may be piped in"""
MEGABYTE = 1_000_000
LARGEST = 1000 * MEGABYTE
"""bytes of an input file, where nothing else is asked for (`--max-file-size`)"""
_LONGEST = 4096
"""characters of a path (PATH_MAX of Linux)"""
_CHUNK = 1 << 20
_KINDS = ((stat.S_ISDIR, "it is a folder", "name a file in it"),
          (stat.S_ISFIFO, "it is a pipe", "write it into a file first"),
          (stat.S_ISSOCK, "it is a socket", "name a regular file"),
          (stat.S_ISCHR, "it is a device", "name a regular file"),
          (stat.S_ISBLK, "it is a device", "name a regular file"))
_largest: ContextVar[int] = ContextVar("largest", default=LARGEST)


class InputFault(OSError):
    """A file that is not read: `strerror` says why, `hint` what to do."""

    def __init__(self, reason: str, hint: str) -> None:
        super().__init__(0, reason)
        self.hint = hint


@contextmanager
def largest_file(size: float) -> Iterator[None]:
    """Files of up to `size` bytes are read inside."""
    token = _largest.set(int(size))
    try:
        yield
    finally:
        _largest.reset(token)


def read_input(path: str | Path, *, standard_input: bool = False) -> bytes:
    """The bytes of a regular file, or of standard input where it may be piped in and is named so.

    Raises:
        OSError: where the file is not read (FileNotFoundError where there is none); `strerror` says why.
            `unreadable` makes a diagnostic of it.
    """
    if standard_input and str(path) in STANDARD_INPUT:
        return _piped()
    try:
        size = check_input(path).st_size
    except InputFault as fault:
        fault.hint += ", or pipe it in and name - as the file" if standard_input and "pipe" in reason(fault) else ""
        raise
    with _opened(path) as stream:
        _check_kind(os.fstat(stream.fileno()))
        return _bounded(stream, size)


def first_bytes(path: str | Path, count: int) -> bytes:
    """The beginning of a file; b"" where it cannot be read, which reading it says.

    Standard input is not looked at.
    """
    if str(path) == "-" or not is_regular(path):
        return b""
    try:
        with _opened(path) as stream:
            return stream.read(count)
    except OSError:
        return b""


def check_input(path: str | Path) -> os.stat_result:
    """The state of a regular file that is not too large, before it is opened.

    Raises:
        OSError: as `read_input`.
    """
    name = str(path)
    if "\0" in name:
        raise InputFault("its name holds a NUL character", "name a regular file")
    if len(name) > _LONGEST:
        raise InputFault(f"its name has {len(name)} characters, at most {_LONGEST} are possible",
                         "name a regular file")
    try:
        found = Path(path).stat()
    except ValueError as fault:  # a name that no file system can hold
        raise InputFault(f"no file can have this name ({fault})", "name a regular file") from fault
    _check_kind(found)
    if found.st_size > _largest.get():
        raise _too_large(f"it has {found.st_size / MEGABYTE:.3g} MB")
    return found


def place(path: str | Path) -> Path:
    """Where a name leads, through links; as it is where it leads nowhere."""
    try:
        return Path(path).resolve()
    except (OSError, RuntimeError, ValueError):
        return Path(path)


def there_is(path: str | Path) -> bool:
    """True where a name leads to something that can be seen; never raises."""
    try:
        return Path(path).exists()
    except (OSError, ValueError):
        return False


def is_regular(path: str | Path) -> bool:
    """True for a regular file that can be seen; never raises."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


def unreadable(fault: OSError, code: str, path: str | Path, hint: str = "") -> Diagnostic:
    """The diagnostic of a file that could not be read; `hint` where the fault has none of its own."""
    return error(code, f"cannot be read: {reason(fault)}", file=shown(path), hint=advice(fault, hint))


def reason(fault: OSError) -> str:
    """Why a file could not be read."""
    return fault.strerror or str(fault)


def advice(fault: OSError, hint: str = "") -> str:
    """What to do about it."""
    if isinstance(fault, PermissionError):
        return "allow it to be read (chmod), or name another file"
    return str(getattr(fault, "hint", "")) or hint or "name a regular file that can be read"


def shown(path: str | Path) -> str:
    """A name as messages show it: printable, not endless."""
    text = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in str(path))
    return text if len(text) <= 300 else f"{text[:120]}...{text[-120:]}"


def _opened(path: str | Path) -> BinaryIO:
    """Opened without waiting: what became a pipe since it was looked at is found out instead of read."""
    return os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)), "rb")


def _check_kind(found: os.stat_result) -> None:
    for is_kind, what, hint in _KINDS:
        if is_kind(found.st_mode):
            raise InputFault(f"{what}, no regular file", hint)


def _piped() -> bytes:
    stream = getattr(sys.stdin, "buffer", None)
    if stream is None or stream.closed:
        raise InputFault("there is no standard input", "pipe a file in, or name one")
    return _bounded(stream, 0)


def _bounded(stream: BinaryIO, size: int) -> bytes:
    """All that is left to read; `size` is what is expected."""
    data = stream.read(size + 1)
    if len(data) <= size:
        return data
    parts, count, largest = [data], len(data), _largest.get()
    while data and count <= largest:
        data = stream.read(_CHUNK)
        parts.append(data)
        count += len(data)
    if count > largest:
        raise _too_large("it does not end within that")
    return b"".join(parts)


def _too_large(what: str) -> InputFault:
    return InputFault(f"{what}, and files of up to {_largest.get() / MEGABYTE:g} MB are read",
                      "raise the limit with --max-file-size MB if it is the right file")
