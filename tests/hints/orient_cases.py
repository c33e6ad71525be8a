"""Hints on tool axes that are chosen, and on what touches: passes out of travel, holders at walls, gouges."""

from __future__ import annotations

from postproc.base.program_time import ProgramTime
from postproc.placement.place import _Proof
from postproc.placement.place_times import TimedPlace
from tests.hints.case import Edit, HintCase
from tests.hints.convert_cases import CUT, LENGTH, START, convert, sheet
from tests.hints.file_cases import BODY, GOOD_BOX, SHAPE
from toolpaths.diagnostics import Diagnostic, error

PASS = START.replace("LOADTL/1\n", "CUTTER/16,8\nLOADTL/1\n") + "MULTAX\nRAPID\nGOTO/0,0,5,0,0,1\nRAPID\n" + (
    "GOTO/0,0,0,0,0,1\nGOTO/80,0,0,0,0,1\nRAPID\nGOTO/80,0,5,0,0,1\n")
UNDER = PASS.replace("16,8", "16,0").replace("0,0,1\n", "0,0,-1\n").replace(",0,5,", ",0,-5,")
HOLE = PASS[:PASS.index("MULTAX")] + "RAPID\nGOTO/0,0,9\nCYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3\nGOTO/0,0,0\nCYCLE/OFF\n" + (
    "RAPID\nGOTO/0,0,9\n")
AT = LENGTH + "[part]\norigin = [{}]\n"
HELD = """[tools.1]
gauge_length = 120.0
flute_length = 20.0
shank = [{diameter = 12.0, length = 30.0}]
holder = [{diameter = 40.0, length = 70.0}]
"""
WALL = '[[bodies.fixtures]]\nname = "wall"\nframe = "part"\nbox = {{low = {}, high = {}}}\n'
SMALL, HIGH, ASIDE = "[37.0, -3.0, 97.0]", "[43.0, 3.0, 103.0]", "[37.0, 197.0, 97.0]"
LOW_Z = 'base = "mikron-ucp710"\n[axes.Z]\ntravel = [-250, {0}]\nhome = {0}\n'


def _oriented(code: str, text: str, setup: str, says: str, *does: Edit, machine: str = "mikron-ucp710",
              more: str = "", **files: str) -> HintCase:
    """Axes of a file chosen."""
    return HintCase(code, f"orient part.apt -m {machine} --setup s.toml{more}",
                    {"part.apt": text + "FINI\n", "s.toml": setup, **{f"{n}.toml": t for n, t in files.items()}}, says, does)


_AXES = [
    _oriented("orient.own_reach", PASS, AT.format("300.0, 0.0, 0.0"), "move or turn the part", sheet("300.0", "0.0")),
    _oriented("orient.travel", HOLE, AT.format("0.0, 300.0, 0.0"), "move or turn the part", sheet("300.0", "0.0")),
    _oriented("orient.reach", UNDER, AT.format("0.0, 0.0, 0.0"), r"\(part\.(x_axis), part\.(y_axis)\)",
              sheet("", r"\1 = [1.0, 0.0, 0.0]\n\2 = [0.0, -1.0, 0.0]\n"), machine="nutating-head"),
    _oriented("orient.ways", PASS, AT.format("0.0, 0.0, 0.0"), "move or turn the part", sheet("0.0]", "-100.0]"),
              machine="m.toml", m=LOW_Z.format(111)),
    _oriented("orient.own_touches", PASS, HELD + WALL.format(SMALL, HIGH), "check part, fixtures and holder",
              sheet(SMALL, ASIDE), sheet(HIGH, "[43.0, 203.0, 103.0]"), more=" --max-tilt 45"),
    _oriented("orient.touches", PASS, HELD + WALL.format("[-90.0, -90.0, 60.0]", "[190.0, 90.0, 110.0]"),
              "check part, fixtures and holder", sheet("60.0]", "-90.0]"), sheet("110.0]", "-40.0]"), more=" --max-tilt 5"),
]
CLAMP = '[bodies]\nclearance = 0.5\n[[bodies.fixtures]]\nname = "clamp"\nbox = {{low = [{0}, -40.0], high = [{1}, 60.0]}}\n'
BALL = START.replace("LOADTL/1\n", "CUTTER/16,8\nLOADTL/1\n") + CUT
DOWN = "GOTO/0,0,0\nGOTO/9,0,0", "GOTO/0,0,-15\nGOTO/9,0,-15"
_TOUCHES = [
    HintCase("collision.gouge", "convert part.apt -m mill-3axis -c linuxcnc --setup s.toml -o p.ngc",
             {"part.apt": SHAPE.replace(*DOWN) + "FINI\n", "s.toml": LENGTH + BODY, "part.off": GOOD_BOX},
             "another tool axis or path", (Edit("part.apt", *reversed(DOWN)),)),
    convert("collision.near", BALL, "move the fixture", sheet("20.3", "30.3"),
            setup=HELD + CLAMP.format("0.0, 20.3", "80.0, 40.0")),
    convert("collision.touch", BALL, "move the fixture", sheet("[5.0, 0.0", "[5.0, 40.0"), sheet("[6.0, 1.0", "[6.0, 41.0"),
            setup=HELD + CLAMP.format("5.0, 0.0", "6.0, 1.0")),
]
_of = _Proof.of


def _unconverted(proof: _Proof, one: TimedPlace) -> tuple[ProgramTime | None, Diagnostic | None]:
    """No program anywhere, as long as a wide margin is asked for."""
    if proof.setup.clearance.margin <= 40.0:
        return _of(proof, one)
    return None, error("link.blocked", "no height is inside", hint="lower clearance.margin")


_PLACES = [
    HintCase("place.proof", "place part.apt -m mikron-ucp710 --setup s.toml -o o.toml",
             {"part.apt": START + CUT + "FINI\n",
              "s.toml": LENGTH + "[clearance]\nmargin = 60.0\n[placement]\nx = [0.0, 10.0]\ny = [0.0, 10.0]\n"},
             r"lower clearance\.(margin)", (sheet("60.0", "40.0"),),
             stands_in=(("postproc.placement.place._Proof.of", _unconverted),)),
]
ORIENT = [*_AXES, *_TOUCHES, *_PLACES]
