"""FEDRAT lines by arrays read as the same lines one by one."""

from __future__ import annotations

import numpy as np
import pytest

import toolpaths
from toolpaths.cl.feeds import UNITS
from toolpaths.cl.text import feed_lines
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import Toolpath

FORMS = ("FEDRAT/MMPM,{}", "FEDRAT / {} , IPM", "FEDRAT/{}", "FEDRAT/MMPR, {}  ", "FEDRAT/{},MMPS")
ODD = ("FEDRAT/MMPM,1E2", "FEDRAT/MMPM,1.2.3", "FEDRAT/MMPM,1-2", "FEDRAT/MMPM,+", "FEDRAT/MMPM,", "FEDRAT/MMPM,-5.",
       "FEDRAT/MMPM,.5", "FEDRAT/MMPM,00012345678901234567890123456789012345", "FEDRAT/MMPM,9999999999999",
       "FEDRAT/MMPM,100,200", "FEDRAT/LENGTH,5", "FEDRAT/MMPM,100 $$ note", "FEDRAT/IPM,5", "fedrat/mmpm,70",
       "FEDRAT/MMPM,$", "FEDRAT/INVERS,2", "RAPID", "SPINDL/900,CLW", "$$ words", "COOLNT/ON",
       "FEDRAT/MMPM, 7", "FEDRATE/MMPM,7", "FEDRAT", "CALSUB/1", "UNITS/MM")


def text_of(form: str, rng: np.random.Generator, odd: tuple[str, ...], count: int = 60) -> str:
    """Points with a feed before most of them, other records between."""
    first, second = form.format("123.5"), form.format("88")
    rows = ["DEFSUB/1", first, "GOTO/9,9,9", second, "GOTO/8,9,9", "ENDSUB", "FEDRAT/50", "GOTO/0,0,0"]
    for _ in range(count):
        rows += [form.format(f"{rng.uniform(1, 3000):.{rng.integers(0, 8)}f}") for _ in range(rng.integers(0, 3))]
        if odd and rng.random() < 0.2:
            rows.append(odd[rng.integers(len(odd))])
        rows += [f"GOTO/{rng.uniform(-9, 9):.4f},{rng.uniform(-9, 9):.4f},1" for _ in range(rng.integers(0, 3))]
    return "\n".join([*rows, "FINI"])


def read(text: str, fewest: int, monkeypatch: pytest.MonkeyPatch) -> tuple[Toolpath, list[Diagnostic]]:
    monkeypatch.setattr(feed_lines, "FEWEST", fewest)
    return toolpaths.read_bytes(text, file="test.apt")


@pytest.mark.covering
@pytest.mark.parametrize("together", [7, 50_000])
@pytest.mark.parametrize("form", FORMS)
def test_feeds_by_arrays_are_those_of_the_records(form: str, together: int,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(feed_lines, "TOGETHER", together)
    used = 0
    for seed in range(25):
        text = text_of(form, np.random.default_rng(seed), () if seed < 3 else ODD[::2] if seed % 2 else ODD)
        path, found = read(text, 1, monkeypatch)
        wanted, noted = read(text, 10**9, monkeypatch)
        assert path.equals(wanted) and (path.line == wanted.line).all()
        assert [str(d) for d in found] == [str(d) for d in noted]
        used += seed < 3 and len({*path.feed[np.isfinite(path.feed)].tolist()}) > 20
    assert used == 3


def test_lines_of_the_form_are_taken_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else nothing above would be compared."""
    runs = []
    monkeypatch.setattr("toolpaths.cl.feeds.many", lambda b, s, numbers: runs.append(len(numbers)))
    read(text_of(FORMS[0], np.random.default_rng(1), ()), 1, monkeypatch)
    assert sum(runs) > 40


def test_the_units_are_those_of_the_records() -> None:
    assert set(feed_lines.UNITS) == UNITS


def test_a_number_is_read_to_its_last_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    numbers = [f"{x:.17f}"[:rng.integers(3, 20)] for x in rng.uniform(0.1, 999.0, 300)]
    text = "UNITS/MM\n" + "".join(f"FEDRAT/MMPS,{n}\nGOTO/{k},0,0\n" for k, n in enumerate(numbers)) + "FINI\n"
    path, _ = read(text, 1, monkeypatch)
    assert path.feed.tolist() == [float(n) for n in numbers]
