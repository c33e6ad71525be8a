"""SHA-256 of the bytes of every file that a conversion reads, its bases, tables and meshes too; where its proof stands."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

from machines.kinds import code_file
from machines.loader import builtin
from machines.user_file import UserFile, base_chain, read_toml
from postproc.base.options import Options
from postproc.controllers.model import builtin_files
from postproc.setup.criteria import criteria_of
from postproc.setup.files import file_keys, seen_from_here, value_at
from toolpaths.dataclass import dataclass
from toolpaths.input_files import read_input
from toolpaths.toolpath import ClSource

ENDING = ".proof.json"
"""behind the name of the program"""
Hashes = tuple["FileHash", ...]
ProofInput = Literal["program", "cl_file", "setup", "machine", "controller", "error_model"]


@dataclass(frozen=True)
class FileHash:
    """A file by its name without its folder, and the SHA-256 of its bytes in hex."""

    file: str
    sha256: str


def proof_place(gcode: Path) -> Path:
    """Where the proof of a program stands."""
    return gcode.with_name(gcode.name + ENDING)


def sha256(data: bytes) -> str:
    """In hex."""
    return hashlib.sha256(data).hexdigest()


def cl_hashes(name: str, source: ClSource) -> Hashes:
    """Of a CL file, and of the code of the package that reads it, where one does."""
    code = source.plug_in
    return (FileHash(Path(name).name, sha256(source.data)), *([] if code is None else [FileHash(str(code), code.sha256)]))


def input_hashes(machine: str, controller: str, options: Options) -> dict[ProofInput, Hashes]:
    """By input (set-up, machine, controller, error model): its file, the files of its `base` chain, files that it names.

    Args:
        machine, controller: built-in names or paths

    Raises:
        OSError: where a file cannot be read any more.
    """
    stated = _criteria(options.setup) if options.setup else ()
    setup = (*(_with_files(options.setup, {}, _meshes) if options.setup else ()),
             *(_with_files(options.hooks, {}, _none) if options.hooks else ()), *stated)
    return {"setup": setup,
            "machine": machine_hashes(machine),
            "controller": _with_files(controller, builtin_files(), _none),
            "error_model": error_model_hashes(options.error_model) if options.error_model else ()}


def machine_hashes(machine: str) -> Hashes:
    """Of a machine's file, its bases, the code of its kind.

    Raises:
        OSError: where a file cannot be read any more.
    """
    return _with_files(machine, builtin(), _kind)


def error_model_hashes(file: str) -> Hashes:
    """Of an error model and its tables.

    Raises:
        OSError: where a file cannot be read any more.
    """
    return _with_files(file, {}, _tables)


def _with_files(source: str, known: Mapping[str, Path], named: Callable[[UserFile], list[Path]]) -> Hashes:
    chain = base_chain(source, known)
    file, _ = read_toml(source, known)
    more = [] if file is None else named(file)
    return tuple(FileHash(path.name, sha256(read_input(path))) for path in (*chain, *dict.fromkeys(more)))


def _none(file: UserFile) -> list[Path]:
    return []


def _meshes(file: UserFile) -> list[Path]:
    """Mesh files of a set-up, as it sees them."""
    seen = seen_from_here(file)
    return [Path(seen.file).parent / str(value_at(seen.values, key)) for key in file_keys(seen.values)]


def _criteria(setup: str) -> Hashes:
    """The code of the packages whose limits of tool axes a set-up states."""
    file, _ = read_toml(setup)
    tables = {} if file is None else file.values.get("orientation", {}).get("criteria", {})
    return tuple(FileHash(str(one.plug_in), one.plug_in.sha256) for one in criteria_of(tables))


def _kind(file: UserFile) -> list[Path]:
    """The code of a kind of machine that is not built in."""
    table = file.values.get("kinematics", {})
    code = code_file(str(table.get("kind", table.get("family", ""))))
    return [] if code is None else [code]


def _tables(file: UserFile) -> list[Path]:
    """CSV tables of an error model, each next to the file that names it."""
    found = list[Path]()
    todo: list[tuple[tuple[str, ...], Any]] = [((key,), value) for key, value in file.values.items()]
    while todo:
        path, value = todo.pop(0)
        if isinstance(value, dict):
            todo += [((*path, key), part) for key, part in value.items()]
        elif path[-1] == "table" and isinstance(value, str):
            found.append(Path(file.origin(path).file).parent / value)
    return found
