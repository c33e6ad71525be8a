"""Read-only arrays of checked shapes in every frozen value: `@arrays` below `@dataclass`.

    @dataclass(frozen=True)
    @arrays(tip="N 3", axis="N 3", line="N", ends="N+1")
    class Targets:
        tip: Floats
        axis: Floats
        line: Ints
        ends: Floats

Letters are lengths that the fields share, numbers are lengths, `N+1` counts from a letter that another field gives,
`#names` is `len(self.names)`, `_` any length and `...` any shape. Fields that are None are passed over; a tuple of arrays is
`*` and the shape of each.
The check is compiled once for each class, when its first value is made.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any, TypeVar

import numpy as np

Owner = TypeVar("Owner", bound=type)
TABLE = "__arrays__"
_LETTER = re.compile(r"[A-Za-z]\w*")


def arrays(**shapes: str) -> Callable[[Owner], Owner]:
    """Make the named fields read-only and check their shapes against each other whenever a value of the class is made.

    A writable array is not copied: the field becomes a read-only view of it. What is no array becomes one.
    A `__post_init__` of the class runs before.

    Raises (when a value is made):
        ValueError: naming class, field, the shape found and the one expected.
    """

    def marked(cls: Owner) -> Owner:
        own: Callable[[Any], None] | None = getattr(cls, "__post_init__", None)
        table = {**getattr(cls, TABLE, {}), **shapes}
        check: list[Callable[[Any], None]] = []

        def __post_init__(self: Any) -> None:
            if own is not None:
                own(self)
            if not check:
                check.append(_compiled(_in_order(table, _optional(type(self)))))
            check[0](self)

        setattr(cls, TABLE, table)
        cls.__post_init__ = __post_init__  # type: ignore[attr-defined]
        return cls

    return marked


def _optional(cls: type) -> set[str]:
    """Fields that may be None."""
    kinds = [item for base in cls.__mro__ for item in vars(base).get("__annotations__", {}).items()]
    return {name for name, kind in kinds if "None" in str(kind)}


def _compiled(table: Sequence[tuple[str, str, bool]]) -> Callable[[Any], None]:
    """One function of all checks of a class: as many comparisons of tuples as it has arrays."""
    lines, known = ["def check(self):"], set[str]()
    for name, shape, optional in table:
        put = f"put(self, {name!r}, a)"
        lines += [f" a = self.{name}", " if a is not None:"]
        if shape.startswith("*"):
            lines += [f"  {put.replace(', a)', ', each(self, a, ' + repr(name) + ', ' + repr(shape[1:].strip()) + '))')}"]
            continue
        lines += ["  if a.__class__ is not ndarray:", "   a = asarray(a)", f"   {put}"]
        lines += _comparison(shape, set(known) if optional else known)
        lines += ["  if a.flags.writeable:", "   a = a.view()", "   a.flags.writeable = False", f"   {put}"]

    def fail(self: Any) -> None:
        raise ValueError(_fault(self, table))

    def each(self: Any, values: Any, name: str, shape: str) -> tuple[Any, ...]:
        wanted = [(i, np.asarray(value), _wanted(self, shape, {})) for i, value in enumerate(values)]
        for i, value, expected in wanted:
            if expected is not None and not _fits(value.shape, expected):
                raise ValueError(f"{_noted(self, f'{name}[{i}]', value.shape, expected)}")
        return tuple(_read_only(value) for _, value, _ in wanted)

    names: dict[str, Any] = {"ndarray": np.ndarray, "asarray": np.asarray, "put": object.__setattr__, "fail": fail,
                             "each": each}
    exec("\n".join(lines), names)
    made: Callable[[Any], None] = names["check"]
    return made


def _in_order(table: Mapping[str, str], optional: Set[str]) -> list[tuple[str, str, bool]]:
    """Name, shape, whether it may be None: fields that give letters, those that count from them, those that may be None.

    Raises:
        TypeError: where nothing gives a letter that is counted from.
    """
    given = {part for name, shape in table.items() if not shape.startswith("*") and name not in optional
             for part in shape.split() if _LETTER.fullmatch(part)}
    counted = {letter: shape for shape in table.values() for part in shape.replace("*", "").split()
               if not _LETTER.fullmatch(part) and part != "..." for letter in _LETTER.findall(re.sub(r"#\w+", "", part))}
    if missing := set(counted) - given - {"_"}:
        raise TypeError(f"no field gives the length {', '.join(sorted(missing))}: {dict(table)}")

    def place(name: str) -> tuple[bool, bool]:
        return name in optional, any(not _LETTER.fullmatch(part) and not part.isdigit() and part != "_"
                                     for part in table[name].split())

    return [(name, table[name], name in optional) for name in sorted(table, key=place)]


def _comparison(shape: str, known: set[str]) -> list[str]:
    """Lines that bind the letters of a shape that are not `known`, and compare the rest."""
    if shape == "...":
        return []
    parts = [_expression(part) for part in shape.split()]
    fresh = [part for part in shape.split() if _LETTER.fullmatch(part) and part not in known]
    if not fresh and "_" not in parts:
        return [f"  if a.shape != ({''.join(f'{part}, ' for part in parts)}):", "   fail(self)"]
    lines, bound = [f"  if a.ndim != {len(parts)}:", "   fail(self)"], set[str]()
    for k, part in enumerate(parts):
        if part in fresh and part not in bound:
            lines.append(f"  {part} = a.shape[{k}]")
            bound.add(part)
    tests = [f"a.shape[{k}] != {part}" for k, part in enumerate(parts) if part != "_" and (
        part not in fresh or part in parts[:k])]
    known |= bound
    return lines + ([f"  if {' or '.join(tests)}:", "   fail(self)"] if tests else [])


def _expression(part: str) -> str:
    return re.sub(r"#(\w+)", r"len(self.\1)", part)


def _wanted(self: Any, shape: str, lengths: Mapping[str, int]) -> tuple[int | str, ...] | None:
    """The lengths of a shape as far as they are known; None for any shape."""
    if shape == "...":
        return None

    def length(part: str) -> int | str:
        if part == "_" or set(_LETTER.findall(re.sub(r"#\w+", "", part))) - set(lengths):
            return part
        return int(eval(_expression(part), {"self": self, **lengths}))

    return tuple(length(part) for part in shape.split())


def _fits(found: tuple[int, ...], expected: tuple[int | str, ...]) -> bool:
    return len(found) == len(expected) and all(
        isinstance(want, str) or got == want for got, want in zip(found, expected, strict=True))


def _fault(self: Any, table: Sequence[tuple[str, str, bool]]) -> str:
    """The first field that does not fit, in the order of the check."""
    lengths: dict[str, int] = {}
    for name, shape, _ in table:
        value = getattr(self, name)
        if value is None or shape.startswith("*"):
            continue
        found = np.shape(value)
        expected = _wanted(self, shape, lengths)
        if expected is not None:
            if not _fits(found, expected):
                return _noted(self, name, found, expected)
            for part, got in zip(shape.split(), found, strict=True):
                if _LETTER.fullmatch(part) and lengths.setdefault(part, got) != got:
                    return _noted(self, name, found, _wanted(self, shape, lengths) or ())
    return f"{type(self).__name__}: shapes do not fit"


def _noted(self: Any, name: str, found: tuple[int, ...], expected: tuple[int | str, ...]) -> str:
    return f"{type(self).__name__}.{name} has shape {_words(found)}, expected {_words(expected)}"


def _words(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join('any' if part == '_' else str(part) for part in shape)}{',' if len(shape) == 1 else ''})"


def _read_only(values: Any) -> Any:
    view = values.view()
    view.flags.writeable = False
    return view
