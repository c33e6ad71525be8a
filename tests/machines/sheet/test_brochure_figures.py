"""Figures of a sheet as brochures print them."""

from __future__ import annotations

import pytest

from machines.sheet.quantity import angles_of, read_quantity


@pytest.mark.parametrize(("text", "ends"), [
    ("-35 to 120 deg", (-35.0, 120.0)), ("+120/-35", (-35.0, 120.0)), ("±110°", (-110.0, 110.0)),
    ("-35 120", (-35.0, 120.0)),
    ("-35° ... +120°", (-35.0, 120.0)), ("+/- 30", (-30.0, 30.0)), ("50 deg/s", None), ("120", None), ("right up", None),
    ("", None)])
def test_both_ends_of_a_turn_as_brochures_print_them(text: str, ends: tuple[float, float] | None) -> None:
    assert angles_of(text) == ends


def test_the_same_figure_in_other_units_may_stand_behind_it() -> None:
    assert read_quantity("762 mm (30 in)", "length") == 762.0
    assert abs(read_quantity("900 ipm (22.9 m/min)", "speed") - 381.0) < 1e-9
