"""The files of a program: its own, those of its subprograms next to it, and what stood there before."""

from __future__ import annotations

from pathlib import Path

from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, warning
from toolpaths.input_files import is_regular, read_input


def program_files(output: Path, text: str, files: dict[str, str]) -> tuple[dict[Path, str], list[Diagnostic]]:
    """Texts by path, the subprograms before the program that calls them; says which of another program will be replaced.

    Raises:
        DiagnosticError: where a subprogram would have the program's own name.
    """
    from postproc.writing.writer import OF_PROGRAM

    if output.name.lower() in {name.lower() for name in files}:
        raise DiagnosticError([error("file.own_name", "the program and one of its subprograms would have the same name",
                                     file=str(output), hint=f"give -o another name than {', '.join(list(files)[:6])}")])
    called = {output.parent / name: text for name, text in files.items()}
    return {**called, output: text}, replaced(called, OF_PROGRAM)


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
                    hint="write programs whose subprograms have the same names into folders of their own")]


def _same_program(path: Path, text: str, mark: str) -> bool:
    own = [line for line in text.splitlines()[:8] if mark in line.lower()]
    try:
        return own[0] in read_input(path)[:4096].decode("utf-8", "replace").splitlines() if own else False
    except OSError:
        return False
