"""Hints of programs that somebody has edited: harm is done to a program that is proved, and undone as the hint says."""

from __future__ import annotations

from tests.hints.case import Edit, HintCase
from tests.hints.cl_cases import SPLINE
from tests.hints.convert_cases import ARC, CUT, LEFT, LENGTH, START, TAP, TURNING, option
from tests.hints.gcode_cases import ISO, TNC

ON = "-m mill-3axis -c fanuc-30i --setup s.toml"
BEGIN = "RAPID\nGOTO/0,0,50\nGOTO/0,0,0\n"
DOWN = "RAPID\nGOTO/0,0,50\nGOTO/0,0,0\nGOTO/9,0,0\nRAPID\nGOTO/40,30,40\nGOTO/40,30,5\nGOTO/50,30,5\n"
FED = LENGTH + "[output]\nrapids_as_feed = true\n"
TILTED = "RAPID\nGOTO/0,0,50,0,0.5,0.866025404\nGOTO/0,0,5\nGOTO/9,0,5\nRAPID\nGOTO/9,0,50\n"


def edited(code: str, text: str, old: str, new: str, says: str, *does: Edit, machine: str = "mill-3axis",
           control: str = "fanuc-30i", more: str = "", stops: tuple[str, ...] = (), setup: str = LENGTH,
           **files: str) -> HintCase:
    """The program of a CL file with `new` in the place of `old`; without `does` it is put back as it was."""
    on = f"-m {machine} -c {control} --setup s.toml"
    return HintCase(code, f"verify p.nc part.apt -m {machine} -c {'c.toml' if 'c' in files else control} --setup s.toml",
                    {"part.apt": START + text + "FINI\n", "s.toml": setup, **{f"{n}.toml": t for n, t in files.items()}},
                    says, does or (Edit("p.nc", new, old),), first=(f"convert part.apt {on} -o p.nc{more}",),
                    harm=(Edit("p.nc", old, new),), stops=stops)


_EDITED = [
    HintCase("verify.asked", f"verify p.nc part.apt {ON}", {"part.apt": START + CUT + "FINI\n", "s.toml": LENGTH},
             r"take (restart) out of its \[output\]|(convert) again with this set-up",
             (Edit("s.toml", "[output]\nprogram_number = 77\n", ""),), first=(f"convert part.apt {ON} -o p.nc",),
             harm=(Edit("s.toml", LENGTH, LENGTH + "[output]\nprogram_number = 77\n"),)),
    edited("verify.end", CUT, "G53 G0 G49 Z400.\nG53 G0 X0. Y0.\n", "", "retract to home before the end is missing",
           Edit("p.nc", "G05.1 Q0\nM9", "G53 G0 G49 Z400.\nG53 G0 X0. Y0.\nG05.1 Q0\nM9")),
    edited("verify.feed", DOWN, "F44122.6982", "F88000.", "the feed of the slowest axis", setup=FED),
    edited("verify.tap", TAP, "F1000.", "F900.", "feed = pitch times speed"),
    edited("verify.state", LEFT + ARC + "CUTCOM/OFF\nGOTO/-20,20,2\nRAPID\nGOTO/-20,20,20\n",
           "G40\nG1 Y20.\nG0 Z20.", "G1 Y20.\nG0 Z20.\nG40",
           "cancel it before the tool leaves the cut"),
    edited("verify.kind", CUT, "G0 X0. Y0.\nG43 H1 Z67", "G1 X0. Y0. F900.\nG0 G43 H1 Z67", "rapid motion"),
    edited("gcode.unstated", CUT, "G17 ", "", "state (G17).* at the start of the program",
           Edit("p.nc", "G21 G40", r"\1 G21 G40")),
    edited("verify.length_alone", CUT, "G53 G0 G49 Z400.\nG53 G0 X", "G49\nG53 G0 Z400.\nG53 G0 X",
           r"in the one that goes home \((G53 G0 G49) Z\)", Edit("p.nc", "G49\nG53 G0 Z", r"\1 Z")),
    edited("gcode.unstated", TILTED, "G49 Z250.\nG69\n", "G49 Z250.\n", "state (G69) at the start of the program",
           Edit("p.nc", "G21 ", r"\1 G21 "), machine="mikron-ucp710", more=" --output-mode tilted"),
    edited("gcode.unstated", TURNING, "TRAORI\nN140 G54\n", "TRAORI\n", "state the work offset .* again behind it",
           Edit("p.nc", "TRAORI\n", "TRAORI\nG54\n"), machine="mikron-ucp710", control="siemens-840d",
           more=" --output-mode tcp"),
    edited("gcode.plane_pose", TILTED, "G0 A-30. C0.", "G0 A-29. C0.", "index to the position of the plane",
           machine="mikron-ucp710", more=" --output-mode tilted"),
    edited("gcode.tcp_frame", TURNING, "G0 A0. C0.\nX0. Y0.\n", "G0 A0. C10.\nX0. Y0.\n",
           r'(\[modes\.tcp\]) (frame = "table")', Edit("c.toml", "", r"\1\n\2\n"), machine="mikron-ucp710",
           more=" --output-mode tcp", c='base = "fanuc-30i"\n'),
    edited("verify.reach", CUT, "G0 X1160.4949 Y1170.8266 Z1170.8266",
           "G0 X1480 Y1480 Z1480\nX1160.4949 Y1170.8266 Z1170.8266", "put the block back",
           machine="delta-parallel-z",
           control="linuxcnc", setup=LENGTH + "[part]\norigin = [0.0, 0.0, -60.0]\n"),
    HintCase("gcode.plane", "time p.nc -m mikron-ucp710 -c fanuc-30i",
             {"p.nc": ISO.replace("G1 X5.", "G49\nG68.2 X0. Y0. Z0. I180. J170. K-180.\nG53.1\nG69\nG1 X5.")},
             "a plane that the rotary axes reach", (Edit("p.nc", "J170.", "J0."),)),
    HintCase("gcode.frame", "time p.h -m mill-3axis -c heidenhain-tnc640", {"p.h": TNC.replace("5 END PGM A MM\n", "")},
             "write 0 BEGIN PGM NAME MM ... (END PGM) NAME MM", (Edit("p.h", "", r"5 \1 A MM\n"),)),
]
_SPLINES = [
    HintCase("tolerance.splines", f"verify p.nc part.apt {ON} --tolerance 0.01",
             {"part.apt": START + BEGIN + SPLINE + "\nRAPID\nGOTO/3,0,50\nFINI\n", "s.toml": LENGTH},
             "the tolerance of the program: (--tolerance)", (option("--tolerance 0.1", "--tolerance 0.01"),),
             first=(f"convert part.apt {ON} --tolerance 0.1 -o p.nc",)),
]
VERIFY = [*_EDITED, *_SPLINES]
