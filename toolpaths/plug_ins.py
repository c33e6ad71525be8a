"""Plug-ins: what installed packages add by entry points; they are looked at only where something is asked for.

A package states in its metadata what it gives, by group and name:

    [project.entry-points."postproc.cl_readers"]
    points = "shop_post.points:PointsReader"

Code of others may raise whatever it likes: here all of it becomes a `PlugInFault`, which names the package.
"""

from __future__ import annotations

import hashlib
import sys
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from toolpaths.dataclass import dataclass

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

PlugInGroup = Literal["postproc.kinematics", "postproc.cl_dialects", "postproc.cl_readers",
                      "postproc.orientation_criteria", "postproc.report_tabs"]
_SHOWN = 12
"""digits of a hash that a header has"""
_LONGEST = 300
"""characters of what the code of others says, at most"""


class PlugInFault(ValueError):
    """A plug-in that cannot be used; the message says which and why, `hint` what to do."""

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True)
class PlugIn:
    """One entry point of an installed package, and the SHA-256 of the package's code, in hex ("" before it is imported)."""

    group: PlugInGroup
    name: str
    package: str
    version: str
    sha256: str = ""

    def __str__(self) -> str:
        return f"{self.name} of {self.package} {self.version}"

    def stamped(self) -> str:
        """For people who look for the same code again: with the first digits of its hash."""
        return f"{self} (code {self.sha256[:_SHOWN]})"


def registered(group: PlugInGroup) -> dict[str, list[EntryPoint]]:
    """Entry points of installed packages by their names, none of them imported; the same one twice counts once."""
    return {name: list(points) for name, points in _registered(group, tuple(map(_as_it_stands, sys.path))).items()}


def _as_it_stands(folder: str) -> tuple[str, int]:
    """A folder that packages are imported from, and ns of its last change: one that is installed later changes it."""
    try:
        return folder, _path(folder).stat().st_mtime_ns
    except OSError:
        return folder, 0


_path = cache(Path)
"""of a folder on `sys.path`; making one takes longer than to ask when it was changed"""


@lru_cache(maxsize=16)  # all metadata of all packages are read for it: ten times a small CL file
def _registered(group: PlugInGroup, folders: tuple[tuple[str, int], ...]) -> dict[str, list[EntryPoint]]:
    from importlib.metadata import entry_points  # costs the start of commands that ask for none

    result: dict[str, list[EntryPoint]] = {}
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, point.value)):
        some = result.setdefault(point.name, [])
        if point.value not in [one.value for one in some]:
            some.append(point)
    return result


def plug_in(group: PlugInGroup, name: str, points: list[EntryPoint]) -> tuple[PlugIn, object]:
    """What stands behind a name, imported.

    Args:
        points: as `registered` gives them

    Raises:
        PlugInFault: where two packages give the name, or the code cannot be imported.
    """
    if len(points) > 1:
        packages = ", ".join(f"{named(point)} ({point.value})" for point in points)
        raise PlugInFault(f"{name!r} of {group} is registered several times: by {packages}",
                          "uninstall all but one of these packages")
    found = imported(points[0], f"{name!r} of {group}, registered by {named(points[0])},")
    package, version = named(points[0]), points[0].dist.version if points[0].dist is not None else "without a version"
    return PlugIn(group, name, package, version, code_hash(points[0].module)), found


def imported(point: EntryPoint, what: str) -> object:
    """The object of an entry point.

    Raises:
        PlugInFault: where its module or it is not there, or running it ends in anything; `what` it is, for the message.
    """
    try:
        return point.load()
    except (Exception, SystemExit) as fault:  # code of others: whatever it raises
        raise PlugInFault(f"{what} is not imported: {said(fault)}",
                          f"correct, reinstall or uninstall the package {named(point)}") from fault


def said(fault: BaseException) -> str:
    """What an exception of others says, in one line."""
    text = " ".join(str(fault).split())
    return f"{type(fault).__name__}: {text[:_LONGEST]}" if text else type(fault).__name__


def named(point: EntryPoint) -> str:
    """The package that registers an entry point."""
    return point.dist.name if point.dist is not None else "an unknown package"


def code_hash(module: str) -> str:
    """SHA-256 of the Python files of the topmost package of an imported module, by their names and bytes; "" without any."""
    top = module.partition(".")[0]
    file = getattr(sys.modules.get(top), "__file__", None) or getattr(sys.modules.get(module), "__file__", None)
    if not file:
        return ""
    path = Path(file)
    files = sorted(path.parent.rglob("*.py")) if path.name == "__init__.py" else [path]
    digest = hashlib.sha256()
    try:
        for one in files:
            name = one.relative_to(path.parent).as_posix().encode()
            digest.update(b"%d %s %d " % (len(name), name, one.stat().st_size) + one.read_bytes())
    except OSError:
        return ""
    return digest.hexdigest()
