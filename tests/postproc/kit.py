"""What the tests of this room share: small CL texts, an own G-code executor, own serial kinematics.

Nothing here uses the code under test: programs are executed word by word in plain Python, tool positions come from
homogeneous matrices in the order of the machine's ISO 10791-6 code with the numbers of its machine file typed again.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

import machines
import postproc
import toolpaths
from postproc.pipeline import PostResult
from postproc.setup import SetupFile, load_setup
from toolpaths.diagnostics import has_errors
from toolpaths.toolpath import Toolpath

SAMPLES = Path(__file__).parents[2] / "samples"
TOOLS = SAMPLES / "tools.setup.toml"
HEAD = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]


def toolpath(*lines: str, head: list[str] | None = None) -> Toolpath:
    """The Toolpath of CL lines after a usual beginning; a fault of the text fails the test."""
    path, found = toolpaths.read_bytes("\n".join([*(HEAD if head is None else head), *lines, "FINI"]), file="test.apt")
    assert not has_errors(found), [str(d) for d in found]
    return path


def goto(tip: np.ndarray, axis: np.ndarray | None = None) -> list[str]:
    """GOTO records of tips (N, 3) and axes (N, 3), 12 decimals."""
    rows = np.asarray(tip) if axis is None else np.hstack([tip, axis])
    return ["GOTO/" + ",".join(f"{v:.12f}" for v in row) for row in rows]


@cache
def machine(name: str) -> machines.machine.Machine:
    return machines.load(name)


@cache
def tool_setup() -> SetupFile:
    setup, found = load_setup(TOOLS)
    assert setup is not None and not found
    return setup


def convert(path: Toolpath, name: str, controller: str | Path = "linuxcnc", setup: SetupFile | None = None,
            **options: object) -> PostResult:
    return postproc.convert(path, machine(name), controller=controller, setup=setup or tool_setup(),
                            options=postproc.Options(**options))


def good(result: PostResult) -> PostResult:
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


@cache
def sample(file: str, name: str, controller: str = "linuxcnc") -> PostResult:
    """A sample converted with the gauge lengths of its set-up."""
    path, _ = toolpaths.read(SAMPLES / file)
    return good(convert(path, name, controller))


def codes(diagnostics: object) -> set[str]:
    return {d.code for d in diagnostics}


def body(text: str) -> list[str]:
    """The blocks between the first tool change and the end, without comments."""
    lines = [n for n in text.splitlines() if not n.startswith(("(", "%"))]
    first = next(i for i, n in enumerate(lines) if "M6" in n)
    last = max(i for i, n in enumerate(lines) if n in ("M5 M9", "M5"))
    return lines[first:last]


# ---- executor ----------------------------------------------------------------------------------------------------


@dataclass
class Step:
    """One elementary motion: line, kind ("rapid", "feed", "arc"), end (J,) machine mm/deg, dense points (K, J)."""

    line: int
    kind: str
    end: np.ndarray
    points: np.ndarray
    feed: float
    inverse: bool
    tool: int
    register: int
    spindle: int
    coolant: bool
    level: float = math.nan


@dataclass
class Peer:
    """A modal executor of RS274/NGC as its manual tells it (sections 3.5, 3.5.16, 3.7), one block after the other."""

    letters: tuple[str, ...]
    work: np.ndarray
    lengths: dict[int, float]
    home: np.ndarray
    on_z: bool = True
    steps: list[Step] = field(default_factory=list)

    def run(self, text: str, dense: int = 20) -> list[Step]:
        at = self.home.astype(float).copy()
        z = self.letters.index("Z")
        plane, motion, inverse, feed, scale = 17, None, False, math.nan, 1.0
        tool = picked = 0
        register, spindle, coolant, retract = -1, 0, False, 98
        sticky: dict[str, float] = {}
        initial = math.nan
        cycling = False
        for number, raw in enumerate(text.splitlines(), 1):
            block = re.sub(r"\([^()]*\)|;.*", "", raw).strip().upper()
            if not block or block.startswith("%"):
                continue
            found = re.findall(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))", block)
            assert "".join(a + b for a, b in found) == re.sub(r"\s", "", block), f"line {number}: {raw!r}"
            gs = [float(v) for a, v in found if a == "G"]
            ms = [int(v) for a, v in found if a == "M"]
            words = {a: float(v) for a, v in found if a not in "GMN"}
            assert len(words) == sum(a not in "GMN" for a, _ in found), f"line {number}: a word twice"
            once, new_motion = None, None
            for g in gs:
                if g in (17, 18, 19):
                    plane = int(g)
                elif g in (93, 94):
                    if inverse != (g == 93):
                        feed = math.nan
                    inverse = g == 93
                elif g in (20, 21):
                    scale = 25.4 if g == 20 else 1.0
                elif g in (98, 99):
                    retract = int(g)
                elif g == 43:
                    register = int(words["H"])
                elif g == 49:
                    register = -1
                elif g in (4, 53):
                    once = int(g)
                elif g in (0, 1, 2, 3, 73, 80, 81, 82, 83, 84, 85, 89):
                    assert new_motion is None, f"line {number}: two motions"
                    new_motion = int(g)
                else:
                    assert g in (40, 54, 64, 90), f"line {number}: G{g:g}"
            if "T" in words:
                picked = int(words["T"])
            for m in ms:
                if m == 6:
                    tool = picked
                spindle = {3: 1, 4: -1, 5: 0}.get(m, spindle)
                coolant = {7: True, 8: True, 9: False}.get(m, coolant)
            if new_motion is not None:
                if new_motion != motion:
                    sticky = {}
                if new_motion < 73 or new_motion == 80:
                    cycling = False
                motion = new_motion
            stated = [a for a in self.letters if a in words]
            if "F" in words:
                feed = words["F"]
            if once == 4 or not (stated or any(k in words for k in "IJK")):
                continue
            assert motion not in (None, 80), f"line {number}: axis words without a motion code"
            shift = self.work.copy()
            if self.on_z and register >= 0:
                shift[z] += self.lengths.get(register, 0.0)
            target = at.copy()
            for a in stated:
                j = self.letters.index(a)
                unit = scale if a in "XYZ" else 1.0
                target[j] = words[a] * unit + (0.0 if once == 53 else shift[j])
            state = (feed, inverse, tool, register, spindle, coolant)
            if inverse and motion in (1, 2, 3):
                assert "F" in words, f"line {number}: no F with inverse time"
            if motion >= 73:
                assert not inverse, f"line {number}: a cycle under inverse time"
                first = not cycling
                if first:
                    initial, sticky = at[z], {}
                cycling = True
                sticky |= {k: words[k] for k in "ZRQP" if k in words}
                at = self._cycle(number, motion, at, target, sticky, z, shift[z], scale, initial, retract, state, first)
                continue
            kind = {0: "rapid", 1: "feed"}.get(motion, "arc")
            t = np.linspace(0.0, 1.0, dense + 1)[1:, None]
            points = at + t * (target - at)
            if kind == "arc":
                points = self._arc(at, target, words, plane, motion == 3, scale, dense)
            self.steps.append(Step(number, kind, target, points, *state))
            at = target
        return self.steps

    def _arc(self, at: np.ndarray, target: np.ndarray, words: dict[str, float], plane: int, ccw: bool, scale: float,
             dense: int) -> np.ndarray:
        """Dense points of an arc; the radius may differ between the ends by what rounding explains."""
        first, second = {17: "XY", 18: "ZX", 19: "YZ"}[plane]
        a, b = self.letters.index(first), self.letters.index(second)
        offset = {"X": "I", "Y": "J", "Z": "K"}
        center = np.array([at[a], at[b]]) + scale * np.array([words.get(offset[first], 0.0), words.get(offset[second], 0.0)])
        p, q = np.array([at[a], at[b]]) - center, np.array([target[a], target[b]]) - center
        assert abs(np.hypot(*p) - np.hypot(*q)) < 0.002, "radius differs between start and end"
        begin, end = math.atan2(p[1], p[0]), math.atan2(q[1], q[0])
        turn = (end - begin) % (2 * math.pi) if ccw else -((begin - end) % (2 * math.pi))
        if abs(turn) < 1e-12:
            turn = 2 * math.pi if ccw else -2 * math.pi
        t = np.linspace(0.0, 1.0, 4 * dense + 1)[1:]
        points = at + t[:, None] * (target - at)
        radius = np.hypot(*p) * (1 - t) + np.hypot(*q) * t
        points[:, a] = center[0] + radius * np.cos(begin + t * turn)
        points[:, b] = center[1] + radius * np.sin(begin + t * turn)
        return points

    def _cycle(self, number: int, code: int, at: np.ndarray, target: np.ndarray, sticky: dict[str, float], z: int,
               shift: float, scale: float, initial: float, retract: int, state: tuple, first: bool) -> np.ndarray:
        """LinuxCNC rises to R where it stands at the first hole of a sequence only; later ones it goes to aslant."""
        bottom, plane = sticky["Z"] * scale + shift, sticky["R"] * scale + shift
        over = target.copy()
        legs: list[tuple[str, np.ndarray]] = []

        def leg(kind: str, base: np.ndarray, height: float) -> None:
            point = base.copy()
            point[z] = height
            legs.append((kind, point))

        if at[z] < plane and first:
            leg("rapid", at, plane)
        leg("rapid", over, max(at[z], plane))
        leg("rapid", over, plane)
        if code in (73, 83):
            assert sticky["Q"] > 0
            depth = plane - sticky["Q"] * scale
            while depth > bottom + 1e-9:
                leg("feed", over, depth)
                if code == 83:
                    leg("rapid", over, plane)
                leg("rapid", over, depth + 0.254)
                depth -= sticky["Q"] * scale
        leg("feed", over, bottom)
        if code in (84, 85, 89):
            leg("feed", over, plane)
        leg("rapid", over, max(initial, plane) if retract == 98 else plane)
        for kind, point in legs:
            if not (point == at).all():
                t = np.linspace(0.0, 1.0, 11)[1:, None]
                self.steps.append(Step(number, kind, point, at + t * (point - at), *state, level=bottom))
                at = point
        return at


def execute(result: PostResult, text: str | None = None) -> list[Step]:
    """The steps of a conversion's text, with the offsets that its set-up tells the operator to enter."""
    job, m = result.job, result.machine
    assert job is not None
    lengths = {int(k): v.gauge_length for k, v in result.setup.tools.items()}
    unit = np.where(np.array(m.rotary), 180.0 / math.pi, 1.0)
    peer = Peer(m.axis_names, np.asarray(job.control.work_offset), lengths, m.home * unit, job.control.length_on_z)
    return peer.run(result.text if text is None else text)


# ---- own kinematics ----------------------------------------------------------------------------------------------

_CHAINS: dict[str, list[tuple[str, tuple[float, float, float], tuple[float, float, float]]]] = {
    "mill-3axis": [("X", (1, 0, 0), (0, 0, 0)), ("Y", (0, 1, 0), (0, 0, 0)), ("Z", (0, 0, 1), (0, 0, 0))],
    "mill-4axis": [("A", (1, 0, 0), (0, 0, 0)), ("X", (1, 0, 0), (0, 0, 0)), ("Y", (0, 1, 0), (0, 0, 0)),
                   ("Z", (0, 0, 1), (0, 0, 0))],
    "mikron-ucp710": [("C", (0, 0, 1), (0, 0, 0)), ("A", (1, 0, 0), (0, 0, 0)), ("X", (1, 0, 0), (0, 0, 0)),
                      ("Y", (0, 1, 0), (0, 0, 0)), ("Z", (0, 0, 1), (0, 0, 0))],
    "trunnion-bc": [("C", (0, 0, 1), (0, 0, 0)), ("B", (0, 1, 0), (-25, 0, -50)), ("X", (1, 0, 0), (0, 0, 0)),
                    ("Y", (0, 1, 0), (0, 0, 0)), ("Z", (0, 0, 1), (0, 0, 0))],
    "head-table": [("C", (0, 0, 1), (0, 0, 0)), ("X", (1, 0, 0), (0, 0, 0)), ("Y", (0, 1, 0), (0, 0, 0)),
                   ("Z", (0, 0, 1), (0, 0, 0)), ("B", (0, 1, 0), (0, 0, 180))],
    "fork-head-ab": [("X", (1, 0, 0), (0, 0, 0)), ("Y", (0, 1, 0), (0, 0, 0)), ("Z", (0, 0, 1), (0, 0, 0)),
                     ("B", (0, 1, 0), (0, 0, 280)), ("A", (1, 0, 0), (0, 0, 250))],
}


def pose_of(name: str, positions: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """(tip, axis) (N, 3) in the table frame of machine positions (N, J), mm and degrees."""
    at = dict(zip(machine(name).axis_names, np.asarray(positions, dtype=float).T, strict=True))
    matrix = np.tile(np.eye(4), (len(positions), 1, 1))
    for letter, direction, point in _CHAINS[name]:
        d, p = np.array(direction, dtype=float), np.array(point, dtype=float)
        step = np.tile(np.eye(4), (len(positions), 1, 1))
        if letter in "XYZ":
            step[:, :3, 3] = at[letter][:, None] * d
        else:
            a = np.radians(at[letter])[:, None, None]
            k = np.array([[0, -d[2], d[1]], [d[2], 0, -d[0]], [-d[1], d[0], 0]])
            step[:, :3, :3] = np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * (k @ k)
            step[:, :3, 3] = p - step[:, :3, :3] @ p
        matrix = matrix @ step
    return matrix[:, :3, 3] - length * matrix[:, :3, 2], matrix[:, :3, 2]


def tool_poses(result: PostResult, steps: list[Step]) -> list[tuple[np.ndarray, np.ndarray]]:
    """(tip, axis) at the dense points of every step, with the tool that is in the spindle."""
    tools = {int(k): v.gauge_length for k, v in result.setup.tools.items()}
    return [pose_of(result.machine.name, s.points, tools.get(s.tool, 0.0)) for s in steps]


# ---- own geometry ------------------------------------------------------------------------------------------------


def unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v, dtype=float) / np.linalg.norm(v, axis=-1, keepdims=True)


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle (N,) rad between unit vectors."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))


def great_circle(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Unit vectors (T, 3) at fractions t of the way from a to b (3,): a turned about a x b."""
    normal = np.cross(a, b)
    size = np.linalg.norm(normal)
    if size < 1e-12:
        return np.tile(a, (len(t), 1))
    across = np.cross(normal / size, a)
    theta = t[:, None] * math.atan2(size, a @ b)
    return np.cos(theta) * a + np.sin(theta) * across


def tilted(theta: float, phi: float) -> np.ndarray:
    """Unit vector at theta degrees from z in the direction phi degrees."""
    a, b = math.radians(theta), math.radians(phi)
    return np.array([math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a)])
