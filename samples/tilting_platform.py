"""Samples that tilt the tool by 30 degrees at most, for machines with a tilting platform: dome, and faces at a slope."""

from __future__ import annotations

import numpy as np
from cltext import ENGAGE_COLOR, RETRACT_COLOR, WORLD, Cutter, Floats, Frame, NxFile, face_frame
from surfaces import Sample, ball_tip, follow

# --- dome ---------------------------------------------------------------------------------------------------

TOP = 14.0
CURVATURE = np.array([1 / 48.0, 1 / 75.0])
"""1/mm along x and y at the top"""
RIM = 22.0
LEAD = np.radians(4)


def dome_surface(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Contact (N, 3) and unit normal (N, 3) of z = TOP - (kx x^2 + ky y^2) / 2: two curvatures, one round top."""
    kx, ky = CURVATURE
    contact = np.column_stack((x, y, TOP - 0.5 * (kx * x * x + ky * y * y)))
    normal = np.column_stack((kx * x, ky * y, np.ones_like(x)))
    return contact, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def led(normal: Floats, heading: Floats, angle: float) -> Floats:
    """Normals (N, 3) leaned by `angle` rad towards the level directions `heading` (N, 3)."""
    along = heading - np.sum(heading * normal, axis=1, keepdims=True) * normal
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(np.cos(angle) * normal + np.sin(angle) * along)


def h4a_dome() -> Sample:
    """Spiral up the dome with the axis leaning outwards, then level passes along x with the axis on the normal."""
    nx = NxFile(("5-axis: dome of two curvatures, ball cutter 8 mm, tool axis at most 30 degrees from z: a spiral from",
                 "the rim to the top, axis 4 degrees off the normal, then passes along x with the axis on the normal,",
                 "one of them straight over the top, where the tool stands along z. Top at z = 14 mm."), decimals=5)
    ball = Cutter(4, "BALL8", 8, 4, rpm=10000)
    nx.operation("DOME_SPIRAL", ball)
    t = np.linspace(0, 1, 8 * 60 + 1)
    phi, r = 2 * np.pi * 8 * t, RIM - (RIM - 2) * t
    contact, normal = dome_surface(r * np.cos(phi), r * np.sin(phi))
    axis = led(normal, np.column_stack((np.cos(phi), np.sin(phi), 0 * phi)), LEAD)
    follow(nx, ball_tip(contact, normal, axis, 4), axis, 1200)
    nx.end()
    nx.operation("DOME_PASSES", ball, load=False)
    tips, axes = [], []
    for k, y in enumerate(np.linspace(-18, 18, 13)):
        x = np.linspace(-RIM, RIM, 23)[:: -1 if k % 2 else 1]
        contact, normal = dome_surface(x, np.full_like(x, y))
        tips.append(ball_tip(contact, normal, normal, 4))
        axes.append(normal)
    follow(nx, np.concatenate(tips), np.concatenate(axes), 1500)
    nx.end()
    return nx.text(), nx.expected()


# --- sloping faces ------------------------------------------------------------------------------------------

SLOPES = {"XPLUS": (0, 20), "YPLUS": (90, 25), "XMINUS": (180, 30), "YMINUS": (270, 25)}
"""direction and tilt of each face, degrees"""


def sloping_face(direction: float, tilt: float) -> Frame:
    """Face 26 mm from the middle, 18 mm high."""
    a, b = np.radians((direction, tilt))
    return face_frame((26 * np.cos(a), 26 * np.sin(a), 18),
                      (np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)))


def small_pocket(nx: NxFile) -> None:
    """Round pocket: down the middle, out, one full turn, back."""
    nx.rapid((0, 0, 30))
    nx.rapid((0, 0, 3))
    nx.feed(300, ENGAGE_COLOR)
    nx.go([(0, 0, -3)])
    nx.feed(700)
    nx.go([(5, 0, -3)])
    nx.arc((0, 0), (-5, 0, -3), ccw=True)
    nx.arc((0, 0), (5, 0, -3), ccw=True)
    nx.feed(1500, RETRACT_COLOR)
    nx.go([(0, 0, -2)])
    nx.rapid((0, 0, 30))


def h4a_indexed() -> Sample:
    """Round pocket and two holes on each of four faces, 20 to 30 degrees of slope."""
    nx = NxFile(("3+2: round pocket and two holes on each of four faces that slope by 20, 25, 30 and 25 degrees;",
                 "two faces in their own MSYS, two in absolute axes. Origin at the middle of the bottom, mm."), decimals=5)
    mill, drill = Cutter(1, "EM6", 6, rpm=8000), Cutter(2, "DR5", 5, drill_point=118, rpm=3800)
    faces = {name: sloping_face(*slope) for name, slope in SLOPES.items()}
    own = {"XPLUS": True, "YPLUS": False, "XMINUS": True, "YMINUS": False}
    for name, face in faces.items():
        nx.operation(f"POCKET_{name}", mill, face if own[name] else WORLD, face, load=name == "XPLUS")
        small_pocket(nx)
        nx.end()
    for name, face in faces.items():
        nx.operation(f"DRILL_{name}", drill, face if own[name] else WORLD, face, load=name == "XPLUS")
        nx.rapid((-8, 11, 30))
        nx.rapid((-8, 11, 8))
        nx.holes("DRILL,FEDTO,-9.0000,RAPTO,2.0000,RTRCTO,AUTO,MMPM,200.0000", [(-8, 11, 0), (8, 11, 0)])
        nx.rapid((8, 11, 30))
        nx.end()
    return nx.text(), nx.expected()
