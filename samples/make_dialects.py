"""Write one path as six systems spell it, in mm and in inches: python samples/make_dialects.py [FOLDER].

Pocket with arcs of both senses, a helix of a quarter and one of a whole turn; holes drilled and pecked with a
second tool; a tilted face in a frame of its own; a cut that turns the tool axis. The inch files hold what a
3-axis machine can take (the first two operations).
"""

from __future__ import annotations

import sys
from pathlib import Path

from cltext import WORLD, Frame
from spellings import Creo, Nx, Operation, Spelling, Tool
from spellings_apt import Catia, Clt, Ncl, SolidWorks

MILL, DRILL = Tool(1, "MILL_10", 10.0), Tool(2, "DRILL_6.8", 6.8, tip=118.0)
FACE = Frame((50.0, 0.0, 0.0), (0.8, 0.0, -0.6), (0.0, 1.0, 0.0))
TILTED = (0.6, 0.0, 0.8)
SYSTEMS: dict[str, type[Spelling]] = {
    "nx.cls": Nx, "creo.ncl": Creo, "solidworks.apt": SolidWorks, "solidworks.clt": Clt, "catia.aptsource": Catia,
    "ncl.as": Ncl}


def pocket(f: Spelling) -> None:
    """Arcs of both senses, helices, two feeds."""
    f.begin(Operation("POCKET", MILL, WORLD, 3000))
    f.rapid((10, 0, 50))
    f.rapid((10, 0, 2))
    f.feed(250)
    f.go((10, 0, -3))
    f.arc((0, 0, -3), (0, 10, -3), ccw=True)
    f.arc((0, 5, -3), (0, 0, -3), ccw=False)
    f.feed(600)
    f.go((20, 0, -3))
    f.arc((20, 5, -3), (25, 5, -5), ccw=True)
    f.arc((20, 5, -5), (25, 5, -8), ccw=True, turns=1)
    f.arc((25, 0, -8), (20, 0, -8), ccw=False, turns=0)
    f.rapid((20, 0, 50))
    f.end()


def holes(f: Spelling) -> None:
    """Two holes drilled, two pecked."""
    f.begin(Operation("HOLES", DRILL, WORLD, 1500))
    f.rapid((30, 5, 50))
    f.cycle(12, clear=3, back=20, rate=120)
    f.go((30, 5, 0))
    f.go((40, 5, 0))
    f.cycle_off()
    f.rapid((30, -5, 50))
    f.cycle(12, clear=3, back=20, rate=100, step=4)
    f.go((30, -5, 0))
    f.go((40, -5, 0))
    f.cycle_off()
    f.rapid((40, -5, 50))
    f.end()


def face(f: Spelling) -> None:
    """A slot and half a circle on a tilted face."""
    f.begin(Operation("FACE", MILL, FACE, 3000))
    n = TILTED
    f.rapid(FACE.point_out((0, 0, 50)), n)
    f.rapid(FACE.point_out((0, 0, 2)), n)
    f.feed(250)
    f.go(FACE.point_out((0, 0, -1)), n)
    f.feed(600)
    f.go(FACE.point_out((10, 0, -1)), n)
    f.arc(FACE.point_out((10, 5, -1)), FACE.point_out((10, 10, -1)), ccw=True)
    f.go(FACE.point_out((0, 10, -1)), n)
    f.rapid(FACE.point_out((0, 10, 50)), n)
    f.end()


def turning_axis(f: Spelling) -> None:
    """The tool axis turns while it cuts."""
    f.begin(Operation("TILT", MILL, WORLD, 3000))
    f.rapid((20, 0, 50))
    f.feed(600)
    f.go((20, 0, 5))
    f.go((25, 0, 5), TILTED)
    f.rapid((30, 0, 50), TILTED)
    f.end()


def texts() -> dict[str, str]:
    """Every file by its name."""
    found: dict[str, str] = {}
    for name, system in SYSTEMS.items():
        for unit in ("MM", "INCH"):
            f = system(unit)
            pocket(f)
            holes(f)
            if unit == "MM":
                face(f)
            if unit == "MM" and system is not Clt:
                turning_axis(f)
            f.close()
            found[name if unit == "MM" else f"inch_{name}"] = f.text()
    return found


def main(folder: Path) -> None:
    """Write all into `folder`/dialects."""
    (folder / "dialects").mkdir(exist_ok=True)
    for name, text in texts().items():
        (folder / "dialects" / name).write_bytes(text.encode("ascii"))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
