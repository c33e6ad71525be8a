"""Spoilt programs: whatever stands in a file, the reader hands back motion or errors with lines, never a traceback."""

from __future__ import annotations

import numpy as np
import pytest

from tests.postproc.readback.test_reader_klartext import CYCLE, START
from tests.postproc.readback.test_reader_klartext import program as klartext
from tests.postproc.readback.test_reader_laws import TIPS, by_tip, in_plane
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, TNC, executed

ROTARY = {"A": -30.0, "C": 40.0}
PIECES = ["G91", "G18", "M99", "M30", "G43 H1", "G49", "Z1e", "=", "(", '"', ";", "~", "/", "G53", "G68.2", "G53.1", "G69",
          "TRAORI", "CYCLE800()", "MCALL", "P0", "L0", "K0", "R0", "R-5", "I1.", "J", "Q0", "F0", "S0", "T", "D0", "M6", "-",
          "99999999", "LBL 0", "CALL LBL 1", "CC", "C X+1 DR-", "PLANE RESET STAY", "M128", "M91", "FMAX", "\n", "%", "O9",
          "G93", "G95", "G20", "G4", "G81", "G80", "G73", "G2", "G3"]
ISO = ("%\nO1\nG54 G90\nG0 X0. Y0. Z9.\nG98 G83 X1. Z-5. R1. Q2. {} F100\nG80\nM98 P2 L2\nG91 G28 Z0.\nG4 P5\n{}\nM30\nO2\n"
       "G2 X1. R5. F9\nM99\n%\n")
PROGRAMS = {
    FANUC: [ISO.format("K2", "G5.1 Q1")], HAAS: [ISO.format("L2", "G187 P1 E.1")],
    SIEMENS: ["G54 G90\nT1\nM6\nD1 G0 X1 Y1 Z9\nF100\nMCALL CYCLE83(20,0,1,-8,,,3,0,0,0,1,1)\nX1\nMCALL\nG2 X5 CR=9 TURN=1\n"
              "X=IC(4)\nCYCLE832(0.1,_FINISH,1)\nG0 SUPA D0 Z400\nM30\n"],
    TNC: [klartext(START + CYCLE.format("200", "+10", " ~\n Q206=+100 ~\n Q202=+3") + "L X+4 R0 FMAX M99\nCC X+1 Y+1\n"
                   "CYCL CALL POS X+1 Y+1 Z+0\nCP IPA+30 DR+\nLP PR+1 PA+3\nCALL LBL 1\nLBL 1\nL IX+1\nLBL 0\n")]}


def spoilt(text: str, rng: np.random.Generator) -> str:
    """A stretch taken out, a piece put in, or two lines swapped, some times."""
    for _ in range(rng.integers(1, 4)):
        at, rows = int(rng.integers(0, len(text) + 1)), text.split("\n")
        a, b = rng.integers(0, len(rows), 2)
        kind = rng.integers(0, 3)
        if kind == 0:
            text = text[:at] + text[at + int(rng.integers(1, 12)):]
        elif kind == 1:
            text = text[:at] + PIECES[int(rng.integers(0, len(PIECES)))] + text[at:]
        else:
            rows[a], rows[b] = rows[b], rows[a]
            text = "\n".join(rows)
    return text


@pytest.mark.parametrize("dialect", [FANUC, HAAS, SIEMENS, TNC])
def test_spoilt_programs_end_in_motion_or_errors(dialect: str) -> None:
    rng = np.random.default_rng(5)
    sources = [*PROGRAMS[dialect], by_tip(dialect, TIPS, [ROTARY] * 4), in_plane(dialect, "mikron-ucp710", ROTARY)]
    refused = 0
    for k in range(96):
        text = spoilt(sources[k % len(sources)], rng)
        motion, found = executed(dialect, text, "mikron-ucp710" if k % 3 else "mill-3axis")
        errors = [d for d in found if d.severity.name == "ERROR"]
        refused += bool(errors)
        assert all(d.lines and min(d.lines) >= 1 and d.file == "MAIN" for d in errors), [str(d) for d in errors]
        assert errors or (motion is not None and np.isfinite(motion.end).all()), text
    assert 24 < refused < 96
