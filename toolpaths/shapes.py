"""Read-only arrays of checked shapes and types in every frozen value: `@arrays` below `@dataclass`.

    @dataclass(frozen=True)
    @arrays(tip="N 3", axis="N 3", line="N", ends="N+1", kind="int8: N")
    class Targets:
        tip: Floats
        axis: Floats
        line: Ints
        ends: Floats
        kind: Array

Letters are lengths that the fields share, numbers are lengths, `N+1` counts from a letter that another field
always gives, `#names` is `len(self.names)`, `##nodes` the length of each item of `nodes`, `_` any length and
`...` any shape. Fields that are None are passed over; a tuple of arrays is `*` and the shape of each. Where
some are None, the others still share their letters, and so do the arrays of a tuple.
The type is that of the annotation (`Floats`, `Ints`, `Bools`), or stands before a colon.
The check is compiled once for each class, when more than `COMPILED_FROM` of its values have been made: of most
classes a small program makes fewer, and compiling takes as long as fifty checks part by part.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from types import CodeType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from toolpaths.arrays import Array, Bools, Ints, taken
from toolpaths.dataclass import dataclass

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Owner = TypeVar("Owner", bound=type)
Table = TypeVar("Table", bound="DataclassInstance")
TABLE = "__arrays__"
COMPILED_FROM = 12
"""values of a class that are checked part by part before the check is compiled"""
_LETTER = re.compile(r"[A-Za-z]\w*")
_ANNOTATED = re.compile(r"\b(?:(Floats|Ints|Bools)|NDArray\[np\.(\w+)\])")
_HELD = re.compile(r"(#+)([\w.]+)")
_NAMED = {"Floats": "float64", "Ints": "int64", "Bools": "bool"}


@dataclass(frozen=True)
class _Field:
    """What one field holds: parts of its shape (None: any), type ("": any), whether it may be None, is a tuple of arrays."""

    name: str
    parts: tuple[str, ...] | None
    kind: str
    optional: bool
    several: bool

    @property
    def letters(self) -> set[str]:
        return {part for part in self.parts or () if _LETTER.fullmatch(part)}

    @property
    def counted(self) -> set[str]:
        """Letters that this field counts from."""
        return {letter for part in self.parts or () if not _LETTER.fullmatch(part) and part != "_"
                for letter in _LETTER.findall(_HELD.sub("", part))}


def arrays(**shapes: str) -> Callable[[Owner], Owner]:
    """Make the named fields read-only and check their shapes against each other, and their types, whenever a value is made.

    A writable array is not copied: the field becomes a read-only view of it. What is no array becomes one; numbers of a
    type that loses nothing become those of the field's type. A `__post_init__` of the class runs before.

    Raises (when a value is made):
        ValueError: naming class, field, the shape or type found and the one expected.
    """

    def marked(cls: Owner) -> Owner:
        own: Callable[[Any], None] | None = getattr(cls, "__post_init__", None)
        table = {**getattr(cls, TABLE, {}), **shapes}
        check: Callable[[Any], None] | None = None
        fields: list[_Field] = []
        made = 0

        def __post_init__(self: Any) -> None:
            nonlocal check, fields, made
            if own is not None:
                own(self)
            if check is not None:
                check(self)
                return
            fields, made = fields or _in_order(table, type(self)), made + 1
            if made > COMPILED_FROM:
                check = _compiled(fields)
            (check or partial(_by_parts, fields))(self)

        setattr(cls, TABLE, table)
        cls.__post_init__ = __post_init__  # type: ignore[attr-defined]  # any class may be given one
        return cls

    return marked


def rows_of(table: Table, letter: str, index: Ints | Bools | slice) -> Table:
    """The same value with some of its rows: of every field whose first length is `letter`; None stays.

    Rows that are kept once for all (`toolpaths.arrays.shared`) are kept once again.
    """
    shapes = {name: shape.rpartition(": ")[2].split() for name, shape in getattr(type(table), TABLE).items()}
    columns = {name: getattr(table, name) for name, shape in shapes.items() if shape[:1] == [letter]}
    return replace(table, **{name: taken(values, index) for name, values in columns.items() if values is not None})


def declared(cls: type) -> dict[str, tuple[str, str]]:
    """Shape and type ("" where none is stated) of each field that `@arrays` names."""
    return {f.name: (" ".join(f.parts or ("...",)), f.kind) for f in _in_order(getattr(cls, TABLE), cls)}


def _in_order(table: Mapping[str, str], cls: type) -> list[_Field]:
    """Fields that always give letters, those that count from them, tuples and those that may be None.

    Raises:
        TypeError: where nothing always gives a letter that is counted from.
    """
    kinds = {name: str(kind) for base in reversed(cls.__mro__)
             for name, kind in vars(base).get("__annotations__", {}).items()}
    fields = [_field(name, text, kinds.get(name, "")) for name, text in table.items()]
    given = {letter for f in fields if not (f.optional or f.several) for letter in f.letters}
    if missing := {letter for f in fields for letter in f.counted} - given:
        raise TypeError(f"no field gives the length {', '.join(sorted(missing))}: {dict(table)}")
    return sorted(fields, key=lambda f: (f.optional or f.several, bool(f.counted)))


def _field(name: str, text: str, annotation: str) -> _Field:
    kind, _, shape = text.rpartition(": ")
    found = _ANNOTATED.search(annotation)
    if not kind and found is not None:
        kind = _NAMED.get(found[1] or "", found[2] or "").rstrip("_")
    parts = tuple(shape.removeprefix("*").split())
    return _Field(name, None if parts == ("...",) else parts, kind, "None" in annotation, shape.startswith("*"))


def _by_parts(fields: list[_Field], self: Any) -> None:
    """The check of a class as it stands, for the first values: what `_compiled` does."""
    held, lengths = self.__dict__, dict[str, int]()
    for f in fields:
        value, kind = held[f.name], np.dtype(f.kind) if f.kind else None
        if value is None and (f.optional or f.several):
            continue
        made = []
        for one in value if f.several else (value,):
            a = _as_type(one, kind, self, f.name)
            if f.parts is not None and not _fits(a.shape, f.parts, lengths, self):
                _fail(self, fields)
            if a.flags.writeable:
                a = a.view()
                a.setflags(write=False)
            made.append(a)
        held[f.name] = tuple(made) if f.several else made[0]


def _fits(shape: tuple[int, ...], parts: tuple[str, ...], lengths: dict[str, int], self: Any) -> bool:
    """Whether a shape is what its parts say; letters that are not known yet get their `lengths`."""
    if any("##" in part for part in parts):
        return shape == _wanted(self, parts, lengths)
    if len(shape) != len(parts):
        return False
    for part, length in zip(parts, shape, strict=True):
        if part == "_":
            continue
        wanted = lengths.setdefault(part, length) if part.isidentifier() else _number(part, self, lengths)
        if length != wanted:
            return False
    return True


def _number(part: str, self: Any, lengths: Mapping[str, int]) -> int:
    """The length that a part counts."""
    return int(eval(_code_of(part), {"self": self, **lengths}))


@cache
def _code_of(part: str) -> CodeType:
    return compile(_expression(part), part, "eval")


def _compiled(fields: list[_Field]) -> Callable[[Any], None]:
    """One function of all checks of a class: as many comparisons of types and of tuples as it has arrays."""
    always = {letter for f in fields if not (f.optional or f.several) for letter in f.letters}
    sometimes = sorted({letter for f in fields for letter in f.letters} - always)
    lines, known = ["def check(self):", " held = self.__dict__", *(f" {letter} = None" for letter in sometimes)], set[str]()
    names: dict[str, Any] = {"ndarray": np.ndarray, "as_type": _as_type, "fail": _fail, "fields": fields}
    seen: dict[tuple[str, ...], str] = {}
    for k, f in enumerate(fields):
        names[f"kind{k}"] = np.dtype(f.kind) if f.kind else None
        put = [] if f.several else [f" held[{f.name!r}] = a"]
        like = seen.get(f.parts or ())
        compared = [f"if a.shape != {like}:", " fail(self, fields)"]
        compared = _comparison(f.parts, known, sometimes) if like is None else compared
        if like is None and f.parts and "_" not in f.parts and not (f.optional or f.several):
            seen[f.parts] = f"shape{k}"
            compared.append(f"shape{k} = a.shape")
        body = [f"if a.__class__ is not ndarray{f' or a.dtype is not kind{k}' if f.kind else ''}:",
                f" a = as_type(a, kind{k}, self, {f.name!r})", *put, *compared,
                "if a.flags.writeable:", " a = a.view()", " a.setflags(False)", *put]
        if f.several:
            lines += [f" if held[{f.name!r}] is not None:", "  made = []", f"  for a in held[{f.name!r}]:",
                      *(f"   {line}" for line in body), "   made.append(a)", f"  held[{f.name!r}] = tuple(made)"]
        else:
            lines.append(f" a = held[{f.name!r}]")
            lines += [" if a is not None:", *(f"  {line}" for line in body)] if f.optional else [f" {line}" for line in body]
    exec("\n".join(lines), names)
    made: Callable[[Any], None] = names["check"]
    return made


def _comparison(parts: tuple[str, ...] | None, known: set[str], sometimes: list[str]) -> list[str]:
    """Lines that bind letters of a shape and compare the rest; `known` are bound, `sometimes` may be by one before."""
    if parts is None:
        return []
    if any("##" in part for part in parts) or all(part != "_" and part not in sometimes and (
            part in known or not _LETTER.fullmatch(part)) for part in parts):
        return [f"if a.shape != ({''.join(f'{_expression(part)}, ' for part in parts)}):", " fail(self, fields)"]
    lines, tests = [f"if a.ndim != {len(parts)}:", " fail(self, fields)"], list[str]()
    for k, part in enumerate(parts):
        if part in sometimes:
            lines += [f"if {part} is None:", f" {part} = a.shape[{k}]"]
        elif _LETTER.fullmatch(part) and part not in known:
            lines.append(f"{part} = a.shape[{k}]")
            known.add(part)
            continue
        if part != "_":
            tests.append(f"a.shape[{k}] != {_expression(part)}")
    return [*lines, f"if {' or '.join(tests)}:", " fail(self, fields)"] if tests else lines


def _expression(part: str) -> str:
    return _HELD.sub(lambda found: f"*map(len, self.{found[2]})" if found[1] == "##" else f"len(self.{found[2]})", part)


def _as_type(values: Any, kind: np.dtype[Any] | None, self: Any, name: str) -> Array:
    """An array of that type.

    Raises:
        ValueError: where numbers would be lost: texts or fractions for counts, counts out of the range of a narrow type.
    """
    a = np.asarray(values)
    if kind is None or a.dtype == kind:
        return a
    if a.size and not np.can_cast(a.dtype, kind, "same_kind"):
        raise ValueError(f"{type(self).__name__}.{name} holds {a.dtype}, expected {kind}")
    rows = a[:1] if a.ndim and len(a) and a.strides[0] == 0 else a
    made = rows.astype(kind)
    if kind.kind in "iu" and kind.itemsize < a.dtype.itemsize and (made != rows).any():
        raise ValueError(f"{type(self).__name__}.{name} holds {rows[made != rows][0]}, out of the range of {kind}")
    return made if rows is a else np.broadcast_to(made[0], a.shape)


def _fail(self: Any, fields: list[_Field]) -> None:
    """Name the first field that does not fit, in the order of the check.

    Raises:
        ValueError: always.
    """
    lengths: dict[str, int] = {}
    for f in fields:
        for name, value in _each(self, f):
            expected = _wanted(self, f.parts, lengths)
            if f.parts is None or expected is None:
                continue
            found = np.shape(value)
            fits = len(found) == len(expected) and all(isinstance(want, str) or got == want
                                                       for got, want in zip(found, expected, strict=True))
            for part, got in zip(f.parts, found, strict=False) if fits and "##" not in "".join(f.parts) else ():
                fits = fits and (not _LETTER.fullmatch(part) or lengths.setdefault(part, got) == got)
            if not fits:
                raise ValueError(f"{type(self).__name__}.{name} has shape {_words(found)}, expected "
                                 f"{_words(_wanted(self, f.parts, lengths) if len(found) == len(expected) else expected)}")
    raise ValueError(f"{type(self).__name__}: shapes do not fit")


def _each(self: Any, f: _Field) -> Iterator[tuple[str, Any]]:
    """Name and array of a field, or of each item of a tuple."""
    value = getattr(self, f.name)
    if value is not None:
        yield from ((f"{f.name}[{i}]", one) for i, one in enumerate(value)) if f.several else [(f.name, value)]


def _wanted(self: Any, parts: tuple[str, ...] | None, lengths: Mapping[str, int]) -> tuple[int | str, ...]:
    """The lengths of a shape as far as they are known."""
    found: list[int | str] = []
    for part in parts or ():
        if "##" in part:
            found += [len(one) for one in getattr(self, part.strip("#"))]
        elif part == "_" or set(_LETTER.findall(_HELD.sub("", part))) - set(lengths):
            found.append(part)
        else:
            found.append(_number(part, self, lengths))
    return tuple(found)


def _words(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join('any' if part == '_' else str(part) for part in shape)}{',' if len(shape) == 1 else ''})"
