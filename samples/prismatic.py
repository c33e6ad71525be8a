"""Samples made of planes, pockets and holes: 3-axis, 3+2, four axes, and a plate in inches."""

from __future__ import annotations

import numpy as np
from cltext import (
    APPROACH_COLOR,
    ENGAGE_COLOR,
    RETRACT_COLOR,
    WORLD,
    Cutter,
    Frame,
    NxFile,
    Triple,
    face_frame,
)

Sample = tuple[str, dict[str, object]]


def rounded_loop(nx: NxFile, half: Triple, corner: float, z: float, ccw: bool) -> None:
    """One turn round a rectangle with rounded corners, from and to the middle of its lower side."""
    hx, hy = half
    s = 1.0 if ccw else -1.0
    nx.go([(s * (hx - corner), -hy, z)])
    for (ax, ay), (cx, cy), (bx, by) in (
        ((hx, -hy + corner), (hx - corner, -hy + corner), (hx, hy - corner)),
        ((hx - corner, hy), (hx - corner, hy - corner), (-hx + corner, hy)),
        ((-hx, hy - corner), (-hx + corner, hy - corner), (-hx, -hy + corner)),
        ((-hx + corner, -hy), (-hx + corner, -hy + corner), (0.0, -hy)),
    ):
        nx.arc((s * cx, cy), (s * ax, ay, z), ccw)
        nx.go([(s * bx, by, z)])


def pocket_level(nx: NxFile, top: float, z: float, turns: int) -> None:
    """Helix down to z, then three loops from inside to the wall."""
    nx.feed(400, ENGAGE_COLOR)
    nx.go([(5, 0, top)])
    nx.arc((0, 0), (0, 5, z), ccw=True, turns=turns)
    nx.feed(900)
    for half, corner in (((14, 4), 1), ((19, 9), 1), ((24, 14), 6)):
        nx.go([(0, -half[1], z)])
        rounded_loop(nx, half, corner, z, ccw=True)


def pocket() -> Sample:
    """3-axis part 100 x 80 x 25 mm, origin at the middle of its top."""
    nx = NxFile(("3-axis: pocket with helical entry, contour with arcs of both senses, drilling cycles, two tools.",
                 "Part 100 x 80 x 25 mm, origin at the middle of the top, mm."))
    mill, drill = Cutter(1, "EM12", 12, rpm=5000), Cutter(2, "DR6.8", 6.8, drill_point=118, rpm=2800)
    nx.operation("POCKET", mill)
    nx.rapid((5, 0, 50))
    nx.rapid((5, 0, 3))
    pocket_level(nx, 1, -5, turns=2)
    nx.feed(2000, RETRACT_COLOR)
    nx.go([(0, -10, -4), (5, 0, -4)])
    pocket_level(nx, -4, -10, turns=1)
    nx.feed(2000, RETRACT_COLOR)
    nx.go([(0, -12, -9)])
    nx.rapid((0, -12, 50))
    nx.end()
    contour(nx, mill)
    nx.operation("DRILL_CORNERS", drill)
    nx.rapid((-40, -30, 50))
    nx.rapid((-40, -30, 10))
    nx.holes("DRILL,FEDTO,-12.0000,RAPTO,3.0000,RTRCTO,AUTO,MMPM,220.0000",
             [(-40, -30, 0), (-40, 30, 0), (40, 30, 0), (40, -30, 0)])
    nx.holes("DRILL,DEEP,FEDTO,-10.0000,RAPTO,3.0000,RTRCTO,20.0000,MANUAL,STEP,4.0000,MMPM,180.0000",
             [(12, 0, -10), (-12, 0, -10)])
    nx.rapid((-12, 0, 50))
    nx.end()
    return nx.text(), nx.expected()


def contour(nx: NxFile, mill: Cutter) -> None:
    """Outside of the part, clockwise, quarter circles in and out, 12 mm deep."""
    nx.operation("CONTOUR", mill, load=False)
    nx.rapid((8, -60, 50))
    nx.rapid((8, -60, 3))
    nx.feed(600, APPROACH_COLOR)
    nx.go([(8, -60, -12)])
    nx.feed(500, ENGAGE_COLOR)
    nx.go([(8, -54, -12)])
    nx.arc((0, -54), (0, -46, -12), ccw=True)
    nx.feed(1100)
    rounded_loop(nx, (56, 46), 6, -12, ccw=False)
    nx.feed(1500, RETRACT_COLOR)
    nx.arc((0, -54), (-8, -54, -12), ccw=True)
    nx.go([(-8, -60, -12)])
    nx.rapid((-8, -60, 50))
    nx.end()


PATTERN = ((-10.0, -8.0), (10.0, -8.0), (10.0, 8.0), (-10.0, 8.0))


def drill_by_cycle(nx: NxFile, cycle: str) -> None:
    """Five holes with a cycle, level clearance of 40 and 10 mm over the face."""
    nx.rapid((0, 0, 40))
    nx.rapid((0, 0, 10))
    nx.holes(cycle, [(0, 0, 0), *((x, y, 0) for x, y in PATTERN)])
    nx.rapid((*PATTERN[-1], 40))


def drill_by_moves(nx: NxFile, depth: float) -> None:
    """Four holes with plain moves, as NX does without a cycle."""
    nx.rapid((*PATTERN[0], 40))
    for x, y in PATTERN:
        nx.rapid((x, y, 5))
        nx.feed(150)
        nx.go([(x, y, -depth)])
        nx.feed(1200, RETRACT_COLOR)
        nx.go([(x, y, 5)])
    nx.rapid((*PATTERN[-1], 40))


def drill_faces(nx: NxFile, faces: dict[str, Frame]) -> Sample:
    """Top in absolute axes, two sides in their own MSYS, two with the tool axis in the points."""
    spot, drill = Cutter(1, "SD10", 10, drill_point=90, rpm=3500), Cutter(2, "DR6", 6, drill_point=118, rpm=3200)
    plain = "DRILL,FEDTO,-3.0000,RAPTO,2.0000,RTRCTO,AUTO,MMPM,250.0000"
    deep = "DRILL,DEEP,FEDTO,-15.0000,RAPTO,2.0000,RTRCTO,AUTO,STEP,5.0000,MMPM,180.0000"
    for name, cutter, own, load, cycle in (
        ("TOP", spot, False, True, plain),
        ("XPLUS", drill, True, True, deep),
        ("YPLUS", drill, True, True, ""),
        ("XMINUS", drill, False, False, deep),
        ("YMINUS", drill, False, False, ""),
    ):
        face = faces[name]
        nx.operation(f"DRILL_{name}", cutter, face if own else WORLD, face, load)
        if cycle:
            drill_by_cycle(nx, cycle)
        else:
            drill_by_moves(nx, 12)
        nx.end()
    return nx.text(), nx.expected()


SIDES = {"XPLUS": (1, 0), "YPLUS": (0, 1), "XMINUS": (-1, 0), "YMINUS": (0, -1)}


def five_faces() -> Sample:
    """Block 80 x 60 x 50 mm, origin at the middle of its bottom."""
    nx = NxFile(("3+2: holes in the top and the four sides of a block 80 x 60 x 50 mm, one operation per face.",
                 "X+ and Y+ in their own MSYS, X- and Y- in absolute axes with a modal tool axis.",
                 "No safe move stands between the operations: the post must link them."))
    faces = {name: face_frame((40 * x, 30 * y, 25), (x, y, 0)) for name, (x, y) in SIDES.items()}
    return drill_faces(nx, {"TOP": face_frame((0, 0, 50), (0, 0, 1)), **faces})


def five_tilted() -> Sample:
    """Truncated pyramid with faces at 45 degrees, origin at the middle of its bottom."""
    nx = NxFile(("3+2: as five_faces.cls on a truncated pyramid, sides tilted 45 degrees, with a UNITS record.",),
                units="MM")
    faces = {name: face_frame((38 * x, 32 * y, 28), (x, y, 1)) for name, (x, y) in SIDES.items()}
    return drill_faces(nx, {"TOP": face_frame((0, 0, 45), (0, 0, 1)), **faces})


def slot(nx: NxFile, z: float) -> None:
    """A hook of two half circles and a clockwise quarter on one side of the bar, arcs about the local Z."""
    nx.rapid((-30, -8, 30))
    nx.rapid((-30, -8, 3))
    nx.feed(300, ENGAGE_COLOR)
    nx.go([(-30, -8, z)])
    nx.feed(800)
    nx.go([(-10, -8, z)])
    nx.arc((-10, 0), (-10, 8, z), ccw=True)
    nx.go([(-30, 8, z)])
    nx.arc((-30, 4), (-30, 0, z), ccw=True)
    nx.arc((-30, -4), (-26, -4, z), ccw=False)
    nx.rapid((-26, -4, 30))


def bar_side(angle: float) -> Frame:
    """Side of a 40 mm square bar along X, turned `angle` degrees about X away from the top."""
    a = np.radians(angle)
    return Frame((0, -20 * np.sin(a), 20 * np.cos(a)), (1, 0, 0), (0, np.cos(a), np.sin(a)))


def indexed_4axis() -> Sample:
    """Square bar along X with a round journal; tool axis always in the YZ plane."""
    nx = NxFile(("4-axis: slots and holes on the four sides of a bar along X (3+1), then a wavy line engraved twice",
                 "round its journal with the tool axis turning about X."), decimals=5)
    mill, drill = Cutter(1, "EM6", 6, rpm=8000), Cutter(2, "DR5", 5, drill_point=118, rpm=3800)
    for angle, own in ((0, False), (90, True), (180, True), (270, False)):
        side = bar_side(angle)
        nx.operation(f"SLOT_{angle}", mill, side if own else WORLD, side, load=angle == 0)
        slot(nx, -3)
        nx.end()
    for angle, own in ((0, False), (90, False), (180, True), (270, True)):
        side = bar_side(angle)
        nx.operation(f"DRILL_{angle}", drill, side if own else WORLD, side, load=angle == 0)
        nx.rapid((-50, 0, 30))
        nx.rapid((-50, 0, 8))
        nx.holes("DRILL,FEDTO,-9.0000,RAPTO,2.0000,RTRCTO,AUTO,MMPM,200.0000", [(-50, 0, 0), (5, 0, 0)])
        nx.rapid((5, 0, 30))
        nx.end()
    engrave(nx, Cutter(3, "BALL2", 2, 1, rpm=12000))
    return nx.text(), nx.expected()


def engrave(nx: NxFile, ball: Cutter) -> None:
    """Two turns of x = 40 + 10 sin 3t on the journal of radius 18, 0.3 mm deep, axis radial."""
    t = np.linspace(0, 4 * np.pi, 721)
    axis = np.column_stack((np.zeros_like(t), np.sin(t), np.cos(t)))
    tip = np.column_stack((40 + 10 * np.sin(3 * t), 17.7 * axis[:, 1], 17.7 * axis[:, 2]))
    nx.operation("ENGRAVE", ball)
    nx.rapid((40, 0, 50), axis[0])
    nx.rapid((40, 0, 20))
    nx.feed(200, ENGAGE_COLOR)
    nx.go(tip[:1])
    nx.feed(600)
    nx.go(tip[1:], axis[1:])
    nx.feed(1500, RETRACT_COLOR)
    nx.go([(40, 0, 20)])
    nx.rapid((40, 0, 50))
    nx.end()


INCH_PLATE = """\
$$ Generic APT text in inches: continuation, lower case, odd blanks, GODLTA, feeds per minute and per revolution.
$$ Plate 6 x 4 x 3/4 inch, origin at the middle of the top.
PARTNO INCH PLATE / 6 x 4 x .75, AL
MACHIN / GENERIC, 1
UNITS / INCHES
REMARK face with steps, slot by increments, drill and peck
FROM / 0, 0, 4.
LOADTL / 1
CUTTER / .5, 0, .25, 0, 0, 0, 2.
SPINDL / 3000, RPM,  CLW
COOLNT/FLOOD
RAPID
GOTO / -3.5, -1.5, 1.
rapid
goto/-3.5,-1.5,.1
FEDRAT / 10.0,  IPM
GOTO / -3.5, -1.5, -.05   $$ down next to the plate
FEDRAT / 24., IPM
GOTO  /    3.5000,   -1.5000,   -0.0500
GODLTA / 0, .4, 0
Goto / -3.5 , -1.1 , $
   -.05
godlta/0,.4,0
GOTO / +3.5, -.7, $ $$ a comment behind the mark
   -0.05
GODLTA / 1.
RAPID
GODLTA / 0, 0, 1.05
$$ slot at a feed per revolution
FEDRAT / .004, IPR
RAPID
GOTO / -1, .5, 1.
RAPID
GOTO / -1, .5, .05
GODLTA / -.175
GOTO / 1, .5, -.125
GODLTA / .125
RAPID
GOTO / 1, .5, 2.
COOLNT / OFF
SPINDL / OFF
STOP
LOADTL / 2, OSETNO, 2
CUTTER / .25
SPINDL/1800,RPM,CLW
COOLNT / ON
RAPID
GOTO / -2.5, -1.5, 1
CYCLE / DRILL, DEPTH, .5, IPM, 6., $
        CLEAR, .1
GOTO / -2.5, -1.5, 0
goto/2.5,-1.5,0
GOTO / 2.5, 1.5, 0.
CYCLE / OFF
RAPID
GOTO / 0, 1.25, .5
CYCLE / DEEP, DEPTH, 1., $
        IPR, .003, $
        CLEAR, .1, STEP, .25
GOTO / 0, 1.25, 0
GOTO / -2.5, 1.5, 0
CYCLE/OFF
COOLNT/OFF
SPINDL/OFF
GOHOME / 0, 0, 4.
FINI
"""


def inch_plate() -> Sample:
    """The plate's text with what it holds, counted by hand."""
    inch = 25.4
    extents = {"x": [-3.5 * inch, 3.5 * inch], "y": [-1.5 * inch, 1.5 * inch], "z": [-0.125 * inch, 4 * inch]}
    feed = (0.15 + 7 + 0.4 + 7 + 0.4 + 7 + 1) + (0.175 + 2 + 0.125)
    return INCH_PLATE, {
        "points": 23, "rapids": 8, "arcs": 0, "cycles": 2, "holes": 5, "operations": 1, "starts": 1, "homes": 1,
        "units": "inch", "extents_mm": {c: [round(v, 4) for v in pair] for c, pair in extents.items()},
        "largest_tilt_deg": 0.0, "feed_length_mm": round(feed * inch, 3),
    }
