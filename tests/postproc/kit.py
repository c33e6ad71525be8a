"""What the tests of this room share: small CL texts, an own G-code executor, own serial kinematics.

Nothing here uses the code under test: programs are executed word by word in plain Python, tool positions come from
homogeneous matrices in the order of the machine's ISO 10791-6 code with the numbers of its machine file typed again.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import machines
import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile, load_setup
from tests.margins import looked_at
from tests.postproc.plain_executor import Peer, Step
from toolpaths.diagnostics import has_errors
from toolpaths.toolpath import Toolpath

SAMPLES = Path(__file__).parents[2] / "samples"
TOOLS = SAMPLES / "tools.setup.toml"
HEAD = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]
NX = ["TOOL PATH/A,TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW"]
"""how a file of NX begins, behind its units"""


def toolpath(*lines: str, head: list[str] | None = None) -> Toolpath:
    """The Toolpath of CL lines after a usual beginning; a fault of the text fails the test."""
    path, found = toolpaths.read_bytes("\n".join([*(HEAD if head is None else head), *lines, "FINI"]),
                                       file="test.apt")
    assert not has_errors(found), [str(d) for d in found]
    return path


SIDES = {"five_faces.cls": (0, 1, 2), "five_tilted.cls": (0, 1, 2), "h4a_indexed.cls": (0, 1, 4, 5),
         "h4a_dome.cls": (0,), "indexed_4axis.cls": (0, 1, 4, 5, 8)}
"""operations of samples with many sides alike that show each kind of work"""
LINES = {"h4a_dome.cls": 160, "blade.cls": 300, "bicubic.cls": 400, "indexed_4axis.cls": 300}
"""lines of samples with many points alike"""


def few_lines(name: str, sides: Sequence[int] | None = None, lines: int = 0) -> str:
    """The text of `few_sides`, or with other operations."""
    head, *operations = re.split(r"(?m)^(?=TOOL PATH/)", (SAMPLES / name).read_text())
    if sides and "LOAD/TOOL" not in operations[sides[0]]:
        load = re.findall(r"LOAD/TOOL.*\n", "".join(operations[:sides[0]]))[-1]
        operations[sides[0]] = operations[sides[0]].replace("SPINDL/", f"{load}SPINDL/", 1)
    text = (head + "".join(operations[k] for k in sides or SIDES.get(name, range(len(operations))))).splitlines()
    most = lines or LINES.get(name, len(text))
    return "\n".join(text if len(text) <= most else [*text[:most], "FINI"]) + "\n"


@cache
def few_sides(name: str, sides: tuple[int, ...] | None = None, lines: int = 0) -> Toolpath:
    """A CL sample, of those with many sides alike some `SIDES` under their own head, of long ones as many `LINES`."""
    path, found = toolpaths.read_bytes(few_lines(name, sides, lines), file=name)
    assert not has_errors(found), [str(d) for d in found]
    return path


def goto(tip: np.ndarray, axis: np.ndarray | None = None) -> list[str]:
    """GOTO records of tips (N, 3) and axes (N, 3), 12 decimals."""
    rows = np.asarray(tip) if axis is None else np.hstack([tip, axis])
    return ["GOTO/" + ",".join(f"{v:.12f}" for v in row) for row in rows]


def circle(center: list[float], normal: list[float], radius: float, times: str = "") -> str:
    """The CIRCLE record of NX; the normal is left-handed there."""
    numbers = ",".join(f"{v:.12f}" for v in (*center, *normal))
    return f"CIRCLE/{numbers},{radius},0.03,0.5,10,0{times}"


@cache
def machine(name: str) -> machines.machine.Machine:
    return machines.load(name)


@cache
def tool_setup() -> SetupFile:
    setup, found = load_setup(TOOLS)
    assert setup is not None and not found
    return setup


@cache
def setup_of(text: str) -> SetupFile:
    """The set-up of a text."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "setup.toml"
        file.write_text(text)
        setup, found = load_setup(file)
    assert setup is not None and not found, found
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
    """A sample, of those with many sides alike a few, converted with the gauge lengths of its set-up."""
    with looked_at():
        return good(convert(few_sides(file), name, controller))


def codes(diagnostics: object) -> set[str]:
    return {d.code for d in diagnostics}


def body(text: str) -> list[str]:
    """The blocks between the first tool change and the end, without comments."""
    lines = [n for n in text.splitlines() if not n.startswith(("(", "%"))]
    first = next(i for i, n in enumerate(lines) if "M6" in n)
    last = max(i for i, n in enumerate(lines) if n in ("M5 M9", "M5", "M9"))
    return lines[first:last]


# ---- what is shared by tests of the text -------------------------------------------------------------------


def shop_file(folder: Path, text: str, base: str = "linuxcnc") -> Path:
    """A shop's controller file that starts from a built-in one."""
    path = folder / "shop.toml"
    path.write_text(f'base = "{base}"\n{text}')
    return path


def words_of(block: str) -> dict[str, str]:
    """The words of a block by letter."""
    return dict(re.findall(r"([A-Z])(-?[\d.]+)", block))


def flat(*lines: str, controller: str | Path = "linuxcnc", name: str = "mill-3axis",
         **options: object) -> list[str]:
    """The blocks from the first cut on, for a path that begins above the origin."""
    result = good(convert(toolpath("RAPID", "GOTO/0,0,5", *lines), name, controller, **options))
    blocks = body(result.text)
    return blocks[next(i for i, b in enumerate(blocks) if re.search(r"G(0*[123]|8\d|73|93)\b", b)):]


def execute(result: PostResult, text: str | None = None) -> list[Step]:
    """The steps of a conversion's text, with the offsets that its set-up says the operator to enter."""
    job, m = result.job, result.machine
    assert job is not None
    lengths = {int(k): v.gauge_length for k, v in result.setup.tools.items()}
    unit = np.where(np.array(m.rotary), 180.0 / math.pi, 1.0)
    peer = Peer(m.axis_names, np.asarray(job.control.work_offset), lengths, m.home * unit,
                job.control.length_on_z)
    return peer.run(result.text if text is None else text)


# ---- own kinematics ----------------------------------------------------------------------------------------

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


# ---- own geometry ------------------------------------------------------------------------------------------


def unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v, dtype=float) / np.linalg.norm(v, axis=-1, keepdims=True)


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle (N,) rad between unit vectors."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))


def great_circle(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Unit vectors (T, 3) at fractions t of the path from a to b (3,): a turned about a x b."""
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
