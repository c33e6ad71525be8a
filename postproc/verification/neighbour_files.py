"""The files that stand next to a program, for the subprograms that it calls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from toolpaths.diagnostics import Diagnostic, DiagnosticError, warning
from toolpaths.input_files import is_regular, place, read_input, unreadable
from toolpaths.interrupted_runs import interrupted


class NeighbourFiles(Mapping[str, bytes]):
    """Files of a program's folder by their names, without itself; read where they are asked for."""

    def __init__(self, program: str | Path) -> None:
        self.folder, self.own = Path(program).parent, Path(program).name

    def __getitem__(self, name: str) -> bytes:
        if name not in set(self):
            raise KeyError(name)
        try:
            return read_input(self.folder / name)
        except OSError as fault:
            raise DiagnosticError([unreadable(fault, "gcode.open", self.folder / name)]) from fault

    def __iter__(self) -> Iterator[str]:
        try:
            files = [p.name for p in self.folder.iterdir() if p.name != self.own and is_regular(p)]
        except OSError:  # a folder that cannot be listed: calls of subprograms say that there are none
            files = []
        return iter(sorted(files))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def unfinished(program: Path) -> list[Diagnostic]:
    """That a killed run was replacing files where a program stands: they may be of two programs."""
    if interrupted(place(program).parent) is None:
        return []
    return [warning("file.unfinished", "a run that was killed had begun to replace files in this folder: subprograms next "
                    "to the program may be new where it is old", file=str(program),
                    hint="convert again: the next command that writes here puts the old files back first")]
