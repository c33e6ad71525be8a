"""What the cutter must do, in the part's frame: CL files in, arrays out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toolpaths.choices import DialectName, LengthUnit, ShopName
    from toolpaths.diagnostics import Diagnostic
    from toolpaths.toolpath import Toolpath

__all__ = ["read", "read_bytes", "write"]
ReadProgress = Callable[[int, int], None]


def read(path: str | Path, *, units: LengthUnit | None = None, dialect: DialectName | ShopName | None = None,
         allow_unknown: Iterable[str] = (), progress: ReadProgress | None = None,
         tolerance: float = 0.0) -> tuple[Toolpath, list[Diagnostic]]:
    """The toolpath of a CL file, and what reading it showed; see `toolpaths.cl.read.read_bytes` for the options."""
    from toolpaths.cl.read import read_file
    result = read_file(path, units=units, dialect=dialect, allow_unknown=allow_unknown, progress=progress,
                       tolerance=tolerance)
    return result.toolpath, result.diagnostics


def read_bytes(data: bytes | str, *, file: str = "", units: LengthUnit | None = None,
               dialect: DialectName | ShopName | None = None,
               allow_unknown: Iterable[str] = (), tolerance: float = 0.0) -> tuple[Toolpath, list[Diagnostic]]:
    """The same from the text of a CL file; `file` is its name in diagnostics."""
    from toolpaths.cl import read as reader
    result = reader.read_bytes(data, file=file, units=units, dialect=dialect, allow_unknown=allow_unknown,
                               tolerance=tolerance)
    return result.toolpath, result.diagnostics


def write(toolpath: Toolpath, path: str | Path | None = None) -> str:
    """APT text of the toolpath, also to the file at `path`; reading it gives the same toolpath."""
    from toolpaths.cl.write import text_of
    text = text_of(toolpath)
    if path is not None:
        from toolpaths.transaction import write_together
        write_together({Path(path): text})
    return text
