"""Samples on curved surfaces and with a turning tool axis: blade, bicubic test part, tour of directions."""

from __future__ import annotations

import numpy as np
from cltext import APPROACH_COLOR, ENGAGE_COLOR, RETRACT_COLOR, UP, Cutter, Floats, NxFile, leaning, measures, numbers

Sample = tuple[str, dict[str, object]]

# --- blade --------------------------------------------------------------------------------------------------

FOOT, HEIGHT, TWIST = 14.0, 42.0, np.radians(30)


def turned(x: Floats, y: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Plane vectors turned about z."""
    c, s = np.cos(angle), np.sin(angle)
    return c * x - s * y, s * x + c * y


def blade_surface(phi: Floats, h: Floats) -> tuple[Floats, Floats]:
    """Contact (N, 3) and outward unit normal (N, 3); elliptic sections shrink and twist with height h in [0, 1]."""
    a, b, da, db = 28 - 8 * h, 9 - 4 * h, -8.0, -4.0
    x, y = turned(a * np.cos(phi), b * np.sin(phi), TWIST * h)
    along = np.column_stack((*turned(-a * np.sin(phi), b * np.cos(phi), TWIST * h), np.zeros_like(phi)))
    ux, uy = turned(da * np.cos(phi), db * np.sin(phi), TWIST * h)
    upward = np.column_stack((ux - TWIST * y, uy + TWIST * x, np.full_like(phi, HEIGHT)))
    normal = np.cross(along, upward)
    return (np.column_stack((x, y, FOOT + HEIGHT * h)),
            normal / np.linalg.norm(normal, axis=1, keepdims=True))


def one_turn(count: int) -> Floats:
    """Ellipse parameters of one turn, spaced half by length and half by the turning of the normal."""
    phi = np.linspace(0, 2 * np.pi, 7201)
    x, y = 24 * np.cos(phi), 7 * np.sin(phi)
    length = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    turning = np.unwrap(np.arctan2(24 * np.sin(phi), 7 * np.cos(phi)))
    measure = length / length[-1] + turning / turning[-1]
    return np.asarray(np.interp(np.linspace(0, 2, count, endpoint=False), measure, phi))


def axis_adjacent(normal: Floats, tilt: Floats) -> Floats:
    """Axis (N, 3) leaning `tilt` rad from z towards the normal's level direction."""
    return leaning(tilt, np.arctan2(normal[:, 1], normal[:, 0]))


def ball_tip(contact: Floats, normal: Floats, axis: Floats, radius: float) -> Floats:
    """Tip of a ball cutter: contact + R n - R axis."""
    return contact + radius * (normal - axis)


def blade() -> Sample:
    """Spiral down the blade with a turning axis, then zig-zag on one flank with an axis fixed per pass."""
    nx = NxFile(("5-axis: spiral of 22 turns round a twisted blade, ball cutter 6 mm, axis 15 to 45 degrees from z;",
                 "then zig-zag on the Y+ flank, axis fixed within a pass. Blade foot at z = 14, tip at z = 56 mm."),
                decimals=5)
    ball = Cutter(4, "BALL6", 6, 3, rpm=12000)
    nx.operation("BLADE_SPIRAL", ball)
    turns, per_turn = 22, 120
    phi = (one_turn(per_turn) + 2 * np.pi * np.arange(turns)[:, None]).ravel()
    h = 1 - np.arange(phi.size) / (phi.size - 1)
    contact, normal = blade_surface(phi, h)
    tilt = np.radians(30 + 10 * np.cos(2 * phi) + 5 * np.cos(2 * np.pi * h * 3))
    axis = axis_adjacent(normal, tilt)
    follow(nx, ball_tip(contact, normal, axis, 3), axis, 1500)
    nx.end()
    nx.operation("BLADE_FLANK", ball, load=False)
    flank(nx)
    nx.end()
    return nx.text(), nx.expected()


def follow(nx: NxFile, tip: Floats, axis: Floats, rate: float) -> None:
    """Rapid to 30 and 5 mm along the first axis, engage, cut, and back out along the last axis."""
    nx.rapid(tip[0] + 30 * axis[0], axis[0])
    nx.rapid(tip[0] + 5 * axis[0])
    nx.feed(300, ENGAGE_COLOR)
    nx.go(tip[:1])
    nx.feed(rate)
    nx.go(tip[1:], axis[1:])
    nx.feed(3000, RETRACT_COLOR)
    nx.go([tip[-1] + 5 * axis[-1]])
    nx.rapid(tip[-1] + 30 * axis[-1])


def flank(nx: NxFile) -> None:
    """Fifteen passes between 35 and 145 degrees of the section, the axis leans to +y by 40 to 20 degrees."""
    phi = np.radians(np.linspace(35, 145, 34))
    tips, axes = [], []
    for i, h in enumerate(np.linspace(0.95, 0.05, 15)):
        contact, normal = blade_surface(phi[:: -1 if i % 2 else 1], np.full_like(phi, h))
        lean = np.radians(20 + 20 * h)
        axis = np.tile([0.0, np.sin(lean), np.cos(lean)], (phi.size, 1))
        tips.append(ball_tip(contact, normal, axis, 3))
        axes.append(axis)
    follow(nx, np.concatenate(tips), np.concatenate(axes), 1800)


# --- bicubic test part --------------------------------------------------------------------------------------

CONTROL_HEIGHTS = np.array([[0, 0, 10, 10], [0, 0, 10, 10], [10, 10, 0, 0], [10, 10, 0, 0]], dtype=float)
"""z of the control points (Grandguillaume, Lavernhe, Tournier 2017, eq. 8): rows x = 0, 20, 40, 60, columns y alike."""


def bernstein(t: Floats) -> tuple[Floats, Floats]:
    """Cubic Bernstein polynomials (..., 4) and their derivatives."""
    s = 1 - t
    value = np.stack((s**3, 3 * s * s * t, 3 * s * t * t, t**3), axis=-1)
    slope = np.stack((-3 * s * s, 3 * s * (s - 2 * t), 3 * t * (2 * s - t), 3 * t * t), axis=-1)
    return value, slope


def bicubic_surface(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Point and unit normal (..., 3). Control points are evenly spaced, so x = 60 u and y = 60 v: a graph z(x, y)."""
    (bu, du), (bv, dv) = bernstein(x / 60), bernstein(y / 60)
    z, zx, zy = (np.einsum("...i,ij,...j", p, CONTROL_HEIGHTS, q) for p, q in ((bu, bv), (du, bv), (bu, dv)))
    normal = np.stack((-zx / 60, -zy / 60, np.ones_like(z)), axis=-1)
    return np.stack((x, y, z), axis=-1), normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def ball_centers(x: Floats, y: Floats, radius: float) -> Floats:
    """Ball centres that stand over the given x, y: the contact is found by fixed-point steps (R x curvature < 0.2)."""
    contact_x, contact_y = x, y
    for _ in range(60):
        _, n = bicubic_surface(contact_x, contact_y)
        contact_x, contact_y = x - radius * n[..., 0], y - radius * n[..., 1]
    point, n = bicubic_surface(contact_x, contact_y)
    return np.asarray(point + radius * n)


def bicubic() -> Sample:
    """Planes Xp = 0, 1, ... 60 of the ball centre, y from 0 to 60, all in the same direction."""
    nx = NxFile(("Bicubic test part, 60 x 60 x 10 mm, of Grandguillaume, Lavernhe, Tournier (2017): ball cutter 16 mm,",
                 "parallel planes Xp = 0, 1, ... 60. The ball centre (and so the tip, axis = z) keeps the plane Xp;",
                 "the contact point leaves it where the surface slopes in x. One way, along +y."), decimals=6)
    ball = Cutter(5, "BALL16", 16, 8, rpm=9000)
    nx.operation("PLANES", ball)
    steps = np.arange(61.0)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    for tip in ball_centers(x, y, 8.0) - [0.0, 0.0, 8.0]:
        nx.rapid((tip[0, 0], 0, 30))
        nx.rapid((tip[0, 0], 0, tip[0, 2] + 3))
        nx.feed(1000, APPROACH_COLOR)
        nx.go(tip[:1])
        nx.feed(5000)
        nx.go(tip[1:])
        nx.rapid((tip[0, 0], 60, 30))
    nx.end()
    return nx.text(), nx.expected()


# --- tour of tool directions --------------------------------------------------------------------------------


def leg(start: tuple[float, float], end: tuple[float, float], count: int) -> Floats:
    """`count` tool directions (tilt, azimuth) in degrees after `start` up to `end`, evenly spaced."""
    return np.column_stack([np.linspace(a, b, count + 1)[1:] for a, b in zip(start, end, strict=True)])


def tour_directions() -> Floats:
    """(N, 2) tilt and azimuth in degrees; a negative tilt is past the pole."""
    legs = [leg((0, 0), (45, 0), 9), leg((45, 0), (45, 360), 36), leg((45, 0), (60, 90), 9),
            leg((60, 90), (-60, 90), 16), leg((60, 270), (20, 200), 8), np.tile([20.0, 200.0], (5, 1))]
    return np.concatenate(([[0.0, 0.0]], *legs))


def near_pole() -> Floats:
    """Directions (N, 3) on a straight path past the pole, 0.5 degrees next to it."""
    along, adjacent = np.tan(np.radians(np.linspace(20, -30, 15))), np.tan(np.radians(0.5))
    v = np.column_stack((along, np.full_like(along, adjacent), np.ones_like(along)))
    turn = np.radians(200)
    v[:, 0], v[:, 1] = turned(v[:, 0], v[:, 1], np.full_like(along, turn))
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


def tour() -> Sample:
    """Short 5-axis path in free space: round a cone, to 60 degrees, through the pole, past it, fixed axis, home."""
    tilt, azimuth = np.radians(tour_directions()).T
    axis = np.concatenate((leaning(tilt, azimuth), near_pole(), [UP]))
    t = np.linspace(0, 1, len(axis))
    tip = np.column_stack((50 * np.sin(2 * np.pi * t), 40 * np.sin(4 * np.pi * t), 20 + 15 * np.cos(2 * np.pi * t)))
    rows = [f"GOTO / {numbers(p, 5)}, {numbers(a, 9)}" for p, a in zip(tip, axis, strict=True)]
    head = ["$$ 5-axis tour of tool directions in free space: cone, 60 degrees of tilt, through the pole, 0.5 degrees",
            "$$ next to it, fixed axis. Short enough to simulate; tip within 60 mm of the origin in each coordinate.",
            "PARTNO TOOL AXIS TOUR", "UNITS / MM", "LOADTL / 1", "CUTTER / 6., 3.", "SPINDL / 5000, RPM, CLW",
            "MULTAX / ON", "RAPID", rows[0], "FEDRAT / 1500., MMPM"]
    expected = {"points": len(rows), "rapids": 1, "arcs": 0, "cycles": 0, "holes": 0, "operations": 1, "starts": 0,
                "homes": 0, "units": "mm", **measures(tip, axis),
                "feed_length_mm": round(float(np.linalg.norm(np.diff(tip, axis=0), axis=1).sum()), 3)}
    return "\n".join([*head, *rows[1:], "SPINDL / OFF", "FINI"]) + "\n", expected
