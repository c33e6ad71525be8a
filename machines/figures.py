"""Where the figures of a machine file come from: a document, an assumption, or who wrote the file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Literal, TypeVar

from pydantic import Field

from machines.key_problem import KeyProblem
from machines.toml_lines import KeyPath, Values, own_copy
from machines.user_file import UserFile
from machines.user_model import UserModel
from toolpaths.dataclass import dataclass

K = TypeVar("K", bound=str)
ASSUMED, SOURCE = "assumed", "source"
"""keys of tables that hold figures"""
FigureSource = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]*: \S")]
"""the short name of a document, a colon, and the place in it, e.g. "brochure: p. 12" """


class Document(UserModel):
    """One `[sources.NAME]` table: a document that states figures of the machine."""

    document: str
    """maker, title, edition"""
    address: str = ""
    """where it is found"""
    by: Literal["maker", "paper", "others"]
    """who states its figures: the machine's maker, a paper that measured them, or others"""


@dataclass(frozen=True)
class FigureTable:
    """What one table of a machine file says of its figures: path of the table, keys assumed, source by key."""

    path: tuple[str, ...]
    assumed: tuple[str, ...]
    source: Mapping[str, str]

    @property
    def name(self) -> str:
        """As figures of this table are named: "X" of "X.velocity", "timing"."""
        return self.path[-1]


def by_key(source: Mapping[K, str]) -> dict[str, str]:
    """The sources of a table by key, whichever keys it has."""
    return {str(key): text for key, text in source.items()}


def source_problems(documents: Mapping[str, Document], tables: Iterable[FigureTable]) -> Iterator[KeyProblem]:
    """Sources that name no document, figures that are sourced and assumed."""
    for table in tables:
        for key, source in table.source.items():
            name, path = source.partition(":")[0], (*table.path, "source", key)
            if name not in documents:
                known = ", ".join(documents) or "none"
                yield KeyProblem("machine.source", path, f"{key} of {table.name} comes from {name!r}, which [sources] has "
                                 f"not: it has {known}", f"add [sources.{name}] with document and by, or name another")
            if key in table.assumed:
                yield KeyProblem("machine.source", path, f"{key} of {table.name} is assumed and has a source: {source}",
                                 "take it out of `assumed`, or out of `source`")


def origins_of_figures(documents: Mapping[str, Document], tables: Iterable[FigureTable]) -> dict[str, str]:
    """Where each figure comes from, by name ("X.velocity"): "assumed", or document and place."""
    result = dict[str, str]()
    for table in tables:
        result |= {f"{table.name}.{key}": ASSUMED for key in table.assumed}
        for key, source in table.source.items():
            name, _, place = source.partition(": ")
            result[f"{table.name}.{key}"] = f"{documents[name].document}: {place}"
    return result


def as_stated(file: UserFile) -> UserFile:
    """The same file without what its base says of figures that it states itself: they are neither assumed nor the base's
    documents' any more."""
    values = own_copy(file.values)
    for path in _tables(values):
        table, assumed = _table_at(values, path), (*path, ASSUMED)
        if isinstance(keys := table.get(ASSUMED), list):
            table[ASSUMED] = [key for key in keys if not _apart(file, (*path, key), assumed)
                              and not _apart(file, (*path, SOURCE, key), assumed)]
        if isinstance(texts := table.get(SOURCE), dict):
            table[SOURCE] = {key: text for key, text in texts.items()
                             if not _apart(file, (*path, key), (*path, SOURCE, key))}
    return replace(file, values=values)


def _tables(values: Values) -> list[KeyPath]:
    """Paths of the tables that hold figures."""
    paths: list[KeyPath] = [("axes", name) for name in _table_at(values, ("axes",))]
    paths += [("kinematics", "axes", name) for name in _table_at(values, ("kinematics", "axes"))]
    return [path for path in [*paths, ("timing",)] if _table_at(values, path)]


def _apart(file: UserFile, figure: KeyPath, word: KeyPath) -> bool:
    """Whether a figure is written in another file than what is said of it."""
    return figure in file.origins and file.origin(figure).file != file.origin(word).file


def _table_at(values: Values, path: KeyPath) -> Values:
    """The table at a path of keys, {} where there is none."""
    found: object = values
    for key in path:
        found = found.get(key) if isinstance(found, dict) else None
    return found if isinstance(found, dict) else {}
