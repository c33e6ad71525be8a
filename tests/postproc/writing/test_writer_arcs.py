"""Arcs in the text of programs: planes, whole circles, helices, slanting planes."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.setup.model import SetupFile
from tests.postproc.kit import NX, angle, body, circle, convert, execute, good, goto, tilted, tool_poses, toolpath


def nx(*lines: str, name: str = "mill-3axis", setup: SetupFile | None = None,
       controller: str = "linuxcnc") -> list[str]:
    path = toolpath(*lines, "END-OF-PATH", head=NX)
    return body(good(convert(path, name, controller, setup)).text)


def test_full_circle_states_both_words_of_the_plane() -> None:
    """NX: TIMES 1 and equal ends is a whole turn; the direction is against the motion, so -z runs anti-clockwise."""
    got = nx("RAPID", "GOTO/10,0,5,0,0,1", "FEDRAT/MMPM,600", "GOTO/10,0,0", circle([0, 0, 0], [0, 0, -1], 10, ",TIMES,1"),
             "GOTO/10,0,0")
    assert "G3 X10 Y0 I-10 J0" in got


def test_clockwise_and_anticlockwise() -> None:
    got = nx("RAPID", "GOTO/10,0,5,0,0,1", "FEDRAT/MMPM,600", "GOTO/10,0,0", circle([0, 0, 0], [0, 0, -1], 10),
             "GOTO/0,10,0", circle([0, 0, 0], [0, 0, 1], 10), "GOTO/10,0,0")
    assert got[got.index("G1 Z0 F600") + 1:][:2] == ["G3 X0 Y10 I-10 J0", "G2 X10 Y0 I0 J-10"]


def test_helix_of_several_turns_is_cut_into_single_turns() -> None:
    got = nx("RAPID", "GOTO/5,0,5,0,0,1", "FEDRAT/MMPM,600", "GOTO/5,0,0", circle([0, 0, -9], [0, 0, -1], 5, ",TIMES,3"),
             "GOTO/5,0,-9")
    arcs = [b for b in got if " I" in b]
    assert arcs == ["G3 X5 Y0 Z-3 I-5 J0", "X5 Y0 Z-6 I-5 J0", "X5 Y0 Z-9 I-5 J0"]


def test_helix_of_odd_turns_passes_its_height_at_every_angle() -> None:
    """Two turns and a quarter: dense points of the text against height = pitch x angle."""
    path = toolpath("RAPID", "GOTO/5,0,5,0,0,1", "FEDRAT/MMPM,600", "GOTO/5,0,0",
                    circle([0, 0, -9], [0, 0, -1], 5, ",TIMES,2"), "GOTO/0,5,-9", "END-OF-PATH", head=NX)
    result = good(convert(path, "mill-3axis"))
    steps = execute(result)
    tips = np.concatenate([p[0] for s, p in zip(steps, tool_poses(result, steps), strict=True) if s.kind == "arc"])
    turned = np.unwrap(np.arctan2(tips[:, 1], tips[:, 0]))
    assert turned[-1] == pytest.approx(4.5 * np.pi, abs=1e-3)
    assert np.abs(tips[:, 2] + 9 * turned / (4.5 * np.pi)).max() < 0.002
    assert np.abs(np.linalg.norm(tips[:, :2], axis=1) - 5).max() < 2e-4


@pytest.mark.parametrize("tool_axis", [[0, 0, 1], [0, -1, 0], [0, 0, -1], [0, 1, 0], [0, 0.6, 0.8]])
def test_arcs_square_to_the_tool_on_an_indexed_bar(tool_axis: list[float]) -> None:
    """A 4-axis machine turns the face up: an arc in the face is an arc of X and Y; sense seen from the spindle."""
    n = np.array(tool_axis, dtype=float)
    x = np.array([1.0, 0, 0])
    y = np.cross(n, x)
    top = 20 * n
    path = toolpath("RAPID", *goto([top + 10 * x + 30 * n], [n]), "FEDRAT/MMPM,600", *goto([top + 10 * x], [n]),
                    circle(list(top), list(-n), 10), *goto([top + 10 * y], [n]), "END-OF-PATH", head=NX)
    blocks = body(good(convert(path, "mill-4axis")).text)
    arcs = [b for b in blocks if " I" in b]
    assert len(arcs) == 1 and arcs[0].startswith("G3 X0 Y10 I-10 J0")
    assert not [b for b in blocks if "G18" in b or "G19" in b]


@pytest.mark.parametrize(("normal", "code"), [([0, 1, 0], "G18"), ([1, 0, 0], "G19")])
def test_upright_arcs_use_the_other_planes(normal: list[float], code: str) -> None:
    """Quarter circles in ZX and YZ of both senses, against dense points on the circle of the CL text."""
    n, down = np.array(normal, dtype=float), np.array([0, 0, -1.0])
    side = np.cross(n, down)
    for sense in (1.0, -1.0):
        start, end = 10 * side, 10 * down
        along = -sense * n
        first, last = (start, end) if sense < 0 else (end, start)
        path = toolpath("RAPID", *goto([first - 4 * down * 10], [[0, 0, 1]]), "FEDRAT/MMPM,600", *goto([first], [[0, 0, 1]]),
                        circle([0, 0, 0], list(along), 10), *goto([last], [[0, 0, 1]]), "END-OF-PATH", head=NX)
        result = good(convert(path, "mill-3axis"))
        steps = execute(result)
        arc = [p[0] for s, p in zip(steps, tool_poses(result, steps), strict=True) if s.kind == "arc"]
        assert len(arc) == 1
        assert code in result.text
        assert np.abs(np.linalg.norm(arc[0], axis=1) - 10).max() < 1e-3
        assert np.abs(arc[0] @ n).max() < 1e-3
        assert np.allclose(arc[0][-1], last, atol=1e-3)
        swept = angle(arc[0][:1] / 10, arc[0][-1:] / 10)[0]
        assert swept < np.pi / 2 + 0.01, "the short path round"


def test_arc_in_a_slanting_plane_becomes_lines() -> None:
    n = tilted(30, 40)
    e = np.cross(n, [0, 0, 1.0])
    e /= np.linalg.norm(e)
    f = np.cross(n, e)
    path = toolpath("RAPID", *goto([10 * e + [0, 0, 30]], [[0, 0, 1]]), "FEDRAT/MMPM,600", *goto([10 * e], [[0, 0, 1]]),
                    circle([0, 0, 0], list(-n), 10), *goto([10 * f], [[0, 0, 1]]), "END-OF-PATH", head=NX)
    result = good(convert(path, "mill-3axis"))
    steps = execute(result)
    assert not [s for s in steps if s.kind == "arc"]
    tips = np.concatenate([p[0] for s, p in zip(steps, tool_poses(result, steps), strict=True) if s.kind == "feed"][1:])
    assert np.abs(np.linalg.norm(tips, axis=1) - 10).max() < 0.01
    assert np.abs(tips @ n).max() < 0.01
