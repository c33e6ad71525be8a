"""Blocks made in one pass have the bytes of blocks made word by word, to which what may round otherwise is left."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.writing import block_text, iso
from postproc.writing.block_text import NumberStyle, TextPieces, WordColumn, certain
from tests.postproc.kit import circle, convert, toolpath

STYLES = [NumberStyle(plus, trim, point) for plus in (False, True) for trim in (False, True) for point in (False, True)]
VALUES = np.array([0.0, -0.0, 1.0, -1.0, 10.0, 100.0, -0.00004, 0.00006, 0.5, -12.3456, 999.9999, 0.99996, 1234567.1])


@pytest.fixture(autouse=True)
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(block_text, "compiled", lambda function: function)


def by_python(value: float, places: int, style: NumberStyle) -> str:
    """As the controller's manual says it, number by number."""
    text = f"{value:{'+' if style.plus_sign else ''}.{places}f}"
    if not float(text):
        text = ("+" if style.plus_sign else "") + text.lstrip("+-")
    if places and style.trim_zeros:
        text = text.rstrip("0").removesuffix("" if style.decimal_point else ".")
    return text + ("." if style.decimal_point and not places else "")


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("places", [0, 3, 4])
def test_numbers_are_those_of_the_formatting_of_python(places: int, style: NumberStyle) -> None:
    values = VALUES[np.abs(np.abs(VALUES) * 10.0**places % 1.0 - 0.5) > 1e-6]
    column = WordColumn(" X", values, np.ones(len(values), dtype=bool), places)
    found = block_text.block_text([column], TextPieces(len(values)), style)
    assert found == "\n".join(f"X{by_python(v, places, style)}" for v in values.tolist())


@pytest.mark.parametrize("value", [0.0005, 2.5e-4 + 1e-16, 1e14, np.nan, np.inf])
def test_what_is_not_certain_is_left(value: float) -> None:
    column = WordColumn("X", np.array([1.0, value]), np.ones(2, dtype=bool), 3)
    assert block_text.block_text([column], TextPieces(2), STYLES[2]) is None or value == 2.5e-4 + 1e-16
    assert certain(np.array([0.0005, 1.0]), 3) is None and certain(np.array([-2.0006, 1.0]), 3) is not None


def test_texts_stand_before_between_and_behind_the_words() -> None:
    pieces = TextPieces(2)
    pieces.put(0, [0], [" G1"])
    pieces.put(1, [1], [" I5"])
    pieces.put(2, [1], [" M9"])
    write = np.array([True, False])
    columns = [WordColumn(" X", np.array([1.0, 2.0]), ~write, 3), WordColumn(" F", np.array([5.0, 6.0]), write, 0)]
    assert block_text.block_text(columns, pieces, STYLES[2]) == "G1 F5\nX2 I5 M9"


@pytest.mark.parametrize(("name", "controller"), [
    ("mikron-ucp710", "linuxcnc"), ("mill-3axis", "fanuc-30i"), ("mill-3axis", "siemens-840d"), ("mill-3axis", "haas-ngc")])
def test_programs_have_the_same_bytes(name: str, controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    feeds = [f"FEDRAT/MMPM,{f}\nGOTO/{k}.5,{k * k / 7:.4f},{5 - k / 9:.5f}" for k, f in
             enumerate((600, 0.4, 312.5, 312.5, 90))]
    path = toolpath("GOTO/0,0,5", *feeds, "GOTO/0,10,5", circle([0, 0, 5], [0, 0, 1], 10), "GOTO/10,0,5", "RAPID",
                    "GOTO/10,0,50", "GOTO/-0.00004,9,50")
    slow, made = convert(path, name, controller), list[int]()
    monkeypatch.setattr(iso, "pays", lambda blocks, some: made.append(some) is None)
    fast = convert(path, name, controller)
    assert slow.ok and slow.text == fast.text and sum(made) > 10
