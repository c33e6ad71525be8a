"""Values that hold arrays: read-only, shapes checked against each other, types too; so is every frozen dataclass."""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from toolpaths import shapes
from toolpaths.arrays import Array, Bools, Floats, Ints, repeated
from toolpaths.shapes import TABLE, arrays, declared, rows_of

WITNESS = "postproc.witness."
"""shares no code with the rest"""
IN_WORK = {"toolpaths.cl.assemble.PointRows", "toolpaths.cl.text.scan._Chunk", "toolpaths.cl.text.scan._Lines",
           "postproc.joints.plan._Stage", "postproc.readback.execution.rows.SectionState",
           "postproc.readback.text.cycles.Sticky", "postproc.verification.length_ends.Ends"}
"""dataclasses that are not frozen: what one function works on; no stage gets them from another"""
ARRAY = re.compile(r"\b(Floats|Ints|Bools|Array|NDArray)\b")
NO_ARRAY = re.compile(r"\b(Callable|list|dict|Mapping|Sequence|tuple\[tuple)\[")
"""functions of arrays, and collections that are not values"""


@cache
def dataclasses_of_the_project() -> dict[str, type]:
    found = dict[str, type]()
    for top in ("toolpaths", "machines", "postproc"):
        package = importlib.import_module(top)
        for info in pkgutil.walk_packages(package.__path__, f"{top}."):
            if not info.name.endswith("__main__"):
                for value in vars(importlib.import_module(info.name)).values():
                    if isinstance(value, type) and dataclasses.is_dataclass(value) and value.__module__ == info.name:
                        found[f"{info.name}.{value.__qualname__}"] = value
    return found


def array_fields(cls: type) -> set[str]:
    """Fields that hold an array, several of them, or none at times."""
    return {field.name for field in dataclasses.fields(cls) if ARRAY.search(str(field.type))
            and not NO_ARRAY.search(str(field.type))}


def unchecked(cls: type) -> set[str]:
    return array_fields(cls) - set(getattr(cls, TABLE, ()))


def test_every_value_with_arrays_is_checked() -> None:
    every = {name: cls for name, cls in dataclasses_of_the_project().items() if not name.startswith(WITNESS)}
    with_arrays = {name for name, cls in every.items() if array_fields(cls)}
    assert len(with_arrays) > 170
    assert {name: unchecked(every[name]) for name in with_arrays - IN_WORK if unchecked(every[name])} == {}
    frozen = {name for name in with_arrays if every[name].__dataclass_params__.frozen}
    assert with_arrays - frozen == IN_WORK
    assert {name: set(getattr(cls, TABLE, ())) - {field.name for field in dataclasses.fields(cls)}
            for name, cls in every.items() if hasattr(cls, TABLE)} == {name: set() for name in every
                                                                     if hasattr(every[name], TABLE)}


def test_every_checked_array_states_its_type() -> None:
    """By its annotation (`Floats`, `Ints`, `Bools`), an `Array` in the table."""
    assert {f"{name}.{field}" for name, cls in dataclasses_of_the_project().items() if hasattr(cls, TABLE)
            for field, (_, kind) in declared(cls).items() if not kind} == set()


def test_a_value_without_the_check_is_noticed() -> None:
    @dataclass(frozen=True)
    class Bare:
        tip: Floats
        parts: tuple[Floats, ...]
        count: int

    assert unchecked(Bare) == {"tip", "parts"}


@dataclass(frozen=True)
@arrays(tip="N 3", line="N", ends="N+1", more="M", pairs="M 2", home="#letters", parts="* P 3", free="...", loose="N _",
        kind="int8: K", grid="##parts 2", some="K")
class Value:
    tip: Floats
    line: Ints
    ends: Floats
    letters: str = "XY"
    home: Any = (0.0, 0.0)
    more: Floats | None = None
    pairs: Floats | None = None
    parts: tuple[Floats, ...] = ()
    free: Any = 0.0
    loose: Floats | None = None
    kind: Array = field(default_factory=lambda: np.array([7]))
    grid: Floats | None = None
    some: Bools | None = None


def value(**changed: Any) -> Value:
    return Value(**{"tip": np.zeros((4, 3)), "line": np.arange(4), "ends": np.zeros(5), **changed})


def test_arrays_become_read_only_and_are_not_copied() -> None:
    tip, parts = np.zeros((4, 3)), (np.zeros((2, 3)),)
    made = value(tip=tip, parts=parts, more=np.zeros(6), pairs=np.zeros((6, 2)))
    assert np.shares_memory(made.tip, tip) and tip.flags.writeable and made.home.tolist() == [0.0, 0.0]
    for held in (made.tip, made.line, made.ends, made.home, made.more, made.pairs, made.parts[0], made.free):
        assert not held.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        made.tip[0] = 1.0


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"line": np.zeros(3, int)}, "Value.line has shape (3,), expected (4,)"),
    ({"tip": np.zeros((4, 2))}, "Value.tip has shape (4, 2), expected (N, 3)"),
    ({"tip": np.zeros(3)}, "Value.tip has shape (3,), expected (N, 3)"),
    ({"ends": np.zeros(4)}, "Value.ends has shape (4,), expected (5,)"),
    ({"home": np.zeros(3)}, "Value.home has shape (3,), expected (2,)"),
    ({"home": 5.0}, "Value.home has shape (), expected (2,)"),
    ({"loose": np.zeros((3, 7))}, "Value.loose has shape (3, 7), expected (4, any)"),
    ({"pairs": np.zeros((6, 3))}, "Value.pairs has shape (6, 3), expected (M, 2)"),
    ({"parts": (np.zeros((2, 3)), np.zeros((2, 2)))}, "Value.parts[1] has shape (2, 2), expected (2, 3)"),
    ({"parts": (np.zeros((2, 3)), np.zeros((4, 3)))}, "Value.parts[1] has shape (4, 3), expected (2, 3)"),
    ({"more": np.zeros(6), "pairs": np.zeros((5, 2))}, "Value.pairs has shape (5, 2), expected (6, 2)"),
    ({"loose": np.zeros(4)}, "Value.loose has shape (4,), expected (4, any)"),
    ({"some": np.zeros(2, bool)}, "Value.some has shape (2,), expected (1,)"),
    ({"parts": (np.zeros((5, 3)),) * 2, "grid": np.zeros((5, 4, 2))}, "Value.grid has shape (5, 4, 2), expected (5, 5, 2)"),
    ({"line": np.zeros(4)}, "Value.line holds float64, expected int64"),
    ({"line": [1.5, 2, 3, 4]}, "Value.line holds float64, expected int64"),
    ({"tip": [["a", "b", "c"]] * 4}, "Value.tip holds <U1, expected float64"),
    ({"some": np.array([1])}, "Value.some holds int64, expected bool"),
    ({"kind": np.array([1, 300])}, "Value.kind holds 300, out of the range of int8"),
    ({"parts": (np.full((2, 3), "x"),)}, "Value.parts holds <U1, expected float64"),
]


@pytest.mark.parametrize(("changed", "said"), WRONG)
def test_a_shape_or_type_that_does_not_fit_names_class_and_field(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError) as fault:
        replace(value(), **changed)
    assert str(fault.value) == said


def both_checks() -> tuple[Callable[[Value], None], Callable[[Value], None]]:
    """Part by part and compiled."""
    fields = shapes._in_order(getattr(Value, TABLE), Value)
    return partial(shapes._by_parts, fields), shapes._compiled(fields)


def unchecked_value(**changed: Any) -> Value:
    made = object.__new__(Value)
    made.__dict__.update({**vars(value()), **changed})
    return made


@pytest.mark.parametrize(("changed", "said"), WRONG)
def test_first_values_are_checked_as_all_others_are(changed: dict[str, Any], said: str) -> None:
    for check in both_checks():
        with pytest.raises(ValueError) as fault:
            check(unchecked_value(**changed))
        assert str(fault.value) == said


@pytest.mark.parametrize("changed", [{}, {"more": [1, 2], "pairs": np.ones((2, 2)), "some": [True]},
                                     {"tip": [[1, 2, 3]] * 4},
                                     {"parts": (np.zeros((2, 3)),) * 2, "grid": np.zeros((2, 2, 2))}])
def test_both_checks_leave_the_same_value(changed: dict[str, Any]) -> None:
    found = [unchecked_value(**changed) for _ in both_checks()]
    for check, one in zip(both_checks(), found, strict=True):
        check(one)
    for name, here in vars(found[0]).items():
        there = getattr(found[1], name)
        for a, b in zip(*(v if isinstance(v, tuple) else (v,) for v in (here, there)), strict=True):
            assert type(a) is type(b) and np.array_equal(a, b)
            assert not isinstance(a, np.ndarray) or (a.dtype == b.dtype and not a.flags.writeable and not b.flags.writeable)


def test_numbers_that_lose_nothing_become_the_type_of_the_field() -> None:
    made = value(tip=[[1, 2, 3]] * 4, line=np.arange(4, dtype=np.int32), kind=np.array([1, -3]), more=[], some=[True, False],
                 parts=(np.ones((2, 3), np.float32),))
    kinds = (made.tip.dtype, made.line.dtype, made.kind.dtype, made.parts[0].dtype)
    assert kinds == (np.float64, np.int64, np.int8, np.float64) and made.more is not None and made.more.dtype == np.float64
    same = np.broadcast_to(np.array([7]), (9,))
    kept = value(kind=same).kind
    assert kept.strides == (0,) and kept.dtype == np.int8 and kept.tolist() == [7] * 9


def test_a_letter_that_no_field_gives_is_a_mistake_of_the_table() -> None:
    @dataclass(frozen=True)
    @arrays(ends="N+1")
    class Wrong:
        ends: Floats

    with pytest.raises(TypeError, match="no field gives the length N"):
        Wrong(np.zeros(3))


def test_counting_from_a_field_that_may_be_missing_is_a_mistake_of_the_table() -> None:
    @dataclass(frozen=True)
    @arrays(tip="N", ends="N+1")
    class Wrong:
        ends: Floats
        tip: Floats | None = None

    with pytest.raises(TypeError, match="no field gives the length N"):
        Wrong(np.zeros(3))


def test_what_a_class_does_when_made_comes_first_and_heirs_check_their_own() -> None:
    @dataclass(frozen=True)
    @arrays(tip="N 3")
    class Base:
        tip: Any

        def __post_init__(self) -> None:
            object.__setattr__(self, "tip", np.reshape(self.tip, (-1, 3)))

    @dataclass(frozen=True)
    @arrays(line="N")
    class Heir(Base):
        line: Floats

    assert Base(range(6)).tip.shape == (2, 3)
    assert Heir(np.zeros((2, 3)), np.zeros(2)).line.shape == (2,)
    with pytest.raises(ValueError, match=r"Heir\.line has shape \(3,\), expected \(2,\)"):
        Heir(np.zeros((2, 3)), np.zeros(3))


def test_rows_are_taken_of_the_fields_that_have_them() -> None:
    @dataclass(frozen=True)
    @arrays(tip="N 3", kind="int8: N", ends="N+1", other="M", extra="N")
    class Values:
        tip: Floats
        kind: Array
        ends: Floats
        other: Floats
        extra: Floats | None = None
        name: str = ""

    values = Values(np.arange(12.0).reshape(4, 3), np.arange(4), np.arange(5.0), np.arange(7.0), name="a")
    with pytest.raises(ValueError, match=r"ends has shape \(5,\), expected \(3,\)"):
        rows_of(values, "N", np.array([True, False, False, True]))
    made = rows_of(rows_of(values, "M", slice(2, 4)), "N", np.array([3, 0, 0, 1]))
    assert made.tip[:, 0].tolist() == [9.0, 0.0, 0.0, 3.0]
    assert made.kind.tolist() == [3, 0, 0, 1] and made.kind.dtype == np.int8
    assert made.other.tolist() == [2.0, 3.0] and made.ends is not None and made.extra is None and made.name == "a"
    once = replace(made, kind=repeated(np.int8(2), 4), extra=np.arange(4.0))
    taken = rows_of(once, "N", np.array([2, 1, 1, 0]))
    assert taken.kind.strides == (0,) and taken.extra is not None and taken.extra.tolist() == [2.0, 1.0, 1.0, 0.0]
