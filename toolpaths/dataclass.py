"""`@dataclass(frozen=True)` as the standard library has it, without its price at start-up.

`dataclasses` writes the text of six methods for every frozen class and compiles each, a third of a millisecond a class in
Python 3.11; a small conversion imports 250 of them, makes values of 160 and compares or prints those of ten. Here what
compares, prints and refuses to be assigned to is no text, and `__init__` is written when the first value is made.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, FrozenInstanceError
from functools import partial
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    def dataclass(cls: type | None = None, /, **asked: bool) -> Any:
        """`dataclasses.dataclass`: the same fields, methods, errors and words of errors.

        What is asked for besides `frozen` and `eq`, and what has such a method of its own, is made by the standard library.
        """
        def made(cls: type) -> type:
            plain = asked.get("frozen", False) and set(asked) <= {"frozen", "eq"} and not set(_METHODS) & set(vars(cls))
            return _frozen(cls, asked.get("eq", True)) if plain else dataclasses.dataclass(**asked)(cls)

        return made if cls is None else made(cls)

COMPILED_FROM = 8
"""values of a class that are made field by field before its `__init__` is compiled"""
_METHODS = ("__init__", "__repr__", "__eq__", "__hash__", "__setattr__", "__delattr__")


class _Factory:
    """Stands in a signature for what is made for each value of the class."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()


class _FirstCalled:
    """`__init__` until it pays to compile it: for the first values of a class, and while nothing is asked of it."""

    def __init__(self, owner: Any) -> None:
        self.owner = owner
        self.calls = 0
        self.fields: tuple[dataclasses.Field[Any], ...] = ()

    def __get__(self, value: object, cls: type) -> Any:
        self.calls += 1
        self.fields = self.fields or dataclasses.fields(self.owner)
        plain = all(field.init and not field.kw_only for field in self.fields)
        return self._compiled().__get__(value, cls) if value is None or not plain or self.calls > COMPILED_FROM else (
            partial(self._by_names, value))

    def _compiled(self) -> Callable[..., None]:
        method = self.owner.__init__ = _initialiser(self.owner)
        return method

    def _by_names(self, value: Any, /, *args: object, **given: object) -> None:
        """What the compiled one does; where a field is missing, unknown or given twice, it is that one that says so."""
        named: dict[str, Any] = {**dict(zip((field.name for field in self.fields), args, strict=False)), **given}
        twice = len(named) < len(args) + len(given)
        for field in self.fields:
            if field.name not in named and field.default is not MISSING:
                named[field.name] = field.default
            elif field.name not in named and field.default_factory is not MISSING:
                named[field.name] = field.default_factory()
        if twice or len(named) != len(self.fields) or any(field.name not in named for field in self.fields):
            self._compiled()(value, *args, **given)
            return
        value.__dict__.update((field.name, named[field.name]) for field in self.fields)
        if hasattr(value, "__post_init__"):
            value.__post_init__()


def _frozen(cls: type, eq: bool) -> Any:
    """The class with fields as the standard library finds them, and with methods that are not compiled.

    Raises:
        TypeError: it derives from a dataclass that is not frozen, or a field without a default follows one that has one.
    """
    cls.__doc__ = cls.__doc__ or cls.__name__
    derived = any(dataclasses.is_dataclass(base) for base in cls.__mro__[1:])
    made: Any = dataclasses.dataclass(cls, init=False, repr=False, eq=False, frozen=derived)
    _in_order(made)
    params = made.__dataclass_params__
    params.init, params.repr, params.eq, params.frozen = True, True, eq, True
    made.__init__ = _FirstCalled(made)
    _put(made, _printing(made), *(_comparing(made) if eq else ()), *(() if derived else _refusing(made)))
    return made


def _in_order(cls: type) -> None:
    """Refuse a field without a default behind one with one; the standard library does so where it writes `__init__`."""
    optional = False
    for f in dataclasses.fields(cls):
        if not f.init or f.kw_only:
            continue
        if f.default is not MISSING or f.default_factory is not MISSING:
            optional = True
        elif optional:
            raise TypeError(f"non-default argument {f.name!r} follows default argument")


def _put(cls: type, *methods: Callable[..., Any]) -> None:
    """The methods under their names, as if they stood in the class."""
    for method in methods:
        method.__qualname__ = f"{cls.__qualname__}.{method.__name__}"
        setattr(cls, method.__name__, method)


def _initialiser(cls: type) -> Callable[..., None]:
    """The compiled `__init__`: sets the fields, then calls `__post_init__` where there is one."""
    fields = dataclasses.fields(cls)
    given = {False: list[str](), True: list[str]()}
    names: dict[str, Any] = {"_factory": _FACTORY}
    put = list[str]()
    own = "__dataclass_self__" if any(f.name == "self" for f in fields) else "self"
    for f in fields:
        made = f.default_factory is not MISSING
        names[f"_default_{f.name}"] = f.default_factory if made else f.default
        default = "=_factory" if made else "" if f.default is MISSING else f"=_default_{f.name}"
        value = f"_default_{f.name}() if {f.name} is _factory else {f.name}" if made and f.init else (
            f"_default_{f.name}()" if made else f.name)
        if f.init:
            given[f.kw_only is True].append(f.name + default)
        if f.init or made:
            put.append(f"{f.name}={value}")
    body = [f" {own}.__dict__.update({', '.join(put)})"] if put else []
    if hasattr(cls, "__post_init__"):
        body.append(f" {own}.__post_init__()")
    head = ", ".join([own, *given[False], *(["*", *given[True]] if given[True] else [])])
    exec(f"def __init__({head}):\n" + ("\n".join(body) or " pass"), names)
    method: Callable[..., None] = names["__init__"]
    method.__annotations__ = {f.name: f.type for f in fields if f.init} | {"return": None}
    method.__qualname__, method.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    return method


def _printing(cls: type) -> Callable[..., Any]:
    names = [field.name for field in dataclasses.fields(cls) if field.repr]

    @recursive_repr()
    def __repr__(self: Any) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__


def _comparing(cls: type) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Equal where class and compared fields are; the hash of these fields."""
    fields = dataclasses.fields(cls)
    compared = _values([f.name for f in fields if f.compare])
    hashed = _values([f.name for f in fields if (f.compare if f.hash is None else f.hash)])

    def __eq__(self: Any, other: object) -> Any:
        return compared(self) == compared(other) if other.__class__ is self.__class__ else NotImplemented

    def __hash__(self: Any) -> int:
        return hash(hashed(self))

    return __eq__, __hash__


def _values(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """A tuple of these fields of a value, as fast as it can be had."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda value: tuple(getattr(value, name) for name in names)


def _refusing(cls: Any) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """No field can be assigned to or deleted, nor can anything else of a value of this very class."""
    names = {field.name for field in dataclasses.fields(cls)}

    def __setattr__(self: Any, name: str, value: object) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return __setattr__, __delattr__
