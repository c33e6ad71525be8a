"""What LinuxCNC's interpreter accepts, refuses and makes of a program: the facts that the linuxcnc controller obeys."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.linuxcnc.interpreter import Canonical, Move, ToolEntry

HEAD = "G21 G90 G94 G17\nT1 M6\nG43 H1\nF1000\n"
TOOLS = {1: ToolEntry(75.5, 6.0), 7: ToolEntry(80.0, 10.0)}

AT, LEFT = "G0 X20 Y0 Z2\n", "G1 Y20\nY40\n"

ACCEPTED = {
    "percent-signs-without-m2": "%\nG21\nG0 X1\n%\n",
    "words-after-percent": "%\nG0 X1\n%\nANYTHING\n",
    "program-number": "%\nO0001\nG0 X1\nM30\n%\n",
    "line-252": "G1 X1 F100 (" + "c" * 239 + ")\nM2\n",
    "g93-f-on-each": HEAD + "G93\nG1 X1 A1 F60\nX2 A2 F60\nG94\nM2\n",
    "g93-rapid": HEAD + "G93\nG0 X1\nG1 X2 F60\nG94\nM2\n",
    "g93-arc": HEAD + "G93\nG2 X10 Y0 I5 J0 F10\nG94\nM2\n",
    "f-after-g94": HEAD + "G93\nG1 X1 F60\nG94\nG1 X2 F100\nM2\n",
    "pure-rotary": HEAD + "G1 C90\nG1 A10 C0\nM2\n",
    "rotary-windings": HEAD + "G1 C720 A-200\nC-1000\nM2\n",
    "cycle-repeats-x": HEAD + "G0 Z10\nG98 G81 X1 Y1 Z-5 R2 F100\nX2\nG80\nM2\n",
    "cycle-changes-with-words": HEAD + "G0 Z10\nG81 X1 Z-5 R2\nG83 X2 Z-5 R2 Q1\nG80\nM2\n",
    "helix-with-rotary": HEAD + "G2 X10 Y0 Z-5 I5 J0 A10 C90\nM2\n",
    "radius-off-by-0.02": HEAD + "G2 X10 Y0 I5.01 J0\nM2\n",
    "exact-path": "G61\nM2\n",
    "blending": "G64 P0.01 Q0.005\nM2\n",
    "machine-coordinates": "G53 G0 Z0\nM2\n",
    "work-offsets": "G59.3\nM2\n",
    "dwell": "G4 P0.5\nM2\n",
    "twelve-decimals": "G1 X1.123456789012 F100\nM2\n",
    "m9-m5-together": "M5 M9\nM2\n",
    "crlf": "G21\r\nG0 X1\r\nM2\r\n",
    "compensation-begins-on-an-arc": HEAD + AT + "G41\nG3 X0 Y20 I-20 J0\nG1 X-20\nG40\nG0 Z20\nM2\n",
    "compensation-ends-before-a-rise": HEAD + AT + "G41\n" + LEFT + "G40\nG0 Z20\nG3 X0 Y60 I-20 J0\nM2\n",
}

REFUSED = {
    "no-end": ("G21\nG0 X1\n", "no percent sign or program end"),
    "empty": ("", "no percent sign"),
    "line-253": ("G1 X1 F100 (" + "c" * 240 + ")\nM2\n", "Command too long"),
    "g93-f-missing": (HEAD + "G93\nG1 X1 A1 F60\nX2 A2\nM2\n", "F word missing with inverse time"),
    "g93-cycle": (HEAD + "G0 Z10\nG93 G81 X1 Z-5 R2 F100\nM2\n", "inverse time feed with canned cycles"),
    "f-missing-after-g94": (HEAD + "G93\nG1 X1 F60\nG94\nG1 X2\nM2\n", "zero feed rate"),
    "no-feed": ("G21\nG1 X1\nM2\n", "zero feed rate"),
    "cycle-changes-without-r": (HEAD + "G0 Z10\nG81 X1 Z-5 R2\nG83 X2 Z-5 Q1\nM2\n", "R clearance plane"),
    "peck-without-q": (HEAD + "G0 Z10\nG83 X1 Z-5 R2\nM2\n", "Q word missing"),
    "cycle-with-rotary": (HEAD + "G0 Z10\nG81 X1 A10 Z-5 R2\nM2\n", "Cannot put an a in canned cycle"),
    "radius-off-by-2": (HEAD + "G2 X10 Y0 I6 J0\nM2\n", "Radius to end of arc differs"),
    "unused-p": ("G0 X1 P5\nM2\n", "P word"),
    "unused-k": ("G1 X1 K5 F100\nM2\n", "K word with no"),
    "unused-h": ("H1\nM2\n", "H word"),
    "word-twice": ("G1 X1 X2 F100\nM2\n", "Multiple x words"),
    "two-motions": ("G0 G1 X1 F100\nM2\n", "same modal group"),
    "axis-after-g80": (HEAD + "G80 X1\nM2\n", "axis values with g80"),
    "machine-coordinates-alone": ("G53 Z0\nM2\n", "axis values without a g code"),
    "exponent": ("G1 X1e1 F100\nM2\n", "E word with no"),
    "tcp": ("T1 M6\nG43.4 H1\nM2\n", "Unknown g code"),
    "tilted-plane": ("G68.2 X0 Y0 Z0 I0 J30 K0\nM2\n", "Unknown g code"),
    "clamp-m10": ("M10\nM2\n", "Unknown m code"),
    "unknown-tool": ("T500 M6\nM2\n", "tool 500 not found"),
    "unknown-length": ("G43 H150\nM2\n", "tool 150 not found"),
    "dwell-x": ("G4 X0.5\nM2\n", "axis values without a g code"),
    "compensation-ends-on-an-arc": (HEAD + AT + "G41\n" + LEFT + "G40\nG3 X0 Y60 I-20 J0\nM2\n",
                                    "must be straight, not an arc"),
    "compensation-begins-on-a-small-arc": (HEAD + AT + "G41\nG3 X18 Y2 I-2 J0\nM2\n", "entry arc is not greater"),
    "plane-under-compensation": (HEAD + AT + "G41\n" + LEFT + "G18 G3 X0 Z22 I-20 K0\nM2\n", "Cannot change planes"),
    "nested-comment": ("G0 X1 (a (b) c)\nM2\n", "Nested comment"),
}


@pytest.fixture
def run(interpret, tmp_path: Path):
    """Program text to Canonical."""
    def run_text(text: str) -> Canonical:
        (tmp_path / "program.ngc").write_bytes(text.encode())
        return interpret(tmp_path / "program.ngc", TOOLS)

    return run_text


@pytest.mark.parametrize("name", ACCEPTED)
def test_accepted(run, name: str) -> None:
    assert run(ACCEPTED[name]).error == ""


@pytest.mark.parametrize("name", REFUSED)
def test_refused(run, name: str) -> None:
    text, reason = REFUSED[name]
    error = run(text).error
    assert reason in error


def test_positions_are_exact_and_carry_their_lines(run) -> None:
    canonical = run(HEAD + "G0 X0 Y0 Z50 A0 C0\nG1 X10.123456789 Y-5 A10.000001 C400\nG10 L2 P1 X100\nG1 X1\nM2\n")
    assert canonical.line.tolist() == [5, 6, 8]
    assert canonical.kind.tolist() == [Move.TRAVERSE, Move.FEED, Move.FEED]
    np.testing.assert_allclose(canonical.pos[1], [10.123456789, -5, 50, 10.000001, 0, 400, 0, 0, 0],
                               rtol=0, atol=1e-12)
    np.testing.assert_allclose(canonical.machine[:, [0, 2]], [[0, 125.5], [10.123456789, 125.5], [101, 125.5]],
                               rtol=0, atol=1e-12)
    assert canonical.tool.tolist() == [1, 1, 1]


@pytest.mark.parametrize(("code", "x"), [("G41", 17.0), ("G41 D0", 17.0), ("G41 D7", 15.0), ("G41 D7\nG40\nG41", 17.0)])
def test_compensation_without_d_takes_the_tool_in_the_spindle(run, code: str, x: float) -> None:
    canonical = run(HEAD + AT + f"{code}\n" + LEFT + "G40\nG0 Z20\nM2\n")
    assert canonical.error == "" and canonical.pos[-2][0] == pytest.approx(x)


def test_inverse_time_and_rotary_feed_give_the_time_of_a_block(run) -> None:
    canonical = run(HEAD + "G93\nG1 X30 Y40 C90 F20\nG1 C180 F30\nG94\nG1 X0 Y0 F600\nG1 C90\nM2\n")
    assert canonical.inverse.tolist() == [True, True, False, False]
    np.testing.assert_allclose(canonical.seconds, [3.0, 2.0, 5.0, 9.0], rtol=1e-12)


def test_tiny_linear_residue_spoils_the_time_of_a_rotary_block(run) -> None:
    """Feed is never below 0.1 mm/min, and a residue of 0.1 um makes it count as a linear move: 1 s becomes 0.06 s."""
    canonical = run(HEAD + "G93\nG1 C10 F60\nG1 X0.0001 C20 F60\nM2\n")
    assert canonical.seconds[0] == pytest.approx(1.0)
    assert canonical.seconds[1] == pytest.approx(60 * 0.0001 / 0.1)


def test_arcs_keep_centre_turn_and_length(run) -> None:
    canonical = run(HEAD + "G0 Z0\nG2 X10 Y10 I10 J0\nG3 I5 Z-5\nG18 G2 X20 Z-5 I5 K0\nG17 G3 X20 Y10 I-1 J0 P2\nM2\n")
    assert canonical.plane.tolist() == [17, 17, 17, 18, 17]
    assert canonical.turn.tolist() == [0, -1, 1, -1, 2]
    np.testing.assert_allclose(canonical.center[1:3], [[10, 0], [15, 10]], atol=1e-12)
    lengths = [np.pi / 2 * 10, np.hypot(2 * np.pi * 5, 5), np.pi * 5, 4 * np.pi]
    np.testing.assert_allclose(canonical.seconds[1:] * 1000 / 60, lengths, rtol=1e-9)


def test_cycle_is_expanded_into_moves(run) -> None:
    canonical = run(HEAD + "G0 Z10\nG98 G82 X1 Y2 Z-5 R2 P0.5 F100\nX3\nG80\nM2\n")
    holes = canonical.pos[canonical.kind == Move.FEED]
    np.testing.assert_allclose(holes[:, :3], [[1, 2, -5], [3, 2, -5]], atol=1e-12)
    assert canonical.seconds[canonical.kind == Move.DWELL].tolist() == [0.5, 0.5]


def test_calls_next_to_motion(run) -> None:
    canonical = run("G21\nT7 M6\nS12000 M3\nM8\nG61\nG64 P0.01\nM5 M9\nM2\n")
    assert canonical.calls("SET_SPINDLE_SPEED") == ["0, 12000.0000"]
    assert canonical.calls("CHANGE_TOOL") and canonical.calls("FLOOD_ON")
    assert canonical.calls("SET_MOTION_CONTROL_MODE") == ["CANON_EXACT_PATH", "CANON_CONTINUOUS, 0.010000"]
