"""One path spelt by six systems, in mm and in inches: the Toolpath must be the same to the written decimals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import toolpaths
from toolpaths.cl.inspect import inspect
from toolpaths.cl.read import ReadResult, read_file
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind, Role, Toolpath

FOLDER = Path(__file__).parents[3] / "samples" / "dialects"
FILES = {"nx": "nx.cls", "creo": "creo.ncl", "solidworks": "solidworks.apt", "solidworks-clt": "solidworks.clt",
         "catia": "catia.aptsource", "ncl": "ncl.as"}
WITHOUT_UNITS = ("nx", "catia")
DECIMALS = {"mm": 1e-4, "inch": 1.3e-3}
"""mm: half the last digit of NX, in inches of five digits and with the rounding of two numbers"""


def read(name: str, unit: str = "mm") -> ReadResult:
    prefix = "" if unit == "mm" else "inch_"
    result = read_file(FOLDER / f"{prefix}{FILES[name]}", units=unit if name in WITHOUT_UNITS else None)
    assert result.dialect == name
    assert not [str(d) for d in result.diagnostics if d.severity is not Severity.INFO]
    assert not result.unknown_words
    assert result.toolpath.units == unit
    return result


def same(p: Toolpath, q: Toolpath, atol: float) -> None:
    """The first len(q) rows of p are those of q."""
    n, k = len(q), len(q.arcs)
    assert q.tip == pytest.approx(p.tip[:n], abs=atol)
    assert q.axis == pytest.approx(p.axis[:n], abs=1e-6)
    assert np.allclose(q.feed, p.feed[:n], atol=atol, rtol=1e-5, equal_nan=True)
    for column in ("feed_mode", "kind", "role", "arc", "cycle", "tool"):
        assert getattr(q, column).tolist() == getattr(p, column)[:n].tolist(), column
    for column, tolerance in (("center", 2 * atol), ("normal", 1e-6), ("radius", 2 * atol), ("sweep", atol)):
        assert getattr(q.arcs, column) == pytest.approx(getattr(p.arcs, column)[:k], abs=tolerance), column
    for c, d in zip(p.cycles, q.cycles, strict=True):
        assert c.kind == d.kind
        assert (d.depth, d.clearance, d.retract, d.feed) == pytest.approx((c.depth, c.clearance, c.retract, c.feed),
                                                                         abs=atol)
        assert set(np.round(d.steps, 1)) == set(np.round(c.steps, 1))
    for t, u in zip(p.tools, q.tools, strict=True):
        assert (u.number, u.diameter) == (t.number, pytest.approx(t.diameter, abs=atol))


def events(p: Toolpath) -> list[tuple[int, str, frozenset[str | float]]]:
    """What all systems state of tools, spindle and coolant, in any order at one row."""
    found = [(e.index, e.word, frozenset(e.values[:1] if e.word == "LOADTL" else e.values))
             for e in p.events if e.word in ("LOADTL", "SPINDL", "COOLNT")]
    return sorted(found, key=str)


@pytest.mark.parametrize("unit", ["mm", "inch"])
@pytest.mark.parametrize("name", [name for name in FILES if name != "nx"])
def test_same_path(name: str, unit: str) -> None:
    nx, other = read("nx", unit).toolpath, read(name, unit).toolpath
    same(nx, other, DECIMALS[unit])
    first = [e for e in events(nx) if e[0] < len(other)]
    assert [e for e in events(other) if e[0] < len(other)] == first


@pytest.mark.parametrize("name", list(FILES))
def test_inches_are_the_same_path(name: str) -> None:
    same(read(name).toolpath, read(name, "inch").toolpath, 5e-3)




def test_the_path_is_what_the_script_says() -> None:
    """Numbers worked out by hand, so that six equal mistakes would show."""
    p = read("ncl").toolpath
    assert np.bincount(p.role, minlength=2).tolist() == [24, 4]
    assert np.degrees(p.arcs.sweep) == pytest.approx([90, 180, 90, 360, 270, 180], abs=1e-3)
    assert p.arcs.normal == pytest.approx(np.array([[0, 0, 1], [0, 0, -1], [0, 0, 1], [0, 0, 1], [0, 0, -1],
                                                    [0.6, 0, 0.8]]), abs=1e-7)
    assert p.arcs.center[[2, 3]].tolist() == [[20, 5, -3], [20, 5, -5]]
    assert p.arcs.center[5] == pytest.approx([50 + 8 - 0.6, 5, -6 - 0.8], abs=1e-4)
    assert p.tip[p.role == Role.HOLE].tolist() == [[30, 5, 0], [40, 5, 0], [30, -5, 0], [40, -5, 0]]
    assert [(c.kind, c.depth, c.clearance, c.retract, c.feed * 60, c.steps) for c in p.cycles] == [
        ("DRILL", 12, 3, 20, 120, ()), ("DEEP", 12, 3, 20, 100, (4,))]
    assert p.axis[[17, 25, 26, 27]] == pytest.approx(np.array([[0.6, 0, 0.8], [0, 0, 1], [0.6, 0, 0.8], [0.6, 0, 0.8]]))
    assert (p.kind == Kind.RAPID).sum() == 15


@pytest.mark.parametrize("unit", ["mm", "inch"])
@pytest.mark.parametrize("name", list(FILES))
def test_plain_counts_and_the_way_back(name: str, unit: str) -> None:
    """Points are the GOTO and the arcs of CATIA, which carry their ends; what is written reads back the same."""
    result = read(name, unit)
    prefix = "" if unit == "mm" else "inch_"
    text = (FOLDER / f"{prefix}{FILES[name]}").read_text()
    lines = ["".join(line.split()) for line in text.splitlines()]
    arcs = sum(line.startswith(("CIRCLE/", "TLON,GOFWD/")) for line in lines)
    ends = sum(line.startswith("TLON,GOFWD/") for line in lines)
    found = inspect(result)
    assert found["points"] == sum(line.startswith("GOTO/") for line in lines) + ends
    assert found["arcs"] == arcs == (6 if unit == "mm" else 5)
    assert found["cycles"] == sum(line.startswith(("CYCLE/D",)) for line in lines) == 2
    assert found["arcs_over_180_deg"] == 1
    assert toolpaths.read_bytes(toolpaths.write(result.toolpath))[0].equals(result.toolpath)


def test_insert_of_solidworks_is_for_people() -> None:
    found = [(e.word, e.values) for e in read("solidworks").toolpath.events if e.word in ("INSERT", "PPRINT")]
    assert found[0] == ("PPRINT", ("[HOLDER=C40] MILL_10",))
    assert {word for word, _ in found} == {"PPRINT"}
