"""Hints of `setup align`: readings of a part that is not where it was meant."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase
from tests.hints.convert_cases import CUT, LENGTH, START

HEAD = "x [mm],y [mm],z [mm],nx,ny,nz,X [mm],Y [mm],Z [mm]\n"
TOP = ((-40, -30), (40, -30), (0, 35), (30, 30))
EDGES = ("-50,-20,-5,-1,0,0,-49.9,-20,-5\n", "-50,30,-5,-1,0,0,-49.9,30,-5\n", "-30,-40,-5,0,-1,0,-30,-40.2,-5\n")
SPARE = "40,-40,-5,0,-1,0,40,-40.2,-5\n"


def plane(off: tuple[float, ...] = (0.003, -0.004, 0.003, -0.002), lean: float = 0.0) -> str:
    """Four points of the top, 0.05 mm high, with deviations, leaning by `lean` mm per mm along x."""
    return "".join(f"{x},{y},0,0,0,1,{x},{y},{0.05 + d + lean * x:g}\n" for (x, y), d in zip(TOP, off, strict=True))


THREE = "".join(plane().splitlines(keepends=True)[:3])
WHOLE = HEAD + plane() + "".join(EDGES) + SPARE


def readings(code: str, text: str, says: str, *does: Edit, machine: str = "mill-3axis", more: str = "",
             stops: tuple[str, ...] = ()) -> HintCase:
    """Readings in r.csv; the edit is of that file where it names none."""
    return HintCase(code, f"setup align r.csv part.apt -m {machine} -c fanuc-30i --setup s.toml -o new.toml{more}",
                    {"r.csv": text, "part.apt": START + CUT + "FINI\n", "s.toml": LENGTH}, says, does, stops=stops)


def csv(old: str, new: str) -> Edit:
    """An edit of the readings."""
    return Edit("r.csv", old, new)


ALIGN = [
    readings("align.cell", WHOLE.replace("-40.2,-5\n", "-40.2,\n", 1), "state all three coordinates",
             csv("-40.2,\n", "-40.2,-5\n")),
    readings("align.column", WHOLE.replace("Z [mm]", "W [mm]", 1), r"(X \[mm\], Y \[mm\], Z \[mm\])",
             csv("W [mm]", "Z [mm]")),
    readings("align.unit", WHOLE.replace("X [mm]", "X [deg]"), r"write the header as .*(X \[mm\]), Y",
             csv("X [deg]", r"\1")),
    readings("align.twice", WHOLE + SPARE, "take the copy out", csv(SPARE + SPARE, SPARE)),
    readings("align.undetermined", HEAD + "0,0,0,0.6,0,0.8,0,0,0.05\n", "touch three points of a plane",
             csv("0,0,0,0.6,0,0.8,0,0,0.05\n", plane())),
    readings("align.open", HEAD + plane(), "touch points that say it", csv("", "".join(EDGES) + SPARE)),
    readings("align.no_spare", HEAD + THREE + "".join(EDGES), "touch one or two points more",
             csv("", SPARE)),
    readings("align.noise", WHOLE, r"\((--sigma-um)\)", Edit(COMMAND, "1000", "4"), more=" --sigma-um 1000",
             stops=()),
    readings("align.uncertain", WHOLE, "each several times", Edit(COMMAND, "--sigma-um 40", "--sigma-um 2"),
             more=" --sigma-um 40"),
    readings("align.tilt", HEAD + plane(lean=0.0008) + "".join(EDGES) + SPARE, "or give (--axis-tolerance [0-9.]+),",
             Edit(COMMAND, "", r" \1")),
    readings("align.tilt", HEAD + plane(lean=0.005) + "".join(EDGES) + SPARE, "shim it",
             csv(plane(lean=0.005), plane())),
]
