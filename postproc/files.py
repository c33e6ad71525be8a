"""Output files are replaced whole or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

from toolpaths.diagnostics import Diagnostic, DiagnosticError, error


def write_atomically(path: Path, text: str | bytes) -> None:
    """Write `text` (UTF-8, or bytes as they are) beside `path` and put it in its place at once; folders are made as needed,
    links are kept.

    Raises:
        DiagnosticError: where the file cannot be written; what stood there stays.
    """
    try:
        path = path.resolve()
        if path.exists() and not path.is_file():
            raise OSError(errno.EINVAL, "it is no regular file")
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except RuntimeError as fault:
        raise DiagnosticError([_cannot(path, OSError(errno.ELOOP, "its links lead in a circle"))]) from fault
    except OSError as fault:
        raise DiagnosticError([_cannot(path, fault)]) from fault
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text.encode("utf-8") if isinstance(text, str) else text)
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    except OSError as fault:
        temporary.unlink(missing_ok=True)
        raise DiagnosticError([_cannot(path, fault)]) from fault
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _cannot(path: Path, fault: OSError) -> Diagnostic:
    return error("file.write", f"cannot be written: {fault.strerror}", file=str(path), hint="choose another place")
