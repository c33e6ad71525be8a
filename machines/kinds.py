"""Kinds of machines: the built-in ones, those of installed packages, and those of files that the user names.

A package registers a kind in its metadata, in the group `postproc.kinematics`, by the word that machine files write:

    [project.entry-points."postproc.kinematics"]
    scissors = "my_machine:ScissorsModel"

Without a package: `POSTPROC_KINDS=my_machine.py` names files (several as in PATH) whose models are registered. Such a
file is a program that is run, so only files named there are, never one that merely lies next to a machine file.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, get_args
from zlib import crc32

from machines.models import KinematicsModel
from toolpaths.input_files import place
from toolpaths.plug_ins import PlugInFault, PlugInGroup, imported, named, registered

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP: PlugInGroup = "postproc.kinematics"
FILES = "POSTPROC_KINDS"
BUILT_IN = {
    "serial": "machines.serial_models:SerialModel",
    "linear-delta": "machines.parallel_models:LinearDeltaModel",
    "h4-linear": "machines.parallel_models:H4LinearModel",
    "legs": "machines.legs_models:LegsModel",
}
"""`[kinematics] kind` -> module:model of that table; imported when a file asks for it"""
_SHOWN = 12
"""digits of a hash that a header has"""
HOW = f'a package registers a kind in the entry point group "{GROUP}"; a file of yours is named in {FILES}=FILE.py'


class KindFault(PlugInFault):
    """A registered kind that cannot be used; the message says why, `hint` what to do."""


def known() -> list[str]:
    """All registered kinds, the built-in ones first.

    Raises:
        KindFault: where files of `POSTPROC_KINDS` cannot be used.
    """
    return list(dict.fromkeys([*BUILT_IN, *sorted(_registered()), *sorted(_in_files())]))


def model_of(kind: str) -> type[KinematicsModel] | None:
    """The model of the `[kinematics]` table of a kind; None where nothing of that name is registered.

    Raises:
        KindFault: where its code cannot be imported or is no model of a kind.
    """
    if kind in BUILT_IN:
        module, _, name = BUILT_IN[kind].partition(":")
        found: type[KinematicsModel] = getattr(import_module(module), name)
        return found
    if kind in (made := _in_files()):
        return made[kind]
    points = _registered().get(kind, [])
    if len(points) > 1:
        packages = ", ".join(f"{point.value} of {named(point)}" for point in points)
        raise KindFault(f"kind {kind!r} is registered several times: {packages}",
                        "uninstall all but one of these packages")
    return _loaded(points[0]) if points else None


def code_file(kind: str) -> Path | None:
    """The file with the model of a kind that is not built in, so that a proof can name its bytes; None of any other."""
    try:
        model = None if kind in BUILT_IN else model_of(kind)
    except KindFault:
        return None
    file = getattr(sys.modules.get(model.__module__), "__file__", None) if model is not None else None
    return Path(file) if file else None


def stamp(kind: str) -> str:
    """Whose code a kind is, for the header of a program; "" for a built-in one."""
    code = code_file(kind)
    if code is None:
        return ""
    points = [] if kind in _in_files() else _registered().get(kind, [])
    origin = f"{named(points[0])} {points[0].dist.version}" if points and points[0].dist is not None else code.name
    return f"kind {kind} of {origin} (code {sha256(code.read_bytes()).hexdigest()[:_SHOWN]})"


def _registered() -> dict[str, list[EntryPoint]]:
    """Entry points of installed packages by kind."""
    return {kind: points for kind, points in registered(GROUP).items() if kind not in BUILT_IN}


def _loaded(point: EntryPoint) -> type[KinematicsModel]:
    what = f"kind {point.name!r} ({point.value} of {named(point)})"
    try:
        model = imported(point, what)
    except PlugInFault as fault:
        raise KindFault(str(fault), fault.hint) from fault
    if not (isinstance(model, type) and issubclass(model, KinematicsModel)):
        raise KindFault(f"{what} is not a KinematicsModel (machines/models.py)",
                        "register the model of the [kinematics] table")
    return model


def _in_files() -> dict[str, type[KinematicsModel]]:
    """Models of the files of `POSTPROC_KINDS` by kind.

    Raises:
        KindFault: where a file cannot be run or registers nothing, or two of them define one kind.
    """
    named = dict.fromkeys(str(place(part)) for part in os.environ.get(FILES, "").split(os.pathsep) if part)
    found, where = dict[str, type[KinematicsModel]](), dict[str, str]()
    for file in named:
        for kind, model in _of_file(file).items():
            if kind in where:
                raise KindFault(f"kind {kind!r} is defined twice: in {where[kind]} and in {file}",
                                f"name one of them in {FILES}, or give one another word")
            found[kind], where[kind] = model, file
    return found


@cache
def _of_file(file: str) -> dict[str, type[KinematicsModel]]:
    hint = f"correct the file, or take it out of {FILES}"
    try:
        module = _run(Path(file))
    except (Exception, SystemExit) as fault:  # code of others: whatever it raises
        raise KindFault(f"{file}, named in {FILES}, is not run: {type(fault).__name__}: {fault}", hint) from fault
    found = {kind: model for model in vars(module).values() for kind in _words(model, module.__name__)}
    if not found:
        raise KindFault(f"{file}, named in {FILES}, holds no kind of machine",
                        'derive a model from KinematicsModel with `kind: Literal["..."]` (docs/how-to/machine-kind.md)')
    return found


def _run(file: Path) -> ModuleType:
    name = f"postproc_kinds_{file.stem}_{crc32(str(place(file)).encode()):08x}"
    spec = spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ImportError("not a Python file")
    module = module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _words(model: object, module: str) -> Iterator[str]:
    """The words that name a model in machine files, of one that its module defines; built-in ones stay as they are."""
    if isinstance(model, type) and issubclass(model, KinematicsModel) and model.__module__ == module:
        yield from (word for word in get_args(model.model_fields["kind"].annotation) if word not in BUILT_IN)
