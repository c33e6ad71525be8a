"""Cuts whose axis turns, as small CL texts, and their runs: what the tests of turning axes share."""

from __future__ import annotations

import numpy as np

from postproc.base.options import Options
from postproc.orientation.passes.passes import PassContext, work_of
from postproc.orientation.turning.cutting_runs import CuttingRun, runs_of
from postproc.orientation.turning.tilt_limits import limits_of
from postproc.orientation.turning.tilt_search import TiltSearch
from postproc.planning.planned import limits_at_feed
from postproc.setup.model import SetupFile
from postproc.setup.orientation import OrientationLimits
from tests.postproc.kit import machine, toolpath
from toolpaths.smoothing.smooth import Tolerance
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

BALL = ["UNITS/MM", "CUTTER/6,3", "LOADTL/1", "SPINDL/RPM,9000,CLW", "MULTAX"]
FEED = "FEDRAT/MMPM,3000"
CONE = 8.0
OPTIONS = Options(orient="auto")


def swing(middle: str = "", normals: bool = False, head: list[str] | None = None, cuts: int = 1,
          end: tuple[float, float] = (0.0, 3.0), radius: float = 80.0, lean: float = 25.0) -> Toolpath:
    """Cuts over a cylinder along y, the axis 25 degrees off its normal, which swings by 70 degrees about it
    within some 12 mm: C hurries there, and has time before and behind. `middle`: a record amid each cut; `end`: mm from
    the axis to the corner's centre, and its radius."""
    lines = list[str]()
    for k in range(cuts):
        x = np.linspace(-24.0, 24.0, 33)
        normal = np.column_stack((np.sin(x / radius), 0.0 * x, np.cos(x / radius)))
        turn = np.radians(20.0 + 35.0 * (1.0 + np.tanh(x / 6.0)))
        flat = np.column_stack((np.cos(turn), np.sin(turn), 0.0 * x))
        axis = np.cos(np.radians(lean)) * normal + np.sin(np.radians(lean)) * flat
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        centre = (radius + end[1]) * normal + np.array([0.0, 2.0 * k, -radius])
        tip = centre - end[1] * axis
        if end[0]:
            out = np.einsum("ni,ni->n", normal, axis)[:, None] * axis - normal
            tip -= end[0] * out / np.linalg.norm(out, axis=1, keepdims=True)
        rows = [",".join(f"{v:.7f}" for v in (*p, *a, *(n if normals else ()))) for p, a, n in
                zip(tip, axis, normal, strict=True)]
        off = [",".join(f"{v:.7f}" for v in (*(p + 20.0 * a), *a)) for p, a in ((tip[0], axis[0]), (tip[-1], axis[-1]))]
        lines += ["RAPID", f"GOTO/{off[0]}", "RAPID", f"GOTO/{rows[0]}", FEED, *(f"GOTO/{row}" for row in rows[1:17])]
        lines += [*([middle] if middle else []), *(f"GOTO/{row}" for row in rows[17:]), "RAPID", f"GOTO/{off[1]}"]
    return toolpath(*lines, head=head or BALL)


def with_cone(**keys: object) -> SetupFile:
    """A set-up with a cone."""
    return SetupFile(orientation=OrientationLimits(**{"cone": CONE, **keys}))


def context(path: Toolpath, setup: SetupFile, name: str = "mikron-ucp710") -> PassContext:
    work, found = work_of(path, machine(name), setup, OPTIONS)
    assert work is not None, found
    return work


def only_run(path: Toolpath, setup: SetupFile) -> tuple[PassContext, CuttingRun]:
    work = context(path, setup)
    return work, runs_of(work, Tolerance(OPTIONS.tolerance, OPTIONS.axis_tolerance * DEG), 60.0 * DEG)[0]


def searched(path: Toolpath, setup: SetupFile) -> TiltSearch:
    work, run = only_run(path, setup)
    limits = limits_of(run, work.machine, OPTIONS.tolerance, 60.0 * DEG)
    return TiltSearch(run, limits, limits_at_feed(work.machine, run.whole.kin))
