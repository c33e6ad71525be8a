"""Rows that are kept once: the same values as copies of them, without their memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from toolpaths.arrays import Array, among, as_slice, joined, repeated, shared, taken

ROWS = [np.zeros(5), np.full((4, 3), -0.0), np.full(3, np.nan), np.ones(6, dtype=bool), np.arange(4), np.zeros((0, 3)),
        np.array([0.0, -0.0]), np.array([[1.0, 2.0], [1.0, 3.0], [1.0, 2.0]]), np.array([7])]


def bits(values: Array) -> tuple[str, tuple[int, ...], bytes]:
    return str(values.dtype), values.shape, np.ascontiguousarray(values).tobytes()


def kept_once(values: Array) -> bool:
    return len(values) > 0 and values.strides[0] == 0


@pytest.mark.parametrize("values", ROWS, ids=str)
def test_a_shared_array_holds_the_same_bits(values: Array) -> None:
    assert bits(shared(values)) == bits(values)
    assert kept_once(shared(values)) == (len(values) > 0 and len({row.tobytes() for row in values}) == 1)


def test_a_shared_array_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="read-only"):
        shared(np.zeros(3))[1] = 1.0


@pytest.mark.parametrize("index", [np.array([2, 0, 0]), np.array([True, False, True]), slice(1, 3), np.zeros(0, dtype=int)],
                         ids=str)
@pytest.mark.parametrize("values", [repeated([1.0, 2.0], 3), np.arange(6.0).reshape(3, 2)],
                         ids=["once", "rows"])
def test_rows_taken_of_what_is_kept_once_are_those_of_a_copy(values: Array, index: Array | slice) -> None:
    found = taken(values, index)
    assert bits(found) == bits(np.array(values)[index])
    assert not len(found) or kept_once(found) == kept_once(values)


def test_parts_with_one_row_stay_one_row() -> None:
    alike = [repeated(2.0, 3), repeated(2.0, 0), repeated(2.0, 2)]
    assert kept_once(joined(alike))
    for parts in (alike, [repeated(2.0, 3), repeated(3.0, 2)], [repeated(2.0, 2), np.arange(2.0)],
                  [np.zeros(0)]):
        assert bits(joined(parts)) == bits(np.concatenate(parts))


@pytest.mark.parametrize(("index", "found"), [([3, 4, 5], slice(3, 6)), ([3], slice(3, 4)), ([3, 5, 4, 6], None), ([], None),
                                              ([0, 2], None), ([1, 1, 2, 4], None)])
def test_only_an_index_that_counts_up_is_a_slice(index: list[int], found: slice | None) -> None:
    given = np.array(index, dtype=np.int64)
    assert as_slice(given) == found if found is not None else as_slice(given) is given


@pytest.mark.parametrize("row", [1.5, "text", True, np.zeros(3), np.arange(12.0).reshape(3, 4).T, np.zeros((0, 2))], ids=str)
@pytest.mark.parametrize("count", [0, 1, 4])
def test_a_repeated_row_is_that_of_numpy(row: Array | float | str, count: int) -> None:
    made, want = repeated(row, count), np.broadcast_to(np.array(row), (count, *np.shape(row)))
    assert bits(made) == bits(want) and not made.flags.writeable
    assert count == 0 or not taken(made, np.arange(count)).flags.writeable


@pytest.mark.parametrize("some", [(), (2.0,), (np.nan, -0.0), (1, 2, 9), [ord("G"), 300]])
@pytest.mark.parametrize("values", [*ROWS[:1], np.array([0.0, 1.0, 2.0, np.nan]), np.frombuffer(b"GXG", dtype=np.uint8)],
                         ids=str)
def test_values_among_a_few_are_those_of_numpy(values: Array, some: Sequence[float]) -> None:
    np.testing.assert_array_equal(among(values, some), np.isin(values, some))
