"""Hints on where the part stands and what the machine reaches there, on one odd record, on the machine's own limits."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.convert_cases import CUT, FAST, LENGTH, START, TURNING, convert, option, part, sheet
from tests.hints.machine_cases import machine_text

DELTA = "delta-parallel-z"
AT = LENGTH + "[part]\norigin = [0.0, 0.0, {z}]\n"
SKIPPED = "OPSKIP/ON\nGOTO/9,5,5\nGOTO/9,6,5\nLOADTL/2\nSPINDL/RPM,900,CLW\n" + (
    "RAPID\nGOTO/9,5,50\nGOTO/9,5,5\nOPSKIP/OFF\nGOTO/9,9,5\n")
ODD = "RAPID\nGOTO/0,0,5\nGOTO/0,0,0\nGOTO/9,0,0\nGOTO/9,9,0\nGOTO/4000,9,0\nGOTO/0,0,0\nRAPID\nGOTO/0,0,5\n"
_REACH = [
    convert("path.odd_record", START + ODD, "correct the record there", part("4000", "0"), stops=()),
    convert("spindle.too_fast", FAST + CUT, r"state at most ([0-9]+) in SPINDL", part("9000", r"\1"),
            m=machine_text("mill-3axis") + "\n[control]\nlargest_spindle_speed = 8000\n"),
    convert("reach.position", START + CUT, r"\(part\.(origin)\)", sheet("", "[part]\norigin = [0.0, 0.0, -750.0]\n"),
            machine="h4a-c-table"),
    convert("singular.distance", START + CUT, "state another (joints).(singular_distance)",
            sheet("0.99", "0.01"), machine=DELTA, setup=AT.format(z=-60.0) + "[joints]\nsingular_distance = 0.99\n",
            code_left=True),
    convert("opskip.mode", START + CUT.replace("GOTO/9,0,0\n", SKIPPED), "put (OPSKIP) around moves of one tool",
            part("GOTO/9,6,5\nLOADTL", r"\1/OFF\nGOTO/9,6,5\nLOADTL"), part("OPSKIP/OFF\nGOTO/9,9", "GOTO/9,9"),
            setup=LENGTH + "[tools.2]\ngauge_length = 100.0\n", control="generic-iso"),
    convert("machine.rollover", START + TURNING, r'allowed are ("\w+"),',
            Edit("m.toml", '"sign"', r"\1"), m=machine_text("mikron-ucp710").replace(
                '[axes.C]\n', '[axes.C]\nmodulo = true\nrollover = "sign"\n'), control="siemens-840d",
            more=" --output-mode axes"),
    convert("place.found", START + CUT, r"\[part\] (origin = \[.*?\]), (x_axis = \[.*?\]), (y_axis = \[.*?\]) in the set-up",
            sheet("", r"[part]\n\1\n\2\n\3\n"), machine="haas-umc-750", control="haas-ngc", stops=("travel.exceeded",)),
    convert("reach.clearance", START + CUT, r"\(part\.(origin)\)", sheet("60.0, 0.0, 190.0", "0.0, 0.0, -60.0"),
            machine=DELTA, setup=LENGTH + "[part]\norigin = [60.0, 0.0, 190.0]\n"),
]
FLAT = START + "RAPID\nGOTO/0,0,0\nGOTO/9,0,0\nRAPID\nGOTO/9,9,0\n"
PLANAR = "planar-delta"
_PLANE = [
    convert("reach.plane", FLAT, r"add \[0\.0, 0\.0, (.*?)\] to part\.origin", sheet("5.0]", r"-110.0]"), machine=PLANAR,
            setup=AT.format(z=5.0), stops=("link.in_plane",)),
    convert("reach.plane", FLAT.replace("9,9,0", "9,9,5"), r"a machine with a slide that leaves it",
            option("planar-delta-z", PLANAR), machine=PLANAR, setup=AT.format(z=-110.0)),
    convert("link.in_plane", FLAT, r"write (in_plane = true) under (\[clearance\])", sheet("", r"\2\n\1\n"), machine=PLANAR,
            setup=AT.format(z=-110.0)),
    convert("setup.in_plane", START + CUT, r"take (in_plane) out of \[clearance\]", sheet("in_plane = true\n", ""),
            setup=LENGTH + "[clearance]\nin_plane = true\n"),
]
_CHECK = [
    convert("check.no_rotary", START + CUT, "convert without (--check-program)", option("", " --check-program c.ngc"),
            more=" --check-program c.ngc"),
    convert("check.poses", START + CUT, r"lower clearance\.(margin)", sheet("360", "40"),
            setup=LENGTH + "[clearance]\nmargin = 360.0\n", more=" --check-program c.ngc", machine="mikron-ucp710"),
    HintCase("place.none", "place part.apt -m mill-3axis --setup s.toml -o o.toml",
             {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH + "[placement]\nx = [495.0, 500.0]\n"},
             "wider limits", (sheet("495.0", "400.0"),)),
    HintCase("analysis.singular", "machine analyse mikron-ucp710 --singular-above 100", {},
             "leave (--singular-above) out", (Edit(COMMAND, " --singular-above 100", ""),)),
    HintCase("machine.singular", "machine check m.toml",
             {"m.toml": 'base = "delta-star"\n[kinematics.workspace]\nz = [-200, 1200]\n'}, "make the workspace smaller",
             (Edit("m.toml", "[kinematics.workspace]\nz = [-200, 1200]\n", ""),)),
]
PLACE = [*_REACH, *_PLANE, *_CHECK]
