"""Read-back of parts that are ordinary in shops and were once refused."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import toolpaths
from postproc.readback.comparison import compare
from tests.postproc.kit import SAMPLES, convert, good, setup_of
from toolpaths.diagnostics import Diagnostic, Severity, warning
from toolpaths.shape import Curves
from toolpaths.toolpath import Toolpath


def ring() -> Toolpath:
    """A vertical path in, holes on a cone all round, a vertical path out at the place of the approach: C has gone round."""
    lines = ["TOOL PATH/D,TOOL,DR", "TLDATA/DRILL,5,0,75,118,50", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "RAPID",
             "GOTO/0,0,80,0,0,1", "CYCLE/DRILL,RAPTO,2,FEDTO,-8,RTRCTO,20,MANUAL,MMPM,100"]
    for phi in np.arange(8) * np.pi / 4.0:
        x, y = np.cos(phi), np.sin(phi)
        lines.append(f"GOTO/{20 * x:.4f},{20 * y:.4f},34.641,{0.5 * x:.7f},{0.5 * y:.7f},0.8660254")
    return read([*lines, "CYCLE/OFF", "RAPID", "GOTO/0,0,80,0,0,1", "END-OF-PATH"])


def tiny_arc() -> Toolpath:
    """An arc shorter than the last decimal of a word, a long one behind it round the same centre."""
    circle = "CIRCLE/0,0,0,0,0,-1,68.9,0.03,0.5,10,0"
    return read(["TOOL PATH/CORE,TOOL,EM", "TLDATA/MILL,10,0,75,0,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "RAPID",
                 "GOTO/68.9,0,20,0,0,1", "FEDRAT/MMPM,500", "GOTO/68.9,0,0", circle, "GOTO/68.9,0.0001,0", circle,
                 "GOTO/0,68.9,0", "GOTO/0,80,0", "RAPID", "GOTO/0,80,20", "END-OF-PATH"])


def read(lines: list[str]) -> Toolpath:
    path, found = toolpaths.read_bytes("\n".join(lines).encode(), file="field.cls")
    assert not toolpaths.diagnostics.has_errors(found), found
    return path


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["linuxcnc", "haas-ngc", "fanuc-30i", "heidenhain-tnc640"])
@pytest.mark.parametrize("index", ["plane", "home"])
def test_a_ring_of_tilted_holes_is_no_rewind(controller: str, index: str) -> None:
    """Home and the retract are the same pose with C half a turn on, the whole program between them; so is Z
    home, where axes are indexed there."""
    setup = setup_of((SAMPLES / "tools.setup.toml").read_text() + f'\n[clearance]\nindex = "{index}"\n')
    result = good(convert(ring(), "mikron-ucp710", controller, setup=setup))
    assert result.comparison is not None


@pytest.mark.parametrize("controller", ["linuxcnc", "haas-ngc", "siemens-840d"])
def test_an_arc_without_a_block_takes_no_other(controller: str) -> None:
    result = good(convert(tiny_arc(), "mikron-ucp710", controller))
    assert result.comparison is not None and result.comparison.worst_tip < 0.01


def test_lines_that_nobody_knows_are_not_reported() -> None:
    assert str(Diagnostic(Severity.WARNING, "a.b", "seven", count=7)) == "warning [a.b] seven (7 times)"
    assert str(warning("a.b", "none", file="part.cls", lines=[0])) == "part.cls: warning [a.b] none"


def test_blocks_stand_on_a_helix_by_their_length(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three turns, the second as sixty lines: the last arc begins at two thirds, not at 61 of 62."""
    radius, phi = 10.0, np.linspace(0.0, 6.0 * np.pi, 181)
    ends = np.concatenate([[60], np.arange(61, 121, 1), [180]])
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.zeros(181)], axis=1)
    begins = np.concatenate([[0], ends[:-1]])
    executed = SimpleNamespace(control=None, poses=lambda motion, rows, t: (points[(ends if t else begins)[rows]], None))
    sweeps = np.full(62, np.nan)
    sweeps[[0, 61]] = 2.0 * np.pi
    monkeypatch.setattr(compare, "arc_sweeps", lambda motion, control: sweeps)
    up = np.array([[0.0, 0.0, 1.0]])
    curves = Curves(points[:1], points[-1:], up, up, np.array([True]), np.zeros((1, 3)), up,
                    np.array([6.0 * np.pi]))
    moves = SimpleNamespace(arc=np.array([0]), link=np.array([False]), curves=curves.take)
    begin, share = compare.place_on_moves(None, executed, np.arange(62), np.zeros(62, dtype=int), moves)
    np.testing.assert_allclose(begin[[1, 61]], [1 / 3, 2 / 3], atol=1e-3)
    np.testing.assert_allclose(share[[0, 61]], 1 / 3, atol=1e-3)
