"""Hints that few files lead to: axes that jump, ranges of error models, words that a control has not, other runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from machines.geometric_error.actual.correction import correct
from machines.kinematics.base import Kinematics
from postproc.collision.executed_path import Parts
from postproc.collision.executed_path import _needed as needed
from postproc.proof.hashes import input_hashes
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.convert_cases import CUT, LEFT, LENGTH, START, TURNING, convert, option, part, sheet
from tests.hints.file_cases import BODY, GOOD_BOX, PROGRAM
from tests.hints.machine_cases import machine_text
from tests.hints.own_room_cases import BALL, CLAMPED, ON
from tests.hints.verify_cases import edited
from toolpaths.arrays import Floats

ROOT = Path(__file__).parents[2]
LONG = "[tools.1]\ngauge_length = 200.0\n"
NEXT = "GOTO/-45,74,58,-0.621510,-0.745127,0.241889\n"
"""far from (0.58, 0.81, 0.04), across the cone of a nutating head"""
HIGH = "RAPID\nGOTO/-31,114,59\nGOTO/-20,114,59\nRAPID\nGOTO/-20,114,69\n"
WIDE = "RAPID\nGOTO/-40,0,5\nGOTO/-40,0,0\nGOTO/40,0,0\nRAPID\nGOTO/40,9,5\n"
KNOWN = "[components.EYX]\npolynomial = [3.0]\nrange = [-30, 30]\n"
WEAR = LENGTH + 'compensation = "wear"\n'
LED = LEFT.replace("CUTCOM/LEFT", "CUTCOM/LEFT,7") + "GOTO/40,0,2\nCUTCOM/OFF\nGOTO/60,20,2\nRAPID\nGOTO/60,20,20\n"
TURNED = "RAPID\nGOTO/0,0,50\nGOTO/0,0,5\nGOTO/9,0,5\nRAPID\nGOTO/9,0,50\nRAPID\n" + (
    "GOTO/30,0,50,0.5,0,0.866025404\nGOTO/4,0,5\nGOTO/4,9,5\nRAPID\nGOTO/30,9,50\n")
ROLLING = machine_text("mikron-ucp710").replace("[axes.C]\n", '[axes.C]\nmodulo = true\nrollover = "sign"\n')
ROUND = "RAPID\nGOTO/0,-40,60,0,-0.6,0.8\nGOTO/0,-10,20,0,-0.6,0.8\nRAPID\nGOTO/0,-40,60,0,-0.6,0.8\nRAPID\n" + (
    "GOTO/0,40,60,0,0.6,0.8\nGOTO/0,10,20,0,0.6,0.8\nRAPID\nGOTO/0,40,60\n")
_PATHS = [
    convert("path.jump", START + "MULTAX/ON\nGOTO/-51,10,-50,0.579520,0.813762,0.044131\n" + NEXT,
            "retract before this point", part(NEXT, "RAPID\n" + NEXT),
            setup=LONG + "[part]\norigin = [-86.8431, -39.249, 50.0]\n", machine="nutating-head",
            control="heidenhain-tnc640", more=" --output-mode axes"),
    convert("link.blocked", START + HIGH, r"\(part\.(origin)\)", sheet("-22.0776, -45.6804, 0.0]", "26.0, -114.0, -295.0]"),
            setup=LONG + "[part]\norigin = [-22.0776, -45.6804, 0.0]\n", machine="rotary-delta", control="siemens-840d"),
    convert("compensation.range", START + WIDE, "or take (--error-model-beyond)", option(r" \1", ""), setup=LENGTH,
            more=" --error-model e.toml", code_left=True, e=KNOWN),
    convert("compensation.axis", START + WIDE, r"(--axis-tolerance 0\.19) where", option(r" \1", ""), setup=LENGTH,
            more=" --error-model e.toml", e="[location]\nEB0S = 600\n"),
    convert("rollover.standing", START + TURNED, r"leave (restart = true) out of the set-up",
            sheet("restart = true", "restart = false"), m=ROLLING, setup=LENGTH + "[output]\nrestart = true\n",
            more=" --output-mode axes"),
    convert("cutcom.own_register", START + LED, r"leave the register out of CUTCOM \((CUTCOM/LEFT)\)",
            part("CUTCOM/LEFT,7", r"\1"), setup=WEAR, control="siemens-840d"),
]
_CLAMPS = [
    edited("verify.clamp", TURNED, "M11\nG0 A", "G0 A", "(M11) in a block before it", machine="m.toml", control="fanuc-30i",
           more=" --output-mode axes", m=CLAMPED),
]
TNC = "-m delta-parallel-z -c heidenhain-tnc640 --setup s.toml"
ZERO = "tool,length\n1,0\n"
_TABLES = [
    HintCase("tool.length_twice", f"verify p.h part.apt {TNC} --tool-table t.csv",
             {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH + "[part]\norigin = [0.0, 0.0, -60.0]\n",
              "t.csv": ZERO.replace("0", "110")}, "L and DL of these tools must be (0)", (Edit("t.csv", "110", r"\1"),),
             first=(f"convert part.apt {TNC} -o p.h --output-mode axes",)),
    HintCase("error-table.kind", "errors import X=x.comp -m mill-3axis -o e.toml",
             {"x.comp": "-100 0.001 0.002\n100 0.002 0.001\n"},
             r"it may be of type (1)", (Edit(COMMAND, "", r" --type \1"),)),
]
_CREO = (ROOT / "samples" / "indexing" / "creo_rotate_multax.ncl").read_text("utf-8")
LOCAL = "-4.0000000000, $\n 0.0000000000, 0.0000000000, 1.0000000000"
RADIAL = "-4.0000000000, $\n 0.0000000000, -0.7071067812, 0.7071067812"
_CAM = [
    HintCase("cl.index-axis", "inspect part.ncl", {"part.ncl": _CREO.replace(LOCAL, RADIAL, 1)}, "without subroutines",
             (Edit("part.ncl", RADIAL, LOCAL),)),
]
RUN = "".join(f"{n},{t}\n" for n, t in zip(range(7, 19), (0.0, *(0.5 + 60.0 * sum(5.0 / (200 + k) for k in range(1, m))
                                                                  for m in range(1, 12))), strict=True))
SLOW = "".join(f"{n},{9 * n * n}\n" for n in range(7, 19))
"""as of another machine"""
_LOGS = [
    HintCase("log.fit", "time p.nc -m mill-3axis -c linuxcnc --calibrate log.csv -o model.toml",
             {"p.nc": PROGRAM, "log.csv": "nc_line,time_s\n" + SLOW}, "log a run of this program on this machine",
             (Edit("log.csv", SLOW, RUN),)),
]
BUMP = "TOOL PATH/A,TOOL,D10\nTLDATA/MILL,10,0,75,0,30\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\nSPINDL/RPM,1000,CLW\n" + (
    f"FEDRAT/MMPM,600\n{CUT}END-OF-PATH\n")
_TURN = "".join(f"GOTO/{x},0,5,{0.01 * x},0,{(1.0 - (0.01 * x)**2)**0.5:.9f}\n" for x in range(0, 20, 4))
LEVELS = "UNITS/MM\n" + "".join(
    f"TOOL PATH/{name},TOOL,T1\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\nRAPID\n"
    f"GOTO/0,0,20,0,0,1\n{_TURN}RAPID\nGOTO/16,0,20,0.16,0,0.987117014\nEND-OF-PATH\n" for name in ("ROUGH", "FINE"))
SILENT = BALL.replace("SPINDL/RPM,1000,CLW\n", "") + "FINI\n"
TILTS = "-m mikron-ucp710 -c fanuc-30i --setup s.toml"
ORIENT = f"convert part.apt {TILTS} --orient auto -o p.nc"
_CHOICES = [
    HintCase("collision.point", f"convert part.cls {ON} --units mm -o p.nc",
             {"part.cls": BUMP, "s.toml": LENGTH + BODY, "part.off": GOOD_BOX}, r"add (tip_angle = )\.\.\. to \[tools\.1\]",
             (sheet("110.0\n", "110.0\n\\g<1>118.0\n"),)),
    HintCase("output.smoothing_mode", f"convert part.cls {TILTS} -o p.nc --output-mode tcp",
             {"part.cls": LEVELS, "s.toml": LENGTH + '[output]\nsmoothing = { ROUGH = "roughing", FINE = "finishing" }\n'},
             r"\[output\] (restart = true)", (sheet("[output]\n", r"[output]\n\1\n"),)),
    HintCase("orient.unproved", ORIENT, {"part.apt": SILENT, "s.toml": LENGTH}, "(--orient keep) leaves the axes",
             (option(r"\1", "--orient auto"),), stops=("spindle.not_started",)),
]


def _ends(*given: Any, **more: Any) -> Any:
    """A machine that ends where the corrected X would be."""
    found = correct(*given, **more)
    return replace(found, q=np.where(found.q[:, :1] > 40.0005, np.nan, found.q))


def _singular(motion: Motion, executed: BlockPoses, kin: Kinematics, parts: Parts, reach: float) -> Floats:
    """A machine that has no bound where X is more than 5 mm."""
    found, (row, _, end) = needed(motion, executed, kin, parts, reach), parts
    return np.where(executed.joints(motion, row, end)[:, 0] > 5.0, np.inf, found)


def _apart(*given: Any) -> dict[str, tuple[str, ...]]:
    """What was hashed before: other files."""
    return dict.fromkeys(input_hashes(*given), ())


_OPEN = 'base = "linuxcnc"\n[comment]\nforbidden = "{}"\n'
SLOPE = '[components.EXX]\npolynomial = [0.0, -0.2]\nrange = [-500, 500]\n'
_STAND_INS = [
    HintCase("verify.no_bound", f"convert part.apt {TILTS} --output-mode axes -o p.nc --require-proof",
             {"part.apt": START + TURNING + "FINI\n", "s.toml": LENGTH},
             "leave (--require-proof) out", (option("", " --require-proof"),),
             stands_in=(("machines.kinematics.serial.Serial.jets_proved", False),)),
    HintCase("collision.bound", "convert part.apt -m mill-3axis -c fanuc-30i --setup s.toml -o p.nc",
             {"part.apt": START.replace("LOADTL/1\n", "CUTTER/10,0\nLOADTL/1\n") + CUT + "FINI\n", "s.toml": LENGTH + BODY,
              "part.off": GOOD_BOX}, r"move the part in the set-up \((part)\.(origin)\)",
             (sheet("", r"[\1]\n\2 = [-30.0, 0.0, 0.0]\n"),),
             stands_in=(("postproc.collision.executed_path._needed", _singular),)),
    HintCase("proof.input_changed", f"convert part.apt {ON} -o p.nc --proof",
             {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}, "convert again", (),
             stands_in=(("postproc.proof.command.hashed", _apart),), ends=True),
    convert("proof.comment", START + CUT, "(comment).(forbidden) of the controller file", Edit("c.toml", '""', '"()"'),
            stands_in=(("postproc.verification.proof_text.head_line", lambda *given: "proved) G1 X9 ("),),
            c=_OPEN.format("")),
    convert("rollover.turn", START + ROUND, r'(rollover = "none") for this axis',
            Edit("m.toml", 'rollover = "shortest"', r"\1"),
            m=ROLLING.replace('"sign"', '"shortest"'), control="fanuc-30i", more=" --output-mode axes",
            stands_in=(("postproc.pipeline.stages.with_short_turns", lambda path, *rest: path),)),
    convert("compensation.reach", START + WIDE, r"move the part in the set-up \((part)\.(origin)\)",
            sheet("", r"[\1]\n\2 = [-20.0, 0.0, 0.0]\n"), more=" --error-model e.toml", e=SLOPE,
            stands_in=(("postproc.correction.error_context.correct", _ends),)),
    convert("plan.reach", START + CUT, "(--feed programmed)", option(r"\1", "--feed planned"), more=" --feed planned",
            control="siemens-840d", stands_in=(("postproc.planning.pass_geometry._machine_paths", lambda passes, *rest: [
                "axis X beyond its end" for one in passes for _ in one.stretches]),)),
]
RARE = [*_PATHS, *_CLAMPS, *_TABLES, *_CAM, *_LOGS, *_CHOICES, *_STAND_INS]
