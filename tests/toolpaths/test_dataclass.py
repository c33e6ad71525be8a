"""`@dataclass(frozen=True)` of the project next to that of the standard library: the same values, texts and refusals."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from typing import Any, ClassVar, cast

import pytest

from toolpaths.dataclass import COMPILED_FROM, dataclass

MAKERS = (dataclasses.dataclass, dataclass)


def classes(make: Callable[..., Any], eq: bool) -> tuple[Any, Any, Any]:
    """The same three classes: of every kind of field, one that derives from it, one without fields."""
    @make(frozen=True, eq=eq)
    class Base:
        """Fields of every kind."""

        first: int
        second: float = 2.0
        many: list[int] = field(default_factory=list)
        unlike: int = field(default=0, compare=False, repr=False)
        named: str = field(default="n", kw_only=True)
        later: int = field(init=False, default=7)
        of_class: ClassVar[int] = 3

        def __post_init__(self) -> None:
            if self.first < 0:
                raise ValueError("below 0")

    @make(frozen=True, eq=eq)
    class Derived(Base):
        """One field more, one with another default."""

        second: float = 5.0
        third: str = "t"

    @make(frozen=True, eq=eq)
    class Empty:
        """Nothing."""

    return Base, Derived, Empty


@dataclass(frozen=True)
class Plain:
    """In a module, as pickle needs it; what is made of it before `__init__` is compiled."""

    a: int
    b: tuple[int, ...] = (1,)
    c: list[int] = field(default_factory=list)


def outcome(call: Callable[[], object]) -> object:
    """What is returned, or class and words of what is raised."""
    try:
        return call()
    except Exception as fault:
        return type(fault).__name__, str(fault)


CALLS: tuple[tuple[tuple[Any, ...], dict[str, Any]], ...] = (
    ((1,), {}), ((1, 3.0, [4], 5), {"named": "x"}), ((), {"first": 2, "many": [1]}), ((-1,), {}), ((), {}),
    ((1, 2, 3, 4, 5, 6, 7), {}), ((1,), {"first": 2}), ((1,), {"unknown": 2}), ((1,), {"later": 2}), ((1,), {"third": "u"}))


@pytest.mark.parametrize("eq", [True, False])
def test_values_texts_and_errors_are_those_of_the_standard_library(eq: bool) -> None:
    for standard, own in zip(*(classes(make, eq) for make in MAKERS), strict=True):
        assert str(inspect.signature(own)) == str(inspect.signature(standard))
        assert [(f.name, f.type, f.init, f.kw_only) for f in dataclasses.fields(own)] == [
            (f.name, f.type, f.init, f.kw_only) for f in dataclasses.fields(standard)]
        assert own.__match_args__ == standard.__match_args__ and own.__dataclass_params__.frozen
        for given, named in CALLS:
            one, other = (outcome(lambda c=c, g=given, n=named: repr(c(*g, **n))) for c in (standard, own))
            assert one == other
    base, derived, _ = classes(dataclass, eq)
    a, b = base(1, many=[2]), base(1, many=[2], unlike=9)
    assert (a == b) is eq and a != derived(1, many=[2]) and a != 1
    assert outcome(lambda: hash(a)) == (("TypeError", "unhashable type: 'list'") if eq else object.__hash__(a))
    assert dataclasses.replace(a, second=4.0).second == 4.0 and dataclasses.asdict(derived(1))["third"] == "t"


def test_no_field_is_assigned_to_or_deleted() -> None:
    for make in MAKERS:
        base, derived, empty = classes(make, True)
        for value in (base(1), derived(1), empty()):
            for name in ("first", "other"):
                with pytest.raises(FrozenInstanceError, match=f"cannot assign to field '{name}'"):
                    setattr(value, name, 1)
                with pytest.raises(FrozenInstanceError, match=f"cannot delete field '{name}'"):
                    delattr(value, name)
        inheriting = type("Inheriting", (base,), {})(1)
        inheriting.other = 2  # the standard library lets a class that is none itself have more
        assert inheriting.other == 2
        with pytest.raises(FrozenInstanceError):
            inheriting.first = 2


def test_the_first_values_are_made_as_the_later_ones_are() -> None:
    made = [Plain(k, c=[k]) for k in range(COMPILED_FROM + 3)]
    assert all(inspect.isfunction(vars(Plain)["__init__"]) for _ in made)
    assert [(m.a, m.b, m.c) for m in made] == [(k, (1,), [k]) for k in range(len(made))]
    assert Plain(1).c is not Plain(1).c and list(vars(made[0])) == list(vars(made[-1])) == ["a", "b", "c"]
    assert pickle.loads(pickle.dumps(made)) == made and len({Plain(1, (2,)) == Plain(1, (2,)), True}) == 1


def test_fields_have_any_name() -> None:
    """Also those of the arguments of what makes the values, before `__init__` is compiled and behind."""
    for name in ("value", "self", "owner", "args", "given", "cls", "fields"):
        for make in MAKERS:
            cls = make(frozen=True)(type("Named", (), {"__annotations__": {name: int, "second": int}}))
            for k in range(COMPILED_FROM + 2):
                first = dataclasses.replace(cls(**{name: k, "second": 2}), second=3)
                assert (getattr(first, name), first.second) == (k, 3)


@pytest.mark.parametrize("call", [
    lambda c: c(1, a=2), lambda c: c(1, 2, b=3), lambda c: c(1, 2, 3, 4), lambda c: c(b=2), lambda c: c(1, d=2),
    lambda c: c()])
def test_the_first_value_is_refused_where_the_standard_library_refuses_it(call: Callable[[Any], object]) -> None:
    standard, own = (make(frozen=True)(type("Few", (), {"__annotations__": {"a": int, "b": int, "c": int}, "b": 2, "c": 3}))
                     for make in MAKERS)
    kind, words = cast("tuple[str, str]", outcome(lambda: call(standard)))
    assert kind == "TypeError" and outcome(lambda: call(own)) == (kind, words)


def test_a_class_with_methods_of_its_own_keeps_them() -> None:
    @dataclass(frozen=True)
    class Own:
        a: int

        def __repr__(self) -> str:
            return "own"

        def __eq__(self, other: object) -> bool:
            return True

        def __hash__(self) -> int:
            return 5

    assert (repr(Own(1)), Own(1) == Own(2), hash(Own(1))) == ("own", True, 5)


def test_a_frozen_class_derives_from_no_other() -> None:
    @dataclasses.dataclass
    class Loose:
        a: int

    with pytest.raises(TypeError, match="cannot inherit frozen"):
        dataclass(frozen=True)(type("Frozen", (Loose,), {"__annotations__": {"b": "int"}}))


@pytest.mark.parametrize("default", [3, field(default=3), field(default_factory=int)])
def test_a_field_without_a_default_behind_one_with_one_is_refused(default: object) -> None:
    fields = {"__annotations__": {"a": int, "b": int}, "a": default}
    refusals = [outcome(lambda make=make: make(frozen=True)(type("Behind", (), dict(fields)))) for make in MAKERS]
    assert refusals == [("TypeError", "non-default argument 'b' follows default argument")] * 2
