"""The files that stand beside a program, for the subprograms that it calls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path


class Beside(Mapping[str, bytes]):
    """Files of a program's folder by their names, without itself; read where they are asked for."""

    def __init__(self, program: str | Path) -> None:
        self.folder, self.own = Path(program).parent, Path(program).name

    def __getitem__(self, name: str) -> bytes:
        if name not in set(self):
            raise KeyError(name)
        return (self.folder / name).read_bytes()

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(p.name for p in self.folder.iterdir() if p.is_file() and p.name != self.own))

    def __len__(self) -> int:
        return sum(1 for _ in self)
