"""Haas NGC: each rule of docs/reference/control-rules.md in which it differs from Fanuc, on programs made by hand."""

from __future__ import annotations

import numpy as np

from postproc.compile.program import Section
from postproc.control.planes import Plane
from tests.postproc.program_kit import LOAD, blocks, command, lines, program, step

TILTED = Section(1, "tilted", Plane(np.eye(3), np.zeros(3)), (90.0, 45.0), (("B", 90.0), ("C", 45.0)))
ENTERED = {0: LOAD, 1: [command("ENTER_SECTION", 1.0)]}


def test_dynamic_work_offset_states_x_and_y_then_z() -> None:
    made = program([step("rapid", B=90.0, C=45.0), step("rapid", X=1.0, Y=2.0, Z=50.0), step("rapid", Z=9.0)],
                   {**ENTERED, 3: [command("LEAVE_SECTION", 1.0)]}, "XYZBC", 3, sections=(Section(0, "axes"), TILTED))
    assert blocks("haas-ngc", made)[3:] == ["G0 B90. C45.", "G254", "G0 X1. Y2.", "G43 H3 Z50.", "Z9.", "G255"]


def test_dynamic_work_offset_with_z_alone_is_one_block() -> None:
    made = program([step("rapid", B=90.0), step("rapid", Z=50.0), step("rapid", X=9.0)], ENTERED, "XYZBC", 3,
                   sections=(Section(0, "axes"), TILTED))
    assert blocks("haas-ngc", made)[4:] == ["G254", "G0 G43 H3 Z50.", "X9."]


def test_length_that_is_in_force_stays_in_the_dynamic_work_offset() -> None:
    made = program([step("rapid", Z=90.0), step("rapid", X=1.0, Y=2.0, Z=50.0)], ENTERED, "XYZBC", 3,
                   sections=(Section(0, "axes"), TILTED))
    assert blocks("haas-ngc", made)[3:] == ["G0 G43 H3 Z90.", "G254", "G0 X1. Y2.", "Z50."]


def test_tcp_is_g234_and_g49() -> None:
    made = program([step("rapid", B=90.0), step("rapid", X=1.0, Y=2.0, Z=50.0)],
                   {**ENTERED, 2: [command("LEAVE_SECTION", 1.0)]}, "XYZBC", 3,
                   sections=(Section(0, "axes"), Section(1, "tcp")))
    assert blocks("haas-ngc", made)[4:] == ["G234 H3", "G0 X1. Y2. Z50.", "G49"]


def test_smoothing_states_the_corner_rounding_and_is_taken_back() -> None:
    text = lines("haas-ngc", program([step("rapid", X=0.0)]), smoothing=0.003)
    assert text.index("G187 P3 E0.003") < text.index("G187")


def test_further_work_offsets_are_g154() -> None:
    assert "G154 P5" in lines("haas-ngc", program([step("rapid", X=0.0)]), work_offset="G114")
