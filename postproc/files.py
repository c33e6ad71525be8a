"""Output files are replaced whole or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, warning
from toolpaths.input_files import is_regular, read_input


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
    except ValueError as fault:
        raise DiagnosticError([_cannot(path, OSError(errno.EINVAL, "no file can have this name"))]) from fault
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


def write_all(output: Path, text: str, files: dict[str, str]) -> list[Diagnostic]:
    """Write a program, and before it the files of its subprograms beside it; says which of another program it replaces.

    Raises:
        DiagnosticError: where one cannot be written, or a subprogram would bear the program's own name.
    """
    from postproc.controllers.writer import OF_PROGRAM

    if output.name.lower() in {name.lower() for name in files}:
        raise DiagnosticError([error("file.own_name", "the program and one of its subprograms would bear the same name",
                                     file=str(output), hint=f"give -o another name than {', '.join(list(files)[:6])}")])
    beside = {output.parent / name: text for name, text in files.items()}
    found = replaced(beside, OF_PROGRAM)
    for path, content in {**beside, output: text}.items():
        write_atomically(path, content)
    return found


def replaced(files: dict[Path, str], mark: str) -> list[Diagnostic]:
    """Files that stand already where `files` will be written, and were written with another program.

    A file names its program in the line that holds `mark`.
    """
    found = [path for path, text in files.items() if is_regular(path) and not _same_program(path, text, mark.lower())]
    if not found:
        return []
    names = ", ".join(path.name for path in found[:6]) + (", ..." if len(found) > 6 else "")
    return [warning("file.replaced", f"{names} of another program stood there and {'are' if len(found) > 1 else 'is'} "
                    "replaced: that program now calls the new text", file=str(found[0]), count=len(found),
                    hint="write programs whose subprograms bear the same names into folders of their own")]


def _same_program(path: Path, text: str, mark: str) -> bool:
    own = [line for line in text.splitlines()[:8] if mark in line.lower()]
    try:
        return own[0] in read_input(path)[:4096].decode("utf-8", "replace").splitlines() if own else False
    except OSError:
        return False


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _cannot(path: Path, fault: OSError) -> Diagnostic:
    return error("file.write", f"cannot be written: {fault.strerror}", file=str(path), hint="choose another place")
