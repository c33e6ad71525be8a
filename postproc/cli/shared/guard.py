"""The outermost guard of the command line: what nobody foresaw ends as one line, a report file and exit code 70.

Nothing is imported here before it is needed, so that the guard holds from the first import of the commands on.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import TextIO

INTERNAL = 70
"""exit code of a fault of the program itself (EX_SOFTWARE of BSD's sysexits.h)"""
INTERRUPTED = 130
_LEAST_MEMORY = 500 * 2**20
"""bytes of address space below which numpy's OpenBLAS neither loads nor fails: its threads wait for each other without
end, or it ends the process without a word"""
_NO_ROOM = ("failed to map segment", "cannot allocate memory", "can't start new thread", "cannot allocate write+execute")
"""what loaders of libraries, threads and compiled code say where memory is used up"""
_ROOMS = ("postproc", "machines", "toolpaths")
_CONSOLE = (errno.EPIPE, errno.ENOSPC, errno.EIO, errno.EBADF, errno.EFBIG, errno.EAGAIN)
"""what printing fails with; files that are read and written have their own diagnostics"""
_LARGEST_HASHED = 10**9
_PARTS = ("numpy", "scipy", "numba", "pydantic", "tomlkit", "typer", "ruckig", "trimesh", "matplotlib")


def guarded(command: Callable[[], object]) -> int:
    """Run a command; its exit code.

    An unexpected exception writes a report file and is shown as `internal error [code]`; Ctrl-C and a closed
    pipe end quietly.
    """
    try:
        if wrong := _too_little_memory() or _other_packages():
            _say(wrong)
            return 1
        _forget()
        try:
            command()
            code = 0
        except SystemExit as end:
            code = _exit_code(end)
        sys.stdout.flush()
        return code if code != INTERRUPTED else _interrupted()
    except KeyboardInterrupt:
        return _interrupted()
    except OSError as fault:
        return _console_gone(fault) if _of_console(fault) else _failed(fault)
    except Exception as fault:
        return _failed(fault)


def _forget() -> None:
    """What a command before this one, in the same process, had to say of its interruption."""
    from postproc.cli.shared.says import SAYS

    SAYS.interrupted = ""


def fingerprint(fault: BaseException) -> str:
    """Eight hexadecimal digits that stand for the kind of an exception and the place of our own code that
    raised it: file and function, not the line, so that one fault keeps its code from version to version."""
    import hashlib

    places = [f"{file}:{name}" for file, name in _own_places(fault)] or ["outside"]
    return hashlib.sha256(f"{type(fault).__name__} {places[-1]}".encode()).hexdigest()[:8]


def report_text(fault: BaseException, arguments: list[str]) -> str:
    """What the bug tracker needs: versions, the command line, the traceback, the inputs by size and hash, not their text."""
    import platform
    import traceback

    from postproc.base.version import VERSION

    return "\n".join([
        f"internal error [{fingerprint(fault)}]", "", f"postproc {VERSION}",
        f"Python {platform.python_version()}, {platform.platform()}", *_versions(), "",
        f"command line: {' '.join(map(_quoted, arguments))}", "",
        "files named in it:", *(_hashes(arguments) or ["none"]), "",
        "traceback:", "".join(traceback.format_exception(fault)).rstrip(), ""])


def _failed(fault: Exception) -> int:
    """Memory that is used up and a package that is not installed are no faults of the program; all else is."""
    if _of_extras(fault):
        _say(str(fault))
        return 1
    if not _of_memory(fault):
        return _internal(fault)
    fault.__traceback__ = fault.__context__ = fault.__cause__ = None  # what the command held is free for the message
    _say("memory is used up; the command ended; each of its files is whole, new or as it was; allow it more (ulimit -v, "
         "the limit of the container), end other programs, or convert the operations of the file one by one")
    return 1


def _of_extras(fault: BaseException) -> bool:
    """True for the DiagnosticError of `toolpaths.extras`, wherever it was raised."""
    return any(getattr(one, "code", "") == "extra.missing" for one in getattr(fault, "diagnostics", ()))


def _of_memory(fault: BaseException | None) -> bool:
    """True where an exception, or one that it came from, says that there is no memory."""
    seen: set[int] = set()
    while fault is not None and id(fault) not in seen:
        seen.add(id(fault))
        if isinstance(fault, MemoryError) or getattr(fault, "errno", None) == errno.ENOMEM:
            return True
        if isinstance(fault, (ImportError, RuntimeError, OSError)) and any(w in str(fault).lower() for w in _NO_ROOM):
            return True
        fault = fault.__cause__ or fault.__context__
    return False


def _too_little_memory() -> str:
    """What is said where the limit of this process (setrlimit(2), RLIMIT_AS) is too small to begin; "" where it is not."""
    try:
        import resource
    except ImportError:  # systems without such limits
        return ""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit == resource.RLIM_INFINITY or limit >= _LEAST_MEMORY:
        return ""
    return (f"the memory limit of {limit >> 20} MB is too small, at least {_LEAST_MEMORY >> 20} MB are needed; "
            f"nothing was written; raise it: ulimit -v {_LEAST_MEMORY >> 10}")


def _other_packages() -> str:
    """What is said where packages of others stand in the place of ours; "" where none do."""
    from postproc.base.neighbours import foreign

    return foreign()


def _internal(fault: BaseException) -> int:
    """One line on standard error, and the report file."""
    code = fingerprint(fault)
    where = _written(f"postproc-error-{code}.txt", fault)
    send = f"please send {where} (versions, command line, traceback, sizes and hashes of the files, not their text)" \
        if where else "no report file could be written; please send the command line and the version"
    _say(f"internal error [{code}] {_named(fault)}: a fault of postproc, not of its use; the command ended, nothing was "
         f"written; {send} to the bug tracker")
    return INTERNAL


def _named(fault: BaseException) -> str:
    """The kind of exception, in words where it has some."""
    return "nested too deeply" if isinstance(fault, RecursionError) else type(fault).__name__


def _written(name: str, fault: BaseException) -> str:
    """Where the report was written: the current folder, else the one for temporary files; "" where neither takes it."""
    import tempfile

    try:
        text = report_text(fault, sys.argv).encode("utf-8", "backslashreplace")
    except Exception:  # the report must not fail for what it is about: used-up memory, a broken package
        text = f"internal error [{fingerprint(fault)}] {type(fault).__name__}\n".encode()
    for folder in (Path(), Path(tempfile.gettempdir())):
        try:
            with os.fdopen(os.open(folder / name, _NEW, 0o600), "wb") as file:
                file.write(text)
        except OSError:
            continue
        return str(folder / name)
    return ""


_NEW = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_NOFOLLOW", 0)


def _own_places(fault: BaseException) -> Iterator[tuple[str, str]]:
    """(file below the package's folder, function) of each frame in our own code, outermost first."""
    root = Path(__file__).parents[3]
    for frame in _frames(fault.__traceback__):
        file = Path(frame.tb_frame.f_code.co_filename)
        if file.is_relative_to(root) and file.relative_to(root).parts[0] in _ROOMS:
            yield file.relative_to(root).as_posix(), frame.tb_frame.f_code.co_name


def _frames(trace: TracebackType | None) -> Iterator[TracebackType]:
    while trace is not None:
        yield trace
        trace = trace.tb_next


def _of_console(fault: OSError) -> bool:
    """True for an OSError of standard output or error: no file is named."""
    return fault.filename is None and fault.errno in _CONSOLE


def _console_gone(fault: OSError) -> int:
    """Nobody reads any more (quiet), or what is printed cannot be stored."""
    _silence(sys.stdout)
    if not isinstance(fault, BrokenPipeError):
        _say(f"standard output cannot be written: {fault.strerror}")
    return 1


def _silence(stream: TextIO) -> None:
    """What is left in a stream goes nowhere, so that Python does not complain of it at its end."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    except (OSError, ValueError, AttributeError):
        return


def _interrupted() -> int:
    from postproc.cli.shared.says import SAYS

    _say(SAYS.interrupted or "interrupted; nothing was written")
    return INTERRUPTED


def _exit_code(end: SystemExit) -> int:
    if end.code is None or isinstance(end.code, int):
        return end.code or 0
    _say(str(end.code))
    return 1


def _say(text: str) -> None:
    """A line on standard error, or nothing where that is closed."""
    try:
        sys.stderr.write(f"{text}\n")
        sys.stderr.flush()
    except (OSError, ValueError, AttributeError):
        _silence(sys.stderr)


def _versions() -> list[str]:
    from importlib.metadata import PackageNotFoundError, version

    found = []
    for name in _PARTS:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} is missing")
    return found


def _hashes(arguments: list[str]) -> list[str]:
    """Name, size and SHA-256 of the regular files that the arguments name."""
    import hashlib
    import stat

    found = []
    for name in dict.fromkeys(part for a in arguments[1:] for part in (a, a.partition("=")[2]) if part):
        try:
            state = Path(name).stat()
            if not stat.S_ISREG(state.st_mode) or state.st_size > _LARGEST_HASHED:
                continue
            with Path(name).open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except (OSError, ValueError):
            continue
        found.append(f"{_quoted(name)}: {state.st_size} bytes, sha256 {digest}")
    return found


def _quoted(text: str) -> str:
    import shlex

    return shlex.quote(text)
