"""What the commands and Python blocks of pages find in their folder: files by the names that pages give them, and names.

Every page runs in a folder of its own with the files of `shop`; `stages` has what a page needs besides, by its place in the
project. The part is small: what takes long with real parts is under test in its own room.
"""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, partial
from json import dumps
from pathlib import Path
from typing import Any

import numpy as np

import machines
from tests.machines.exchange.test_fusion import trunnion

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"
PACKAGE = Path(machines.__file__).parent
TOOLS = (SAMPLES / "tools.setup.toml").read_text("utf-8")
ORIGIN = "[part]\norigin = [15, -8, 30]\n"
FAR = TOOLS + "[part]\norigin = [-13, 15, -250]\n[output]\nrapids_as_feed = true\n"
PLACED = "[placement]\npoint = [13, -15, 0]\nx = [0, 10]\n"
INI = """[EMC]
VERSION = 1.1
[KINS]
KINEMATICS = trivkins coordinates=XYZ
JOINTS = 3
[TRAJ]
COORDINATES = XYZ
LINEAR_UNITS = mm
""" + "".join(f"[JOINT_{k}]\nTYPE = LINEAR\nMIN_LIMIT = -300\nMAX_LIMIT = 300\nMAX_VELOCITY = 200\nMAX_ACCELERATION = 900\n"
              "HOME = 0\n" for k in range(3))
READINGS = """x [mm],y [mm],z [mm],nx,ny,nz,X [mm],Y [mm],Z [mm]
0,0,0,0,0,1,0,0,0.1
30,0,0,0,0,1,30,0,0.1
0,30,0,0,0,1,0,30,0.1
-20,5,-5,-1,0,0,-19.8,5,-5
-20,25,-5,-1,0,0,-19.8,25,-5
5,-20,-5,0,-1,0,5,-19.9,-5
"""


@dataclass(frozen=True)
class Stage:
    """What a page needs. (`report --figures` is under test in tests/postproc/page.)

    Attributes:
        files: text of files by name; "" takes a file of `shop` away
        copies: files and folders of the project, by the name that the page gives them
        before: what happens in the folder before a command that begins with this
        names: of Python blocks, made in the page's folder
        instead: texts of commands that take long or that a caller fills in, and what stands for them here
    """

    files: dict[str, str] = field(default_factory=dict)
    copies: dict[str, str] = field(default_factory=dict)
    before: dict[str, Callable[[], None]] = field(default_factory=dict)
    names: Callable[[], dict[str, Any]] = dict
    instead: dict[str, str] = field(default_factory=dict)


@cache
def part(passes: int = 4, step: int = 5) -> str:
    """A CL file as NX writes it: a ball cutter's passes over waves, points each `step` mm."""
    lines = ["UNITS/MM", "TOOL PATH/FINISH,TOOL,BALL8", "TLDATA/MILL,8.0000,4.0000,60.0000,0.0000,0.0000",
             "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000", "$$ centerline data",
             "LOAD/TOOL,1,ADJUST,1", "SPINDL/RPM,8000,CLW", "COOLNT/FLOOD"]
    for k in range(passes):
        y = -10.0 * k
        lines += ["RAPID", f"GOTO/0.0000,{y:.4f},5.0000,0.0000000,0.0000000,1.0000000", "FEDRAT/MMPM,250.0",
                  f"GOTO/0.0000,{y:.4f},0.0000", "FEDRAT/MMPM,2000.0",
                  *(f"GOTO/{x:.4f},{y:.4f},{-2.0 * math.sin(x / 9.0):.4f}" for x in range(1, 27, step)), "RAPID",
                  f"GOTO/26.0000,{y:.4f},5.0000"]
    return "\n".join([*lines, "END-OF-PATH", "FINI", ""])


@cache
def program(controller: str, machine: str = "mikron-ucp710", passes: int = 1, step: int = 9) -> str:
    """The part on a control; few blocks, since fits execute them many times."""
    import postproc
    import toolpaths
    from postproc.setup.model import SetupFile

    return postproc.convert(toolpaths.read_bytes(part(passes, step))[0], machine, controller, SetupFile()).checked().text


def logged(file: str, controller: str) -> None:
    """log.csv, a run of the program on the Mikron: each line when it began, on a control 2 % slower than its model."""
    import postproc

    found = postproc.time(file, "mikron-ucp710", controller)
    line, first = np.unique(found.blocks.line, return_index=True)
    rows = zip(line, 1.02 * found.timed.begin[first] + 17.0, strict=True)
    Path("log.csv").write_text("nc_line,time_s\n" + "".join(f"{k},{at:.3f}\n" for k, at in rows), encoding="utf-8")


def tables() -> dict[str, str]:
    """The CSV tables that the page of error models shows, by the names in their first lines."""
    text = (ROOT / "docs/reference/error-models.md").read_text("utf-8")
    return dict(re.findall(r"```text\n# (\S+\.csv)\n(.*?)\n```", text, re.DOTALL))


def sheet() -> str:
    """The data sheet that its page shows."""
    return (PACKAGE / "sheet/README.md").read_text("utf-8").split("```toml\n")[1].split("```")[0]


def shop() -> dict[str, str]:
    """Files that pages speak of as a shop's."""
    linuxcnc, fanuc, mill = program("linuxcnc"), program("fanuc-30i"), program("fanuc-30i", "mill-3axis")
    return {"part.cls": part(), "shop.toml": TOOLS + ORIGIN, "part.ngc": linuxcnc, "old.ngc": linuxcnc, "a.ngc": linuxcnc,
            "b.ngc": linuxcnc, "part.nc": fanuc, "A.nc": mill, "B.nc": mill, "r.csv": READINGS, "readings.csv": READINGS,
            "errors.toml": (SAMPLES / "errors/mikron-ucp710.toml").read_text("utf-8"), "shop.ini": INI,
            "shop.sheet.toml": sheet(), "a.toml": TOOLS, "b.toml": TOOLS + ORIGIN}


def _placed() -> None:
    Path("shop.toml").write_text(TOOLS + PLACED, encoding="utf-8")


def _arrays() -> dict[str, Any]:
    machine = machines.load("mikron-ucp710")
    q = np.array([[10.0, 20.0, -30.0, 0.5, 1.0]])
    tip, axis = machine.kinematics.with_tool(80.0).forward(q)
    return {"machine": machine, "q": q, "tip": tip, "axis": axis}


def _read() -> dict[str, Any]:
    import toolpaths
    from postproc.setup.model import load_setup

    setup = load_setup("shop.toml")[0]
    return {"path": toolpaths.read("part.cls")[0], "machine": machines.load("mikron-ucp710"), "setup": setup}


def _clock() -> dict[str, Any]:
    n = 40
    points = np.stack((np.arange(n + 1.0), np.sin(np.arange(n + 1.0) / 6.0), np.zeros(n + 1)), axis=1)
    return {"points": points, "length": np.linalg.norm(np.diff(points, axis=0), axis=1), "speed": np.full(n, 30.0),
            "tolerance": np.full(n + 1, 0.01), "stop": np.zeros(n + 1, bool), "weight": np.ones(3),
            "velocity": np.full(3, 200.0), "acceleration": np.full(3, 1000.0), "jerk": np.full(3, 5e4)}


def _feeds() -> dict[str, Any]:
    from tests.postproc.feedrate_kit import random_path

    q = np.zeros((1, 5))
    return {"m": machines.load("mikron-ucp710"), "path": random_path(2, length=200.0), "ends": np.array([0.0, 90.0, 200.0]),
            "feeds": np.array([20.0, 40.0]), "s": np.array([10.0, 20.0]), "cuts": np.array([0.0, 50.0, 120.0]), "q0": q,
            "q1": q + 0.5}


def _curves() -> dict[str, Any]:
    from tests.toolpaths.smoothing.test_smoothing import rounded

    return {"np": np, "curves": rounded(0.4, 40.0), "s": np.array([1.0, 2.0])}


MACHINE = Stage({"shop.toml": 'base = "mikron-ucp710"\n', "shop.setup.toml": TOOLS,
                 "part.apt": part(), "part.clt": (SAMPLES / "dialects/solidworks.clt").read_text("utf-8"),
                 "part.nci": (SAMPLES / "other_forms/plate.nci").read_text("utf-8")},
                instead={"%1": "part.cls", "%2": "part.mpf"})
"""pages of CAM systems: shop.toml is a machine there"""
SMALL = Stage(instead={"samples/pocket.cls": "part.cls", "samples/bicubic.cls": "part.cls"})


@cache
def stages() -> dict[str, Stage]:
    """What pages need besides those of `shop`, by their places in the project; made when a page is run."""
    return {
        "README.md": Stage(
            files={"shop.toml": "", "part.cls": part(1),
                   **{f"samples/{name}.cls": part(1) for name in ("pocket", "five_faces")}},
            copies={"measurements.toml": "samples/calibration/reversal.toml",
                    "reversal.csv": "samples/calibration/reversal.csv",
                    **{f"samples/{name}": f"samples/{name}" for name in ("tools.setup.toml", "batch")},
                    **{f"mikron-ucp710-{axis}.csv": f"samples/errors/mikron-ucp710-{axis}.csv" for axis in "XYZ"}},
            before={"time part.ngc -m mikron-ucp710 -c linuxcnc --calibrate": partial(logged, "part.ngc", "linuxcnc"),
                    "place": _placed},
            instead={"setup new part.cls": "setup new part.cls --yes", "-j 4": "-j 1", "--pass 3": "--pass 0",
                     "--line 40": "--line 15",
                     " --figures pictures": "", "-m trunnion-bc -c fanuc-30i": "-c fanuc-30i",
                     "orient part.cls": "orient part.cls --max-tilt 5", "--orient auto": "--orient auto --max-tilt 5"}),
        "docs/how-to/calibrate-the-time.md": Stage(  # so small a part leaves nothing to measure: test every move
            instead={"time part.nc -m mikron-ucp710 -c siemens-840d --plan": "time -m mikron-ucp710 -c siemens-840d --plan"},
            files={name: program("siemens-840d") for name in ("part.nc", "next.nc")},
            before={"time part.nc -m mikron-ucp710 -c siemens-840d --calib": partial(logged, "part.nc", "siemens-840d")}),
        "docs/how-to/from-nx.md": MACHINE,
        "docs/how-to/time-report.md": SMALL,
        "docs/how-to/show-a-program.md": SMALL,
        "docs/how-to/planned-feeds.md": SMALL,
        "docs/how-to/from-fusion.md": replace(MACHINE, files=MACHINE.files | {
            "shop.toml": "", "shop.mch": dumps(trunnion()), "shop.setup.toml": FAR}),
        "machines/README.md": Stage(names=_arrays),
        "machines/sheet/README.md": Stage(files={"shop.toml": ""}),
        "machines/calibration/README.md": Stage(copies={
            f"samples/{name}": f"samples/{name}" for name in ("calibration", "tool_axis_tour.apt", "tools.setup.toml")}),
        "machines/geometric_error/README.md": Stage(copies={"errors.toml": "samples/errors/mikron-ucp710.toml", **{
            one.name: f"samples/errors/{one.name}" for one in sorted((SAMPLES / "errors").glob("*.csv"))}}, names=_arrays),
        "docs/reference/error-models.md": Stage(
            files={"x.comp": "-100 -100.002 -100.001\n0 0 0.001\n100 100.003 100.004\n",
                   "y.csv": "Y [mm],EYY [um],EXY [um]\n-200,0,1\n200,4,2\n",
                   **{name: f"{head}\n" for name, head in tables().items()}},
            copies={one.name: f"samples/errors/{one.name}" for one in sorted((SAMPLES / "errors").glob("*.*"))},
            names=_arrays, instead={"--step C=30": "--step C=120", "--loss 5": "--loss 20"}),
        "postproc/clock/README.md": Stage(names=_clock),
        "postproc/feedrate/README.md": Stage(names=_feeds),
        "postproc/orientation/README.md": Stage(names=_read),
        "postproc/placement/README.md": Stage(files={"shop.toml": TOOLS + PLACED}, names=_read),
        "samples/bridges/fusion/README.md": MACHINE,
        "samples/bridges/solidworks/README.md": MACHINE,
        "samples/bridges/mastercam/README.md": MACHINE,
        "toolpaths/README.md": Stage(names=_curves),
    }


def stage(page: Path) -> Stage:
    """What a page needs besides those of `shop`."""
    return stages().get(page.relative_to(ROOT).as_posix(), Stage()) if page.is_relative_to(ROOT) else Stage()


def lay(folder: Path, given: Stage) -> None:
    """The files of a page."""
    for name, text in (shop() | given.files).items():
        (folder / name).parent.mkdir(exist_ok=True)
        if text:
            (folder / name).write_text(text, encoding="utf-8")
    for name, place in given.copies.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / place).is_dir():
            shutil.copytree(ROOT / place, folder / name)
        else:
            shutil.copy(ROOT / place, folder / name)
